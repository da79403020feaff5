"""The person of a scene: its model, resized, with joints, posture and goals on the body."""
