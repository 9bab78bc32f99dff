"""What to cite for the distinct element method of this package."""

from limitmason.answers.references import METHOD, THEORY, Cited, Reference

CUNDALL_STRACK = Reference(
    "cundall1979", "article", "A discrete numerical model for granular assemblies",
    ("Cundall, P. A.", "Strack, O. D. L."), 1979, "Géotechnique", "29", "1", "47-65", "10.1680/geot.1979.29.1.47",
)  # fmt: skip
CUNDALL = Reference(
    "cundall1988", "article",
    "Formulation of a three-dimensional distinct element model - Part I. A scheme to detect and represent contacts in "
    "a system composed of many polyhedral blocks",
    ("Cundall, P. A.",), 1988,
    "International Journal of Rock Mechanics and Mining Sciences and Geomechanics Abstracts", "25", "3", "107-116",
    "10.1016/0148-9062(88)92293-0",
)  # fmt: skip
GODIO = Reference(
    "godio2017", "article",
    "Effects of the dilatancy of joints and of the size of the building blocks on the mechanical behavior of masonry "
    "structures",
    ("Godio, M.", "Stefanou, I.", "Sab, K."), 2017, "Meccanica", doi="10.1007/s11012-017-0688-z",
)  # fmt: skip

PAPERS = (Cited(THEORY, CUNDALL_STRACK), Cited(THEORY, CUNDALL))
"""Explicit time integration of blocks on joints of finite stiffness."""

COLLAPSE = (*PAPERS, Cited(METHOD, GODIO))
"""The same, and the search of the load that can be held or the tilt at which a wall falls."""
