"""Axles on the fill over an arch: vertical loads that spread with depth to the extrados."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import finite
from limitmason.errors import InputError
from limitmason.model.applied_forces import AppliedForces
from limitmason.model.face_touch import outer_faces_touched

if TYPE_CHECKING:
    from limitmason.model.assembly import Assembly

# chosen, far above the rounding of coordinates, far below what anybody builds
_UP = 1e-6  # least upward part of the normal of a loaded face: on vertical ones no fill lies
_ACROSS = 1e-6  # largest part along y of the normal of a face that does not slope along y
_BARE = 1e-3  # least part of a face that is bare, and by which a block is over it: joints may be drawn with a gap
_LEVEL_SLACK = 1e-9  # of the extrados' length: a level given as the crown's height may be lower by rounding
_WIDEST_SPREAD = 80.0  # [deg], chosen: towards 90 the length grows without end


class Strip(NamedTuple):
    """A bare face that looks up, as a strip along x.

    Parameters
    ----------
    block : its number
    start, end : its span in x [m]
    z, slope : its height at x is z + slope (x - start) [m], [-]
    width, y : its width and its middle in y [m]
    """

    block: int
    start: float
    end: float
    z: float
    slope: float
    width: float
    y: float


def extrados(assembly: Assembly) -> list[Strip]:
    """Bare faces of free blocks that look up, by their starts in x from left to right.

    A face is bare where no joint lies on it. Of one that joints cover in part, as the top of a pier beside its
    springing, what no block stands over is bare.

    Parameters
    ----------
    assembly : an arch or several side by side, spanning in the x-z plane

    Raises
    ------
    InputError
        For a face that slopes along y, by the name of its block.
    """
    strips = []
    faces, touched = outer_faces_touched(assembly)
    bounds = np.array([b.bounds for b in assembly.blocks])
    for f in np.flatnonzero((faces.normal[:, 2] > _UP) & ~assembly.fixed[faces.part]).tolist():
        corners, n, k = faces.corners[f], faces.normal[f], int(faces.part[f])
        # a strip has one height at every x
        if abs(n[1]) > _ACROSS:
            if touched[f]:
                continue
            name = assembly.blocks[k].name
            raise InputError(f"block {name!r} has a face that slopes along y: axles cross arches in x-z")
        low, high = corners.min(axis=0), corners.max(axis=0)
        slope = -n[0] / n[2]
        for start, end in _not_under(bounds, low, high) if touched[f] else [(low[0], high[0])]:
            height = float(corners[0, 2] + slope * (start - corners[0, 0]))
            strips.append(Strip(
                block=k, start=float(start), end=float(end), z=height, slope=float(slope),
                width=float(high[1] - low[1]), y=float(low[1] + high[1]) / 2,
            ))
    return sorted(strips, key=lambda s: s.start)


def _not_under(bounds: Array, low: Array, high: Array) -> list[tuple[float, float]]:
    """Spans in x of a face over which no other block stands [m].

    Parameters
    ----------
    bounds : lowest and highest x, y, z of every block [m], shape (n, 2, 3)
    low, high : lowest and highest x, y, z of the face [m], shape (3,)
    """
    start, end = float(low[0]), float(high[0])
    least, middle = _BARE * (end - start), 0.5 * (low[2] + high[2])
    bottom, top = bounds[:, 0], bounds[:, 1]
    beside = np.minimum(top[:, 1], high[1]) - np.maximum(bottom[:, 1], low[1])
    # over the middle of an inclined face: the next stone of an arch may end no higher than the joint below it
    over = (top[:, 2] - middle > least) & (beside > _BARE * (high[1] - low[1]))
    over &= (top[:, 0] > start) & (bottom[:, 0] < end)  # what stands elsewhere covers nothing
    spans, at = [], start
    for left, right in [*sorted(zip(bottom[over, 0].tolist(), top[over, 0].tolist(), strict=True)), (end, end)]:
        if min(left, end) - at > least:
            spans.append((at, min(left, end)))
        at = max(at, right)
    return spans


def axle_forces(
    assembly: Assembly, at: float, force: float, *, level: float, spread_deg: float = 30.0, contact: float = 0.3,
    strips: list[Strip] | None = None,
) -> AppliedForces:
    r"""Forces of an axle that presses on the fill, on the extrados.

    Even over the length to which it has spread at the extrados below it, and over the width of the arch:

    .. math:: |x - x_a| \le b / 2 + (z_f - z(x_a)) \tan(\beta)

    Parameters
    ----------
    assembly : the arch, spanning in the x-z plane
    at : x_a of the axle [m]
    force : its load downwards over the whole width [N]
    level : z_f, top of the fill [m]
    spread_deg : beta, from the vertical, at least 0 and below 80 [deg]
    contact : b, length of the wheels on the fill [m], > 0
    strips : from :func:`extrados`, where it is asked for many positions

    Returns
    -------
    AppliedForces
        Vertical forces, each at the middle of the loaded length of a face.

    Raises
    ------
    InputError
        For fill below the extrados, an angle that is none, and no face that looks up.

    Notes
    -----
    While the whole length lies on the extrados, the resultant is the force and acts below the axle. Where the length
    runs off an end, that part of the load goes to the ground. The resultant is then smaller and acts at the middle of
    the part that is left. Fill passes the load on and does nothing else; its lateral pressure, which resists, is left
    out.
    """
    strips = extrados(assembly) if strips is None else strips
    if not strips:
        raise InputError("no free block has a bare face that looks up: there is nothing to drive over")
    top = max(max(s.z, s.z + s.slope * (s.end - s.start)) for s in strips)
    if not level >= top - _LEVEL_SLACK * (max(s.end for s in strips) - strips[0].start):
        raise InputError(f"level of the fill {level:g} m is below the extrados at {top:g} m")
    spread_deg, contact = finite("spread_deg", spread_deg), finite("contact", contact)
    if not (0.0 <= spread_deg < _WIDEST_SPREAD and contact > 0.0):
        raise InputError(
            f"spread_deg must be at least 0 and below {_WIDEST_SPREAD:g}, contact positive: {spread_deg!r}, {contact!r}"
        )
    # an axle beside the arch is as deep in the fill as at the nearer end
    below = min(strips, key=lambda s: max(s.start - at, at - s.end, 0.0))
    z = below.z + below.slope * (min(max(at, below.start), below.end) - below.start)
    half = 0.5 * contact + (level - z) * math.tan(math.radians(spread_deg))
    # arches side by side share the load by their widths, each by how much of the strip below it lies beside
    beside = [min(s.end, below.end) - max(s.start, below.start) for s in strips]  # [m], below 0 for none of it
    span = below.end - below.start
    wide = sum(s.width * (length / span) for s, length in zip(strips, beside, strict=True) if length > 0.0)
    # of the whole spread, on the extrados or not
    area = 2.0 * half * wide
    forces = AppliedForces.none(assembly)
    for s in strips:
        a, b = max(s.start, at - half), min(s.end, at + half)
        if b <= a:
            continue
        down = np.array([0.0, 0.0, -force * (b - a) * s.width / area])
        x = 0.5 * (a + b)
        forces.add(s.block, np.array([x, s.y, s.z + s.slope * (x - s.start)]), down)
    return forces
