"""One body of zones without joints, held and loaded at its nodes: what closed forms of continua are compared with."""

import numpy as np
from linear import solution
from scipy import sparse

from dem.kernels import LAW_SIZE
from dem.kernels import zone_arrays as arrays
from dem.kernels import zones as kernel
from dem.kernels.zone_measure import measure_zones
from dem.kernels.zone_motion import advance_zones
from dem.zones.assemble_zones import make_zones
from dem.zones.running import read
from dem.zones.zoned_model import largest_eigenvalue, stable_masses
from limitmason.deformable import PLANE_STRESS


def grid(xs, zs):
    """Nodes and zones between lines of x and of z."""
    n, m = len(xs) - 1, len(zs) - 1
    x, z = np.meshgrid(xs, zs)
    first = (np.arange(m)[:, None] * (n + 1) + np.arange(n)).ravel()
    return np.column_stack([x.ravel(), z.ravel()]), np.column_stack([first, first + 1, first + n + 2, first + n + 1])


class ZoneBody:
    """A mesh with forces on nodes (``load``) and freedoms that keep their velocity (``held``)."""

    def __init__(self, place, cells, material, held=None, plane=PLANE_STRESS, thickness=1.0, density=None):
        n = len(place)
        thick = np.full(len(cells), thickness)
        self.tables, self.zones = make_zones(place, cells, [material] * len(cells), thick, plane)
        held = np.zeros((n, 2), bool) if held is None else held
        zeros = [np.zeros((n, 2)) for _ in range(5)]
        self.nodes = arrays.Nodes(place, *zeros[:2], np.ones(n), *zeros[2:4], np.full(n, -1), zeros[4], held)
        none, no = np.zeros(0), np.zeros(0, np.int64)
        self.sides = arrays.Sides(np.zeros(2, np.int64), np.zeros(1, np.int64), np.zeros(2))
        self.contacts = arrays.SideContacts(
            no, no, no, none, np.zeros((0, 2), np.int64), *[none] * 8
        )
        b = np.zeros((0, 3))
        none = np.zeros((0, 2, 2)), np.zeros((0, 3), bool)
        self.rigid = arrays.Rigid(np.zeros((0, 2)), b, b, b, b, *none, b, b, b, b, no)
        self.total = np.zeros(arrays.Z_SIZE)
        dof = np.stack([2 * cells, 2 * cells + 1], 2).reshape(-1, 8)
        k = self.tables.stiffness[self.zones.kind]
        self.stiffness = sparse.csr_matrix(
            (k.ravel(), (np.repeat(dof, 8, 1).ravel(), np.tile(dof, (1, 8)).ravel())), (2 * n, 2 * n)
        )
        self.free = np.flatnonzero(~held.ravel())
        if density is None:
            self.dt = 1.0
            self.nodes.mass[:] = stable_masses(self.stiffness, n)[::2]
        else:
            share = self.tables.weight.sum(axis=1)[self.zones.kind] / 4 * density
            self.nodes.mass[:] = np.bincount(cells.ravel(), np.repeat(share, 4), n)
            mass = np.repeat(self.nodes.mass, 2)
            self.dt = float(np.sqrt(0.9 * 4.0 / largest_eigenvalue(self.stiffness, mass)))

    def run(self, steps, local=0.8, drifts=False):
        advance_zones(self.arrays, steps, self.dt, local, drifts)

    @property
    def arrays(self):
        """What the kernels see: no joints."""
        return arrays.ZonedArrays(
            self.nodes, self.zones, self.tables, self.sides, self.contacts, self.rigid, np.zeros((1, LAW_SIZE)), False,
            self.total,
        )

    def forces(self):
        """Forces of the zones on the nodes in the present position, shape (n, 2)."""
        self.nodes.force[:] = 0.0
        kernel.zone_forces(self.nodes, self.zones, self.tables, self.total)
        return self.nodes.force.copy()

    def stresses(self):
        """Stresses xx, zz, xz, yy at all stress points, shape (e, 4, 4), and the elastic energy."""
        out = np.zeros((len(self.zones.kind), 4, 4))
        energy = measure_zones(self.arrays, out, np.zeros((0, 4)))
        return out, energy

    def solved(self):
        """Linear static displacements under the loads, shape (n, 2)."""
        u = np.zeros(2 * len(self.nodes.place))
        k = self.stiffness[self.free][:, self.free]
        u[self.free] = solution(k, self.nodes.load.ravel()[self.free])
        return u.reshape(-1, 2)


def energy_error(model):
    """Work of loads and supports less what is stored, lost and in motion, over the work, of a zoned model [-]."""
    total = model.total
    work = total[arrays.Z_APPLIED] + total[arrays.Z_SUPPORT]
    rest = total[arrays.Z_LOST].sum() + total[arrays.Z_KINETIC] + read(model).energy
    return float((work - rest) / max(abs(work), 1e-300))
