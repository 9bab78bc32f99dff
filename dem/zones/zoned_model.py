"""What a model of zoned blocks consists of, its stiffness, and the masses that keep its step stable.

Freedoms are x and z of one node after another; a point of a joint has an opening and a slip.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import eigsh

from dem.default_damping import ZONES
from dem.kernels.arrays import LAW, Index
from dem.kernels.zone_arrays import Nodes, QuadTable, Rigid, SideContacts, Sides, ZonedArrays, Zones
from dem.zones.mesh import ZoneMesh
from limitmason.arrays import Array
from limitmason.errors import InputError
from limitmason.model import Assembly

AXES, SENSE = (0, 2, 4), (1.0, 1.0, -1.0)
"""Which of a block's six motions x, z and ry are, and their signs here: a turn from x to z is one about -y."""

MOVING = ("nodes", "zones", "contacts", "rigid")
"""Groups of arrays that a run changes."""

MARGIN = 0.95
"""Part of the largest stable square of the step that is used; chosen."""

FEW = 60
"""Freedoms below which all eigenvalues are worked out at once; chosen."""

CLOSE = 1e-3
"""Relative error that is asked of an eigenvalue [-]."""

BEYOND = 2e-3
"""Part by which the largest one is raised, twice the error: it must not lie below the exact one [-]."""

BELOW_ZERO = 1e-9
"""How far below zero the smallest eigenvalue is sought from, over the largest entry: no matrix is singular there."""


@dataclass(frozen=True, eq=False)
class ZonedModel:
    """Everything that changes, and the arrays it changes on.

    Made by :func:`dem.zones.assemble_zones.make_model`.

    Parameters
    ----------
    nodes, zones, tables, sides, contacts, rigid : kernel arrays, see :mod:`dem.kernels.zone_arrays`
    law : row of the joint law for every row of ``interface``, shape (k, LAW_SIZE)
    soft : whether a joint loses strength or has added terms
    interface : interface of the assembly each law is of, shape (k,)
    total : accumulated works, entries ``Z_...`` of :mod:`dem.kernels.zone_arrays`
    dt : step [s]; 1 where masses are scaled to the step
    plane : "plane stress" or "plane strain"
    warnings : what a user should know
    lost : what joints lose where they fail, in words
    """

    assembly: Assembly
    mesh: ZoneMesh
    nodes: Nodes
    zones: Zones
    tables: QuadTable
    sides: Sides
    contacts: SideContacts
    rigid: Rigid
    law: Array
    soft: bool
    interface: Index
    total: Array
    dt: float
    plane: str
    warnings: tuple[str, ...]
    lost: tuple[str, ...]

    def copy(self) -> "ZonedModel":
        """This model with arrays of its own."""

        def copied(group: Any) -> Any:
            """A named tuple of copies."""
            return type(group)(*(v.copy() for v in group))

        moving = {name: copied(getattr(self, name)) for name in MOVING}
        return replace(self, **moving, total=self.total.copy())

    @property
    def arrays(self) -> ZonedArrays:
        """What the kernels see of it."""
        return ZonedArrays(*(getattr(self, name) for name in ZonedArrays._fields))


def free_stiffness(model: ZonedModel) -> sparse.csr_matrix:
    """Elastic stiffness of a model by the unknowns of :func:`freedoms`, (free, free)."""
    reach = freedoms(model)
    return sparse.csr_matrix(reach.T @ stiffness(model) @ reach)


def stiffness(model: ZonedModel) -> sparse.csr_matrix:
    """Elastic stiffness of zones and closed joints of a model [N/m], shape (2 n, 2 n).

    Rows and columns are the freedoms of all nodes.
    """
    zones, contacts = model.zones, model.contacts
    # freedoms of the four nodes of every zone; an entry of the whole for each pair of them
    dof = (2 * zones.node[:, :, None] + np.arange(2)).reshape(len(zones.node), -1)
    width = dof.shape[1]
    k = model.tables.stiffness[zones.kind]
    rows, cols = np.repeat(dof, width, 1).ravel(), np.tile(dof, (1, width)).ravel()
    b, size = contact_matrix(model), 2 * len(model.nodes.place)
    law = model.law[contacts.joint]
    stiff = law[:, [LAW.kn, LAW.ks]] * contacts.area[:, None]
    of_zones = sparse.csr_matrix((k.ravel(), (rows, cols)), (size, size))
    # of joints B^T (k A) B, B giving opening and slip of every point, k being kn and ks
    return (of_zones + b.T @ sparse.diags(stiff.ravel()) @ b).tocsr()


