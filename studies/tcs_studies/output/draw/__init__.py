"""Pictures of the studies: boxes, paths, answers and work."""
