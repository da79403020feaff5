"""The environment of a scene: its file, furniture and obstacles, and the plant they make."""
