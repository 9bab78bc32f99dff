"""Adapter of ``lm.pushover``, judged by the static theorem, energy, finer steps and the way back."""

import re
import time
from dataclasses import replace

import numpy as np

from .assemblies import Law
from .engine import number
from .laws import Answer, different
from .model import Frame, Model, Quantity
from .static_engines import exact
from .statics import Statics

MOVES = 0.02
"""By how much a refinement may move an answer before it is a defect [-]."""

SAME = 1e-3
"""Of the largest load, to which a branch that loses nothing is passed again."""

ENERGY = 0.01
"""Energy that a path may leave over, of its work: what its default steps promise [-]."""

SHARES = (0.5, 0.9)
"""Of the limit load: where branches are compared, by the displacement at which it is first reached."""

NEARLY = (1 - 2 * MOVES, 1 - MOVES, 1.0)
"""Of the first limit load: the displacement of a flat top hangs on its last digits, those at which it is nearly there
do not."""


def limited(model: Model) -> bool:
    """Whether the structure stands and its load has a limit of the order of its weight, by own statics."""
    moving = np.abs(model.live[model.free, :3]).sum() / model.weight
    return 0.02 < Statics(model).limit() * moving < 3.0


def curve(model: Model, blocks: str = "rigid", **options):
    """The path as a user asks for it."""
    import limitmason as lm

    return lm.pushover(*model.build(), blocks=blocks, **options)


def finer(times: float):
    """Default steps of all kinds, so many times finer."""
    from limitmason.capacity import Steps

    d, kinds = Steps(), ("first", "largest", "smooth", "peak", "energy", "opening", "sliding", "straight")
    return Steps(**{k: getattr(d, k) / times for k in kinds}, most=int(np.ceil(times * d.most)))


def path(model: Model, blocks: str = "rigid", fine: float = 1.0, to: float | None = None) -> Answer:
    """Status, limit point and the branch up to it; with steps of all kinds so many times finer."""
    import limitmason as lm

    got = lm.pushover(*model.build(), blocks=blocks, steps=None if fine == 1.0 else finer(fine), to=to)
    if got.energy is None:
        return {"status": str(got.status)}
    out: Answer = {}  # how a path ends past its peak hangs on rounding
    top = got.peak
    if got.first_limit_point is not None or got.status == "open joints still bear bond":
        out["limit load"] = number(top.load, live=-1)
        if not got.breaks and top.load > 0 and abs(got.load[0]) < 1e-9 * top.load:
            at = [float(got._crossing(share * top.load, top.index)) for share in SHARES]
            out["displacement"] = Quantity(np.array(at), length=1, size=max(at), slack=20.0)
    if got.first_limit_point is not None:
        out["first limit load"] = number(got.first_limit_point.load, live=-1)
        out[_FIRST] = first_reached(got)
    out[_ENERGY] = float(np.abs(got.energy.error).max())
    moved = np.max([np.abs(got.displacement_of(k)).max(axis=1) for k in model.free], axis=0)
    out[_NEAR] = float(got.load[moved <= NEAR * model.length].max(initial=0.0))
    out[_END] = np.array([got.displacement[-1], got.load[-1], np.abs(got.load).max()])
    out[_TOLD] = " ".join(w for w in got.warnings if re.search(TOLD, w))
    return out


_ENERGY, _NEAR, _FIRST, _END, _TOLD = "_energy", "_near", "_first", "_end", "_told"
_NONE = np.full(len(NEARLY), np.nan)

RATIOS = (4.0, 1.7, 3.0, 1.3, 2.0)
"""By how much steps are made finer: what one of them finds hangs on where its samples happen to lie."""

PATIENCE = 60.0
"""Processor seconds for finer steps of one structure."""

TOLD = "was not reached|found anew the load fell|the path leaps"
"""What a path says of itself whose answer may hang on its steps."""

NEAR = 2e-3
"""Of the structure's length: motion of its blocks up to which own statics of the unmoved structure hold."""


def first_reached(got) -> np.ndarray:
    """Displacements at which a curve first comes to the shares ``NEARLY`` of its first limit load [m]; nan if none."""
    top = got.first_limit_point
    if top is None or top.load <= 0 or got.load[0] > NEARLY[0] * top.load:
        return np.full(len(NEARLY), np.nan)
    return np.array([got._crossing(share * top.load, top.index) for share in NEARLY])


def apart(usual: np.ndarray, fine: np.ndarray) -> float:
    """By how much a first limit point is nearly reached before or beyond that of a finer curve [-].

    At 98 % of its load, it lies between those at 96 and 100 % of the finer one's where both have the same.
    """
    at = usual[1]
    return float(max(fine[0] / at - 1.0, at / fine[2] - 1.0, 0.0)) if np.isfinite([*usual, *fine]).all() else 0.0


