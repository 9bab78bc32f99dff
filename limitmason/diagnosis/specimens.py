"""What specimens of a study have recorded: names, circumstances, covariates."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Integral
from typing import Any

from limitmason.diagnosis.inference.shared_noise import is_circumstance
from limitmason.errors import InputError


def name_of(specimen: Any) -> str | None:
    """The "specimen" or "name" of a specimen, or None where it has none."""
    said = (recorded(specimen, key) for key in ("specimen", "name"))
    return next((str(value) for value in said if value is not None), None)


def recorded(specimen: Any, name: str) -> Any:
    """What a specimen has recorded under a name, or None where nothing is."""
    return specimen.get(name) if isinstance(specimen, Mapping) else getattr(specimen, name, None)


def called(specimen: Any, number: int) -> str:
    """What a specimen is called: "specimen" or "name", else its number from 0."""
    name = name_of(specimen)
    direction = specimen.get("direction", "") if name and isinstance(specimen, Mapping) else ""
    return f"specimen {number if name is None else name}{direction}"


def numbers_of(keys: Iterable[tuple[Any, str]], specimens: Sequence[Any]) -> list[int]:
    """Places of specimens that are told by name or by number, from 0.

    Parameters
    ----------
    keys : name or number of each, and what the message calls it

    Raises
    ------
    InputError
        For a specimen that is not there, a name of several, and a number that is also the name of another.
    """
    names = [name_of(s) for s in specimens]
    place = {name: i for i, name in enumerate(names) if name is not None}
    out = []
    for key, what in keys:
        number = place.get(key, key) if isinstance(key, str) else key
        if isinstance(key, str) and names.count(key) > 1:
            raise InputError(f"{what}: {names.count(key)} specimens are called so: name them apart")
        if isinstance(number, bool) or not isinstance(number, Integral) or not 0 <= int(number) < len(specimens):
            known = ", ".join(place) or "none has a name"
            raise InputError(f"{what}: no such specimen; known: {known}, or 0 to {len(specimens) - 1}")
        if not isinstance(key, str) and place.get(str(key), number) != number:
            raise InputError(f"{what}: {key} is the place of one specimen, from 0, and the name of another: "
                             f"give the name as text, {str(key)!r}")
        out.append(int(number))
    return out


def circumstances_of(specimens: Sequence[Any]) -> list[str]:
    """Names under which all specimens record a circumstance, not all the same."""
    if not all(isinstance(s, Mapping) for s in specimens):
        return []
    shared = [k for k in (specimens[0] if specimens else ()) if is_circumstance(k) and all(k in s for s in specimens)]
    return [k for k in shared if len({str(s[k]) for s in specimens}) > 1]


def covariates_of(
    given: Iterable[str] | Mapping[str, Sequence[Any]], specimens: Sequence[Any],
    spread_out: Callable[[str, Sequence[Any], int], list[Any]],
) -> dict[str, list[Any]]:
    """Values of every covariate per row, from the specimens by name, or as given.

    Parameters
    ----------
    given : names of what every specimen records, or columns by name with an entry per specimen or row
    spread_out : makes a column with one entry per row, from its name, the column, and the number of specimens

    Raises
    ------
    InputError
        For a covariate that a specimen lacks, or a wrong number of values.
    """
    if isinstance(given, Mapping):
        out = {str(k): list(v) for k, v in given.items()}
    else:
        out = {}
        for name in given:
            out[name] = []
            for i, s in enumerate(specimens):
                try:
                    out[name].append(s[name] if isinstance(s, Mapping) else getattr(s, name))
                except (KeyError, AttributeError):
                    raise InputError(f"covariate {name!r} is not recorded for specimen {i}") from None
    return {name: spread_out(f"covariate {name!r}", v, len(specimens)) for name, v in out.items()}
