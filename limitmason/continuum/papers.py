"""What to cite for the cracking continuum."""

from limitmason.answers.references import METHOD, SOLVER, THEORY, Cited, Reference

ROTS = Reference(
    "rots1988", "phdthesis", "Computational modeling of concrete fracture", ("Rots, J. G.",), 1988,
    "Delft University of Technology",
)  # fmt: skip
SELBY = Reference(
    "selby1997", "article", "A constitutive model for analysis of reinforced concrete solids",
    ("Selby, R. G.", "Vecchio, F. J."), 1997, "Canadian Journal of Civil Engineering", "24", "3", "460-470",
    note="volume and pages recalled, not checked against the original",
)  # fmt: skip
SCIKIT_FEM = Reference(
    "skfem2020", "article", "scikit-fem: A Python package for finite element assembly",
    ("Gustafsson, T.", "McBain, G. D."), 2020, "Journal of Open Source Software", "5", "52", "2369",
    "10.21105/joss.02369",
)  # fmt: skip

PAPERS = (Cited(THEORY, ROTS), Cited(METHOD, SELBY), Cited(SOLVER, SCIKIT_FEM))
"""Rotating cracks, equivalent strains, and the assembly of finite elements."""
