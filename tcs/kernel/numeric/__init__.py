"""Arms that no closed form solves: curves of the null space, followed from Newton starts."""