def contact_matrix(model: ZonedModel) -> sparse.csr_matrix:
    """Matrix that gives opening and slip of contact points by displacements of nodes.

    Its shape is (2 m, 2 n). Rows are opening and slip of one point after another, columns x and z of one node after
    another. A point lies between two nodes of block b and two of block a, which move it by their shares.
    """
    c, side, place = model.contacts, model.sides, model.nodes.place
    i, j = side.node[c.segment], side.node[c.segment + 1]
    run = place[j] - place[i]
    t = run / np.linalg.norm(run, axis=1)[:, None]
    axes = np.stack([np.column_stack([t[:, 1], -t[:, 0]]), t])  # normal and tangent
    first = side.arc[c.segment]
    along = (c.arc - first) / (side.arc[c.segment + 1] - first)
    node = np.stack([c.node[:, 0], c.node[:, 1], i, j])
    # displacement of the point on b less that on a: shares of b add to one, those of a to minus one
    share = np.stack([1.0 - c.share, c.share, along - 1.0, -along])
    # one entry for each (axis, node, point, x or z): share of the node times component of the axis
    data = share[None, :, :, None] * axes[:, None]
    row = (2 * np.arange(len(t)) + np.arange(2)[:, None])[:, None, :, None]
    column = (2 * node[:, :, None] + np.arange(2))[None]
    where = tuple(np.broadcast_to(x, data.shape).ravel() for x in (row, column))
    return sparse.csr_matrix((data.ravel(), where), (2 * len(t), 2 * len(place)))


def freedoms(model: ZonedModel) -> sparse.csr_matrix:
    """Displacement of all nodes of a model from the free unknowns, shape (2 n, free).

    The unknowns are x and z of the nodes of zones, then x, z and turn of rigid blocks where they are not held.
    """
    nodes, rigid = model.nodes, model.rigid
    n, free, carried = len(nodes.place), np.flatnonzero(nodes.body < 0), np.flatnonzero(nodes.body >= 0)
    own = (2 * free[:, None] + np.arange(2)).ravel()
    zones = sparse.csr_matrix((np.ones(len(own)), (own, np.arange(len(own)))), (2 * n, len(own)))
    body, one = nodes.body[carried], np.ones(len(carried))
    arm = nodes.place[carried] - rigid.centre[body]
    # a node moves by x and z of its block, and by its turn from x to z
    data = np.column_stack([one, one, -arm[:, 1], arm[:, 0]])
    where = (2 * carried[:, None] + [0, 1, 0, 1]).ravel(), (3 * body[:, None] + [0, 1, 2, 2]).ravel()
    moved = sparse.csc_matrix((data.ravel(), where), (2 * n, rigid.held.size))
    return sparse.csr_matrix(sparse.hstack([zones, moved[:, np.flatnonzero(~rigid.held.ravel())]]))


def stable_masses(k: sparse.csr_matrix, nodes: int) -> Array:
    """Masses per freedom for a step of 1 under local damping.

    They follow from the largest eigenvalue of their stiffness.

    m proportional to the row sums of |K| (Gershgorin), one for all freedoms of a node; then scaled so that
    (1 + ZONES) lambda_max(M^-1 K) <= 4 MARGIN.

    Parameters
    ----------
    k : stiffness over the free unknowns of :func:`freedoms` [N/m], symmetric, shape (n, n)
    nodes : how many nodes of zones stand at the head of the freedoms, two each

    Returns
    -------
    mass of every freedom [kg], shape (n,)
    """
    mass = np.asarray(abs(k).sum(axis=1)).ravel()
    own = 2 * nodes
    mass[:own] = np.repeat(mass[:own].reshape(-1, 2).max(axis=1), 2)
    if not (mass > 0.0).all():
        raise InputError("a block is held by no zone and no joint")
    return mass * largest_eigenvalue(k, mass) * (1.0 + ZONES) / (4.0 * MARGIN)


def largest_eigenvalue(k: sparse.csr_matrix, mass: Array) -> float:
    """Largest eigenvalue of M^-1 K for a diagonal M [1/s2].

    It lies above the exact one by up to :data:`BEYOND` and its error.

    Parameters
    ----------
    k, mass : stiffness [N/m] and the diagonal of M [kg], shapes (n, n) and (n,)
    """
    root = sparse.diags(1.0 / np.sqrt(mass))
    scaled = (root @ k @ root).tocsr()
    if k.shape[0] < FEW:
        return float(np.linalg.eigvalsh(scaled.toarray())[-1])
    start = np.random.default_rng(0).standard_normal(k.shape[0])
    return float(eigsh(scaled, 1, which="LA", v0=start, tol=CLOSE, return_eigenvectors=False)[0]) * (1.0 + BEYOND)


def slowest_period(model: ZonedModel) -> float:
    """Steps of the slowest swing of a model with closed, elastic joints.

    It is 2 pi / omega with omega^2 the smallest eigenvalue of M^-1 K, masses as they are, sought from just below zero.
    """
    free = np.flatnonzero(model.nodes.body < 0)
    mass = np.concatenate([np.repeat(model.nodes.mass[free], 2), model.rigid.mass[~model.rigid.held]])
    root = sparse.diags(1.0 / np.sqrt(mass))
    scaled = (root @ free_stiffness(model).tocsc() @ root).tocsc()
    shift = -BELOW_ZERO * float(scaled.diagonal().max())
    start = np.random.default_rng(0).standard_normal(len(mass))
    low = float(eigsh(scaled, 1, sigma=shift, which="LM", v0=start, tol=CLOSE, return_eigenvectors=False)[0])
    return float(2.0 * np.pi / np.sqrt(max(low, 1e-300)) / model.dt)
