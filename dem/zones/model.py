"""A plane assembly as zones, contact points and rigid blocks: what the zones' kernels see, with masses and loads."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh

from dem.joints import Grid, JointOptions, losses, make_laws
from dem.kernels.arrays import LAW_KN, LAW_KS, LAW_RATE, LAW_RATE_SLIP
from dem.kernels.zone_arrays import Z_SIZE, Contacts, Nodes, Rigid, Sides, Tables, Zones
from dem.zones.attach import make_contacts, make_sides
from dem.zones.element import ZoneTables, elasticity, zone_tables
from dem.zones.mesh import ZoneMesh, make_mesh
from dem.zones.yielding import material_row
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS
from limitmason.errors import InputError
from limitmason.law_table import refuse_ties
from limitmason.model import Assembly, Loads, Material

Array = NDArray[np.float64]
Index = NDArray[np.int64]

DAMPING = 0.8
"""Local damping for which masses are scaled: it can make a force 1.8 times as large."""

MARGIN = 0.95
"""Part of the largest stable square of the step that is used."""


@dataclass(frozen=True, eq=False)
class ZonedModel:
    """Everything that changes, and the arrays it changes on; made by :func:`make_model`.

    Parameters
    ----------
    nodes, zones, tables, sides, contacts, rigid : kernel arrays
    law : row of the joint law for every row of ``interface``
    lost : what joints lose where they fail, in words
    soft : whether a joint loses strength
    interface : interface of the assembly each law is of
    total : accumulated works, see ``dem.kernels.zones``
    dt : [s]; 1 where masses are scaled to the step
    plane : "plane stress" or "plane strain"
    """

    assembly: Assembly
    mesh: ZoneMesh
    nodes: Nodes
    zones: Zones
    tables: Tables
    sides: Sides
    contacts: Contacts
    rigid: Rigid
    law: Array
    soft: bool
    interface: Index
    total: Array
    dt: float
    plane: str
    warnings: tuple[str, ...]
    lost: tuple[str, ...]


def make_model(
    assembly: Assembly,
    loads: Loads,
    *,
    zone_size: float,
    plane: str = PLANE_STRESS,
    contact_points: Grid | None = None,
    joint_options: JointOptions | None = None,
    dynamic: bool = False,
    stiff: Iterable[int] = (),
) -> ZonedModel:
    """Zones of the blocks that have a material; blocks that are held, or have none, are rigid.

    Parameters
    ----------
    assembly : blocks that are convex prisms along y
    loads : dead loads act at once: weight, and wrenches spread over the zones of a block as a rigid motion would be
    zone_size : largest edge of a zone [m]
    plane : "plane stress" or "plane strain"
    contact_points : see :func:`dem.zones.attach.make_contacts`
    joint_options : as in the rigid DEM; a dashpot is refused
    dynamic : real masses instead of masses scaled to the step
    stiff : numbers of further blocks that are rigid, whatever their material: plates that are driven

    Raises
    ------
    InputError
        For a plane that does not exist, no block with a material, a zone larger than its block, loads out of the plane,
        and as :func:`dem.zones.mesh.make_mesh`.
    """
    options = joint_options or JointOptions()
    if plane not in (PLANE_STRESS, PLANE_STRAIN):
        raise InputError(f"plane must be {PLANE_STRESS!r} or {PLANE_STRAIN!r} (stress= of a push), got {plane!r}")
    if options.dashpot is not None and np.any(np.asarray(list(
        options.dashpot.values() if hasattr(options.dashpot, "values") else np.atleast_1d(options.dashpot)
    ), dtype=float) > 0.0):  # fmt: skip
        raise InputError("joint_options: zoned runs have local damping alone; leave the dashpot out")
    refuse_ties(assembly, "a block cut into zones", "use rigid blocks")
    mesh = make_mesh(assembly, zone_size, stiff)
    if mesh.rigid.all():
        raise InputError(
            "no block has a material: give assembly.with_material(limitmason.Material(young_modulus=..., "
            "poisson_ratio=..., density=...)), or run rigid blocks"
        )
    for name, wrench in (("dead", loads.dead), ("live", loads.live)):
        free = ~assembly.fixed
        outside = np.abs(wrench[free][:, [1, 3, 5]]).max(initial=0.0)
        if outside > 1e-9 * max(np.abs(wrench[free]).max(initial=0.0), 1e-300):
            raise InputError(f"{name} loads act out of the x-z plane: zoned blocks stay in it")
    materials = [assembly.blocks[block].material for block in mesh.zone_block]
    tables, zones = make_zones(mesh.place, mesh.zones, materials, mesh.thickness[mesh.zone_block], plane)
    sides = make_sides(mesh)
    contacts, interface = make_contacts(assembly, mesh, sides, contact_points)
    laws, warnings = make_laws(assembly, loads.dead, options)
    law = np.ascontiguousarray(laws[interface])
    soft = bool((law[:, [LAW_RATE, LAW_RATE_SLIP]] > 0.0).any())
    n = len(mesh.place)
    body = np.full(n, -1, dtype=np.int64)
    numbers = np.flatnonzero(mesh.rigid)
    for b, block in enumerate(numbers):
        body[mesh.block == block] = b
    held = assembly.held[numbers][:, [0, 2, 4]]
    nb = len(numbers)
    rigid = Rigid(
        assembly.centroids[numbers][:, [0, 2]], np.zeros((nb, 3)), np.zeros((nb, 3)), np.ones((nb, 3)),
        np.zeros((nb, 3)), held.copy(), np.zeros((nb, 3)), np.zeros((nb, 3)), np.zeros((nb, 3)), np.zeros((nb, 3)),
        np.flatnonzero(body >= 0).astype(np.int64),
    )  # fmt: skip
    zero = np.zeros((n, 2))
    nodes = Nodes(mesh.place, zero, zero.copy(), np.ones(n), zero.copy(), zero.copy(), body, zero.copy(),
                  np.zeros((n, 2), bool))  # fmt: skip
    model = ZonedModel(
        assembly, mesh, nodes, zones, tables, sides, contacts, rigid, law, soft, interface, np.zeros(Z_SIZE), 1.0,
        plane, warnings, losses(assembly, laws),
    )  # fmt: skip
    set_loads(model, loads.dead)
    return _with_masses(model, dynamic)


def make_zones(
    place: Array, cells: Index, materials: Sequence[Material | None], thickness: Array, plane: str
) -> tuple[Tables, Zones]:
    """Tables of all zone shapes and materials, and zones without strain; equal shapes share a table.

    Parameters
    ----------
    place : nodes [m], shape (n, 2)
    cells : nodes of every zone, counter-clockwise, shape (e, 4)
    materials, thickness : of every zone [m]
    """
    made: list[ZoneTables] = []
    rows: list[Array] = []
    known: dict[tuple, int] = {}
    of_material: dict[int, int] = {}
    e = len(cells)
    kind, material = np.zeros(e, np.int64), np.zeros(e, np.int64)
    for z, cell in enumerate(cells):
        made_of = materials[z]
        assert made_of is not None
        elastic = elasticity(made_of.young_modulus, made_of.poisson_ratio, plane)
        if id(made_of) not in of_material:
            of_material[id(made_of)] = len(rows)
            rows.append(material_row(made_of, plane == PLANE_STRAIN, elastic))
        material[z] = of_material[id(made_of)]
        r = place[cell] - place[cell].mean(axis=0)
        size = np.abs(r).max()
        key = (*np.round(r / (1e-9 * size)).astype(int).ravel().tolist(), float(f"{size:.9e}"), float(thickness[z]),
               id(made_of))  # fmt: skip
        if key not in known:
            known[key] = len(made)
            made.append(zone_tables(r, float(thickness[z]), elastic))
        kind[z] = known[key]
    zones = Zones(
        cells, kind, material, np.zeros((e, 4, 4)), np.zeros((e, 8)), np.zeros((e, 4)), np.zeros((e, 4), np.int64),
        np.zeros((e, 4)),
    )  # fmt: skip
    columns = [np.ascontiguousarray(np.stack([getattr(t, name) for t in made])) for name in ZoneTables._fields]
    return Tables._make([*columns, np.stack(rows)]), zones


def set_loads(model: ZonedModel, wrench: Array) -> None:
    """Apply a wrench per block [N, N m], shape (n, 6): on a zoned block as a rigid motion's inertia acts."""
    mesh, nodes, rigid = model.mesh, model.nodes, model.rigid
    volume = nodal_volume(model)
    nodes.load[:] = 0.0
    centroid = model.assembly.centroids[:, [0, 2]]
    number = {int(block): b for b, block in enumerate(np.flatnonzero(mesh.rigid))}
    for block in range(model.assembly.n_blocks):
        # a turn from x to z is one about -y
        fx, fz, moment = wrench[block, 0], wrench[block, 2], -wrench[block, 4]
        if mesh.rigid[block]:
            rigid.load[number[block]] = fx, fz, moment
            continue
        own = np.flatnonzero(mesh.block == block)
        v = volume[own]
        middle = v @ mesh.place[own] / v.sum()
        r = mesh.place[own] - middle
        lever = middle - centroid[block]
        moment -= lever[0] * fz - lever[1] * fx
        inertia = v @ (r * r).sum(axis=1)
        nodes.load[own, 0] = v * (fx / v.sum() - moment / inertia * r[:, 1])
        nodes.load[own, 1] = v * (fz / v.sum() + moment / inertia * r[:, 0])


