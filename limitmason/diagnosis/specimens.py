"""What specimens of a study have recorded: names, circumstances, covariates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from limitmason.diagnosis.inference.shared_noise import is_circumstance


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


def circumstances_of(specimens: Sequence[Any]) -> list[str]:
    """Names under which all specimens record a circumstance, not all the same."""
    if not all(isinstance(s, Mapping) for s in specimens):
        return []
    shared = [k for k in (specimens[0] if specimens else ()) if is_circumstance(k) and all(k in s for s in specimens)]
    return [k for k in shared if len({str(s[k]) for s in specimens}) > 1]
