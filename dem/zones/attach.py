"""Contact points of plane joints, attached to the sides of the blocks on either side."""

import numpy as np

from dem.kernels.arrays import Index
from dem.kernels.zone_arrays import SideContacts, Sides
from dem.model.joints import Grid, make_points
from dem.zones.mesh import ZoneMesh
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.model import Assembly

ONE_PLACE = 1e-9
"""Places that are equal once rounded to whole parts of this length are one [m]."""

WHOLE = 1e-9
"""Part by which a length may exceed a whole number of spacings, or a distance another one, by rounding [-]."""

ACROSS = 1e-6
"""Component along y of a joint's unit normal up to which it is rounding."""

AWAY = 0.9
"""Cosine between the outward normal of a side and the one looked for below which it is another side: 25 degrees."""


def make_sides(mesh: ZoneMesh) -> Sides:
    """Sides as the kernel takes them, with distances along them."""
    arc = np.zeros(len(mesh.sides))
    for a, b in zip(mesh.side_start[:-1], mesh.side_start[1:], strict=True):
        steps = np.diff(mesh.place[mesh.sides[a:b]], axis=0)
        arc[a + 1 : b] = np.cumsum(np.linalg.norm(steps, axis=1))
    return Sides(mesh.sides, mesh.side_start, arc)


def make_contacts(assembly: Assembly, mesh: ZoneMesh, sides: Sides, grid: Grid | None) -> tuple[SideContacts, Index]:
    """Contact points of all joints that touch a block not held, in the plane.

    Parameters
    ----------
    mesh, sides : nodes of the blocks, and the chains of them along every side
    grid : as in the rigid DEM, at its places and with its areas; None puts points no further apart than the zones'
        edges. Each then has half of the joint to its neighbour on either side: what zones under even stress ask for

    Returns
    -------
    contacts : the points
    interface : number of the interface of every row of the law

    Raises
    ------
    InputError
        For a joint that does not run along y.
    """
    x = assembly.arrays
    found = None if grid is None else make_points(assembly, grid, "grid")
    interfaces = np.flatnonzero(~(assembly.fixed[x.block_a] & assembly.fixed[x.block_b]))
    position, area = [], []  # of the points of every interface: x and z [m], shape (points, 2), and [m2]
    for k in interfaces.tolist():
        _check_plane(assembly, k)
        if found is None:
            # the joint is a line in the plane: its direction, and where along that its corners lie
            corners = x.corners[x.corner_start[k] : x.corner_start[k + 1]][:, [0, 2]]
            direction = np.array([-x.normal[k, 2], x.normal[k, 0]])
            ends = (corners - corners.mean(axis=0)) @ direction
            length = float(np.ptp(ends))
            # where all blocks are rigid there are no zones: two points
            n = max(int(np.ceil(length / (mesh.size or length) - WHOLE)), 1) + 1
            first = corners.mean(axis=0) + ends.min() * direction
            position.append(first + np.linspace(0.0, length, n)[:, None] * direction)
            share = np.full(n, 1.0 / (n - 1))
            share[[0, -1]] *= 0.5
            area.append(share * x.area[k])
        else:
            rows = np.flatnonzero(found.interface == k)
            flat = found.position[rows][:, [0, 2]]
            # both points across the thickness lie at one place in the plane
            _, at, number = np.unique(np.round(flat / ONE_PLACE).astype(np.int64), axis=0, return_index=True,
                                      return_inverse=True)
            position.append(flat[at])
            area.append(np.bincount(number.ravel(), found.area[rows]))
    row = np.repeat(np.arange(len(interfaces)), [len(part) for part in area])
    m = len(row)
    # fields of SideContacts
    side, segment, arc = np.zeros(m, np.int64), np.zeros(m, np.int64), np.zeros(m)
    node, share, gap = np.zeros((m, 2), np.int64), np.zeros(m), np.zeros(m)
    for k, place in enumerate(np.concatenate(position)):
        i = assembly.interfaces[interfaces[row[k]]]
        normal = np.asarray(i.normal)[[0, 2]]
        side[k], segment[k], _ = _nearest(mesh, sides, i.block_a, normal, place)
        # a point is a place between two nodes of b
        _, at_b, share[k] = _nearest(mesh, sides, i.block_b, -normal, place)
        node[k] = sides.node[at_b : at_b + 2]
        on_b = (1.0 - share[k]) * mesh.place[node[k, 0]] + share[k] * mesh.place[node[k, 1]]
        # and lies on the segment of a from node ``begin`` to node ``end``, whose normal is (t_z, -t_x)
        begin, end = mesh.place[sides.node[segment[k] : segment[k] + 2]]
        t = (end - begin) / np.linalg.norm(end - begin)
        arc[k] = sides.arc[segment[k]] + (on_b - begin) @ t
        # faces that touch within the tolerance count as touching: their distance is taken from the opening
        gap[k] = -((on_b - begin) @ np.array([t[1], -t[0]]))
    contacts = SideContacts(
        joint=row.astype(np.int64), side=side, segment=segment, arc=arc, node=node, share=share,
        area=np.concatenate(area), gap=gap, slip=np.zeros(m), lift=np.zeros(m), damage=np.zeros(m),
        opening=np.zeros(m), along=np.zeros(m),
    )
    return contacts, interfaces.astype(np.int64)


def _check_plane(assembly: Assembly, k: int) -> None:
    """Refuse interface number k where it faces y: zoned blocks are for walls in x-z."""
    i = assembly.interfaces[k]
    if abs(i.normal[1]) > ACROSS:
        raise InputError(
            f"{assembly.joint_text(i.block_a, i.block_b)} faces y: zoned blocks are for walls in x-z of one leaf; in "
            "space take simply deformable blocks, which strain and bend"
        )


def _nearest(mesh: ZoneMesh, sides: Sides, block: int, normal: Array, point: Array) -> tuple[int, int, float]:
    """Where a block's sides that look along a normal pass a point nearest.

    Parameters
    ----------
    mesh, sides : nodes of the blocks, and the chains of them along every side
    block : number of the block
    normal : outward unit normal x, z, shape (2,)
    point : x, z [m], shape (2,)

    Returns
    -------
    side : its number
    at : entry in the row of all chains of the first of the two nodes beside the point
    share : of the way from there to the second node [-]
    """
    best, found = np.inf, (0, 0, 0.0)
    for side in np.flatnonzero(mesh.side_block == block):
        first, last = sides.start[side], sides.start[side + 1] - 1
        chain = mesh.place[sides.node[first : last + 1]]
        run = chain[-1] - chain[0]
        out = np.array([run[1], -run[0]]) / np.linalg.norm(run)
        if out @ normal < AWAY:
            continue
        e = np.diff(chain, axis=0)
        share = ((point - chain[:-1]) * e).sum(axis=1) / (e * e).sum(axis=1)
        off = np.linalg.norm(chain[:-1] + np.clip(share, 0.0, 1.0)[:, None] * e - point, axis=1)
        # of two segments that meet at the point the first, so that nothing hangs on rounding
        at = int(np.flatnonzero(off <= off.min() + WHOLE * np.linalg.norm(run))[0])
        if off[at] < best - WHOLE * np.linalg.norm(run):
            best, found = float(off[at]), (int(side), int(first + at), float(np.clip(share[at], 0.0, 1.0)))
    return found
