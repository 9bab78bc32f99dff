"""What joints cut anew take over: shear, dilation, damage and elastic energy.

``stiff`` is half the stiffness k A of every point [N/m], ``deep`` its depth, negative where it is open [m], and
``along`` the size of its elastic slip [m], shape (m,) each.
"""

from typing import NamedTuple

import numpy as np

from dem.kernels.arrays import LAW, Array, Index, Joints, Points
from dem.kernels.compiled import kernel
from dem.kernels.contact_geometry import CROSSING
from dem.kernels.joint_law import tension
from dem.kernels.joint_strength import peak_of, plain_peak_of, softening_of, strength_of
from dem.kernels.pivots import extremes

HARDER = 1.05
"""Normal force of joints on one face after they are cut anew, over that before, up to which they keep their energy."""

DEEPER = 4.0
"""Elastic displacement up to which a point is moved on to keep the energy, over that without a move; chosen."""

EXACT = 1e-12
"""Part of what is sought to which a search by halving goes, and of an energy that is rounding [-]."""


class Heirs(NamedTuple):
    """Joints that are cut, beside what the kernel steps with."""

    contact: Index  # how their blocks meet, (k,)
    world: Array  # frame in global axes, (k, 3, 3)
    position: Array  # of the points [m], (m, 3)
    apart: Array  # distance of the blocks now beside the gap: of edges, or by deformation of the faces [m], (m,)
    aside: Array  # displacement now of the faces along each other by their deformation [m], (m, 2)
    setback: Array  # part of the gap that keeps the energy [m], (m,)


class Testators(NamedTuple):
    """What the joints carry that are cut anew."""

    contact: Index  # how their blocks meet, (k,)
    position: Array  # of the points [m], (m, 3)
    force: Array  # on block b, global axes [N], (m, 3)


@kernel(fast=False, counted=True)
def inherit(
    points: Points, joints: Joints, left: Testators, start: Index, heirs_of: Index, own: Index,
    new: Points, cut: Joints, heirs: Heirs,
) -> None:
    """Write elastic shear, dilation and damage of the nearest old points to new ones.

    Parameters
    ----------
    points, joints : old ones
    left : what the old ones carry
    start, heirs_of : numbers of the old joints that new joint j inherits from, ``heirs_of[start[j] : start[j + 1]]``
    own : 1 where such a joint is of the same pair, shape of ``heirs_of``: damage is a pair's own
    new, cut : points and joints that are cut; slips, plastic openings and damage are written
    heirs : what else is known of the new joints
    """
    for j in range(len(cut.block_a)):
        a, b, p0, p1 = cut.block_a[j], cut.block_b[j], cut.start[j], cut.start[j + 1]
        total = np.zeros(3)  # force of all old joints on block b of the new one, global axes [N]
        summed = heirs.contact[j] == CROSSING  # whether the whole force is taken over, and not stress point by point
        for h in range(start[j], start[j + 1]):
            old = heirs_of[h]
            summed = summed or left.contact[old] == CROSSING
            same = joints.block_b[old] == b or joints.block_a[old] == a
            along = 1.0 if same else -1.0
            for k in range(joints.start[old], joints.start[old + 1]):
                for r in range(3):
                    total[r] += along * left.force[k, r]
        if start[j] == start[j + 1]:
            continue  # nothing to inherit from
        shear, area, ks = np.empty(3), 0.0, cut.law[j, LAW.ks]
        for p in range(p0, p1):
            area += new.area[p]
        for p in range(p0, p1):
            far, nearest, donor = np.inf, -1, -1  # squared distance, number of the old point, entry of its joint
            for h in range(start[j], start[j + 1]):
                for k in range(joints.start[heirs_of[h]], joints.start[heirs_of[h] + 1]):
                    d0 = heirs.position[p, 0] - left.position[k, 0]
                    d1 = heirs.position[p, 1] - left.position[k, 1]
                    d2 = heirs.position[p, 2] - left.position[k, 2]
                    apart = d0 * d0 + d1 * d1 + d2 * d2
                    if apart < far:
                        far, nearest, donor = apart, k, h
            if nearest < 0:
                continue
            old = heirs_of[donor]
            # force on block b of the old joint; the new joint may have swapped a and b
            same = joints.block_b[old] == b or joints.block_a[old] == a
            per_area = (1.0 if same else -1.0) / points.area[nearest]
            for r in range(3):
                # stress on the new block b [Pa]; where a point and an area take over from each other the force stays
                shear[r] = total[r] / area if summed else per_area * left.force[nearest, r]
            new.lift[p] = 0.0 if heirs.contact[j] == CROSSING else points.lift[nearest]
            new.damage[p] = points.damage[nearest] if own[donor] else 0.0
            w = heirs.world
            new.slip_1[p] = (shear[0] * w[j, 0, 0] + shear[1] * w[j, 0, 1] + shear[2] * w[j, 0, 2]) / ks
            new.slip_2[p] = (shear[0] * w[j, 1, 0] + shear[1] * w[j, 1, 1] + shear[2] * w[j, 1, 2]) / ks


