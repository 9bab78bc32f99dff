"""What to cite for capacity curves of rigid blocks on elastic joints.

The path itself is this package's own.
"""

from limitmason.answers.references import METHOD, SOLVER, cited

PAPERS = (*cited(METHOD, "haslinger1983"), *cited(SOLVER, "goulart2024"))
"""The fixed point by which friction that does not dilate becomes a sequence of convex programs, and their solver."""
