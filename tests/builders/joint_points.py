"""One contact point of a joint, driven along a path by the compiled law of the DEM."""

from typing import NamedTuple

import numpy as np
from walls import on_slab

import limitmason as lm
from dem.kernels.joint_law import return_map
from dem.kernels.joint_strength import peak_of, softening_of
from dem.model.joints import JointOptions, make_laws


class Path(NamedTuple):
    """Stress and state along a path, and losses up to there, shape (k,) each."""

    normal: np.ndarray  # N, compression positive [Pa]
    shear: np.ndarray  # T along t1 [Pa], on b
    lift: np.ndarray  # w_p [m]
    damage: np.ndarray
    rubbed: np.ndarray  # friction less what the lift takes [J/m2]
    broken: np.ndarray  # released by damage [J/m2]


def law_row(joint: lm.Joint, **options) -> np.ndarray:
    """The law of a joint as the kernels read it, shape (1, LAW_SIZE)."""
    block = on_slab([((0, 0, 0), (0.2, 0.2, 0.2))], joint=joint)
    rows, _ = make_laws(block, lm.Loads.horizontal(block).dead, JointOptions(**options))
    return rows[:1]


def along(joint: lm.Joint, opening=None, slip=None, pressure=None, **options) -> Path:
    """Drive a point by its opening w, or under a pressure that stays, and by its slip e along t1.

    Parameters
    ----------
    opening, slip : [m], shape (k,); zero where omitted
    pressure : N [Pa] to which the opening gives way, instead of an opening
    options : of ``JointOptions``
    """
    row = law_row(joint, **options)
    peak, fall = peak_of(row, 0), softening_of(row, 0)
    given = slip if opening is None else opening
    zero = np.zeros(len(given))
    s1 = s2 = lift = damage = rubbed = broken = 0.0
    before = None
    out = []
    for k, e in enumerate(zero if slip is None else slip):
        w = lift - pressure / peak.kn if opening is None else opening[k]
        moved = (0.0, 0.0, 0.0) if before is None else (e - before[0], 0.0, w - before[1])
        before = e, w
        t, _, n, s1, s2, lift, damage, rub, raised, _, released = return_map(
            w, e, 0.0, s1, s2, lift, damage, peak, fall, (0.0, 0.0, 0.0, 0.0, 0.0), True, moved
        )
        rubbed, broken = rubbed + rub - raised, broken + released
        out.append((n, t, lift, damage, rubbed, broken))
    return Path(*np.array(out).T)