def nodal_volume(model: ZonedModel) -> Array:
    """Volume of zones that goes with every node [m3], shape (n,)."""
    zones, tables = model.zones, model.tables
    out = np.zeros(len(model.nodes.place))
    # bilinear shares: a weight that is uniform in a zone goes to its nodes as their shape functions say
    s = 1.0 / np.sqrt(3.0)
    xi, eta = np.array([-1.0, 1.0, 1.0, -1.0]), np.array([-1.0, -1.0, 1.0, 1.0])
    shape = 0.25 * (1.0 + np.outer(xi * s, xi)) * (1.0 + np.outer(eta * s, eta))  # stress point, node
    np.add.at(out, zones.node, (tables.weight @ shape)[zones.kind])
    return out


def stiffness(model: ZonedModel) -> sparse.csr_matrix:
    """Elastic stiffness of zones and closed joints [N/m] over the freedoms x0, z0, x1, ... of all nodes."""
    zones, contacts = model.zones, model.contacts
    dof = np.stack([2 * zones.node, 2 * zones.node + 1], axis=2).reshape(-1, 8)
    k = model.tables.stiffness[zones.kind]
    rows, cols, data = [np.repeat(dof, 8, 1).ravel()], [np.tile(dof, (1, 8)).ravel()], [k.ravel()]
    b, size = contact_matrix(model), 2 * len(model.nodes.place)
    stiff = np.column_stack([model.law[contacts.joint, LAW_KN], model.law[contacts.joint, LAW_KS]])
    stiff *= contacts.area[:, None]
    whole = sparse.csr_matrix((np.concatenate(data), (np.concatenate(rows), np.concatenate(cols))), (size, size))
    return (whole + b.T @ sparse.diags(stiff.ravel()) @ b).tocsr()


