"""What to cite for the cracking continuum."""

from limitmason.answers.references import METHOD, SOLVER, THEORY, cited

PAPERS = (*cited(THEORY, "rots1988"), *cited(METHOD, "selby1997"), *cited(SOLVER, "skfem2020"))
"""Rotating cracks, equivalent strains, and the assembly of finite elements."""
