"""Residuals of a returned state, from the geometry alone: equilibrium, joint law, flow rule.

A state is forces at contact points and velocities of blocks. Centroids, weights, normals and load wrenches are those of
``space``, taken from the solids; of the answer only points, forces and twists are used.
"""

from typing import NamedTuple

import numpy as np

from .assemblies import Case
from .space import find_contacts, wrenches

Array = np.ndarray


class Residuals(NamedTuple):
    """All relative [-].

    Parameters
    ----------
    equilibrium : largest unbalanced force, or moment over size, of a block over its own loads and joint forces
    outside : largest distance of a loaded point from the contact it should lie on, over the smaller block
    strength : largest excess over the joint law, over the own load of the smaller block at that joint
    flow : most negative e_n - tan(psi) |e_t|, over the largest rate
    power : largest power that a joint force does against its flow rule, over the power of the live load
    """

    equilibrium: float
    outside: float
    strength: float
    flow: float = float("nan")
    power: float = float("nan")


def residuals(case: Case, assembly, answer, tan_psi: float | None = None) -> Residuals:
    """Residuals of ``answer`` for a dry case; with ``tan_psi`` those of the motion, too."""
    solids = case.solids()
    size, centroid, dead, live = wrenches(case, solids)
    faces = find_contacts(solids)
    forces = answer.resultants
    # the load a block itself brings: what is in balance has to be so against this
    own = np.maximum(np.abs(dead[:, :3]).max(axis=1), abs(answer.collapse_multiplier) * np.abs(live[:, :3]).max(axis=1))
    rest = dead + answer.collapse_multiplier * live
    carried = np.zeros(len(size))
    outside = strength = 0.0
    flow, power = 0.0, 0.0
    twists = None if answer.mechanism is None else answer.mechanism.twists
    rates, works = [], []
    for at, k, force in zip(forces.point_position, forces.point_interface, forces.point_force, strict=True):
        interface = assembly.interfaces[int(k)]
        a, b = interface.block_a, interface.block_b
        for block, sign in ((b, 1.0), (a, -1.0)):
            rest[block, :3] += sign * force
            rest[block, 3:] += np.cross(at - centroid[block], sign * force)
            carried[block] = max(carried[block], np.abs(force).max())
        small = min(size[a], size[b])
        mine = [f for f in faces if (f.a, f.b) in ((a, b), (b, a))]
        away = [_distance(f, at) / small for f in mine]
        if not away:
            outside = np.inf
            continue
        f = mine[int(np.argmin(away))]
        outside = max(outside, min(away))
        n = f.normal if (f.a, f.b) == (a, b) else -f.normal
        normal = float(force @ n)
        shear = force - normal * n
        scale = min(own[i] for i in (a, b) if i not in case.fixed) or np.abs(dead).max()
        strength = max(strength, (np.linalg.norm(shear) - case.law.mu * normal) / scale / max(1.0, case.law.mu))
        if tan_psi is None:
            continue
        va, vb = (twists[i, :3] + np.cross(twists[i, 3:], at - centroid[i]) for i in (a, b))
        opening = float((vb - va) @ n)
        slip = (vb - va) - opening * n
        speed = np.linalg.norm(slip)
        rates.append(max(abs(opening), speed))
        flow = max(flow, tan_psi * speed - opening)
        works += [normal * (opening - tan_psi * speed), shear @ slip + case.law.mu * normal * speed]
    free = case.free
    balance = np.maximum(np.abs(rest[:, :3]).max(axis=1), np.abs(rest[:, 3:]).max(axis=1) / size)
    # a weightless block has only its joint forces to be measured by
    by = np.where(own > 0, own, np.where(carried > 0, carried, 1.0))
    equilibrium = float((balance[free] / by[free]).max())
    if tan_psi is None:
        return Residuals(equilibrium, outside, strength)
    done = float((live[free] * twists[free]).sum())
    power = float(np.abs(works).max() / done) if done > 0 else np.inf
    return Residuals(equilibrium, outside, strength, flow / max(rates), power)


def _distance(face, at: Array) -> float:
    """Distance of a point from a contact polygon; over its middle line when that is the plane of symmetry."""
    off = abs((at - face.corners[0]) @ face.normal)
    edges = np.roll(face.corners, -1, axis=0) - face.corners
    inward = np.cross(face.normal, edges / np.linalg.norm(edges, axis=1)[:, None])
    inside = ((at - face.corners) * inward).sum(axis=1)
    return float(max(off, -inside.min()))
