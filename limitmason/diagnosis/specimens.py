"""What a study reads of its specimens: what each is called, its covariates, and the values measured on it."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from limitmason.errors import InputError


def called(specimen: Any, number: int) -> str:
    """What a specimen is called: its "specimen" or "name", else its number counted from 0."""
    for key in ("specimen", "name"):
        value = specimen.get(key) if isinstance(specimen, Mapping) else getattr(specimen, key, None)
        if value is not None:
            direction = specimen.get("direction", "") if isinstance(specimen, Mapping) else ""
            return f"specimen {value}{direction}"
    return f"specimen {number}"


def positive_values(values: Sequence[float] | np.ndarray, n: int) -> np.ndarray:
    """Measured values of n specimens, copied and read-only.

    Raises
    ------
    InputError
        For another number of them, or values that are not positive and finite.
    """
    out = np.array(values, dtype=float)
    if out.shape != (n,):
        raise InputError(f"measured must have one value per specimen ({n}), got shape {out.shape}")
    bad = np.flatnonzero(~(np.isfinite(out) & (out > 0)))
    if len(bad):
        raise InputError(f"measured values must be positive and finite; specimen {bad[0]} has {out[bad[0]]!r}")
    out.flags.writeable = False
    return out


def covariates_of(given: Iterable[str] | Mapping[str, Sequence], specimens: Sequence[Any]) -> dict[str, list]:
    """Values of every covariate, read from the specimens by name or as they are given.

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
    for name, column in out.items():
        if len(column) != len(specimens):
            raise InputError(f"covariate {name!r} has {len(column)} values for {len(specimens)} specimens")
    return out
