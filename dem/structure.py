"""A structure of rigid, lumped or strained blocks as a push drives it."""

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.driving import Follower, unit_twist, widest_spacing
from dem.history import History
from dem.joint_marks import JointMarks
from dem.joints import JointOptions
from dem.pace import LEAST_STEPS, slowest_period, softest_note
from dem.push_curve import PushCurve
from dem.resuming import check_same, signature
from dem.settings import PushSettings
from dem.settling import settled
from dem.simulate import resume, simulate
from dem.state import UnstableError, make_state
from limitmason.deformable import PLANE_STRESS, SOLID
from limitmason.deformable.levels import LUMPED, RIGID, SIMPLY_DEFORMABLE
from limitmason.mechanics.contact_points import on_few_points
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.plane import Plane, find_plane
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Damping, Drive, Hold, Settle, Stage

Array = NDArray[np.float64]

UNITS: Mapping[str, Callable[[Assembly], Assembly]] = {
    RIGID: lambda assembly: assembly, LUMPED: with_lumped_units, SIMPLY_DEFORMABLE: lambda assembly: assembly,
}  # fmt: skip
"""What units make of their joints: lumped ones give them their compliance."""

GENTLE = 0.02
"""Part of the path over which the drive starts at a quarter of its speed [-]."""

BRAKE = Damping(local=0.5, combined=True)
"""Damping of a driven run; local damping alone drags on what slides: 5 % of a plastic wall's load, 20 % of peaks."""

_TRIED = 100


class BlockStructure:
    """Rigid or strained blocks that a push drives.

    Parameters
    ----------
    assembly : what is driven; of lumped units with the joints' series stiffness
    unit, held : twist of the blocks per displacement of 1 m, and the freedoms that the drive holds, shapes (n, 6)
    blocks : how they deform, in words
    same : digests by name of what a file of it must have in common with it
    least_steps : of the faster run
    to_settle : slowest motions in which it comes to rest, about; 0 where settling has an end of its own
    """

    least_steps = LEAST_STEPS
    to_settle = 0.0

    def __init__(self, assembly: Assembly, drive: Drive, loads: Loads | None, chosen: PushSettings) -> None:
        """Contact points, masses and signature; nothing moves yet."""
        self.move = drive = drive if chosen.calm is None else replace(drive, calm=chosen.calm)
        self.unit, self.held = unit_twist(drive, assembly)
        self.assembly = model = UNITS[chosen.blocks](assembly)
        self.chosen = chosen
        loads = loads if loads is not None else Loads.weight(model)
        self.loads = Loads(loads.dead, np.zeros_like(loads.dead), loads.name)
        plane, strains = _plane(model, self.loads, self.unit), chosen.blocks == SIMPLY_DEFORMABLE
        stress = chosen.stress or (PLANE_STRESS if strains and plane is not None else SOLID)
        grid = chosen.contact_points
        self.state = make_state(
            model, self.loads, contact_points=default_spacing(model) if grid is None else grid,
            joint_options=chosen.joint_options, blocks=SIMPLY_DEFORMABLE if strains else RIGID,
            plane=None if strains and stress == SOLID else plane, stress=stress, driven=self.unit,
        )  # fmt: skip
        if grid is None:
            finer = "give contact_points, the spacing [m], a twelfth of the thickness"
            self.state = replace(self.state, warnings=(*self.state.warnings, *on_few_points(model, finer)))
        self.settle = chosen.settle or Settle(tolerance=1e-5)
        if drive.servo:
            self.settle = Settle(
                self.settle.tolerance, self.settle.max_steps, damping=self.settle.damping, servo=drive.servo
            )
        b, p = self.state.bodies, self.state.points
        parts = {
            "scaled masses": (b.mass, b.inv_inertia), "strain shapes": (*(self.state.modes or ()),),
            "contact points": (p.s, p.t, p.area, p.gap), "loads": (self.state.dead,),
        }  # fmt: skip
        self.same: Mapping[str, str] = signature(
            model, parts, blocks=chosen.blocks, stress=stress, joint_options=chosen.joint_options or JointOptions(),
            settle=self.settle, sound=chosen.sound,
        )  # fmt: skip
        self.blocks = f"{chosen.blocks}, {stress}" if strains else chosen.blocks
        self.settled: History | None = None

    @property
    def at_rest(self) -> History:
        """The run that came to rest."""
        assert self.settled is not None
        return self.settled

    @cached_property
    def period(self) -> float:
        """Steps of the slowest motion."""
        return slowest_period(self.assembly, self.state, self.loads)

    @property
    def _driven_block(self) -> int:
        return int(np.argmax(np.linalg.norm(self.unit[:, :3], axis=1)))

    def step_time(self) -> float:
        """Time that a step takes [s], from a few of a copy once they are compiled."""
        simulate(self.assembly, Hold(steps=1), start=self.state, sample=1)
        clock = time.perf_counter()
        simulate(self.assembly, Hold(steps=_TRIED), start=self.state, sample=_TRIED)
        return (time.perf_counter() - clock) / _TRIED

    def contrast(self) -> str:
        """What makes its motion slow, in words."""
        return softest_note(self.state, self.assembly)

    def check(self, file: Path, same: Mapping[str, str]) -> None:
        """Refuse a file of another push."""
        check_same(file, History.load(file, self.assembly).same, same)

    def rest(self, file: Path | None) -> None:
        """Come to rest under the dead loads, or take the rest from a file; it is kept there."""
        self.settled = settled(
            self.assembly, self.state, self.settle, self.loads, sound=self.chosen.sound, file=file, same=self.same
        )

    def drive(
        self, path: Sequence[float], steps: int, same: Mapping[str, str], file: Path | None, follow: Follower
    ) -> PushCurve:
        """Drive a copy along a path in so many steps, or on from where a file says that it stood."""
        clock, chosen, stages = time.perf_counter(), self.chosen, _stages(self.move, path, steps)
        origin = float(self.at_rest["step"][-1])
        follow.begin(origin)
        try:
            if file is not None and file.exists():
                history = History.load(file, self.assembly)
                check_same(file, history.same, same)
                if history.position is not None:
                    follow.begin(origin, float(history["step"][-1]) - origin if len(history["step"]) else 0.0)
                    history = resume(history, stages, progress=follow, checkpoint=file)
            else:
                history = simulate(
                    self.assembly, stages, start=replace(self.at_rest, same=dict(same)), checkpoint=file,
                    progress=follow, sample=max(steps // chosen.samples, 1), damping=chosen.damping or BRAKE,
                    detect_every=chosen.detect_every,
                )  # fmt: skip
        except UnstableError as error:
            # a block that has fallen out may end a run whose curve was there before
            if error.history is None or len(error.history.shift) < 2:
                raise
            history = replace(error.history, warnings=(*error.history.warnings, f"the run ended early: {error}"))
        if file is not None:
            history.save(file)
        return self._curve(history, steps, time.perf_counter() - clock)

    def _curve(self, history: History, steps: int, seconds: float) -> PushCurve:
        """What a history that began at the settled one says of the drive."""
        rest, block = self.at_rest, self._driven_block
        before, axis = rest.state.bodies, self.unit[block, :3]
        driven = [k for k, b in enumerate(history.reaction_blocks) if self.unit[b].any()]
        twist = self.unit[history.reaction_blocks[driven]]
        names = JointMarks._fields
        marks: dict[str, Any] = {k: np.concatenate([getattr(rest, k)[-1:], getattr(history, k)]) for k in names}
        p, start = rest.state.points, rest.state.joints.start

        def begun(values: Array) -> Array:
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
        )  # fmt: skip