def _convex(model: Model) -> Model:
    """The model with the smallest convex law that holds a path's own, which takes ft beyond the apex without shear."""

    def law(w: Law) -> Law:
        return replace(w, cohesion=max(w.cohesion, w.mu * w.tension))

    return replace(model, law=law(model.law), laws={pair: law(w) for pair, w in model.laws.items()})


def judge_path(model: Model, answer: Answer, blocks: str = "rigid") -> list[str]:
    """Upper bound of the static theorem, energy, and finer steps; a path that says that it hangs on them may."""
    out = []
    if "limit load" in answer and exact(model):
        bound = Statics(_convex(model)).limit()
        near = answer[_NEAR]
        if near > bound * (1 + MOVES) + 1e-6:
            out.append(f"load {near!r} above the static theorem's {bound!r}")
    if answer.get(_ENERGY, 0.0) > ENERGY:
        out.append(f"energy left over {answer[_ENERGY]:.2g}")
    out += back(model, blocks)
    if "limit load" in answer and not answer[_TOLD]:
        out += moved_by_steps(model, answer, blocks)
    return out


def moved_by_steps(model: Model, answer: Answer, blocks: str = "rigid") -> list[str]:
    """What finer steps change; those that processor time is left for."""
    out, loads, end = [], ("limit load", "first limit load"), answer[_END]
    until = time.process_time() + PATIENCE
    for fine in RATIOS:
        if time.process_time() > until:
            break
        found = path(model, blocks, fine)
        change = different(*({k: a[k] for k in loads if k in a} for a in (found, answer)), Frame(), MOVES)
        if not change and (off := apart(answer.get(_FIRST, _NONE), found.get(_FIRST, _NONE))) > MOVES:
            change = [f"first limit load nearly reached at another displacement ({off:.1e})"]
        out += [f"steps {fine:g} times finer: {c}" for c in change]
    if not out and time.process_time() < until:
        # how far a path goes on behind its limit point hangs on its steps: both go to where the default ends
        usual, found = (path(model, blocks, fine, to=float(end[0]))[_END] for fine in (1.0, RATIOS[0]))
        if usual[0] == found[0] and (off := abs(found[1] - usual[1]) / usual[2]) > MOVES:
            out.append(f"load at the end: {usual[1]:.6g} for {found[1]:.6g} ({off:.1e} of the largest)")
    return out


def _least(gone) -> float:
    """Least that slip loses in a step, by the forces at its end and over its work."""
    return min(c.dissipation for c in gone.certificates if not c.jump)


def back(model: Model, blocks: str = "rigid") -> list[str]:
    """Slip and cracks win no energy; a branch on which nothing was lost is passed again on the way back.

    A point slides before it opens, unless it bears no shear. A step in which it does both ends with no shear: by
    trapezoids it seems to lose or to win energy. Of either sign the branch is over, for it does not close as it opened.
    """
    gone = curve(model, blocks)
    if gone.energy is None:
        return []
    work = float(np.abs(np.diff(gone.energy.live)).sum()) + 1e-300
    lost = gone.energy.lost + gone.energy.broken
    if refused := [k for k, c in enumerate(gone.certificates) if not c.accepted]:
        return [f"the certificate refuses samples {refused}: least dissipation {_least(gone):.2g} of the work"]
    if gone.breaks or len(gone) < 4 or any(gone.jumps):
        return []
    end = int(np.flatnonzero(np.abs(lost) > 1e-7 * work).min(initial=len(gone))) - 1
    if end < 3 or not (np.diff(gone.displacement[: end + 1]) > 0).all():
        return []
    first = curve(model, blocks, to=float(gone.displacement[end]))
    if abs(first.displacement[-1] - gone.displacement[end]) > 1e-9 * gone.displacement[end]:
        return []
    if np.abs(first.energy.lost + first.energy.broken).max() > 1e-9 * np.abs(np.diff(first.energy.live)).sum():
        return []  # its last step is another than that of the longer path, and a point may slip in it
    out = []
    for share in (0.6, 0.2):
        k = int(np.argmin(np.abs(first.displacement - share * first.displacement[-1])))
        again = curve(model, blocks, start=first, to=float(first.displacement[k])) if 0 < k < len(first) - 1 else first
        if again is first:
            continue
        if abs(again.displacement[-1] - first.displacement[k]) > 1e-6 * first.displacement[-1]:
            out.append(f"back: ends at {again.displacement[-1]:.4g} of {first.displacement[k]:.4g} m ({again.status})")
        elif (off := abs(again.load[-1] - first.load[k]) / np.abs(first.load).max()) > SAME:
            out.append(f"back: off by {off:.2g} of the largest load on a branch that loses nothing")
    return out
