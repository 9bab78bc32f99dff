"""A structure of rigid, lumped or strained blocks as a push drives it."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from dem.default_damping import PUSHING
from dem.driving.own_weight import settled
from dem.driving.pace import LEAST_STEPS, slowest_period, softest_note
from dem.driving.push_curve import PushCurve
from dem.driving.structure import DrivenStructure, widest_spacing
from dem.kernels import E_STEPS
from dem.model.initial_state import initial_state
from dem.model.joint_marks import MARKS
from dem.model.joints import JointOptions
from dem.settings import PushSettings
from dem.stages.history import History
from dem.stages.resuming import RunStatus, signature
from dem.stages.simulate import prepared, simulate, taken_up
from dem.stages.stage_run import StageRun
from limitmason.arrays import Array
from limitmason.deformable import PLANE_STRESS, SOLID
from limitmason.deformable.levels import LUMPED, RIGID, SIMPLY_DEFORMABLE
from limitmason.mechanics.contact_points import FEW_POINTS, extents, on_few_points
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.plane import Plane, find_plane, two_planes
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Drive, Hold, Settle, Stage

GENTLE, GENTLER = 0.02, 4
"""Part of the path over which the drive starts so many times more slowly [-], as a jump of speed shakes the blocks."""

AT_REST = 1e-5
"""Unbalance up to which own weight rests before a drive, over a block's own load [-]; chosen."""

_ALONG = 1e-12  # of 1: a normal whose largest component is as near lies along a global axis, but for rounding


