"""Least and greatest thrust of a structure on a support, or through a cut."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from limitmason.answers.results import Prediction, Status
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.limit.settlement import (
    GUIDED_OPTIONS,
    guides_across,
    largest_multiplier,
    least_reaction,
    refuse_other_options,
    with_reaction,
)
from limitmason.model.assembly import Assembly
from limitmason.model.contact_warnings import loose_blocks
from limitmason.model.input import read_vector
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.model.support_motion import Group, SupportMotion, group_of

NO_DIRECTION = 1e-6
"""Length of a direction, over the distance that it is taken from, up to which it is rounding [-]."""

NO_THRUST = 1e-9
"""Thrust over the largest dead load of a block, up to which it is zero [-]: rounding of the solver."""


@dataclass(frozen=True, eq=False)
class Thrust:
    """Least and greatest thrust that admissible forces allow.

    Parameters
    ----------
    least, greatest : force along ``direction`` with which the structure presses on the support, or what lies before a
        cut on what lies behind it [N]; infinite where nothing bounds it, NaN where the structure cannot stand
    direction : unit vector, shape (3,)
    states : the predictions at both ends: joint forces, mechanism as the support or the cut gives way, certificate.
        ``reaction.least`` is the thrust at the least, and minus the thrust at the greatest. Draw the lines of thrust
        with ``lm.figures.contact_forces(state.structure, state)``
    """

    least: float
    greatest: float
    direction: Array
    states: tuple[Prediction, Prediction]

    def __str__(self) -> str:
        """Both ends with the direction."""
        d = _words(self.direction)
        if math.isnan(self.least) or math.isnan(self.greatest):
            return f"no thrust along ({d}): {' and '.join(dict.fromkeys(str(s.status) for s in self.states))}"
        return f"thrust {self.least:.6g} N to {self.greatest:.6g} N along ({d})"


def _words(direction: Array) -> str:
    """A unit vector in words, shape (3,): what is zero but for rounding is zero."""
    return ", ".join(f"{v:.4g}" for v in direction.round(9) + 0.0)


@of_model
def thrust(
    assembly: Assembly,
    support: Group | None = None,
    *,
    cut: Sequence[str] = (),
    direction: ArrayLike | None = None,
    loads: Loads | None = None,
    **options: Any,
) -> Thrust:
    r"""Least and greatest thrust on supports, or through a cut of joints.

    .. math:: H_{\min}, H_{\max} = \min, \max\ d \cdot \sum_s f_s \quad \text{over}\quad A f + w = 0,\ f \in K

    Parameters
    ----------
    assembly : with the support held
    support : a held block by name or number, or several
    cut : joints by name, "voussoir-10|voussoir-11", as ``assembly.joint_names`` lists them, each with all its faces;
        the thrust is what the first blocks exert on the second ones. Give either support or cut
    direction : d; by default horizontal, from the middle of the free blocks to that of the support, or of the cut from
        its first blocks to the second
    loads : dead loads; self weight by default
    options : ``contact_model``, ``grid``, ``in_plane``, ``solver`` and ``tolerance`` of
        :func:`limitmason.limit.limit_analysis`

    Returns
    -------
    Thrust
        Both ends positive where the structure pushes along d.

    Raises
    ------
    InputError
        For a joint that does not exist or is named twice, joints that alone bear what is on one side of them, a support
        that is not held, live loads, another option, and where no direction follows.

    Notes
    -----
    Heyman's minimum and maximum thrust, with friction as the joints have it, associative. The real thrust lies between
    them, near the least once the supports have spread a little. Wrong for psi < phi: the range may then be narrower.
    """
    refuse_other_options(options, GUIDED_OPTIONS)
    if not isinstance(cut, str | Sequence):
        raise InputError(f"cut: give joints by name, got {cut!r}")
    if (support is None) == (not cut):
        raise InputError("thrust: give either a support or a cut of joints")
    loads = Loads.weight(assembly) if loads is None else loads
    if loads.live.any():
        raise InputError("loads: a thrust is asked of dead loads; give them with case='dead'")
    if cut:
        names = [cut] if isinstance(cut, str) else cut
        if len(set(names)) < len(names):
            raise InputError(f"cut: a joint is named twice in {', '.join(names)}")
        joints, group = [k for name in names for k in _joints(assembly, name)], []
        _refuse_sole_bearing(assembly, joints, loads)
        first, second = ([getattr(assembly.interfaces[k], f"block_{s}") for k in joints] for s in "ab")
        between = assembly.centroids[second].mean(axis=0) - assembly.centroids[first].mean(axis=0)
    else:
        assert support is not None
        joints, group = [], group_of(assembly, support)
        between = assembly.centroids[group].mean(axis=0) - assembly.centroids[~assembly.fixed].mean(axis=0)
    d = read_vector("direction", between * (1, 1, 0) if direction is None else direction)
    if not np.linalg.norm(d) > NO_DIRECTION * np.linalg.norm(between):
        raise InputError("direction: none follows from where the support or the cut is; give one")
    d = d / np.linalg.norm(d) + 0.0
    # the least reaction against a support that gives way along d is the least thrust on it; along -d, the greatest
    ends = []
    for end, sense in (("least", 1.0), ("greatest", -1.0)):
        if cut:
            state = _through(assembly, joints, sense * d, loads, options)
            where = "through " + ", ".join(dict.fromkeys(assembly.joint_names[k] for k in joints))
        else:
            assert support is not None
            state, _ = least_reaction(assembly, support, SupportMotion(tuple(sense * d)), loads, options)
            where = "on " + ", ".join(assembly.blocks[i].name for i in group)
        assert state.reaction is not None
        value = sense * state.reaction.least
        value = 0.0 if abs(value) < NO_THRUST * np.abs(loads.dead).max() else value
        state = replace(state, method=f"{end} thrust {where}, which gives way along ({_words(sense * d)})")
        ends.append((-sense * math.inf if state.status == Status.UNBOUNDED else value, state))
    (least, low), (greatest, high) = ends
    return Thrust(float(least), float(greatest), d, (_as_range(low, least, greatest), _as_range(high, least, greatest)))


def _as_range(state: Prediction, least: float, greatest: float) -> Prediction:
    """The state at one end, which stands without a thrust if zero lies between ``least`` and ``greatest``."""
    assert state.reaction is not None
    return replace(state, reaction=state.reaction._replace(stands_without=bool(least <= 0.0 <= greatest)))


def _joints(assembly: Assembly, name: str) -> list[int]:
    """Numbers of the joints of a name, such as "voussoir-10|voussoir-11".

    Two blocks that touch at several faces have a joint of the same name at each.
    """
    if name not in assembly.joint_names:
        near = [n for n in assembly.joint_names if str(name).partition("|")[0] in n.split("|")][:3]  # a few examples
        raise InputError(f"cut: there is no joint {name!r}" + (f"; did you mean {', '.join(near)}?" if near else ""))
    return [k for k, known in enumerate(assembly.joint_names) if known == name]


def _refuse_sole_bearing(assembly: Assembly, joints: list[int], loads: Loads) -> None:
    """Refuse a cut through the ``joints`` that alone join blocks to the supports: equilibrium says what passes."""
    rest = replace(assembly, interfaces=tuple(i for k, i in enumerate(assembly.interfaces) if k not in joints))
    loose = loose_blocks(rest)
    if len(loose):
        force = ", ".join(f"{f:.6g}" for f in loads.dead[loose, :3].sum(axis=0) + 0.0)
        raise InputError(
            f"cut: its joints alone bear block {assembly.blocks[loose[0]].name!r} ({len(loose)} such blocks): what "
            f"passes is the dead load of these, ({force}) N, and has no range; leave out joints, or give support="
        )


def _through(assembly: Assembly, joints: list[int], d: Array, loads: Loads, options: dict[str, Any]) -> Prediction:
    """Prediction of the greatest force against d that passes through a cut of joints.

    Every cut joint presses on a weightless plate in place of its second block. Free loads take any wrench from the
    plate to that block. The live load is a unit force along d shared by all plates.

    Parameters
    ----------
    joints : numbers of the interfaces that are cut
    d : unit vector, shape (3,)
    loads : dead loads
    options : of the limit analysis

    Returns
    -------
    Prediction: its least reaction is minus that force [N].
    """
    n, m = assembly.n_blocks, len(joints)
    behind = [assembly.interfaces[k].block_b for k in joints]
    # no two blocks may be called alike: joints of one name are told apart by their numbers
    alike = [assembly.joint_names.count(assembly.joint_names[k]) > 1 for k in joints]
    names = [f"cut {assembly.joint_names[k]}{f' {k}' if a else ''}" for k, a in zip(joints, alike, strict=True)]
    plates = tuple(replace(assembly.blocks[b], name=name) for b, name in zip(behind, names, strict=True))
    interfaces = list(assembly.interfaces)
    for plate, k in enumerate(joints):
        interfaces[k] = replace(interfaces[k], block_b=n + plate)
    made = replace(assembly, blocks=(*assembly.blocks, *plates), interfaces=tuple(interfaces))
    dead = np.vstack([loads.dead, np.zeros((m, 6))])
    total = float(np.linalg.norm(dead[:n][~assembly.fixed, :3], axis=1).sum())
    # moments over the extent of the structure, so that all six are alike in size
    unit = np.ones(6)
    unit[3:] = float(np.ptp(assembly.centroids, axis=0).max())

    def pairs(wrenches: Array) -> Array:
        """Loads on all blocks, then plates [N, N m], shape (..., n + m, 6).

        Scaled ``wrenches`` (..., m, 6) act on the plates, and equal and opposite on the block behind each.
        """
        out = np.zeros((*wrenches.shape[:-2], n + m, 6))
        for j, b in enumerate(behind):
            out[..., n + j, :] += total * wrenches[..., j, :] * unit
            out[..., b, :] -= total * wrenches[..., j, :] * unit
        return out

    seen = np.tile([*d, 0.0, 0.0, 0.0], (m, 1))
    cutting = Loads(dead, pairs(seen / m), f"thrust through {', '.join(assembly.joint_names[k] for k in joints)}")
    across = guides_across(made, cutting, seen, np.ones(6, dtype=bool), options.get("in_plane"))
    found = largest_multiplier(made, cutting, pairs(across), **options)
    # told of the blocks that there are: a plate only differs from the block behind it by the way that the cut gives
    mechanism = found.mechanism and replace(found.mechanism, twists=found.mechanism.twists[:n])
    # a force [N], not a multiplier; the reasons that go with a reaction speak of a support
    return replace(
        with_reaction(found, total, "N"), warnings=found.warnings, structure=assembly, loads=loads, mechanism=mechanism
    )
