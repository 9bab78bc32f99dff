"""Every packaged case by every theory that applies: one table of values, ranges and ratios, checked against theory."""

from limitmason.packaged.answers import Settings, dem_verdict, settings_of, solve_cases
from limitmason.packaged.cases import Case, Reference, cases, not_covered
from limitmason.packaged.report import as_markdown, write_csv

__all__ = [
    "Case",
    "Reference",
    "Settings",
    "as_markdown",
    "cases",
    "dem_verdict",
    "not_covered",
    "settings_of",
    "solve_cases",
    "write_csv",
]
