"""Settings of the DEM: of a search for the collapse multiplier, and of a structure that is driven.

Default damping is in ``dem.default_damping``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypedDict

import numpy as np

from dem.model.joints import Grid as Spacing
from dem.model.joints import JointOptions
from dem.model.rest_or_collapse import LoadVerdict
from limitmason.checks import choice, count, instance, listener, positive
from limitmason.deformable import SOLID
from limitmason.deformable.levels import LUMPED, RIGID, SIMPLY_DEFORMABLE, ZONED
from limitmason.errors import InputError
from limitmason.model.stages import Damping, Settle

Grid = tuple[int, int]


class ContactOptions(TypedDict, total=False):
    """How joints are modelled: options of :func:`dem.initial_state` by name.

    None is as good as left out.
    """

    contact_points: Grid | Mapping[str, Grid] | None
    contact_model: str | None
    joint_options: JointOptions | None


class StateOptions(ContactOptions, total=False):
    """How an assembly is modelled: options of :func:`dem.initial_state` by name.

    None is as good as left out.
    """

    mode: str | None
    blocks: str | None
    stress: str | None
    dt: float | None


def given(options: Mapping[str, Any], kind: type[ContactOptions], function: str) -> dict[str, Any]:
    """Options of a function that are not None.

    Parameters
    ----------
    options : as the function was called, by name
    kind : class whose fields are the names that they may have
    function : its name, for the error

    Raises
    ------
    TypeError
        For an unknown name, as Python has it.
    """
    for name in options:
        if name not in kind.__annotations__:
            raise TypeError(f"{function}() got an unexpected keyword argument {name!r}")
    return {name: value for name, value in options.items() if value is not None}


CHECKS = ("stiffness", "ks/kn", "contact points", "rate")
"""What a search can be repeated with, see :class:`DemSettings`."""

EDGES, FIRST = "edges", "first"
"""Where the contact points of joints that slide are, see :class:`DemSettings`."""


@dataclass(frozen=True, kw_only=True)
class DemSettings:
    """Settings of :func:`dem.collapse`, by name.

    ``limitmason.predict(..., "dem")`` takes them too.

    Parameters
    ----------
    contact_points : points along the unit and across the thickness of every interface, one pair, or one per kind
        ("bed", "head", "base") or per wall by how its blocks' names begin ({"facade": (2, 8), "return": (2, 2)}; a
        joint between two walls takes the finer); at psi < phi torsion needs about 8 across. (4, 8) by default, where
        joints crush (15, 15) of "lobatto"
    contact_model : "grid", "lobatto" for points that crowd towards the edges, or "vertices" for corners only
    contacts : "edges": points of joints that slide follow the edges of their faces. Pairs of blocks that meet later are
        not looked for, and a joint keeps its plane: loads under which blocks moved far are pointed out. "first" keeps
        every point where it was on its block, as ``lm.pushover(contacts="first")`` does: a bearing that slides along
        then bears more and more
    tolerance : width of the final bracket over the multiplier [-]. Each load is held until force and moment are small
        in four checks in a row; where blocks keep moving, the last equilibrium is restored and the increment halved
    error_budget : what to repeat the search with: "stiffness" (kn, ks x 10), "ks/kn" (ks x 0.4, which decides how
        wedged blocks share their thrust), "contact points" (x 2, and crowded towards the edges: "lobatto") and "rate"
        (increments half as long). The repeats start near the multiplier found and close in on it
        to twice ``tolerance``; where the multiplier may move by 2 % there is a warning. All four together take two to
        five times as long as the search. () for none
    joint_options : limits of dilation, softening lengths
    blocks, stress : "rigid", or "simply deformable" blocks that strain and bend, in space ("solid"), "plane stress" or
        "plane strain"; see :func:`dem.initial_state`
    first_increment : first step of the multiplier; a twentieth of that at which live equals dead load by default
    max_steps : budget for one load, up to three times that while it is still on its way to a verdict; when it runs out
        the load is "undecided", never counted as stable
    moved_limit : displacement that counts as collapse, over the smallest block dimension [-]; None begins with 0.02
        and, where a load in equilibrium moves a block by more than half of that, as soft joints do, goes on from
        there with 0.3. A number is kept, and a warning says where it is too small
    equilibrium : largest unbalanced force of every block over its own load, and moment over that load times its least
        thickness [-]; a twentieth of the load increment where that is less
    damping : while loading; local 0.4 with stops at peaks of the kinetic energy, given up for local 0.6 in a load that
        has not settled after 8000 steps
    progress : called with every load tried and its verdict

    Raises
    ------
    InputError
        For an unknown check, and numbers that are not positive.
    """

    contact_points: Grid | Mapping[str, Grid] | None = None
    contact_model: str | None = None
    contacts: str = EDGES
    tolerance: float = 5e-3
    error_budget: tuple[str, ...] = CHECKS
    joint_options: JointOptions | None = None
    blocks: str = RIGID
    stress: str = SOLID
    first_increment: float | None = None
    max_steps: int = 60_000
    moved_limit: float | None = None
    equilibrium: float = 1e-4
    damping: Damping | None = None
    progress: Callable[[float, LoadVerdict], object] | None = None

    def __post_init__(self) -> None:
        """Say which setting is wrong."""
        choice("contacts", self.contacts, (EDGES, FIRST))
        positive("tolerance", self.tolerance)
        positive("equilibrium", self.equilibrium)
        count("max_steps", self.max_steps)
        for name in ("moved_limit", "first_increment"):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name))
        _of_classes(self)
        if isinstance(self.error_budget, str) or not isinstance(self.error_budget, Sequence):
            raise InputError(
                f"error_budget must be several of {', '.join(CHECKS)}, such as ({CHECKS[0]!r},), or () for none, got "
                f"{self.error_budget!r}"
            )
        for check in self.error_budget:
            choice("a check of error_budget", check, CHECKS)
        listener("progress", self.progress, "a multiplier and its verdict")


def _of_classes(settings: DemSettings | PushSettings) -> None:
    """Refuse a damping, or options of joints, that are something else."""
    if settings.damping is not None:
        instance("damping", settings.damping, Damping)
    if settings.joint_options is not None:
        instance("joint_options", settings.joint_options, JointOptions)


KINDS = (RIGID, LUMPED, SIMPLY_DEFORMABLE, ZONED)
"""How the units of a driven structure deform."""

_WHOLE = (RIGID, LUMPED, SIMPLY_DEFORMABLE)
_TAKEN_BY = {
    "stress": (SIMPLY_DEFORMABLE, ZONED), "zone_size": (ZONED,), "damping": _WHOLE, "settle": _WHOLE,
    "detect_every": _WHOLE, "calm": _WHOLE, "sound": _WHOLE,
}
"""Settings of a push that some kinds of blocks do not know, and who takes them."""

# chosen: fewer samples show no curve, fewer steps no motion
_LEAST_SAMPLES, _LEAST_STEPS = 10, 100

ZONED_STEPS = 10
"""Steps of a sample of zoned blocks, at least: its load is a mean over the last of them."""


@dataclass(frozen=True, kw_only=True)
class PushSettings:
    """Settings of :func:`dem.push`, by name there.

    Parameters
    ----------
    blocks : "rigid"; "lumped": rigid blocks whose joints take over the compliance of the units' material, see
        :func:`limitmason.mechanics.lumped_units.with_lumped_units`; "simply deformable": blocks that strain and bend,
        see :func:`dem.initial_state`; "zoned": walls in the x-z plane, each block with a material cut into zones that
        strain, yield and crack in tension. Blocks that are held or without a material stay rigid, zoned ones also
        where they are driven
    stress : of simply deformable and zoned blocks: "plane stress" (the default of a plane problem, and of all zoned
        ones), "plane strain", or "solid", in space, of simply deformable ones
    zone_size : largest edge of a zone [m]; of zoned blocks, where it must be given
    contact_points : as for :func:`dem.initial_state`; by default spaced by half the smallest side of any joint, and
        where zones meet. Where joints crush there are 15 on a side, crowded towards the edges. Brittle joints answer
        differently at other spacings, so that it stands in the answer
    joint_options : see :class:`dem.JointOptions`
    steps : of the faster run over the whole path; by default forty of the slowest motion's periods, and 6000 at least,
        40 000 and ten a sample of zoned blocks
    rate_check : run again at a third of the speed: the answer is that run, its difference to the first the rate error.
        False runs once, for studies of many
    samples : per run, between which nothing is recorded
    longest : predicted run time above which the push is refused [s], with ``steps`` given that of settling alone
    damping : while driven; local 0.5 by default, combined where motion is steady
    settle : how the own weight settles; to 1e-5 by default. It acts at once. Where joints slide by that, it comes on
        once more and evenly, over as many steps as it took to rest and 1000 at least
    detect_every : see :func:`dem.simulate`
    calm : stand still while the kinetic energy is above this part of the elastic one [-], as ``Drive(calm=...)``: what
        a brittle drop sets moving rests before more is asked of the structure, at 3e-4 for up to twice the steps. None
        drives on whatever happens
    sound : where own weight breaks joints as it comes to rest, let it come to rest once more on joints that lose
        nothing, and then on joints as they are. Weight that acts at once overshoots by some per cent and breaks what
        it would not break at rest. Zoned blocks need none: their weight comes on slowly

    Raises
    ------
    InputError
        For an unknown kind of blocks, a setting that they do not take, and numbers that are too small.
    """

    blocks: str = RIGID
    stress: str | None = None
    zone_size: float | None = None
    contact_points: Spacing | None = None
    joint_options: JointOptions | None = None
    steps: int | None = None
    rate_check: bool = True
    samples: int = 400
    longest: float = 3600.0
    damping: Damping | None = None
    settle: Settle | None = None
    detect_every: int | None = 50
    calm: float | None = None
    sound: bool = False

    def __post_init__(self) -> None:
        """Say which setting is wrong, or would not be used."""
        choice("blocks", self.blocks, KINDS)
        count("samples", self.samples)
        if self.steps is not None:
            count("steps", self.steps)
        if self.longest != np.inf:
            positive("longest", self.longest)
        if self.settle is not None:
            instance("settle", self.settle, Settle)
        if self.detect_every is not None:
            count("detect_every", self.detect_every)
        for name in ("rate_check", "sound"):
            choice(name, getattr(self, name), (True, False))
        _of_classes(self)
        for name, usual in ((f.name, f.default) for f in fields(self) if f.name in _TAKEN_BY):
            if getattr(self, name) != usual and self.blocks not in _TAKEN_BY[name]:
                raise InputError(
                    f"{self.blocks} blocks take no {name}: leave it out, or take blocks of another kind "
                    f"({', '.join(_TAKEN_BY[name])})"
                )
        if self.blocks == ZONED and self.zone_size is None:
            raise InputError("zoned blocks need zone_size=, the largest edge of a zone [m]")
        zoned = self.blocks == ZONED
        least = ZONED_STEPS * self.samples if zoned else _LEAST_STEPS
        if self.samples < _LEAST_SAMPLES or (self.steps is not None and self.steps < least):
            words = f"{ZONED_STEPS} times as many" if zoned else f"{_LEAST_STEPS}"
            raise InputError(
                f"samples must be at least {_LEAST_SAMPLES} and steps at least {words}, got {self.samples!r} and "
                f"{self.steps!r}"
            )
