"""Driven structures: a plate pushed to a displacement, at a speed and a third of it, as one load-displacement curve."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dem.driving import SLOWER, named, turning_points, unit_twist, widest_spacing
from dem.history import History
from dem.joints import Grid, JointOptions, per_interface
from dem.pace import default_steps, slowest_period, softest_note
from dem.push_curve import PushCurve, make_curve
from dem.resuming import digest, part_file, spelled
from dem.settling import check_taken_up
from dem.settling import settled as at_rest
from dem.simulate import Progress, resume, simulate
from dem.state import State, UnstableError, make_state
from dem.zones.push import push_zoned
from limitmason.deformable import PLANE_STRESS, SOLID
from limitmason.deformable.levels import LUMPED, MODAL, RIGID, ZONED
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import on_few_points
from limitmason.mechanics.lumped_units import with_lumped_units
from limitmason.mechanics.plane import find_plane
from limitmason.model import Assembly, Loads
from limitmason.model.stages import Damping, Drive, Hold, Settle, Stage

Array = NDArray[np.float64]

BLOCKS: Mapping[str, Callable[[Assembly], Assembly]] = {
    RIGID: lambda assembly: assembly, LUMPED: with_lumped_units, MODAL: lambda assembly: assembly,
}  # fmt: skip
"""How the units deform: not at all; through joints that take the units' compliance over; in modes of their own."""

GENTLE = 0.02
"""Part of the path over which the drive starts at a quarter of its speed [-]."""

LONGEST = 3600.0
"""Predicted run time above which a push whose rate nobody chose is refused [s]."""

_TRIED = 100

BRAKE = Damping(local=0.5, combined=True)
"""Damping of a driven run; local damping alone drags on what slides: 5 % of a plastic wall's load, 20 % of peaks."""

SAMPLES = 400
"""Samples per run, where none are asked for."""


