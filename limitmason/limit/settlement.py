"""Settlement of a support: is the structure stable when a support gives way, and by which mechanism."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.results import CANNOT_STAND, NO_TILT, UNBOUNDED, Prediction, Status
from limitmason.errors import InputError
from limitmason.limit.analysis import limit_analysis
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.support import DEGREES_OF_FREEDOM, Support

_DIRECTIONS = {f"{sign}{axis}": (k, s) for k, axis in enumerate("xyz") for sign, s in (("+", 1.0), ("-", -1.0))}

_REASON = {
    CANNOT_STAND: "no reaction of this support carries the dead load: the structure is unstable already",
    UNBOUNDED: "the structure does not let the support move that way: it needs no reaction along it",
}


def settlement_analysis(
    assembly: Assembly, support: int | str | Sequence[int | str], *, direction: str = "-z", loads: Loads | None = None,
    **options: Any,
) -> Prediction:  # fmt: skip
    """Mechanism and smallest reaction of a support that gives way.

    The support is freed along one direction d and guided otherwise. Minimise R subject to A f + w_dead - R d = 0
    at the support: R is the smallest force that the moving support must still supply against d, and the dual is the
    settlement mechanism.

    Parameters
    ----------
    support : name or number of a block with held degrees of freedom, or a list of wholly held blocks that move as one
    direction : "-z" (down), "+x" (spreading), ...
    loads : dead loads, nothing live; self weight by default
    options : as for :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Prediction
        ``details["support_reaction"]`` is R [N], ``details["reaction_bounds"]`` what mechanism and forces prove of it
        [N], ``details["stands_without_support"]`` whether the structure stands without it (R <= 0 within 1e-6 of the
        weight); else it moves with the support by the mechanism returned. "cannot stand" means that no reaction keeps
        it in equilibrium: already unstable. "unbounded": the support cannot move that way. R is NaN then.
        ``collapse_multiplier`` is NaN: no load is multiplied here. The two multipliers of the certificate are -R over
        the total dead load. ``structure`` is the model that was solved, without joints between held blocks: the ground
        bears both sides of them, and their friction must not hold what settles.

    Raises
    ------
    InputError
        When a block is not held along the direction, a list is empty, names a block twice or one that is not wholly
        held, and for loads with a live part.
    """
    if direction not in _DIRECTIONS:
        raise InputError(f"direction must be one of {sorted(_DIRECTIONS)}, got {direction!r}")
    if options.get("flow_rule", "associative") != "associative":
        raise InputError("settlement analysis knows the associative flow rule only: its multipliers may be negative")
    axis, sign = _DIRECTIONS[direction]
    moved = _moved(assembly, support, axis, direction)
    i = moved[0]
    guided = _guided(assembly, moved, axis)
    loads = Loads.weight(assembly) if loads is None else loads
    if loads.live.any():
        raise InputError("loads: the live part has no role in a settlement; give dead loads alone, case='dead'")
    dead = np.array(loads.dead)
    dead[moved] = 0.0  # the weight of the support itself is no concern of the structure
    free = ~guided.fixed
    total = float(np.linalg.norm(dead[free, :3], axis=1).sum())
    live = np.zeros_like(dead)
    live[i, axis] = sign * total
    name = assembly.blocks[i].name + (f" and {len(moved) - 1} more" if len(moved) > 1 else "")
    settling = Loads(dead, live, f"settlement of {name} along {direction}")
    prediction = limit_analysis(guided, settling, check_dead_load=False, **options)
    no_tilt = "the reaction of a support is no multiplier of loads"
    details = {**prediction.details, NO_TILT: no_tilt, "support_reaction": float("nan")}
    warnings = (_REASON[Status(prediction.status)],) if prediction.status in _REASON else prediction.warnings
    if np.isfinite(prediction.collapse_multiplier):
        reaction = -prediction.collapse_multiplier * total
        details["support_reaction"] = reaction
        # rounding leaves a reaction of zero a little to either side
        details["stands_without_support"] = bool(reaction <= 1e-6 * total)
        if prediction.certificate is not None:
            ends = (prediction.certificate.kinematic_multiplier, prediction.certificate.static_multiplier)
            details["reaction_bounds"] = tuple(float(-total * end) for end in ends)
    if {assembly.block_index(s.block) for s in assembly.supports} <= set(moved):
        warnings = (*warnings, "every support settles: the structure follows as one, and R is its dead load alone")
    motion = prediction.mechanism
    if motion is not None:
        twists = np.array(motion.twists)
        twists[moved] = twists[i]
        motion = replace(motion, twists=twists)
    return replace(
        prediction, mechanism=motion, method=f"settlement of {name} along {direction}", details=details,
        collapse_multiplier=float("nan"), warnings=warnings,
    )  # fmt: skip


def _moved(assembly: Assembly, support: int | str | Sequence[int | str], axis: int, direction: str) -> list[int]:
    """Numbers of the blocks that settle as one."""
    named = [support] if isinstance(support, int | str | np.integer) else list(support)
    moved = [assembly.block_index(block) for block in named]
    if not moved or len(set(moved)) < len(moved):
        raise InputError(f"support: give one block, or a list of different ones that settle as one; got {support!r}")
    for k in moved:
        if not assembly.held[k, axis]:
            raise InputError(f"block {assembly.blocks[k].name!r} is not held along {direction!r}, so it cannot settle")
        if len(moved) > 1 and not assembly.fixed[k]:
            raise InputError(f"block {assembly.blocks[k].name!r} is not wholly held: blocks that settle as one must be")
    return moved


def _guided(assembly: Assembly, moved: list[int], axis: int) -> Assembly:
    """The assembly with a support free along an axis; the first block of a group owns the joints and ties of all."""
    first, fixed = moved[0], assembly.fixed
    owner = np.arange(assembly.n_blocks)
    owner[moved] = first
    joints = [
        replace(joint, block_a=int(owner[joint.block_a]), block_b=int(owner[joint.block_b]))
        for joint in assembly.interfaces
        if not (fixed[joint.block_a] and fixed[joint.block_b])
    ]

    def owned(block: int | str) -> str:
        return assembly.blocks[owner[assembly.block_index(block)]].name

    ties = [
        replace(tie, block_a=owned(tie.block_a), block_b=None if tie.block_b is None else owned(tie.block_b))
        for tie in assembly.ties
    ]
    rest = [name for k, name in enumerate(DEGREES_OF_FREEDOM) if assembly.held[first, k] and k != axis]
    others = [s for s in assembly.supports if assembly.block_index(s.block) != first]
    supports = (*others, *([Support(first, dofs=rest)] if rest else []))
    return replace(assembly, interfaces=tuple(joints), supports=supports, ties=tuple(ties))
