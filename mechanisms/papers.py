"""What to cite for the closed-form mechanisms.

The page docs/mechanisms.md says which of their terms are taken from a source and which are derived.
"""

from limitmason.answers.references import THEORY, cited

PAPERS = cited(THEORY, "dayala2003", "argiento2018", "murano-two-leaf")
"""A load factor for every mechanism, frictional resistances of a crack, and the structure of mechanisms A, B and D."""
