"""Packaged experiments and benchmarks: what was built, loaded, measured and computed, each number with its source.

>>> from limitmason import experiments
>>> test = experiments.load("minho-dry-stone-2005-2009", "SW.100.1")
>>> test.measured["Vmax+"]
Quantity(41.5, 'kN')
>>> assembly, loads = test.assembly(), test.loads()
"""

from limitmason.experiments.comparisons import Comparison, as_text, run, table
from limitmason.experiments.record import Experiment, Option, Quantity, Source, Target
from limitmason.experiments.registry import all_cases, load, sources, specimens
from limitmason.experiments.summary import summary_table

__all__ = [
    "Comparison",
    "Experiment",
    "Option",
    "Quantity",
    "Source",
    "Target",
    "all_cases",
    "as_text",
    "load",
    "run",
    "sources",
    "specimens",
    "summary_table",
    "table",
]
