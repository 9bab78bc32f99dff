"""Joints between blocks of zones in space: contact points that slide over the facets of a block.

A contact point stays at its place on block b. Its foot on block a is the point of the bilinear facet nearest to it,
found by Newton's method from where it was; over the rim of a facet it goes on to the one beside it. Opening is the
distance along the facet's normal at the foot, which is parallel to the line between both: its work is that of the
force. Slip is the way of the foot over block a in the reference position, so that strain of the face is no slip.
"""

import numpy as np

from dem.kernels.arrays import Array
from dem.kernels.compiled import kernel
from dem.kernels.law import peak_of, plain_peak_of, return_map, softening_of, stress
from dem.kernels.solid_arrays import FaceContacts, Facets
from dem.kernels.zone_arrays import Z_FRACTURE, Z_FRICTION, Nodes

Numbers = tuple[float, ...]

_FOOT = 1e-9  # change of local coordinates from which a pass of Newton's method would change nothing
_RIM = 1.0 + 1e-6  # a point at an edge belongs to either facet: it changes only where it has left for good


@kernel(forceinline=True)
def corner(i: int, nodes: Nodes) -> Numbers:
    """Place of a node now [m]."""
    return (
        nodes.place[i, 0] + nodes.shift[i, 0], nodes.place[i, 1] + nodes.shift[i, 1],
        nodes.place[i, 2] + nodes.shift[i, 2],
    )  # fmt: skip


@kernel(forceinline=True)
def blend(a: Numbers, b: Numbers, c: Numbers, d: Numbers, w: Numbers) -> Numbers:
    """Weighted sum of four vectors."""
    return (
        w[0] * a[0] + w[1] * b[0] + w[2] * c[0] + w[3] * d[0], w[0] * a[1] + w[1] * b[1] + w[2] * c[1] + w[3] * d[1],
        w[0] * a[2] + w[1] * b[2] + w[2] * c[2] + w[3] * d[2],
    )  # fmt: skip


@kernel(forceinline=True)
def dot(a: Numbers, b: Numbers) -> float:
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel(forceinline=True)
def shares(s: float, t: float) -> Numbers:
    """Bilinear shape functions of a facet's nodes."""
    return (
        0.25 * (1.0 - s) * (1.0 - t), 0.25 * (1.0 + s) * (1.0 - t), 0.25 * (1.0 + s) * (1.0 + t),
        0.25 * (1.0 - s) * (1.0 + t),
    )  # fmt: skip


@kernel(forceinline=True)
def first_slopes(t: float) -> Numbers:
    """Their derivatives along the first local direction."""
    return -0.25 * (1.0 - t), 0.25 * (1.0 - t), 0.25 * (1.0 + t), -0.25 * (1.0 + t)


@kernel(forceinline=True)
def second_slopes(s: float) -> Numbers:
    """Their derivatives along the second local direction."""
    return -0.25 * (1.0 - s), -0.25 * (1.0 + s), 0.25 * (1.0 + s), 0.25 * (1.0 - s)


@kernel(inline="always")
def foot(k: int, nodes: Nodes, facets: Facets, contacts: FaceContacts) -> tuple:
    """Foot of contact point k on block a.

    Returns
    -------
    facet, s, t : where the foot lies
    t1, t2, n : tangents and outward normal of block a there
    opening, slip_1, slip_2 : [m]
    """
    x = blend(
        corner(contacts.node[k, 0], nodes), corner(contacts.node[k, 1], nodes), corner(contacts.node[k, 2], nodes),
        corner(contacts.node[k, 3], nodes),
        (contacts.share[k, 0], contacts.share[k, 1], contacts.share[k, 2], contacts.share[k, 3]),
    )  # fmt: skip
    at, s, t = contacts.facet[k], contacts.local[k, 0], contacts.local[k, 1]
    tried = 0
    while True:
        i0, i1, i2, i3 = facets.node[at, 0], facets.node[at, 1], facets.node[at, 2], facets.node[at, 3]
        a, b, c, d = corner(i0, nodes), corner(i1, nodes), corner(i2, nodes), corner(i3, nodes)
        for _ in range(12):
            y = blend(a, b, c, d, shares(s, t))
            g, h = blend(a, b, c, d, first_slopes(t)), blend(a, b, c, d, second_slopes(s))
            r = (x[0] - y[0], x[1] - y[1], x[2] - y[2])
            gg, gh, hh, rg, rh = dot(g, g), dot(g, h), dot(h, h), dot(r, g), dot(r, h)
            inv = 1.0 / (gg * hh - gh * gh)
            ds, dt = (hh * rg - gh * rh) * inv, (gg * rh - gh * rg) * inv
            s += ds
            t += dt
            if abs(ds) + abs(dt) < _FOOT:
                break
        tried += 1
        edge = -1
        if t < -_RIM:
            edge = 0
        if s > _RIM:
            edge = 1
        if t > _RIM:
            edge = 2
        if s < -_RIM:
            edge = 3
        if edge < 0 or tried > 32 or facets.beside[at, edge] < 0:
            break
        at, s, t = facets.beside[at, edge], 0.0, 0.0
    w = shares(s, t)
    y = blend(a, b, c, d, w)
    g, h = blend(a, b, c, d, first_slopes(t)), blend(a, b, c, d, second_slopes(s))
    n = (g[1] * h[2] - g[2] * h[1], g[2] * h[0] - g[0] * h[2], g[0] * h[1] - g[1] * h[0])
    inv = 1.0 / np.sqrt(dot(n, n))
    n = (n[0] * inv, n[1] * inv, n[2] * inv)
    opening = (x[0] - y[0]) * n[0] + (x[1] - y[1]) * n[1] + (x[2] - y[2]) * n[2] + contacts.gap[k]
    # the same on the reference face, in which the tangents of the joint are given
    p, o, e = nodes.place, contacts.origin, contacts.tangent
    row = contacts.joint[k]
    e1, e2 = (e[row, 0, 0], e[row, 0, 1], e[row, 0, 2]), (e[row, 1, 0], e[row, 1, 1], e[row, 1, 2])
    a = (p[i0, 0] - o[k, 0], p[i0, 1] - o[k, 1], p[i0, 2] - o[k, 2])
    b = (p[i1, 0] - o[k, 0], p[i1, 1] - o[k, 1], p[i1, 2] - o[k, 2])
    c = (p[i2, 0] - o[k, 0], p[i2, 1] - o[k, 1], p[i2, 2] - o[k, 2])
    d = (p[i3, 0] - o[k, 0], p[i3, 1] - o[k, 1], p[i3, 2] - o[k, 2])
    way = blend(a, b, c, d, w)
    u, v = blend(a, b, c, d, first_slopes(t)), blend(a, b, c, d, second_slopes(s))
    along, beside = dot(v, e2), -dot(u, e2)  # of t1 in both local directions, times their area
    sign = 1.0 if dot(u, e1) * along + dot(v, e1) * beside > 0.0 else -1.0
    t1 = (along * g[0] + beside * h[0], along * g[1] + beside * h[1], along * g[2] + beside * h[2])
    inv = sign / np.sqrt(dot(t1, t1))
    t1 = (t1[0] * inv, t1[1] * inv, t1[2] * inv)
    t2 = (n[1] * t1[2] - n[2] * t1[1], n[2] * t1[0] - n[0] * t1[2], n[0] * t1[1] - n[1] * t1[0])
    return at, s, t, t1, t2, n, opening, dot(way, e1), dot(way, e2)


