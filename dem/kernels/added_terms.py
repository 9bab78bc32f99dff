"""Terms added to the joint law (``Joint.terms``): entries of laws and strengths.

The functions that the registered terms give are composed into one and compiled with the rest. Without any the composed
function is the identity and compiles to nothing.
"""

from dataclasses import fields
from typing import Any

import numpy as np

from dem.kernels.arrays import LAW, Array
from dem.kernels.compiled import ADDED, kernel

Numbers = tuple[float, ...]
_STRENGTHS = "tan_phi, tan_psi, cohesion, tension"

COLUMNS: dict[str, range] = {}
"""Columns of every added term by its name: 1 where a joint has it, and its numbers."""

LAW_SIZE = len(LAW)
for _name, _term in ADDED.items():
    COLUMNS[_name] = range(LAW_SIZE, LAW_SIZE + 1 + len(fields(_term)))
    LAW_SIZE = COLUMNS[_name].stop


def _composed() -> dict[str, Any]:
    """Source of three functions on the added terms, written out and run; by name.

    ``entries(law, j)`` gives the numbers that joint j has for all terms, and ``has(law, j)`` whether it has any term.
    ``changed(added, ..., slip, damage)`` gives the strengths after every term of the joint, whose first entry, its
    flag, is not 0. A compiled function cannot loop over terms of different classes: each has a line of its own.
    """
    lines = [
        "def entries(law, j):",
        f"    return ({''.join(f'law[j, {k}], ' for k in range(len(LAW), LAW_SIZE))})",
        "def has(law, j):",
        f"    return {' or '.join(f'law[j, {k.start}] != 0.0' for k in COLUMNS.values())}",
        f"def changed(added, {_STRENGTHS}, slip, damage):",
    ]
    for number, columns in enumerate(COLUMNS.values()):
        flag, *numbers = (f"added[{k - len(LAW)}]" for k in columns)
        lines += [
            f"    if {flag} != 0.0:",
            f"        {_STRENGTHS} = term_{number}({', '.join([_STRENGTHS, 'slip', 'damage', *numbers])})",
        ]
    names: dict[str, Any] = {
        f"term_{k}": kernel(kept=False, forceinline=True)(term.strength) for k, term in enumerate(ADDED.values())
    }
    exec("\n".join([*lines, f"    return {_STRENGTHS}"]), names)
    return names


if ADDED:
    _made = _composed()
    entries_of, has_added, _changed = (
        kernel(kept=False, forceinline=True)(_made[name]) for name in ("entries", "has", "changed")
    )
else:

    @kernel(forceinline=True)
    def entries_of(law: Array, j: int) -> Numbers | None:
        """Entries of joint j's added terms in the rows ``law`` of all joints: None."""
        return None

    @kernel(forceinline=True)
    def has_added(law: Array, j: int) -> bool:
        """Whether joint j has added terms in the rows ``law`` of all joints."""
        return False

    @kernel(forceinline=True)
    def _changed(
        added: Numbers, tan_phi: float, tan_psi: float, cohesion: float, tension: float, slip: float, damage: float
    ) -> Numbers:
        """Strengths as given, whatever the plastic slip [m] and damage: no term is added."""
        return tan_phi, tan_psi, cohesion, tension


@kernel(forceinline=True)
def with_added(
    added: Numbers | None, tan_phi: float, tan_psi: float, cohesion: float, tension: float, slip_1: float,
    slip_2: float, damage: float,
) -> Numbers:
    """tan(phi), tan(psi), c and ft with the terms added to the law.

    Parameters
    ----------
    added : numbers of the joint's added terms; None where it has none
    tan_phi, tan_psi, cohesion, tension : values without them [-], [Pa]
    slip_1, slip_2 : plastic slip before the step [m]
    damage : 0 to 1, before the step
    """
    if added is None:
        return tan_phi, tan_psi, cohesion, tension
    return _changed(added, tan_phi, tan_psi, cohesion, tension, np.sqrt(slip_1 * slip_1 + slip_2 * slip_2), damage)
