"""Predicted beside measured: one structure by all theories, packaged experiments beside their values, and the tables.

>>> import limitmason as lm
>>> wall = lm.experiments.load("ferris-tin-loi-2001", "wall-1")
>>> (row,) = lm.validation.run(wall, "associative", quantities=["associative"])
>>> f"{row.predicted:.4f} {row.reference} {row.ratio:.2f}"
'0.6429 0.643 1.00'

Every table is made of :class:`Row`: what a method says, and the value beside it.
"""

from limitmason.experiments.shown import Settings
from limitmason.validation.cases import Case, ReferenceValue, cases, not_covered, settings_of
from limitmason.validation.comparing import SideBySide, compare, measured_range
from limitmason.validation.page import as_markdown, ratio_span, references_for, write_csv
from limitmason.validation.rows import Row
from limitmason.validation.solving import dem_verdict, solve_cases
from limitmason.validation.specimen import as_text, run, table, write_rows
from limitmason.validation.summary import summary_table, table_rows

Answer = Comparison = Row
"""Names of version 0.1, kept for one release."""

__all__ = [
    "Case",
    "ReferenceValue",
    "Row",
    "Settings",
    "SideBySide",
    "as_markdown",
    "as_text",
    "cases",
    "compare",
    "dem_verdict",
    "measured_range",
    "not_covered",
    "ratio_span",
    "references_for",
    "run",
    "settings_of",
    "solve_cases",
    "summary_table",
    "table",
    "table_rows",
    "write_csv",
    "write_rows",
]
