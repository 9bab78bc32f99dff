"""Driven structures: a plate pushed to a displacement, at a speed and a third of it, as one load-displacement curve."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from dem.driving.block_structure import BlockStructure
from dem.driving.pace import default_steps
from dem.driving.push_curve import PushCurve, told
from dem.driving.structure import SLOWER, DrivenStructure, Follower, turning_points
from dem.driving.zoned_structure import ZonedStructure
from dem.settings import PushSettings
from dem.stages.resuming import RunStatus, digests, part_file
from dem.stages.run import Progress
from limitmason.checks import instance
from limitmason.deformable.levels import ZONED
from limitmason.display.progress import reached, watched
from limitmason.errors import InputError
from limitmason.model import Assembly, Loads
from limitmason.model.model_call import of_model
from limitmason.model.stages import Drive


@of_model
@watched("push")
def push(
    assembly: Assembly,
    drive: Drive,
    *,
    to: float | Sequence[float],
    loads: Loads | None = None,
    settings: PushSettings | None = None,
    progress: Progress | None = None,
    checkpoint: str | Path | None = None,
    label: str = "",
    **options: Any,
) -> PushCurve:
    """Load-displacement curve of a structure that is driven once it has settled.

    The load is what the drive exerts along its direction beyond what stood there when it began, conjugate in work to
    the displacement, which counts from the settled state. The run goes on to the end of the path whatever the load
    does: it recovers after drops.

    Parameters
    ----------
    assembly : the structure; what the drive names is part of it
    drive : its ``displacement`` is a direction, {"plate": {"z": -1.0}}; degrees of freedom given as 0 are held, those
        not named are free, so that a plate may turn. A ``servo`` holds in all of the run; of zoned blocks, which stay
        in the x-z plane, it is a dead force
    to : displacement at the end [m]; several are a path with turning points (cycles), each from the start
    loads : dead loads; self weight alone by default. Live loads do not act
    settings : those of :class:`dem.PushSettings`; its defaults where omitted
    progress : called with the last sample as a mapping, with "run", "part" of all steps done and "time left" [s] added;
        return True to stop ("interrupted")
    checkpoint : file beside which the runs are kept as they go; a push of the same model with the same file goes on
        where it was cut off, to the same bits, or returns at once what was finished. With other settings, or the file
        of a version that did not keep them, it is refused
    label : what a legend calls it; the driven blocks by default
    options : single settings by name, in place of those in ``settings``

    Returns
    -------
    PushCurve
        Of the slower of two runs, with that at the first speed as its ``faster`` and their difference in
        ``errors["rate"]``; of the one run without ``rate_check``, or where the first was interrupted.

    Raises
    ------
    UnstableError
        As :func:`dem.simulate`, before there is a curve; after that the curve ends there and its warnings say so.
    NotConverged
        :class:`dem.UnsettledError` for a structure that does not settle under its dead loads.
    InputError
        For a drive without direction or out of the plane, a path without length, settings that are wrong, contrasts of
        stiffness that make the run hopeless (with the predicted time), a checkpoint of another push, and what
        :func:`dem.initial_state` refuses.
    KeyboardInterrupt
        Stopped by the keyboard while own weight comes to rest; after that what was driven is kept.

    Notes
    -----
    Masses are scaled, so that time means nothing and a drop of load is a fall through a sequence of static states only
    as far as the kinetic energy stays small beside the work: ``errors["kinetic"]`` says so at every sample, and the two
    speeds differ where it does not. Large structures are stepped by two threads, see :func:`dem.simulate`.
    """
    usual = PushSettings() if settings is None else instance("settings", settings, PushSettings)
    chosen, path = replace(usual, **options), turning_points(to)
    made: type[DrivenStructure] = ZonedStructure if chosen.blocks == ZONED else BlockStructure
    structure = made(assembly, drive, loads, chosen)
    # digests of all that a file of a driven run must agree with: those of the structure, which are of model, blocks,
    # loads, servo and settling, and those of what acts only while it is driven
    same = dict(structure.same) | digests(
        drive=(structure.unit.tolist(), structure.held.tolist(), chosen.calm or drive.calm), to=path,
        samples=chosen.samples, damping=chosen.damping, detect_every=chosen.detect_every,
    )
    # one file per run, at the first speed and at a third of it
    files = [part_file(checkpoint, name) for name in ("v", f"v{SLOWER}")[: 1 + chosen.rate_check]]
    # before a file of this push is written beside those of another
    for file in files:
        if file is not None and file.exists():
            structure.check(file, same)
    steps = chosen.steps or default_steps(structure.period, structure.least_steps)
    counts = (steps, SLOWER * steps)[: len(files)]
    rest = part_file(checkpoint, "settled")
    # a run that has begun was let through then; of one that has only settled the time of the push is still to be judged
    if not any(file is not None and file.exists() for file in files):
        # 0 is what costs nothing unforeseen: a settled state that was kept, and steps that the user chose
        swings = structure.to_settle if rest is None or not rest.exists() else 0.0
        _refuse_hopeless(structure, swings, 0 if chosen.steps else sum(counts), chosen.longest)
    reached(None, "settling")
    structure.rest(rest)
    curves: list[PushCurve] = []
    for number, (count, file) in enumerate(zip(counts, files, strict=True)):
        before = sum(counts[:number])
        reached(before / sum(counts), f"run {number + 1} of {len(counts)}", share=count / sum(counts))
        follow = Follower(progress, run=number, before=before, count=count, total=sum(counts))
        curve = structure.drive(path, count, same | digests(steps=count), file, follow)
        curves.append(told(curve, label or ", ".join(map(str, drive.displacement))))
        if curve.status == RunStatus.INTERRUPTED:
            break
    return curves[0] if len(curves) == 1 else curves[1].beside(curves[0])


def _refuse_hopeless(structure: DrivenStructure, swings: float, steps: int, longest: float) -> None:
    """Refuse a push of a structure whose predicted time is beyond ``longest`` [s].

    Parameters
    ----------
    swings : slowest motions in which it comes to rest, about; 0 where it has, or where settling has an end of its own
    steps : of all its runs; 0 where the user chose them: only settling is then of unknown length
    longest : time that it may take [s]

    Raises
    ------
    InputError
        With the predicted time, and what is stiff beside what is soft.
    """
    # nothing to predict: the user chose the steps, and settling ends by itself
    if not swings and not steps:
        return
    per_step = structure.step_time()
    predicted = per_step * (swings * structure.period + steps)
    if predicted > longest:
        parts = [f"to settle some {swings:.0f} of them"] * (swings > 0.0) + [f"the push {steps} steps"] * (steps > 0)
        raise InputError(
            f"the push would take about {predicted / 3600.0:.1f} h: the slowest motion takes {structure.period:.3g} "
            f"steps of {1e6 * per_step:.0f} us, {', '.join(parts)}; {structure.contrast()}. Give softer units, stiffer "
            "joints or larger zones, longest=, or steps= and look at the rate error"
        )


__all__ = ["PushSettings", "push"]