def contact_matrix(model: ZonedModel) -> sparse.csr_matrix:
    """Opening and slip of every contact point from displacements of all nodes, shape (2 m, 2 n)."""
    contacts, sides, place = model.contacts, model.sides, model.nodes.place
    i, j = sides.node[contacts.segment], sides.node[contacts.segment + 1]
    run = place[j] - place[i]
    length = np.linalg.norm(run, axis=1)
    t = run / length[:, None]
    n = np.column_stack([t[:, 1], -t[:, 0]])
    along = (contacts.arc - sides.arc[contacts.segment]) / (
        sides.arc[contacts.segment + 1] - sides.arc[contacts.segment]
    )
    m = len(along)
    rows, cols, data = [], [], []
    parts = (
        (contacts.node[:, 0], 1.0 - contacts.share), (contacts.node[:, 1], contacts.share),
        (i, along - 1.0), (j, -along),
    )  # fmt: skip
    for which, direction in enumerate((n, t)):
        for node, share in parts:
            for r in range(2):
                rows.append(2 * np.arange(m) + which)
                cols.append(2 * node + r)
                data.append(share * direction[:, r])
    shape = (2 * m, 2 * len(place))
    return sparse.csr_matrix((np.concatenate(data), (np.concatenate(rows), np.concatenate(cols))), shape)


