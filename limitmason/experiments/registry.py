"""Packaged experiments by name."""

from difflib import get_close_matches
from importlib import import_module
from types import MappingProxyType, ModuleType
from typing import Any

from limitmason.experiments.record import Experiment

_MODULES = MappingProxyType(
    {
        "ferris-tin-loi-2001": "limitmason.experiments.ferris_tin_loi",
        "minho-dry-stone-2005-2009": "limitmason.experiments.minho",
        "rondelet-wallette": "limitmason.experiments.rondelet",
        "pavia-tilting": "limitmason.experiments.pavia",
        "bnw-walls": "limitmason.experiments.bnw",
        "brick-panels-opening": "limitmason.experiments.brick_panels",
        "mcmaster-bending": "limitmason.experiments.mcmaster",
        "murano-u-walls": "limitmason.experiments.murano",
    }
)


def sources() -> tuple[str, ...]:
    """Names of the packaged sources."""
    return tuple(_MODULES)


def specimens(source: str) -> tuple[str, ...]:
    """Names of a source's specimens.

    Raises
    ------
    ValueError
        For an unknown source; the message lists the known ones.
    """
    return _module(source).specimens()


def load(source: str, specimen: str, **options: Any) -> Experiment:
    """A packaged experiment.

    Parameters
    ----------
    source : for example "ferris-tin-loi-2001"; see :func:`sources`
    specimen : for example "wall-3"; see :func:`specimens`
    options : of the assembly, see ``Experiment.option_table``

    Returns
    -------
    Experiment
        With ``assembly()``, ``loads()``, ``measured``, ``published`` and the data sheet as ``str``.

    Raises
    ------
    ValueError
        For an unknown source, specimen or option; the message lists near or known names.

    Examples
    --------
    >>> test = load("ferris-tin-loi-2001", "wall-3")
    >>> test.published["associative"]
    Quantity(0.404, '-')
    """
    module = _module(source)
    known = module.specimens()
    if specimen not in known:
        near = get_close_matches(str(specimen), known, n=3, cutoff=0.3)
        names = ", ".join(known) if len(known) <= 12 else ", ".join(known[:12]) + ", ..."
        hint = f"; near it: {', '.join(near)}" if near else ""
        raise ValueError(f"{source} has no specimen {specimen!r}{hint}; it has {names}")
    return module.load(specimen, **options)


def all_cases(*, source: str | None = None, with_model: bool | None = None) -> tuple[Experiment, ...]:
    """Every packaged experiment with default options.

    Parameters
    ----------
    source : only this one
    with_model : True for those with an assembly, False for those without, None for all
    """
    names = sources() if source is None else (source,)
    cases = (load(name, specimen) for name in names for specimen in specimens(name))
    return tuple(c for c in cases if with_model is None or c.has_model == with_model)


def _module(source: str) -> ModuleType:
    if source not in _MODULES:
        near = get_close_matches(str(source), _MODULES, n=2, cutoff=0.3)
        hint = f"; near it: {', '.join(near)}" if near else ""
        raise ValueError(f"unknown experiment source {source!r}{hint}; known: {', '.join(_MODULES)}")
    return import_module(_MODULES[source])
