"""Every packaged case by every theory, and by limit analysis beside what was measured or published.

The pages of the documentation that come of it are ``methods.md`` and the table of ``predicted.md``.
"""

from .cases import Case, ReferenceValue, cases, not_covered, settings_of
from .page import UNEXPLAINED, as_markdown, ratio_span, references_for, write_csv
from .solving import dem_verdict, solve_cases
from .summary import summary_table, table_rows

__all__ = [
    "UNEXPLAINED",
    "Case",
    "ReferenceValue",
    "as_markdown",
    "cases",
    "dem_verdict",
    "not_covered",
    "ratio_span",
    "references_for",
    "settings_of",
    "solve_cases",
    "summary_table",
    "table_rows",
    "write_csv",
]