@kernel(fast=False)
def _pressed(stiff: Array, deep: Array, by: float) -> tuple[float, float]:
    """Energy [J] and normal force [N] of points pressed less deep by ``by`` [m].

    ``stiff`` is half the normal stiffness [N/m] and ``deep`` the depth [m] of every point, shape (m,).
    """
    energy = force = 0.0
    for k in range(len(deep)):
        left = max(deep[k] - by, 0.0)
        energy += stiff[k] * left * left
        force += 2.0 * stiff[k] * left
    return energy, force


@kernel(fast=False)
def _bears(law: Array, j: int, deep: float, damage: float, slip_1: float, slip_2: float) -> float:
    """Largest elastic slip of a point of joint j, with the strength left to it [m].

    Parameters
    ----------
    law : rows of all joints, shape (k, LAW_SIZE)
    j : number of the joint
    deep : depth of the point, negative where it is open [m]
    damage : 0 at the peak, 1 at residual values [-]
    slip_1, slip_2 : plastic slip, on which added terms may depend [m]
    """
    softening = softening_of(law, j)
    if law[j, LAW.cross] != 0.0:  # edges that cross take no added terms
        mu, _, c, ft = strength_of(plain_peak_of(law, j), softening, damage, slip_1, slip_2)
    else:
        mu, _, c, ft = strength_of(peak_of(law, j), softening, damage, slip_1, slip_2)
    kn = law[j, LAW.kn]
    n = min(tension(kn * deep, ft, ft + damage * softening.secant), kn * law[j, LAW.crushing])
    return max(c + mu * n, 0.0) / law[j, LAW.ks]


@kernel(fast=False, counted=True)
def largest_elastic_slip(new: Points, cut: Joints, heirs: Heirs) -> Array:
    """Largest elastic slip that points found anew bear as they lie [m], shape (m,).

    ``new``, ``cut`` and ``heirs`` are as in :func:`keep_energy`.
    """
    most = np.empty(len(new.gap))
    for j in range(len(cut.block_a)):
        for k in range(cut.start[j], cut.start[j + 1]):
            deep = new.lift[k] - new.gap[k] - heirs.apart[k]
            most[k] = _bears(cut.law, j, deep, new.damage[k], new.slip_1[k], new.slip_2[k])
    return most


@kernel(fast=False)
def _sheared(stiff: Array, along: Array, most: Array, part: float) -> float:
    """Energy [J] of points at ``part`` of their elastic slip, each within its most.

    Parameters
    ----------
    stiff : half the shear stiffness of every point [N/m], shape (m,)
    along : its elastic slip [m], shape (m,)
    most : its largest elastic slip by Coulomb's law [m], shape (m,)
    part : factor on all elastic slips [-]
    """
    energy = 0.0
    for k in range(len(along)):
        size = min(part * along[k], most[k])
        energy += stiff[k] * size * size
    return energy


@kernel(fast=False)
def _set_back(stiff: Array, deep: Array, allowed: float, push: float, setback: Array) -> None:
    """Write how far points are set back [m] to store an energy ``allowed`` [J].

    Points that store too much are all set back by one distance. Points that store too little are moved on, each by one
    part of its depth, as far as the force stays within ``HARDER`` times ``push`` and the depth within ``DEEPER`` times.

    Parameters
    ----------
    stiff : half the normal stiffness of every point [N/m], shape (m,)
    deep : depth of every point, negative where it is open [m], shape (m,)
    allowed : energy that they are to store [J]
    push : normal force of the old points [N]
    setback : of every point, negative where it is moved on [m], written, shape (m,)
    """
    held, force = _pressed(stiff, deep, 0.0)
    if held <= allowed * (1.0 + EXACT):
        more = 0.0
        if held > 0.0:
            # energy grows with the square of the depth, force with the depth
            more = max(min(np.sqrt(allowed / held), HARDER * push / force, DEEPER) - 1.0, 0.0)
        for k in range(len(deep)):
            setback[k] = -more * max(deep[k], 0.0)
        return
    deepest = deep[extremes(deep, len(deep))[1]]
    low, high = 0.0, deepest
    while high - low > EXACT * deepest:
        middle = 0.5 * (low + high)
        if _pressed(stiff, deep, middle)[0] > allowed:
            low = middle
        else:
            high = middle
    for k in range(len(deep)):
        setback[k] = min(max(deep[k], 0.0), high)