class BlockStructure(DrivenStructure):
    """Rigid or strained blocks that a push drives.

    Settling has an end of its own. Attributes beside those of :class:`DrivenStructure`:

    Attributes
    ----------
    move : the drive, with the calm of the settings
    loads : dead loads [N, N m]; live ones of factor 0
    state : unloaded, from which it settles
    settle : the stage in which it comes to rest
    at_rest : run that came to rest, once it has
    """

    at_rest: History

    least_steps = LEAST_STEPS
    tried = 100
    least_samples = 2

    def __init__(self, assembly: Assembly, drive: Drive, loads: Loads | None, chosen: PushSettings) -> None:
        """Contact points, masses and signature; nothing moves yet.

        Parameters
        ----------
        assembly : what is driven, as the user gave it
        drive : which blocks and along which direction
        loads : dead ones; self weight where None
        chosen : settings of the push
        """
        super().__init__(assembly, drive, loads, chosen)
        self.move = drive = drive if chosen.calm is None else replace(drive, calm=chosen.calm)
        self.assembly = model = with_lumped_units(assembly) if chosen.blocks == LUMPED else assembly
        loads = loads if loads is not None else Loads.weight(model)
        self.loads = loads.scaled(live=0.0)
        plane, strains = _plane(model, self.loads, self.unit), chosen.blocks == SIMPLY_DEFORMABLE
        # a square pier lies in two planes at once: in which of them stress is plane would be chance
        flat = strains and plane is not None and not two_planes(model, self.loads, self.unit)
        stress = chosen.stress or (PLANE_STRESS if flat else SOLID)
        grid = chosen.contact_points
        # joints that crush have a grid of their own, see PushSettings
        if grid is None and not np.isfinite(model.arrays.compressive_strength).any():
            grid = default_spacing(model)
        self.state = initial_state(
            model, self.loads, contact_points=grid,
            joint_options=chosen.joint_options, blocks=SIMPLY_DEFORMABLE if strains else RIGID,
            # blocks that strain in space leave the plane by Poisson's ratio
            plane=None if strains and stress == SOLID else plane, stress=stress, driven=self.unit,
        )
        if chosen.contact_points is None and grid is not None:
            # the spacing is none that the user gave
            said = tuple(w for w in self.state.warnings if not w.startswith(FEW_POINTS))
            finer = "give contact_points, the spacing [m], a twelfth of the thickness"
            self.state = replace(self.state, warnings=(*said, *on_few_points(model, finer)))
        self.settle = chosen.settle or Settle(tolerance=AT_REST)
        if drive.servo:
            self.settle = replace(self.settle, servo=drive.servo)
        b, p = self.state.bodies, self.state.points
        parts = {
            "scaled masses": (b.mass, b.inv_inertia), "strain shapes": (*(self.state.modes or ()),),
            "contact points": (p.s, p.t, p.area, p.gap), "loads": (self.state.dead, self.state.dead_arms),
        }
        self.same = signature(
            model, parts, blocks=chosen.blocks, stress=stress, joint_options=chosen.joint_options or JointOptions(),
            settle=self.settle, sound=chosen.sound,
        )
        self.blocks = f"{chosen.blocks}, {stress}" if strains else chosen.blocks

    @cached_property
    def period(self) -> float:
        """Steps of the slowest motion."""
        return slowest_period(self.assembly, self.state, self.loads)

    def contrast(self) -> str:
        """What makes its motion slow, in words."""
        return softest_note(self.state, self.assembly)

    def try_steps(self, count: int) -> None:
        """Take steps of a copy."""
        simulate(self.assembly, Hold(steps=count), start=self.state, sample=count)

    def come_to_rest(self) -> None:
        """Come to rest under the dead loads."""
        rest = settled(self.assembly, self.state, self.settle, self.loads, sound=self.chosen.sound)
        self.at_rest = replace(rest, same=dict(self.same))

    def keep_rest(self, file: Path) -> None:
        """Write the run that came to rest to a file."""
        self.at_rest.save(file)

    def take_rest(self, file: Path) -> None:
        """Take the run that came to rest from a file."""
        self.at_rest = History.load(file, self.assembly)

    def check(self, file: Path, same: Mapping[str, str]) -> None:
        """Refuse a file of another push.

        One of another model is refused by the block or joint that differs, and its field.
        """
        History.load(file, self.assembly)
        super().check(file, same)

    def begun(self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None) -> StageRun:
        """Run of a copy along a path, with arguments as for :meth:`DrivenStructure.begun`."""
        chosen, stages = self.chosen, _stages(self.move, path, steps)
        # a file knows how its run was made and where it stood
        if file is not None:
            return taken_up(History.load(file, self.assembly), stages)
        return prepared(
            self.assembly, stages, start=replace(self.at_rest, same=dict(same)),
            sample=max(steps // chosen.samples, 1), damping=chosen.damping or PUSHING, detect_every=chosen.detect_every,
        )

    def steps_of(self, run: StageRun) -> tuple[float, float]:
        """Number that the first step of a run counts from, and steps that it has taken."""
        origin = float(self.at_rest["step"][-1])
        return origin, float(run.rec.state.total[E_STEPS]) - origin if run.samples else 0.0

    def curve_of(self, run: StageRun, status: RunStatus, steps: int, seconds: float) -> PushCurve:
        """Curve of a run from the settled state: displacement, force, errors and marks.

        Displacement is that of the block that the drive moves farthest, force what the drive exerts on all it moves,
        along the drive and conjugate in work. Sample 0 is the state at rest, with no force.

        Parameters
        ----------
        status : how the run ended
        steps : that it was to take
        seconds : that it took [s]
        """
        history = run.rec.history(status)
        # the block that moves farthest, along its own direction
        rest, block = self.at_rest, int(np.argmax(np.linalg.norm(self.unit[:, :3], axis=1)))
        before, axis = rest.state.bodies, self.unit[block, :3]
        # columns of the recorded reactions that are of driven blocks, and how these move per 1 m
        driven = [k for k, b in enumerate(history.reaction_blocks) if self.unit[b].any()]
        twist = self.unit[history.reaction_blocks[driven]]
        marks: dict[str, Any] = {k: np.concatenate([getattr(rest, k)[-1:], getattr(history, k)]) for k in MARKS}
        p, start = rest.state.points, rest.state.joints.start

        def begun(values: Array) -> Array:
            """Values of the samples behind that of the state at rest, which is 0."""
            return np.concatenate([[0.0], values])

        return PushCurve(
            begun((history.shift[:, block] - before.shift[block]) @ axis),
            begun(np.einsum("sbk,bk->s", history.reaction[:, driven], twist)),
            errors={
                "energy": begun(history.energy_error / history._work),
                "kinetic": begun(history.kinetic_ratio_since(rest)),
            },
            # a state goes on and is written to
            states=[(before.shift.copy(), before.quat.copy()), *zip(history.shift, history.quaternion, strict=True)],
            status=history.status, warnings=history.warnings, assembly=self.assembly, history=history, **marks,
            settlement=float(before.shift[block] @ axis), blocks=self.blocks, law="; ".join(history.lost_in_failure),
            spacing=widest_spacing((p.s[a:b], p.t[a:b]) for a, b in pairwise(start)), steps=steps, seconds=seconds,
        )


def default_spacing(assembly: Assembly) -> float:
    """Spacing of contact points by default, half the smallest side of a joint [m]."""
    x = assembly.arrays
    return 0.5 * float(extents(x, x.tangent_1, x.tangent_2).min())


def _plane(assembly: Assembly, loads: Loads, unit: Array) -> Plane | None:
    """Plane normal to a global axis in which driven blocks stay, None without one.

    ``unit`` is the twist of the blocks per displacement of 1 m, shape (n, 6).
    """
    plane = find_plane(assembly, loads, unit)
    return plane if plane is not None and np.isclose(np.abs(plane.normal).max(), 1.0, atol=_ALONG) else None


def _stages(drive: Drive, path: Sequence[float], steps: int) -> Sequence[Stage]:
    """A gentle start and one stage for every branch of the path.

    The start takes a small part of the way, at most half of the first branch, at a quarter of the speed.

    Parameters
    ----------
    drive : its displacement is a direction, of any length
    path : turning points of the drive's displacement [m], from 0
    steps : of the whole run
    """
    names = ("x", "y", "z", "rx", "ry", "rz")
    size = float(max(np.linalg.norm([m.get(k, 0.0) for k in names[:3]]) for m in drive.displacement.values()))

    def stage(length: float, count: float) -> Drive:
        """Drive over a length [m], negative backwards, in so many steps."""
        moves = {b: {k: length * v / size for k, v in m.items()} for b, m in drive.displacement.items()}
        return Drive(moves, steps=max(round(count), 1), keep=True, servo=drive.servo, damping=drive.damping,
                     calm=drive.calm)

    lengths = np.diff([0.0, *path])
    travel = float(np.abs(lengths).sum())
    start = np.sign(lengths[0]) * min(GENTLE * travel, 0.5 * abs(lengths[0]))
    # steps per metre behind the start, which takes four times as many: all of them together are those of the run
    pace = steps / (travel + (GENTLER - 1.0) * abs(start))
    return [stage(start, GENTLER * pace * abs(start)), stage(lengths[0] - start, pace * abs(lengths[0] - start))] + [
        stage(length, pace * abs(length)) for length in lengths[1:]
    ]
