"""An independent referee: random assemblies solved a second time, by programs written from their geometry alone.

``assemblies`` makes them, ``plane`` and ``space`` solve them (nothing of ``limitmason`` is imported there), ``compare``
sets limit analysis against them, ``python -m tests.referee --cases 5000 --seed 1 --out DIR`` does so by the thousand.

``structures`` makes small ones for every engine of ``engines``, ``statics`` answers the same questions from geometry,
and ``laws`` writes each structure down in other frames, numbers and units, in which no answer may change.
"""