@kernel(forceinline=True)
def solid_joint_forces(
    nodes: Nodes, facets: Facets, contacts: FaceContacts, law: Array, soft: bool, total: Array
) -> None:
    """Add the forces of all contact points to ``nodes.force``; slip, dilation and damage follow."""
    force = nodes.force
    rubbed_all = broken_all = 0.0
    for k in range(contacts.joint.size):
        at, s, t, t1, t2, n, opening, e1, e2 = foot(k, nodes, facets, contacts)
        contacts.facet[k], contacts.local[k, 0], contacts.local[k, 1] = at, s, t
        row = contacts.joint[k]
        s1, s2, lift = contacts.slip[k, 0], contacts.slip[k, 1], contacts.lift[k]
        if soft:
            q1, q2, q3, s1, s2, lift, contacts.damage[k], rubbed, raised, _, broken = return_map(
                opening, e1, e2, s1, s2, lift, contacts.damage[k], peak_of(law, row), softening_of(law, row), None, True
            )
        else:
            q1, q2, q3, s1, s2, lift, _, rubbed, raised, _, broken = return_map(
                opening, e1, e2, s1, s2, lift, 0.0, plain_peak_of(law, row), None, None, True
            )
        contacts.slip[k, 0], contacts.slip[k, 1], contacts.lift[k] = s1, s2, lift
        area = contacts.area[k]
        rubbed_all += area * (rubbed - raised)
        broken_all += area * broken
        fx = area * (q1 * t1[0] + q2 * t2[0] + q3 * n[0])
        fy = area * (q1 * t1[1] + q2 * t2[1] + q3 * n[1])
        fz = area * (q1 * t1[2] + q2 * t2[2] + q3 * n[2])
        w = shares(s, t)
        for m in range(4):
            i, j, share = contacts.node[k, m], facets.node[at, m], contacts.share[k, m]
            force[i, 0] += share * fx
            force[i, 1] += share * fy
            force[i, 2] += share * fz
            force[j, 0] -= w[m] * fx
            force[j, 1] -= w[m] * fy
            force[j, 2] -= w[m] * fz
    total[Z_FRICTION] += rubbed_all
    total[Z_FRACTURE] += broken_all


@kernel(forceinline=True)
def solid_joint_stresses(nodes: Nodes, facets: Facets, contacts: FaceContacts, law: Array, joint: Array) -> float:
    """Openings, slips and stresses of all contact points in the present position; changes no state.

    Parameters
    ----------
    joint : opening less dilation, slip along t1 and t2 [m], normal stress (compression positive) and shear stresses on
        b [Pa], written, shape (m, 6)

    Returns
    -------
    elastic energy [J]
    """
    energy = 0.0
    for k in range(contacts.joint.size):
        _, _, _, _, _, _, opening, e1, e2 = foot(k, nodes, facets, contacts)
        row = contacts.joint[k]
        q1, q2, q3, elastic = stress(
            opening, e1, e2, contacts.slip[k, 0], contacts.slip[k, 1], contacts.lift[k], contacts.damage[k],
            peak_of(law, row), softening_of(law, row),
        )  # fmt: skip
        joint[k, 0], joint[k, 1], joint[k, 2] = opening - contacts.lift[k], e1, e2
        joint[k, 3], joint[k, 4], joint[k, 5] = q3, q1, q2
        energy += contacts.area[k] * elastic
    return energy
