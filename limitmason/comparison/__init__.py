"""Predicted beside measured: one structure by all theories, and packaged experiments beside their values.

>>> import limitmason as lm
>>> wall = lm.experiments.load("ferris-tin-loi-2001", "wall-1")
>>> (row,) = lm.comparison.run(wall, "associative", quantities=["associative"])
>>> f"{row.predicted:.4f} {row.reference} {row.ratio:.2f}"
'0.6429 0.643 1.00'

Every table is made of :class:`Row`: what a method says, and the value beside it.
"""

from limitmason.comparison.comparing import SideBySide, compare, measured_range
from limitmason.comparison.rows import Row
from limitmason.comparison.specimen import as_text, run, table, write_rows
from limitmason.display.notebook import shows

__all__ = ["Row", "SideBySide", "as_text", "compare", "measured_range", "run", "table", "write_rows"]

shows(__name__)
