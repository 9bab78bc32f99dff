"""Causes: physical extensions of a model, each an edit of assembly and loads that is usable on its own.

>>> from limitmason import causes
>>> weak_base = causes.weak_base_joint()
>>> assembly, loads = weak_base.apply(0.8, assembly, loads)  # doctest: +SKIP

after which every method works as before. Measurement causes have ``apply(size, prediction, specimen)``. ``ALL`` holds
the declared causes by name; each is called as ``causes.cohesion(bounds, **options)``. :func:`standard` is a list for a
study, :func:`table` says what each is, :func:`declare` declares one of your own.
"""

from limitmason.answers.method import LEVERS
from limitmason.causes.catalogue import ALL, acts_on, delivered, each_joint, of_batch, standard, table
from limitmason.causes.cause import Cause, Extension
from limitmason.causes.declare import Declared, declare
from limitmason.display.notebook import shows
from limitmason.mechanics.elastic_joints import dead_load_stress, elastic_displacements

_BY_FUNCTION = {declared.function.__name__: declared for declared in ALL.values()}

__all__ = [
    "ALL", "LEVERS", "Cause", "Declared", "Extension", "acts_on", "dead_load_stress", "declare", "delivered",
    "each_joint", "elastic_displacements", "of_batch", "standard", "table", *_BY_FUNCTION,
]

shows(__name__)


def __getattr__(name: str) -> Declared:
    """A declared cause by the name of its function."""
    if name in _BY_FUNCTION:
        return _BY_FUNCTION[name]
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Public names."""
    return sorted(__all__)
