"""What to cite for the closed-form mechanisms.

The page docs/mechanisms.md says which of their terms are taken from a source and which are derived.
"""

from limitmason.answers.references import THEORY, Cited, Reference

MURANO = Reference(
    "murano-two-leaf", "misc",
    "Comparison of different numerical modelling approaches for the assessment of the out-of-plane behaviour of "
    "two-leaf stone masonry walls",
    ("Murano, A.",), note="with others; journal and year are not given in the sources at hand",
)  # fmt: skip
DAYALA = Reference(
    "dayala2003", "article",
    "Definition of collapse mechanisms and seismic vulnerability of historic masonry buildings",
    ("D'Ayala, D.", "Speranza, E."), 2003, "Earthquake Spectra", "19", "3", "479-509", "10.1193/1.1599896",
)  # fmt: skip
ARGIENTO = Reference(
    "argiento2018", "article",
    "Formulating the in-plane frictional resistances and collapse mechanisms for multi-storey masonry block walls",
    ("Argiento, L. U.", "Maione, A.", "Casapulla, C."), 2018, "Frattura ed Integrità Strutturale", "12", "46",
    "226-239", "10.3221/IGF-ESIS.46.21",
)  # fmt: skip

PAPERS = (Cited(THEORY, DAYALA), Cited(THEORY, ARGIENTO), Cited(THEORY, MURANO))
"""A load factor for every mechanism, frictional resistances of a crack, and the structure of mechanisms A, B and D."""
