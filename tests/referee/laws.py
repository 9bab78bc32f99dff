"""What no answer may depend on: how a structure lies in space, how it is numbered and written down, and in which units.

Every law is a frame; :func:`broken` asks an engine for the answer there and takes it back.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from .model import Frame, Model, Quantity

SLOW = "too long"

Array = np.ndarray
Answer = dict[str, Quantity | str]


def _quarter(random) -> Array:
    """A turn that takes axes to axes."""
    while True:
        m = np.eye(3)[random.permutation(3)] * random.choice([-1.0, 1.0], 3)[:, None]
        if np.linalg.det(m) > 0:
            return m


def _turned(random, model: Model, axes: bool) -> Frame:
    matrix = _quarter(random) if axes else Rotation.from_quat(random.normal(size=4)).as_matrix()
    return Frame(matrix=matrix, shift=random.normal(size=3) * model.length)


def _mirrored(random, model: Model, axes: bool) -> Frame:
    return Frame(matrix=np.diag(random.permutation([-1.0, 1.0, 1.0])))


def _renumbered(random, model: Model, axes: bool) -> Frame:
    return Frame(order=random.permutation(len(model.solids)))


def _units(random, model: Model, axes: bool) -> Frame:
    length, mass, time = 1e3 ** random.choice([-1, 0, 1], 3)
    return Frame(length=float(length), mass=float(mass), time=float(time))


LAWS: dict[str, Callable[[Any, Model, bool], Frame]] = {
    "turned": _turned,
    "mirrored": _mirrored,
    "renumbered": _renumbered,
    "in mm, N": lambda random, model, axes: Frame(length=1e3, mass=1e3),
    "in other units": _units,
    "live load doubled": lambda random, model, axes: Frame(live=2.0),
    "live load reversed": lambda random, model, axes: Frame(live=-1.0),
    "stiffness halved": lambda random, model, axes: Frame(stiff=0.5),
}


def different(found: Answer, wanted: Answer, frame: Frame, tolerance: float) -> list[str]:
    """What differs by more than the tolerance between an answer, taken back from its frame, and the one wanted."""
    out = []
    for name in sorted(k for k in found.keys() | wanted.keys() if not k.startswith("_")):
        a, b = found.get(name), wanted.get(name)
        if not (isinstance(a, Quantity) and isinstance(b, Quantity)):
            if a != b:
                out.append(f"{name}: {a!r} for {b!r}")
            continue
        x, y = frame.back(a), np.asarray(b.value, dtype=float)
        if x.shape != y.shape:
            out.append(f"{name}: shape {x.shape} for {y.shape}")
            continue
        size = b.size if b.size is not None else np.abs(y[np.isfinite(y)]).max(initial=0.0)
        with np.errstate(invalid="ignore"):
            off = np.where((x == y) | (np.isnan(x) & np.isnan(y)), 0.0, np.abs(x - y))
        off = np.where(np.isnan(off), np.inf, off)
        worst = float(off.max(initial=0.0))
        if worst > tolerance * b.slack * size + 1e-300:
            k = np.unravel_index(int(np.argmax(off)), off.shape) if off.shape else ()
            out.append(f"{name}: {x[k]:.9g} for {y[k]:.9g} ({worst / size if size else np.inf:.1e})")
    return out


def broken(engine, model: Model, name: str, wanted: Answer, random) -> list[str]:
    """Differences of the answer in one law's frame from the one wanted; a refusal there that was none is one."""
    frame = LAWS[name](random, model, engine.axes)
    found = engine.ask(model.seen(frame))
    return [] if SLOW in found else different(found, wanted, frame, engine.tolerance)