def freedoms(model: ZonedModel) -> sparse.csr_matrix:
    """Displacement of all nodes from the free unknowns: nodes of zones, then freedoms of rigid blocks not held."""
    nodes, rigid = model.nodes, model.rigid
    n = len(nodes.place)
    free = np.flatnonzero(nodes.body < 0)
    columns = np.stack([2 * np.arange(len(free)), 2 * np.arange(len(free)) + 1], axis=1)
    rows = np.stack([2 * free, 2 * free + 1], axis=1)
    rigid_rows, rigid_cols, data, count = [], [], [], 2 * len(free)
    for b, freedom in np.argwhere(~rigid.held):
        own = np.flatnonzero(nodes.body == b)
        r = nodes.place[own] - rigid.centre[b]
        if freedom < 2:
            rigid_rows.append(2 * own + freedom)
            data.append(np.ones(len(own)))
            rigid_cols.append(np.full(len(own), count))
        else:
            rigid_rows += [2 * own, 2 * own + 1]
            data += [-r[:, 1], r[:, 0]]
            rigid_cols += [np.full(len(own), count)] * 2
        count += 1
    return sparse.csr_matrix((
        np.concatenate([np.ones(rows.size), *data]),
        (np.concatenate([rows.ravel(), *rigid_rows]), np.concatenate([columns.ravel(), *rigid_cols])),
    ), (2 * n, count))  # fmt: skip


def stable_masses(k: sparse.csr_matrix, pairs: int) -> Array:
    """Masses per freedom for a step of 1 under local damping, from the largest eigenvalue of their stiffness.

    m proportional to the row sums of |K| (Gershgorin), one for both freedoms of a node; then scaled so that
    (1 + DAMPING) lambda_max(M^-1 K) <= 4 MARGIN.

    Parameters
    ----------
    k : stiffness over the free freedoms [N/m], symmetric
    pairs : nodes at the head of the freedoms, two each
    """
    mass = np.asarray(abs(k).sum(axis=1)).ravel()
    mass[: 2 * pairs] = np.repeat(mass[: 2 * pairs].reshape(-1, 2).max(axis=1), 2)
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


def _with_masses(model: ZonedModel, dynamic: bool) -> ZonedModel:
    """Masses of nodes and rigid blocks, and the step: real ones, or as large as a step of 1 needs."""
    nodes, rigid = model.nodes, model.rigid
    reach = freedoms(model)
    k = (reach.T @ stiffness(model) @ reach).tocsr()
    free = np.flatnonzero(nodes.body < 0)
    if not dynamic:
        mass = stable_masses(k, len(free))
        nodes.mass[free] = mass[: 2 * len(free) : 2]
        rigid.mass[~rigid.held] = mass[2 * len(free) :]
        # a smooth level joint is stiff across as soon as its block tilts a little: both directions as the stiffer one
        both = np.where(rigid.held[:, :2], 0.0, rigid.mass[:, :2]).max(axis=1, initial=0.0)
        rigid.mass[:, :2] = np.where(both > 0.0, both, 1.0)[:, None]
        return model
    density = np.array([b.density for b in model.assembly.blocks])
    nodes.mass[free] = (nodal_volume(model) * density[model.mesh.block])[free]
    x, numbers = model.assembly.arrays, np.flatnonzero(model.mesh.rigid)
    rigid.mass[:, 0] = rigid.mass[:, 1] = x.mass[numbers]
    rigid.mass[:, 2] = x.inertia[numbers, 1, 1]
    mass = np.concatenate([np.repeat(nodes.mass[free], 2), rigid.mass[~rigid.held]])
    if not (mass > 0.0).all():
        raise InputError("a block that moves has no mass: give its material, or the block, a density")
    return replace(model, dt=float(np.sqrt(MARGIN * 4.0 / largest_eigenvalue(k, mass))))
