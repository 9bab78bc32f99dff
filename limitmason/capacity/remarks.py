"""What a finished path has to say of itself: what broke, points that slid back, and points that blocks have left."""

import numpy as np

from limitmason.capacity.certificate import Balance
from limitmason.capacity.generations import Generations
from limitmason.capacity.point_law import History, slid_back
from limitmason.capacity.result import Break
from limitmason.capacity.stepping import Node
from limitmason.capacity.touching import outside

WANDERED = 0.1
"""Slip over the size of a joint from which a point that is not found anew is no longer where it was [-]."""


def breaks_of(generations: Generations, nodes: list[Node], balances: list[Balance]) -> tuple[Break, ...]:
    """What broke at once, and where."""
    found = []
    for k, node in enumerate(nodes):
        if node.broken is None or k == 0:
            continue
        p = generations.structures[node.generation].points
        rows, blocks = node.broken, generations.structures[0].assembly.blocks
        pairs = zip(p.block_a[rows].tolist(), p.block_b[rows].tolist(), strict=True)
        joints = dict.fromkeys(f"{blocks[min(a, b)].name} - {blocks[max(a, b)].name}" for a, b in pairs)
        found.append(Break(k, tuple(joints), len(rows), balances[k].jumped))
    return tuple(found)


def returned(generations: Generations, nodes: list[Node]) -> str:
    """What to say of points that slide back or round a bend after they have dilated."""
    for k, node in enumerate(nodes):
        s = generations.structures[node.generation]
        p = s.points
        # points found anew have a lift from elsewhere
        aside = np.einsum("mci,mi->mc", p.directions[:, 1:], p.place_b - p.place_a)
        own = np.abs(aside).max(axis=1) < 1e-9 * s.size
        back = np.flatnonzero(own & slid_back(p.law.tan_psi, History(node.history.slip, node.history.lift)))
        if len(back):
            a, b = (s.assembly.blocks[i].name for i in (p.block_a[back[0]], p.block_b[back[0]]))
            return (
                f"from sample {k} on {a!r} and {b!r} slide back, or round a bend: the curve keeps the lift of "
                "dilation, which the DEM gives back; quote it up to there, or set dilatancy_angle_deg to 0"
            )
    return ""


def stayed(generations: Generations, nodes: list[Node]) -> str:
    """What to say of points that have slid far and are not found anew: blocks no longer meet there."""
    for k, node in enumerate(nodes):
        s = generations.structures[node.generation]
        p = s.points
        joined = p.interface >= 0
        size = np.full(p.count, s.size)
        size[joined] = np.sqrt(s.assembly.arrays.area[p.interface[joined]])
        far = np.where(p.corner < 0, np.linalg.norm(node.history.slip, axis=1), 0.0)
        if generations.shapes is not None:
            far = np.maximum(far, outside(generations.shapes, s.assembly, p, node.pose))
        worst = int((far / size).argmax())
        if far[worst] > WANDERED * size[worst]:
            a, b = (s.assembly.blocks[i].name for i in (p.block_a[worst], p.block_b[worst]))
            return (
                f"from sample {k} on {a!r} and {b!r} have slid by more than {WANDERED:g} of their joint at a point "
                "that is not found anew (edges that cross, points inside a face): the curve beyond is that of the "
                "first points"
            )
    return ""