@watched("push")
def push(
    assembly: Assembly,
    drive: Drive,
    *,
    to: float | Sequence[float],
    loads: Loads | None = None,
    blocks: str = RIGID,
    stress: str | None = None,
    contact_points: Grid | None = None,
    joint_options: JointOptions | None = None,
    steps: int | None = None,
    rate_check: bool = True,
    damping: Damping | None = None,
    settle: Settle | None = None,
    samples: int = SAMPLES,
    detect_every: int | None = 50,
    longest: float = LONGEST,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    label: str = "",
    zone_size: float | None = None,
    calm: float | None = None,
    sound: bool = False,
) -> PushCurve:
    """Load-displacement curve of a structure that is driven to a displacement, own weight settled first.

    The load is what the drive exerts along its direction beyond what stood there when it began, conjugate in work to
    the displacement, which counts from the settled state. The run goes on to the end of the path whatever the load
    does: it recovers after drops.

    Parameters
    ----------
    drive : its ``displacement`` is a direction, {"plate": {"z": -1.0}}; degrees of freedom given as 0 are held, those
        not named are free, so that a plate may turn. A ``servo`` holds in all of the run
    to : displacement at the end [m]; several are a path with turning points (cycles), each from the start
    loads : dead loads; self weight alone by default. Live loads do not act
    blocks : "rigid"; "lumped": rigid blocks whose joints take over the compliance of the units' material, see
        :func:`limitmason.mechanics.lumped_units.with_lumped_units`; "modal": blocks that strain and bend, see
        :func:`dem.make_state`; "zoned": each block with a material cut into zones that strain, in walls in the x-z
        plane also yield and crack in tension, see :func:`dem.zones.push.push_zoned`
    stress : of modal and zoned blocks: "plane stress" (the default of a plane problem, and of all zoned ones), "plane
        strain", or "solid", in space
    contact_points : as for :func:`dem.make_state`; by default spaced by half the smallest length of a joint, and where
        zones meet. Brittle joints answer differently at other spacings, so that it stands in the answer
    joint_options : see :class:`dem.JointOptions`
    steps : of the faster run over the whole path; by default as :func:`dem.pace.default_steps` says
    rate_check : run again at a third of the speed: the answer is that run, its difference to the first the rate error.
        False runs once, for studies of many
    damping : while driven; local 0.5 by default, combined where motion is steady
    settle : how the own weight settles; to 1e-5 by default
    samples : per run, between which nothing is recorded
    detect_every : see :func:`dem.simulate`
    longest : predicted run time above which the push is refused, where ``steps`` is not given [s]
    progress : called with the last sample as a mapping, with "run", "part" of all steps done and "time left" [s] added;
        return True to stop ("interrupted")
    checkpoint : file beside which the runs are kept as they go; a push of the same model with the same file goes on
        where it was cut off, to the same bits, or returns at once what was finished. With other settings, or the file
        of a version that did not keep them, it is refused
    zone_size : largest edge of a zone [m]; of zoned blocks, where it must be given
    calm : stand still while the kinetic energy is above this part of the elastic one [-], as ``Drive(calm=...)``: what
        a brittle drop sets moving rests before more is asked of the structure, at 3e-4 for up to twice the steps. None
        drives on whatever happens; not with zoned blocks
    sound : where own weight breaks joints as it comes to rest, let it come to rest once more on joints that lose
        nothing, and then on joints as they are. Weight that acts at once overshoots by some per cent and breaks what
        it would not break at rest. Zoned blocks need none: their weight comes on slowly

    Returns
    -------
    PushCurve

    Raises
    ------
    UnstableError
        As :func:`dem.simulate`, before there is a curve; after that the curve ends there and its warnings say so.
    UnsettledError
        For a structure that does not settle under its dead loads.
    InputError
        For a drive without direction, a path without length, an unknown kind of blocks, contrasts of stiffness that
        make the run hopeless (with the predicted time), a checkpoint of another push, and what
        :func:`dem.make_state` refuses.
    KeyboardInterrupt
        Stopped by the keyboard while own weight comes to rest; after that what was driven is kept.

    Notes
    -----
    Masses are scaled, so that time means nothing and a drop of load is a fall through a sequence of static states only
    as far as the kinetic energy stays small beside the work: ``errors["kinetic"]`` says so at every sample, and the two
    speeds differ where it does not.
    """
    if blocks not in (*BLOCKS, ZONED):
        raise InputError(f"blocks must be one of {', '.join(map(repr, (*BLOCKS, ZONED)))}, got {blocks!r}")
    if blocks == ZONED:
        if zone_size is None:
            raise InputError("zoned blocks need zone_size=, the largest edge of a zone [m]")
        usual = (
            ("damping", damping, None), ("settle", settle, None), ("detect_every", detect_every, 50),
            ("calm", calm, None), ("sound", sound, False),
        )  # fmt: skip
        for name, value, default in usual:
            if value != default:
                raise InputError(f"zoned blocks take no {name}: leave it out")
        return push_zoned(
            assembly, drive, to=to, zone_size=zone_size, loads=loads, plane=stress or PLANE_STRESS,
            contact_points=contact_points, joint_options=joint_options, steps=steps, rate_check=rate_check,
            samples=samples, longest=longest, progress=progress, checkpoint=checkpoint, label=label,
        )  # fmt: skip
    if zone_size is not None:
        raise InputError(f"zone_size is of zoned blocks: give blocks={ZONED!r}, or leave it out")
    if samples < 10 or (steps is not None and steps < 100):
        raise InputError(f"samples must be at least 10 and steps at least 100, got {samples!r} and {steps!r}")
    if calm is not None:
        drive = replace(drive, calm=calm)
    path, unit = turning_points(to), unit_twist(drive, assembly)[0]
    model = BLOCKS[blocks](assembly)
    loads = loads if loads is not None else Loads.weight(model)
    loads = Loads(loads.dead, np.zeros_like(loads.dead), loads.name)
    grid = contact_points if contact_points is not None else default_spacing(model)
    plane = _plane(model, loads, unit)
    if blocks != MODAL and stress is not None:
        raise InputError(f"stress={stress!r} is for {MODAL} and {ZONED} blocks: others have no stress of their own")
    if stress is None:
        stress = PLANE_STRESS if blocks == MODAL and plane is not None else SOLID
    state = make_state(
        model, loads, contact_points=grid, joint_options=joint_options, blocks=MODAL if blocks == MODAL else RIGID,
        plane=None if blocks == MODAL and stress == SOLID else plane, stress=stress, driven=unit,
    )  # fmt: skip
    if contact_points is None:
        finer = "give contact_points, the spacing [m], a twelfth of the thickness"
        state = replace(state, warnings=(*state.warnings, *on_few_points(model, finer)))
    reached(None, "settling")
    rest = settle or Settle(tolerance=1e-5)
    if drive.servo:
        rest = Settle(rest.tolerance, rest.max_steps, damping=rest.damping, servo=drive.servo)
    same = _signature(
        model, state, blocks=blocks, stress=stress, joint_options=joint_options or JointOptions(), settle=rest,
        sound=sound,
    )  # fmt: skip
    driven = same | _digests(
        drive=(unit.tolist(), drive.calm), to=path, samples=samples, damping=damping or BRAKE, detect_every=detect_every
    )
    # before a file of this push is written beside those of another
    for number in range(1 + rate_check):
        file = _run_file(checkpoint, number)
        if file is not None and file.exists():
            check_taken_up(file, History.load(file, model), driven)
    settled = at_rest(model, state, rest, loads, sound=sound, file=part_file(checkpoint, "settled"), same=same)
    travel = float(np.abs(np.diff([0.0, *path])).sum())
    if steps is None:
        # a few steps of a copy: the time of settling holds that of compiling
        clock = time.perf_counter()
        simulate(model, Hold(steps=_TRIED), start=settled, sample=_TRIED)
        per_step = (time.perf_counter() - clock) / _TRIED
        period = slowest_period(model, settled.state, loads)
        steps = default_steps(period)
        predicted = per_step * steps * (1 + SLOWER * rate_check)
        if predicted > longest:
            raise InputError(
                f"the push would take about {predicted / 3600.0:.1f} h: the slowest motion takes {period:.3g} steps, "
                f"and the path {steps} of them; {softest_note(settled.state, model)}. Give longest=, or steps= and "
                "look at the rate error"
            )
    runs, done, total = [], 0, steps * (1 + SLOWER * rate_check)
    for number, count in enumerate((steps, SLOWER * steps) if rate_check else (steps,)):
        follow = _Follower(progress, number, done, count, total)
        reached(done / total, f"run {number + 1} of {1 + rate_check}", share=count / total)
        begun = replace(settled, same=driven | _digests(steps=count))
        history = _run(model, begun, _stages(drive, path, travel, count), max(count // samples, 1), damping,
                       detect_every, follow if progress is not None else None, checkpoint, number)  # fmt: skip
        runs.append(history)
        done += count
        if history.status == "interrupted":
            break
    level = f"{blocks}, {stress}" if blocks == MODAL else blocks
    words = {"blocks": level, "spacing": _spacing(settled.state), "label": named(drive, label)}
    curves = [
        make_curve(model, settled, history, unit, count, **words)
        for history, count in zip(runs, (steps, SLOWER * steps), strict=False)
    ]
    return curves[0] if len(curves) == 1 else curves[1].beside(curves[0])


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


def _plane(assembly: Assembly, loads: Loads, unit: Array) -> Any:
    """Plane of a plane problem along the global axes, None in space."""
    plane = find_plane(assembly, loads, unit)
    return plane if plane is not None and np.isclose(np.abs(plane.normal).max(), 1.0, atol=1e-12) else None


def _signature(assembly: Assembly, state: State, **settings: Any) -> dict[str, str]:
    """What the files of a push must have in common with it: settings and what of the model joints do not say."""
    b, p = state.bodies, state.points
    parts = {
        "scaled masses": (b.mass, b.inv_inertia),
        "strain shapes": (*(state.modes or ()),),
        "contact points": (p.s, p.t, p.area, p.gap),
        "loads": (state.dead,),
    }
    made = {name: digest(*(np.ascontiguousarray(v).tobytes() for v in arrays)) for name, arrays in parts.items()}
    return assembly.fingerprint.digests | made | _digests(**settings)


def _digests(**settings: Any) -> dict[str, str]:
    return {name: digest(spelled(value).encode()) for name, value in settings.items()}


def _stages(drive: Drive, path: Sequence[float], travel: float, steps: int) -> Sequence[Stage]:
    """A gentle start and one stage for every branch of the path."""
    names = ("x", "y", "z", "rx", "ry", "rz")
    size = float(max(np.linalg.norm([m.get(k, 0.0) for k in names[:3]]) for m in drive.displacement.values()))

    def stage(length: float, count: float) -> Drive:
        moves = {b: {k: length * v / size for k, v in m.items()} for b, m in drive.displacement.items()}
        return Drive(moves, steps=max(round(count), 1), keep=True, servo=drive.servo, damping=drive.damping,
                     calm=drive.calm)  # fmt: skip

    lengths = np.diff([0.0, *path])
    start = np.sign(lengths[0]) * min(GENTLE * travel, 0.5 * abs(lengths[0]))
    pace = steps / (travel + 3.0 * abs(start))
    return [stage(start, 4.0 * pace * abs(start)), stage(lengths[0] - start, pace * abs(lengths[0] - start))] + [
        stage(length, pace * abs(length)) for length in lengths[1:]
    ]


def _run(
    assembly: Assembly, settled: History, stages: Sequence[Stage], sample: int, damping: Damping | None,
    detect_every: int | None, progress: Progress | None, checkpoint: str | Path | None, number: int,
) -> History:  # fmt: skip
    file = _run_file(checkpoint, number)
    try:
        if file is not None and file.exists():
            before = History.load(file, assembly)
            check_taken_up(file, before, settled.same)
            if before.position is None:
                return before
            history = resume(before, stages, progress=progress, checkpoint=file)
        else:
            history = simulate(
                assembly, stages, start=settled, sample=sample, damping=damping or BRAKE, detect_every=detect_every,
                progress=progress, checkpoint=file,
            )  # fmt: skip
    except UnstableError as error:
        # a block that has fallen out may end a run whose curve was there before
        if error.history is None or len(error.history.shift) < 2:
            raise
        history = replace(error.history, warnings=(*error.history.warnings, f"the run ended early: {error}"))
    if file is not None:
        history.save(file)
    return history


def _run_file(checkpoint: str | Path | None, number: int) -> Path | None:
    return part_file(checkpoint, "v" if number == 0 else f"v{SLOWER}")


def _spacing(state: State) -> float:
    """Largest distance between neighbouring contact points of a joint [m]."""
    p, start = state.points, state.joints.start
    return widest_spacing((p.s[a:b], p.t[a:b]) for a, b in pairwise(start))


class _Follower:
    """Adds to every sample what part of the push is done and how long the rest will take."""

    def __init__(self, progress: Progress | None, run: int, before: int, count: int, total: int) -> None:
        self.progress, self.run, self.before, self.count, self.total = progress, run, before, count, total
        self.clock, self.first = time.perf_counter(), -1.0

    def __call__(self, sampled: Mapping[str, Any]) -> object:
        """Hand the sample on."""
        if self.first < 0.0:
            self.first, self.clock = float(sampled["step"]), time.perf_counter()
        taken = float(sampled["step"]) - self.first
        pace = (time.perf_counter() - self.clock) / taken if taken > 0.0 else np.nan
        done = self.before + min(taken, self.count)
        assert self.progress is not None
        return self.progress(
            {**sampled, "run": self.run, "part": done / self.total, "time left": pace * (self.total - done)}
        )


__all__ = ["BLOCKS", "default_spacing", "per_interface", "push"]
