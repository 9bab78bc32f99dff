"""Stiffness of a zoned model over its freedoms, and the masses that keep its step stable."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh

from dem.kernels.arrays import LAW
from dem.kernels.zone_arrays import SideContacts, Sides
from dem.zones.zoned_model import ZonedModel
from limitmason.arrays import Array
from limitmason.errors import InputError

DAMPING = 0.8
"""Local damping for which masses are scaled: it can make a force 1.8 times as large."""

MARGIN = 0.95
"""Part of the largest stable square of the step that is used."""


def stiffness(model: ZonedModel) -> sparse.csr_matrix:
    """Elastic stiffness of zones and closed joints [N/m] over the freedoms x0, z0, x1, ... of all nodes."""
    zones, contacts = model.zones, model.contacts
    dof = (2 * zones.node[:, :, None] + np.arange(2)).reshape(len(zones.node), -1)
    width = dof.shape[1]
    k = model.tables.stiffness[zones.kind]
    rows, cols = np.repeat(dof, width, 1).ravel(), np.tile(dof, (1, width)).ravel()
    b, size = contact_matrix(model), 2 * len(model.nodes.place)
    law = model.law[contacts.joint]
    stiff = law[:, [LAW.kn, LAW.ks]] * contacts.area[:, None]
    whole = sparse.csr_matrix((k.ravel(), (rows, cols)), (size, size))
    return (whole + b.T @ sparse.diags(stiff.ravel()) @ b).tocsr()


def contact_matrix(model: ZonedModel) -> sparse.csr_matrix:
    """Opening and slip of every contact point from displacements of all nodes, shape (2 m, 2 n).

    Rows are opening and slip of one point after another, columns x and z of one node after another. A point lies
    between two nodes of block b and two of block a, which move it by their shares.
    """
    axes, parts = _on_sides(model.contacts, model.sides, model.nodes.place)
    m = len(model.contacts.area)
    rows, cols, data = [], [], []
    for which, direction in enumerate(axes):
        for node, share in parts:
            for r in range(2):
                rows.append(2 * np.arange(m) + which)
                cols.append(2 * node + r)
                data.append(share * direction[:, r])
    shape = (2 * m, 2 * len(model.nodes.place))
    return sparse.csr_matrix((np.concatenate(data), (np.concatenate(rows), np.concatenate(cols))), shape)


Parts = list[tuple[NDArray[np.int64], Array]]


def _on_sides(contacts: SideContacts, sides: Sides, place: Array) -> tuple[list[Array], Parts]:
    """Normal and tangent of contact points, and the nodes that move them with their shares."""
    i, j = sides.node[contacts.segment], sides.node[contacts.segment + 1]
    run = place[j] - place[i]
    t = run / np.linalg.norm(run, axis=1)[:, None]
    first = sides.arc[contacts.segment]
    along = (contacts.arc - first) / (sides.arc[contacts.segment + 1] - first)
    parts = [
        (contacts.node[:, 0], 1.0 - contacts.share), (contacts.node[:, 1], contacts.share), (i, along - 1.0),
        (j, -along),
    ]
    return [np.column_stack([t[:, 1], -t[:, 0]]), t], parts


def freedoms(model: ZonedModel) -> sparse.csr_matrix:
    """Displacement of all nodes from the free unknowns: nodes of zones, then freedoms of rigid blocks not held."""
    nodes, rigid = model.nodes, model.rigid
    n = len(nodes.place)
    free = np.flatnonzero(nodes.body < 0)
    columns = np.arange(2 * len(free))
    rows = (2 * free[:, None] + np.arange(2)).ravel()
    rigid_rows, rigid_cols, data, count = [], [], [], 2 * len(free)
    for b, freedom in np.argwhere(~rigid.held):
        own = np.flatnonzero(nodes.body == b)
        if freedom < 2:
            moved = np.zeros((len(own), 2))
            moved[:, freedom] = 1.0
        else:  # a turn from x to z
            arm = nodes.place[own] - rigid.centre[b]
            moved = np.column_stack([-arm[:, 1], arm[:, 0]])
        rigid_rows.append((2 * own[:, None] + np.arange(2)).ravel())
        rigid_cols.append(np.full(2 * len(own), count))
        data.append(moved.ravel())
        count += 1
    return sparse.csr_matrix((
        np.concatenate([np.ones(rows.size), *data]),
        (np.concatenate([rows, *rigid_rows]), np.concatenate([columns, *rigid_cols])),
    ), (2 * n, count))


def stable_masses(k: sparse.csr_matrix, nodes: int) -> Array:
    """Masses per freedom for a step of 1 under local damping, from the largest eigenvalue of their stiffness.

    m proportional to the row sums of |K| (Gershgorin), one for all freedoms of a node; then scaled so that
    (1 + DAMPING) lambda_max(M^-1 K) <= 4 MARGIN.

    Parameters
    ----------
    k : stiffness over the free freedoms [N/m], symmetric
    nodes : at the head of the freedoms, two each
    """
    mass = np.asarray(abs(k).sum(axis=1)).ravel()
    own = 2 * nodes
    mass[:own] = np.repeat(mass[:own].reshape(-1, 2).max(axis=1), 2)
    if not (mass > 0.0).all():
        raise InputError("a block is held by no zone and no joint")
    return mass * largest_eigenvalue(k, mass) * (1.0 + DAMPING) / (4.0 * MARGIN)


def largest_eigenvalue(k: sparse.csr_matrix, mass: Array) -> float:
    """Largest eigenvalue of M^-1 K for a diagonal M [1/s2], not below the exact one by more than 1e-3 of it."""
    root = sparse.diags(1.0 / np.sqrt(mass))
    scaled = (root @ k @ root).tocsr()
    if k.shape[0] < 60:
        return float(np.linalg.eigvalsh(scaled.toarray())[-1])
    start = np.random.default_rng(0).standard_normal(k.shape[0])
    return float(eigsh(scaled, 1, which="LA", v0=start, tol=1e-3, return_eigenvectors=False)[0]) * (1.0 + 2e-3)
