"""What a path is controlled by: a block, the live load, or a support that moves.

An arc length is no control here: ``program`` says why.
The default, the live load, is that of ``pushover`` in ``analysis``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from limitmason.arrays import Array
from limitmason.capacity.step_equilibrium import Node
from limitmason.capacity.system import System
from limitmason.errors import InputError
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.moved import joined_to_first
from limitmason.model.support import DEGREES_OF_FREEDOM, Support
from limitmason.model.support_motion import group_of

_AXES = {"x": 0, "y": 1, "z": 2}
_ROUNDING = 1e-9  # of the couples over the sizes of their blocks: live forces that small have cancelled


def as_one_assembly(assembly: Assembly, loads: Loads, control: Any) -> tuple[Assembly, Loads, Any]:
    """The model in which moving supports are one block, with its loads and control.

    Joints of the group to the ground are dropped. Where no group of supports moves, all three stay as they are.

    Parameters
    ----------
    control : as of :func:`limitmason.pushover`: "live", or a block or group of supports and an axis
    """
    if isinstance(control, str):
        return assembly, loads, control
    named = isinstance(control, Sequence)
    if not named or len(control) != 2 or control[1] not in [*_AXES]:
        turned = named and len(control) == 2 and not isinstance(control[1], str)
        turns = "; a group that turns: lm.settlement_analysis, or dem.Drive" if turned else ""
        raise InputError(f"control must be 'live' or (block, 'x' or 'y' or 'z'), got {control!r}{turns}")
    group = group_of(assembly, control[0])  # numbers of its blocks, all held where they are several
    control = (assembly.blocks[group[0]].name, control[1])
    # a block that is free is no support; loads of another number of blocks are refused by name, and not here
    if not assembly.fixed[group[0]] or len(loads.dead) != assembly.n_blocks:
        return assembly, loads, control
    kept = np.delete(np.arange(assembly.n_blocks), group[1:])
    return joined_to_first(assembly, group, drop=True), loads.of_blocks(kept), control


def with_moving_support(
    assembly: Assembly, loads: Loads, control: Any, to: float | None
) -> tuple[Assembly, Loads, tuple[int, int] | None]:
    """The model and loads of a support that is to be moved, with its block and axis.

    The support is freed along the axis. Its live load there is the total dead load, so that the multiplier is its force
    over that. Without a support that moves, model and loads stay as they are and the third value is None.

    Parameters
    ----------
    control : "live", or (block, axis), as :func:`as_one_assembly` returns it
    to : as of :func:`limitmason.pushover`

    Returns
    -------
    tuple
        Model, loads, and (number of the block, 0, 1 or 2 for x, y or z).

    Raises
    ------
    InputError
        Without a displacement ``to``, beside live loads, and where the only support would move.
    """
    if isinstance(control, str):
        return assembly, loads, None
    axis = _AXES[control[1]]
    block = assembly.block_index(control[0])
    if not assembly.held[block, axis]:
        return assembly, loads, None
    name = assembly.blocks[block].name
    if to is None:
        raise InputError("control is a support that moves: say how far, to=...")
    if loads.live.any():
        raise InputError(f"control: {name!r} is a support that moves under dead loads; leave the live loads out")
    rest = [d for k, d in enumerate(DEGREES_OF_FREEDOM) if assembly.held[block, k] and k != axis]
    others = [s for s in assembly.supports if assembly.block_index(s.block) != block]
    if not others:
        raise InputError(f"control: {name!r} is the only support, with which the whole structure would move")
    guided = replace(assembly, supports=(*others, *([Support(block, dofs=tuple(rest))] if rest else [])))
    dead, arms, live = np.array(loads.dead), np.array(loads.dead_arms), np.zeros_like(loads.live)
    dead[block], arms[block] = 0.0, 0.0  # the weight of the support itself is no concern of the structure
    live[block, axis] = float(np.linalg.norm(dead[~assembly.fixed, :3], axis=1).sum())
    return guided, Loads(dead, live, f"{name} moves", dead_arms=arms), (block, axis)


def control_row(assembly: Assembly, control: Any, basis: Array, free: NDArray, live: Array) -> tuple[Array, float]:
    """Weights of the control displacement, and the live loads' work per unit of it.

    The control displacement is the sum of the weights, (n, d), times the motions of the degrees of freedom. The work is
    that in the reference pose [N], negative where the live loads push against the axis.

    Parameters
    ----------
    control : "live", or (block, axis), as :func:`as_one_assembly` returns it
    basis : rigid motion (shift, spin) per degree of freedom of a block, shape (6, d)
    free : which degrees of freedom are free, shape (n, d)
    live : live load on them [N, N m], shape (n, d)
    """
    # only of degrees of freedom that shift a block, unit vectors: those that turn it have no displacement
    forces = np.where(np.abs(basis[:3]).max(axis=0) > 0.5, live, 0.0)
    total = float(np.linalg.norm(forces, axis=1).sum())
    couples = float((np.linalg.norm(live - forces, axis=1) / np.cbrt(assembly.volumes)).sum())
    if not total > _ROUNDING * couples:
        raise InputError("no live force acts on a free block: there is nothing to push with")
    if isinstance(control, str):
        if control != "live":
            raise InputError(f"control must be 'live' or (block, 'x'), got {control!r}")
        return forces / total, total
    i = assembly.block_index(control[0])
    row = np.zeros_like(live)
    row[i] = basis[_AXES[control[1]]] * free[i]
    if not row.any():
        raise InputError(f"control: block {control[0]!r} does not move along {control[1]!r}")
    # the load that pushes a block down grows while its z falls
    return row, -total if float((row * live).sum()) < 0.0 else total


def refuse_undriven(system: System, first: Node, control: Any) -> None:
    """Refuse the control of a block which the live load does not move in the first state of a path.

    Parameters
    ----------
    system, first : equations of the path, and its state under dead load
    control : "live", or (block, axis), as :func:`as_one_assembly` returns it
    """
    if isinstance(control, str) or system.driven(system.evaluate(first.pose, first.history, first.multiplier)):
        return
    raise InputError(
        f"control: the live load does not move block {control[0]!r} along {control[1]!r}: give an axis along which it "
        "does, or leave control out"
    )


def turns_back(control: Any, loads: Loads) -> list[str]:
    """A note on a path that stopped: the centroids may turn back while the loads, beside them, go on.

    Parameters
    ----------
    control : "live", or (block, axis), as :func:`as_one_assembly` returns it
    loads : of the path
    """
    if not isinstance(control, str) or not loads.live_arms.any():
        return []
    return [
        "the live loads act beside the centroids, whose displacement along them is the control: it turns back where "
        "blocks rock and lift their centroids; give control=(block, axis) of a block that goes on"
    ]
