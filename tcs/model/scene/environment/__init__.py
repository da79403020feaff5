"""The environment of a scene: its file, furniture and obstacles, and the plant they make.

In: an environment file and the models, meshes and point clouds that it names. Out: checked values
(`environment_file`), the shapes of obstacles (`obstacle_shapes`), a Drake plant (`plant`) and what
touches what in it (`check`).
"""
