"""Settlement of a support: whether the structure stands, and its mechanism."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.results import NO_TILT, Prediction, Reaction, Status
from limitmason.arrays import Array, Flags
from limitmason.errors import InputError
from limitmason.limit.analysis import whole_limit_analysis
from limitmason.limit.associative import analyse
from limitmason.limit.papers import papers_behind
from limitmason.limit.program.static_theorem import make_problem
from limitmason.limit.solvers import TOLERANCE
from limitmason.mechanics.contact_points import Grid, chosen_grid
from limitmason.mechanics.equilibrium import degrees_of_freedom
from limitmason.mechanics.law_table import refuse
from limitmason.mechanics.model_notes import adds_model_notes
from limitmason.mechanics.plane import find_plane
from limitmason.mechanics.residuals import part_labels
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.model.moved import joined_to_first
from limitmason.model.support import DEGREES_OF_FREEDOM, Support
from limitmason.model.support_motion import Group, SupportMotion, group_of

_DIRECTIONS = {f"{sign}{a}": s * np.eye(3)[k] for k, a in enumerate("xyz") for sign, s in (("+", 1.0), ("-", -1.0))}

ZERO_REACTION = 1e-6
"""Reaction over the weight that counts as zero [-]: rounding leaves one to either side."""

NO_MOTION = 1e-12
"""Part of a motion over its largest that is rounding, as of a cosine of 90 degrees [-]."""

ALONG = 1e-9
"""Component of a degree of freedom of the plane along one of space up to which it has none [-]: rounding."""

GUIDED_OPTIONS = ("contact_model", "grid", "in_plane", "solver", "tolerance")
"""Options of limit analysis that go with supports and plates guided along a motion."""

_REASON = {
    Status.CANNOT_STAND: "no reaction of this support carries the dead load: the structure is unstable already",
    Status.UNBOUNDED: "the structure does not let the support move that way: it needs no reaction along it",
}


@of_model
def settlement_analysis(
    assembly: Assembly, support: Group, *, direction: str | SupportMotion = "-z", loads: Loads | None = None,
    **options: Any,
) -> Prediction:
    """Mechanism and smallest reaction of a support that gives way.

    The support is freed along one motion d and guided otherwise. Minimise R subject to A f + w_dead - R d = 0
    at the support: R is the smallest force that the moving support must still supply against d, and the dual is the
    settlement mechanism.

    Parameters
    ----------
    assembly : with the support held
    support : name or number of a block with held degrees of freedom, or a list of wholly held blocks that move as one:
        a strip, a springer, a ring
    direction : "-z" (down), "+x" (spreading), ...; or a :class:`limitmason.SupportMotion`, a translation and a turn
        about a point: R is then the work of the reaction against it, [N] for a translation of 1, [N m] for a turn of 1
    loads : dead loads, nothing live; self weight by default
    options : ``contact_model``, ``grid``, ``in_plane``, ``solver`` and ``tolerance`` of
        :func:`limitmason.limit.limit_analysis`; along a single axis also ``torsion_limit`` and ``verbose``

    Returns
    -------
    Prediction
        ``reaction`` is R, what mechanism and forces prove of it, and whether the structure stands without it: whether
        zero lies between R and the greatest reaction, within 1e-6 of the weight. "cannot stand" means that no reaction
        keeps it in equilibrium: already unstable. "unbounded": the support cannot move that way. R is NaN then.
        ``collapse_multiplier`` is NaN: no load is multiplied here. The two multipliers of the certificate are -R over
        the total dead load. ``structure`` is the model that was solved, without joints between held blocks: the ground
        bears both sides of them, and their friction must not hold what settles.

    Raises
    ------
    InputError
        When a block is not held along the motion, a list is empty, names a block twice or one that is not wholly
        held, and for loads with a live part and another option.
    """
    found, tolerance = least_reaction(assembly, support, direction, loads, options)
    reaction = found.reaction
    if reaction is None or not reaction.least < -tolerance:
        return found
    # R < 0: the support must pull at least. The structure stands without it only if zero lies between this and the
    # greatest reaction, which is the least one against the opposite motion with its sign changed
    motion = _motion_of(direction)
    back = SupportMotion([-v for v in motion.translation], [-v for v in motion.rotation], motion.about)
    other, _ = least_reaction(assembly, support, back, loads, options)
    # unbounded: no motion opposes that reaction, which may grow without end, and so passes zero
    needs_none = other.status == Status.UNBOUNDED or (other.reaction is not None and other.reaction.least <= tolerance)
    return replace(found, reaction=reaction._replace(stands_without=needs_none))


def refuse_other_options(options: Mapping[str, Any], taken: Sequence[str]) -> None:
    """Refuse an option by its name that is not among those that are ``taken``."""
    if unknown := sorted(options.keys() - set(taken)):
        raise InputError(f"{unknown[0]!r} is no option of this analysis; it takes {', '.join(taken)}")


def _motion_of(direction: str | SupportMotion) -> SupportMotion:
    """The motion of a support, given as such or by the name of a direction."""
    if isinstance(direction, str) and direction in _DIRECTIONS:
        return SupportMotion(tuple(_DIRECTIONS[direction]))
    if not isinstance(direction, SupportMotion):
        axes = ", ".join(sorted(_DIRECTIONS))
        raise InputError(f"direction must be one of {axes} or lm.SupportMotion((x, y, z)), got {direction!r}")
    return direction


def least_reaction(
    assembly: Assembly, support: Group, direction: str | SupportMotion, loads: Loads | None, options: dict[str, Any]
) -> tuple[Prediction, float]:
    """Least reaction R of a support that gives way, by one program.

    Its ``stands_without`` is right only where R is not below zero.

    Parameters
    ----------
    assembly, support, direction, loads : as for :func:`settlement_analysis`
    options : of :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    prediction, tolerance : the latter the size up to which a reaction counts as none [N]
    """
    named = f"along {direction}" if isinstance(direction, str) else "by the given motion"
    direction = _motion_of(direction)
    if options.get("flow_rule", "associative") != "associative":
        raise InputError("settlement analysis knows the associative flow rule only: its multipliers may be negative")
    options = {name: value for name, value in options.items() if name != "flow_rule"}
    moved = group_of(assembly, support)
    i = moved[0]  # the first block owns the joints of all
    motion = direction.twist(assembly.centroids[i])
    moves = np.abs(motion) > NO_MOTION * np.abs(motion).max()
    for k in moved:
        if not assembly.held[k, moves].all():
            raise InputError(f"block {assembly.blocks[k].name!r} is not held {named}, so it cannot settle")
    loads = Loads.weight(assembly) if loads is None else loads
    if loads.live.any():
        raise InputError("loads: the live part has no role in a settlement; give dead loads alone, case='dead'")
    # along one axis only that degree of freedom is set free; along others all six are, with forces that guide five
    single = moves.sum() == 1
    all_move = {assembly.block_index(s.block) for s in assembly.supports} <= set(moved)
    if not single and all_move:
        raise InputError(f"every support moves {named}: name those that move, others stay, or move all along one axis")
    refuse_other_options(options, (*GUIDED_OPTIONS, "torsion_limit", "verbose") if single else GUIDED_OPTIONS)
    guided = released(assembly, moved, tuple(np.flatnonzero(moves if single else np.ones(6, dtype=bool))))
    dead = np.array(loads.dead)
    dead[moved] = 0.0  # the weight of the support itself is no concern of the structure
    free = ~guided.fixed
    total = float(np.linalg.norm(dead[free, :3], axis=1).sum())
    unit = np.ones(6)
    unit[3:] = float(np.ptp(assembly.centroids, axis=0).max())
    seen = motion * unit  # turns as displacements at the size of the structure
    # the live load acts along d, with power ``total`` on it: R is minus its multiplier times ``total``
    live = np.zeros_like(dead)
    live[i] = total * seen * unit / (seen @ seen)
    name = assembly.blocks[i].name + (f" and {len(moved) - 1} more" if len(moved) > 1 else "")
    settling = Loads(dead, live, f"settlement of {name} {named}")
    if single:
        prediction = whole_limit_analysis(guided, settling, check_dead_load=False, **options)
    else:
        across = guides_across(guided, settling, seen[None], assembly.held[i], options.get("in_plane"))
        cases = np.zeros((len(across), *dead.shape))
        cases[:, i] = total * across[:, 0] * unit
        prediction = largest_multiplier(guided, settling, cases, **options)
    # of a mere turn R is a moment
    prediction = with_reaction(prediction, total, "N" if any(direction.translation) else "N m")
    if all_move:
        words = "every support settles: the structure follows as one, and R is its dead load alone"
        prediction = replace(prediction, warnings=(*prediction.warnings, words))
    mechanism = prediction.mechanism
    if mechanism is not None:
        # the other blocks of the group move with the first as one body
        twists = np.array(mechanism.twists)
        arms = assembly.centroids[moved] - assembly.centroids[i]
        twists[moved] = twists[i] + np.pad(np.cross(twists[i, 3:], arms), ((0, 0), (0, 3)))
        mechanism = replace(mechanism, twists=twists)
    return replace(prediction, mechanism=mechanism, method=settling.name), ZERO_REACTION * total


def with_reaction(prediction: Prediction, total: float, unit: str) -> Prediction:
    """An answer in multipliers as one in reactions, R = -lambda ``total`` [N].

    The live load pushes the support along its motion d, the reaction acts against d: hence the minus.

    Parameters
    ----------
    prediction : largest multiplier of a live load that has the power ``total`` on d. Where its status says that there
        is none, the reason takes the place of its warnings, which speak of live loads
    total : dead load of the free blocks, sum of the sizes of their forces [N]
    unit : of the reaction

    Returns
    -------
    The answer. Its ``stands_without`` is right for R >= 0 only: :func:`settlement_analysis` sees to the others.
    """
    reaction = Reaction(unit=unit)
    if np.isfinite(prediction.collapse_multiplier):
        least, c, ends = -prediction.collapse_multiplier * total, prediction.certificate, (math.nan, math.nan)
        if c is not None:  # the least reaction as the mechanism proves it, and as the forces do
            ends = float(-total * c.kinematic_multiplier), float(-total * c.static_multiplier)
        reaction = Reaction(least, *ends, bool(least <= ZERO_REACTION * total), unit)
    return replace(
        prediction, collapse_multiplier=float("nan"), reaction=reaction,
        details={**prediction.details, NO_TILT: "the reaction of a support is no multiplier of loads"},
        warnings=(_REASON[Status(prediction.status)],) if prediction.status in _REASON else prediction.warnings,
    )


def guides_across(guided: Assembly, loads: Loads, seen: Array, held: Flags, in_plane: bool | None) -> Array:
    """Unit wrenches that guide freed blocks and do no work on their motion, (k, b, 6).

    With these as free loads, blocks that are free in all ways can follow the motion ``seen`` only.

    Parameters
    ----------
    guided, loads : the model with these blocks free, and the loads by which its plane is found
    seen : motion of every block, turns as displacements at a size, shape (b, 6)
    held : degrees of freedom in which they are guided at all, shape (6,)
    in_plane : False keeps motions out of the model's plane; else they are left out where it has one

    Returns
    -------
    Wrenches, moments over that size, normal to each other [-]; k is one less than the guided freedoms of the b blocks.
    """
    plane = find_plane(guided, loads) if in_plane is None or in_plane else None
    basis = degrees_of_freedom(guided, plane)[0].T
    basis = np.array([row for row in basis if held[np.abs(row) > ALONG].all()])
    # rows after the first of a single row's right singular vectors: all that is normal to it
    across = np.linalg.svd((seen @ basis.T).reshape(1, -1))[2][1:]
    return across.reshape(-1, len(seen), len(basis)) @ basis


def released(assembly: Assembly, moved: list[int], freed: tuple[int, ...]) -> Assembly:
    """The assembly with ``moved``, blocks of a support, joined and partly free.

    The first block of a group owns the joints and ties of all.

    Parameters
    ----------
    moved : numbers of the blocks
    freed : which of the six degrees of freedom: 0 to 2 along x, y, z, and 3 to 5 about them
    """
    first, joined = moved[0], joined_to_first(assembly, moved)
    rest = [name for k, name in enumerate(DEGREES_OF_FREEDOM) if assembly.held[first, k] and k not in freed]
    others = [s for s in assembly.supports if assembly.block_index(s.block) != first]
    supports = (*others, *([Support(first, dofs=tuple(rest))] if rest else []))
    return replace(joined, supports=supports)


@adds_model_notes(cites=papers_behind)
def largest_multiplier(
    assembly: Assembly,
    loads: Loads,
    cases: Array,
    *,
    contact_model: str = "vertices",
    grid: Grid | Mapping[str, Grid] | None = None,
    in_plane: bool | None = None,
    solver: str = "auto",
    tolerance: float = TOLERANCE,
) -> Prediction:
    r"""Largest multiplier of the live load beside loads of any multiplier.

    .. math:: \max \lambda \quad A f + w_d + \lambda w_l + \sum_k u_k c_k = 0, \qquad f \in K

    Parameters
    ----------
    assembly, loads : the problem
    cases : c_k [N, N m], shape (k, n_blocks, 6); of the size of the live load
    contact_model, grid, in_plane, solver, tolerance : as for :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Prediction
        ``details["free multipliers"]`` are the u_k. The mechanism does no work on any c_k; its bound is for these u_k.
        Parts that neither live load nor cases reach are left out.

    Notes
    -----
    Associative. The dead load alone is not checked: u_k may be what carries it.
    """
    refuse("associative", assembly)
    label, loaded = part_labels(assembly), loads.live.any(axis=1) | cases.any(axis=(0, 2))
    # what is not held on to the loaded parts has no say in the multiplier, and may not even stand
    apart = np.flatnonzero((label >= 0) & ~np.isin(label, label[loaded]))
    assembly = assembly.with_supports([Support.fixed(int(i)) for i in apart])
    model: dict[str, Any] = {"grid": chosen_grid(contact_model, grid), "in_plane": in_plane, "cases": cases}
    problem = make_problem(assembly, loads, contact_model=contact_model, **model)
    return analyse(problem, solver=solver, tolerance=tolerance, check_dead_load=False)[0]
