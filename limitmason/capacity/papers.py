"""What to cite for capacity curves of rigid blocks on elastic joints.

The path itself is this package's own.
"""

from limitmason.answers.references import METHOD, SOLVER, Cited, Reference

HASLINGER = Reference(
    "haslinger1983", "article", "Approximation of the Signorini problem with friction, obeying the Coulomb law",
    ("Haslinger, J.",), 1983, "Mathematical Methods in the Applied Sciences", "5", pages="422-437",
    note="volume and pages recalled, not checked against the original",
)  # fmt: skip
CLARABEL = Reference(
    "goulart2024", "misc", "Clarabel: An interior-point solver for conic programs with quadratic objectives",
    ("Goulart, P. J.", "Chen, Y."), 2024, "arXiv 2405.12762", url="https://arxiv.org/abs/2405.12762",
)  # fmt: skip

PAPERS = (Cited(METHOD, HASLINGER), Cited(SOLVER, CLARABEL))
"""The fixed point by which friction that does not dilate becomes a sequence of convex programs, and their solver."""
