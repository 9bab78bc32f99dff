"""One body of hexahedral zones without joints, held and loaded at its nodes: against closed forms of continua."""

import numpy as np
from linear import solution
from scipy import sparse

from dem.kernels import LAW_SIZE
from dem.kernels import solid_arrays as arrays
from dem.kernels.solid_zones import solid_forces
from dem.kernels.zone_arrays import Z_SIZE, Nodes, ZonedArrays
from dem.kernels.zone_measure import measure_solids
from dem.kernels.zone_motion import advance_solids
from dem.zones.element import CUBE
from dem.zones.model import make_solids
from dem.zones.stable import largest_eigenvalue, stable_masses
from limitmason.geometry import box
from limitmason.model import Block


def grid(xs, ys, zs):
    """Nodes and zones between planes of x, of y and of z."""
    z, y, x = np.meshgrid(zs, ys, xs, indexing="ij")
    number = np.arange(x.size).reshape(x.shape)
    k, m, n = (s - 1 for s in x.shape)
    cells = np.stack([number[c : k + c, b : m + b, a : n + a].ravel() for a, b, c in (CUBE > 0).astype(int)], axis=1)
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), cells


class SolidBody:
    """A mesh with forces on nodes (``load``) and freedoms that keep their velocity (``held``)."""

    def __init__(self, place, cells, material, held=None, density=None):
        n = len(place)
        made_of = Block("body", (box((0, 0, 0), (1, 1, 1)),), 1.0, material=material)
        self.tables, self.zones = make_solids(place, cells, [made_of] * len(cells))
        held = np.zeros((n, 3), bool) if held is None else held
        zeros = [np.zeros((n, 3)) for _ in range(5)]
        self.nodes = Nodes(place, *zeros[:2], np.ones(n), *zeros[2:4], np.full(n, -1), zeros[4], held)
        none, no = np.zeros(0), np.zeros(0, np.int64)
        whole, real = np.zeros((0, 4), np.int64), np.zeros((0, 4))
        self.facets = arrays.Facets(whole, whole)
        self.contacts = arrays.FaceContacts(
            no, no, np.zeros((0, 2)), np.zeros((0, 3)), whole, real, none, none, np.zeros((0, 2)), none, none,
            np.zeros((0, 2, 3)),
        )  # fmt: skip
        b = np.zeros((0, 6))
        self.rigid = arrays.RigidSolids(
            np.zeros((0, 3)), b, np.zeros((0, 4)), b, b, b, np.zeros((0, 6), bool), b, b, b, b, no
        )
        self.total = np.zeros(Z_SIZE)
        dof = (3 * cells[:, :, None] + np.arange(3)).reshape(-1, 24)
        k = self.tables.stiffness[self.zones.kind]
        self.stiffness = sparse.csr_matrix(
            (k.ravel(), (np.repeat(dof, 24, 1).ravel(), np.tile(dof, (1, 24)).ravel())), (3 * n, 3 * n)
        )
        self.free = np.flatnonzero(~held.ravel())
        if density is None:
            self.dt = 1.0
            self.nodes.mass[:] = stable_masses(self.stiffness, n, 3)[::3]
        else:
            share = self.tables.weight.sum(axis=1)[self.zones.kind] / 8 * density
            self.nodes.mass[:] = np.bincount(cells.ravel(), np.repeat(share, 8), n)
            mass = np.repeat(self.nodes.mass, 3)
            self.dt = float(np.sqrt(0.9 * 4.0 / largest_eigenvalue(self.stiffness, mass)))

    def run(self, steps, local=0.8, drifts=False):
        advance_solids(self.arrays, steps, self.dt, local, drifts)

    @property
    def arrays(self):
        """What the kernels see: no joints."""
        return ZonedArrays(
            self.nodes, self.zones, self.tables, self.facets, self.contacts, self.rigid, np.zeros((1, LAW_SIZE)), False,
            self.total,
        )  # fmt: skip

    def forces(self):
        """Forces of the zones on the nodes in the present position, shape (n, 3)."""
        self.nodes.force[:] = 0.0
        solid_forces(self.nodes, self.zones, self.tables)
        return self.nodes.force.copy()

    def stresses(self):
        """Stresses at all stress points, shape (e, 8, 3, 3), and the elastic energy."""
        out = np.zeros((len(self.zones.kind), 8, 6))
        energy = measure_solids(self.arrays, out, np.zeros((0, 6)))
        return out[..., [[0, 5, 4], [5, 1, 3], [4, 3, 2]]], energy

    def solved(self):
        """Linear static displacements under the loads, shape (n, 3)."""
        u = np.zeros(3 * len(self.nodes.place))
        k = self.stiffness[self.free][:, self.free]
        u[self.free] = solution(k, self.nodes.load.ravel()[self.free])
        return u.reshape(-1, 3)