@kernel(fast=False)
def _bearable(stiff: Array, along: Array, most: Array, allowed: float) -> float:
    """Factor on elastic slips with which points store at most ``allowed`` [J].

    It is found by halving, and at most DEEPER.

    Parameters
    ----------
    stiff : half the shear stiffness of every point [N/m], shape (m,)
    along : its elastic slip [m], shape (m,)
    most : its largest elastic slip by Coulomb's law [m], shape (m,)
    allowed : energy that they are to store [J]
    """
    low, high = 0.0, DEEPER
    if _sheared(stiff, along, most, high) <= allowed:
        return high
    while high - low > EXACT * high:
        middle = 0.5 * (low + high)
        if _sheared(stiff, along, most, middle) > allowed:
            high = middle
        else:
            low = middle
    return low


@kernel(fast=False, counted=True)
def keep_energy(
    new: Points, cut: Joints, heirs: Heirs, start: Index, rows: Index, pressure: Array, sheared: Array, push: Array
) -> None:
    """Make joints found anew store the elastic energy of those that they replace.

    They do as far as their law bears it.

    Contacts found anew have other points and areas. Without this the energy would jump, and blocks would be kicked.
    A joint is "cut" where its contact polygon is computed by cutting the faces of two displaced blocks by each other.
    A "family" is a set of pairs of blocks between which forces are shared out anew, as where one block slides from one
    stone to the next: what one joint of it loses another takes over, so that energy is kept in the family as a whole.
    Pressure first: depths are set back until 1/2 sum kn A x^2 fits. Then shear: one factor on all elastic slips, each
    held below what Coulomb's law bears at the new pressure.

    Parameters
    ----------
    new, cut, heirs : points and joints found anew; gaps, setbacks and slips are changed
    start, rows : joints of family f are ``rows[start[f] : start[f + 1]]``
    pressure, sheared : energy of pressure and of shear in the old joints of every family [J], shape (families,)
    push : their normal force [N], shape (families,)
    """
    for f in range(len(pressure)):
        m = 0
        for i in range(start[f], start[f + 1]):
            m += cut.start[rows[i] + 1] - cut.start[rows[i]]
        stiff, deep, setback, along, most = np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m)
        at = 0
        for i in range(start[f], start[f + 1]):
            j = rows[i]
            for k in range(cut.start[j], cut.start[j + 1]):
                # energy of a point is 0.5 k A x^2, with x its depth [m]; ``apart`` opens it beside the gap
                stiff[at] = 0.5 * cut.law[j, LAW.kn] * new.area[k]
                deep[at] = new.lift[k] - new.gap[k] - heirs.apart[k]
                at += 1
        _set_back(stiff, deep, pressure[f], push[f], setback)
        at = 0
        for i in range(start[f], start[f + 1]):
            j = rows[i]
            for k in range(cut.start[j], cut.start[j + 1]):
                heirs.setback[k] = setback[at]
                new.gap[k] += setback[at]
                most[at] = _bears(
                    cut.law, j, deep[at] - setback[at], new.damage[k], new.slip_1[k], new.slip_2[k]
                )
                stiff[at] = 0.5 * cut.law[j, LAW.ks] * new.area[k]
                along[at] = np.hypot(new.slip_1[k] - heirs.aside[k, 0], new.slip_2[k] - heirs.aside[k, 1])
                at += 1
        # one factor on all slips, each held to what its law bears
        part = _bearable(stiff, along, most, sheared[f])
        at = 0
        for i in range(start[f], start[f + 1]):
            for k in range(cut.start[rows[i]], cut.start[rows[i] + 1]):
                size = min(part * along[at], most[at]) / max(along[at], 1e-300)
                new.slip_1[k] = heirs.aside[k, 0] + size * (new.slip_1[k] - heirs.aside[k, 0])
                new.slip_2[k] = heirs.aside[k, 1] + size * (new.slip_2[k] - heirs.aside[k, 1])
                at += 1
