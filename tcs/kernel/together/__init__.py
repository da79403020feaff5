"""Two arms of one robot that reach their goals at the same time.

In: the problems of two arms, each without the other one, and postures of each that reach a goal by
itself. Out: the pair of postures in which neither arm touches the other. Nothing here is compiled
before a pair of goals is scored.
"""
