"""What to cite for the distinct element method of this package."""

from limitmason.answers.references import METHOD, THEORY, cited

PAPERS = cited(THEORY, "cundall1979", "cundall1988")
"""Explicit time integration of blocks on joints of finite stiffness."""

COLLAPSE = (*PAPERS, *cited(METHOD, "godio2017"))
"""With it the search of the load that can be held or the tilt at which a wall falls."""