def default_spacing(assembly: Assembly) -> float:
    """Half the smallest of the lengths and heights of joints [m], each the longer side in its plane of the wall."""
    x = assembly.arrays
    owner = np.repeat(np.arange(len(x.block_a)), np.diff(x.corner_start))
    arm = x.corners - x.centre[owner]
    first = x.corner_start[:-1]
    spans = np.stack([
        np.maximum.reduceat(a, first) - np.minimum.reduceat(a, first)
        for a in (np.einsum("ij,ij->i", arm, t[owner]) for t in (x.tangent_1, x.tangent_2))
    ])  # fmt: skip
    return 0.5 * float(spans.min(axis=0).min())


def _plane(assembly: Assembly, loads: Loads, unit: Array) -> Plane | None:
    """Plane of a plane problem along the global axes, None in space."""
    plane = find_plane(assembly, loads, unit)
    return plane if plane is not None and np.isclose(np.abs(plane.normal).max(), 1.0, atol=1e-12) else None


def _stages(drive: Drive, path: Sequence[float], steps: int) -> Sequence[Stage]:
    """A gentle start and one stage for every branch of the path."""
    names = ("x", "y", "z", "rx", "ry", "rz")
    size = float(max(np.linalg.norm([m.get(k, 0.0) for k in names[:3]]) for m in drive.displacement.values()))

    def stage(length: float, count: float) -> Drive:
        moves = {b: {k: length * v / size for k, v in m.items()} for b, m in drive.displacement.items()}
        return Drive(moves, steps=max(round(count), 1), keep=True, servo=drive.servo, damping=drive.damping,
                     calm=drive.calm)  # fmt: skip

    lengths = np.diff([0.0, *path])
    travel = float(np.abs(lengths).sum())
    start = np.sign(lengths[0]) * min(GENTLE * travel, 0.5 * abs(lengths[0]))
    pace = steps / (travel + 3.0 * abs(start))
    return [stage(start, 4.0 * pace * abs(start)), stage(lengths[0] - start, pace * abs(lengths[0] - start))] + [
        stage(length, pace * abs(length)) for length in lengths[1:]
    ]
