"""Packaged experiments and benchmarks: what was built, loaded, measured and computed, each number with its source.

>>> from limitmason import experiments
>>> test = experiments.load("minho-dry-stone-2005-2009", "SW.100.1")
>>> test.measured["Vmax+"]
Quantity(41.5, 'kN')
>>> assembly, loads = test.assembly(), test.loads()

A source is one folder here: data, ``source.json``, licence, and a module with its ``RECIPE``.
"""

from limitmason.display.notebook import shows
from limitmason.experiments.experiment import Experiment, Option, Quantity, Source, TargetValue
from limitmason.experiments.recipe import Recipe
from limitmason.experiments.registry import all_cases, load, recipe_of, sources, specimens
from limitmason.experiments.shown import Departure, Settings, Shown, Variant

__all__ = [
    "Departure", "Experiment", "Option", "Quantity", "Recipe", "Settings", "Shown", "Source", "TargetValue", "Variant",
    "all_cases", "load", "recipe_of", "sources", "specimens",
]

shows(__name__)
