"""Packaged experiments by name: every folder of this package is a source, named like it with hyphens."""

import pkgutil
from difflib import get_close_matches
from functools import cache
from importlib import import_module

from limitmason.answers.references import Cited
from limitmason.errors import InputError
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment
from limitmason.experiments.recipe import Recipe

_SHOWN = 12
"""So many specimens are named in an error; a large source has two hundred."""


@cache
def sources() -> tuple[str, ...]:
    """Names of the packaged sources, one for every folder of this package."""
    package = import_module(__package__)
    return tuple(sorted(m.name.replace("_", "-") for m in pkgutil.iter_modules(package.__path__) if m.ispkg))


def tabled() -> tuple[str, ...]:
    """Names of the sources that stand in tables of all cases.

    A large one with a page of its own does not.
    """
    return tuple(name for name in sources() if not recipe_of(name).page)


def specimens(source: str) -> tuple[str, ...]:
    """Names of a source's specimens.

    Raises
    ------
    InputError
        For an unknown source; the message lists the known ones.
    """
    return recipe_of(source).specimens()


def load(source: str, specimen: str, **options: object) -> Experiment:
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
    InputError
        For an unknown source, specimen or option; the message lists near or known names.

    Examples
    --------
    >>> test = load("ferris-tin-loi-2001", "wall-3")
    >>> test.published["associative"]
    Quantity(0.404, '-')
    """
    found = recipe_of(source)
    known = found.specimens()
    if specimen not in known:
        names = ", ".join(known[:_SHOWN]) + (", ..." if len(known) > _SHOWN else "")
        raise InputError(f"{source} has no specimen {specimen!r}{_near(specimen, known, 3)}; it has {names}")
    return found.load(specimen, **options)


def all_cases(*, source: str | None = None, with_model: bool | None = None) -> tuple[Experiment, ...]:
    """Every packaged experiment with default options.

    Parameters
    ----------
    source : only this one; by default all but those with a page of their own
    with_model : True for those with an assembly, False for those without, None for all
    """
    names = tabled() if source is None else (source,)
    cases = (load(name, specimen) for name in names for specimen in specimens(name))
    return tuple(c for c in cases if with_model is None or c.has_model == with_model)


def recipe_of(source: str) -> Recipe:
    """What the folder of a source offers.

    Raises
    ------
    InputError
        For an unknown source; the message lists the known ones.
    """
    if source not in sources():
        near = _near(source, sources(), 2)
        raise InputError(f"unknown experiment source {source!r}{near}; known: {', '.join(sources())}")
    return import_module(f"{__package__}.{source.replace('-', '_')}").RECIPE


def _near(name: str, known: tuple[str, ...], most: int) -> str:
    """Up to ``most`` known names that are spelt much like a wrong one, in words.

    There may be none.
    """
    near = get_close_matches(str(name), known, n=most, cutoff=0.3)
    return f"; near it: {', '.join(near)}" if near else ""


def papers_of(source: str) -> tuple[Cited, ...]:
    """What to cite for the data of a packaged source.

    Nothing for a name that is none.
    """
    return source_folder.papers_of(source) if source in sources() else ()
