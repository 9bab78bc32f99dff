"""What the folder of a source offers: its specimens, how one is loaded, built and driven, and how it is shown."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from limitmason.experiments.shown import Shown


@dataclass(frozen=True, eq=False)
class Recipe:
    """A source as functions.

    The module of its folder calls it ``RECIPE``, by which it is found.

    Parameters
    ----------
    specimens : names of its specimens, called without arguments
    load : the experiment of a specimen, called with its name and options of the assembly
    assembly : blocks of an experiment; None where the sources at hand do not say enough for any
    loads : dead and live loads, called with experiment, assembly and sense (1.0 or -1.0) of the live load
    curve : measured curve of an experiment; None where none was found for any
    shown : how the source is shown beside the theories
    drive : what was driven and which way, of an experiment; None where nothing was
    page : where a large source is shown by itself; it is in no table of all cases
    """

    specimens: Callable[[], tuple[str, ...]]
    load: Callable[..., Any]
    assembly: Callable[..., Any] | None = None
    loads: Callable[..., Any] | None = None
    curve: Callable[..., Any] | None = None
    shown: Shown = field(default_factory=Shown)
    drive: Callable[..., Any] | None = None
    page: str = ""
