"""An assembly as zones, contact points and rigid blocks: what the zones' kernels see, with masses and loads."""

from collections.abc import Hashable, Iterable, Sequence

import numpy as np

from dem.kernels import LAW, LAW_SIZE
from dem.kernels.arrays import Index
from dem.kernels.zone_arrays import Z_SIZE, Nodes, QuadTable, Rigid, Zones
from dem.model.joints import Grid, JointOptions, losses, make_laws
from dem.zones.attach import make_contacts, make_sides
from dem.zones.element import SQUARE, ZoneTables, shape_values, zone_tables
from dem.zones.material_row import material_row
from dem.zones.mesh import make_mesh
from dem.zones.stable import freedoms, stable_masses, stiffness
from dem.zones.zoned_model import AXES, SENSE, ZonedModel
from limitmason.arrays import Array, Flags
from limitmason.checks import choice
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, Elasticity
from limitmason.errors import InputError
from limitmason.mechanics.law_table import refuse_ties
from limitmason.model import Assembly, Loads, Material


def make_model(
    assembly: Assembly,
    loads: Loads,
    *,
    zone_size: float,
    plane: str = PLANE_STRESS,
    contact_points: Grid | None = None,
    joint_options: JointOptions | None = None,
    stiff: Iterable[int] = (),
) -> ZonedModel:
    """Zones of the blocks that have a material.

    Blocks that are held, or have none, are rigid.

    Parameters
    ----------
    assembly : of blocks that are convex prisms along y
    loads : dead loads act at once: weight, and wrenches spread over the zones of a block as a rigid motion would be
    zone_size : largest edge of a zone [m]
    plane : "plane stress" or "plane strain"
    contact_points : see :func:`dem.zones.attach.make_contacts`
    joint_options : as in the rigid DEM; a dashpot is refused
    stiff : numbers of further blocks that are rigid, whatever their material: plates that are driven

    Raises
    ------
    InputError
        For a state of stress that does not exist, no block with a material, a zone larger than its block, loads out of
        the plane, and as :func:`dem.zones.mesh.make_mesh`.
    """
    options = joint_options or JointOptions()
    choice("plane (stress= of a push)", plane, (PLANE_STRESS, PLANE_STRAIN))
    if options.dashpot is not None and np.any(np.asarray(list(
        options.dashpot.values() if hasattr(options.dashpot, "values") else np.atleast_1d(options.dashpot)
    ), dtype=float) > 0.0):
        raise InputError("joint_options: zoned runs have local damping alone; leave the dashpot out")
    refuse_ties(assembly, "a block cut into zones", "use rigid blocks")
    mesh = make_mesh(assembly, zone_size, stiff)
    if mesh.rigid.all():
        raise InputError(
            "no block has a material: give assembly.with_material(limitmason.Material(young_modulus=..., "
            "poisson_ratio=..., density=...)), or run rigid blocks"
        )
    laws, warnings = make_laws(assembly, loads.dead, options)
    for name, wrench in (("dead", loads.dead), ("live", loads.live)):
        free = ~assembly.fixed
        outside = np.abs(wrench[free][:, [1, 3, 5]]).max(initial=0.0)
        if outside > 1e-9 * max(np.abs(wrench[free]).max(initial=0.0), 1e-300):
            raise InputError(
                f"{name} loads act out of the x-z plane, in which zoned blocks stay: take simply deformable blocks, "
                "which strain and bend in space"
            )
    materials = [assembly.blocks[block].material for block in mesh.zone_block]
    tables, zones = make_zones(mesh.place, mesh.zones, materials, mesh.thickness[mesh.zone_block], plane)
    sides = make_sides(mesh)
    contacts, interface = make_contacts(assembly, mesh, sides, contact_points)
    law = np.ascontiguousarray(laws[interface])
    soft = bool((law[:, [LAW.by_opening, LAW.by_slip, *range(len(LAW), LAW_SIZE)]] > 0.0).any())
    n = len(mesh.place)
    body = np.full(n, -1, dtype=np.int64)
    for b, block in enumerate(np.flatnonzero(mesh.rigid)):
        body[mesh.block == block] = b
    zero = np.zeros((n, 2))
    nodes = Nodes(mesh.place, zero, zero.copy(), np.ones(n), zero.copy(), zero.copy(), body, zero.copy(),
                  np.zeros((n, 2), bool))
    model = ZonedModel(
        assembly=assembly, mesh=mesh, nodes=nodes, rigid=_rigid_blocks(assembly, mesh.rigid, body), law=law,
        soft=soft, interface=interface, total=np.zeros(Z_SIZE), dt=1.0, plane=plane, warnings=warnings,
        lost=losses(assembly, laws), tables=tables, zones=zones, sides=sides, contacts=contacts,
    )
    set_loads(model, loads.dead)
    _scale_masses(model)
    return model


def _rigid_blocks(assembly: Assembly, rigid: Flags, body: Index) -> Rigid:
    """Rigid blocks at rest.

    Parameters
    ----------
    rigid : whether a block is, shape (n_blocks,)
    body : number of the rigid block that carries each node, -1 for a node of a zone
    """
    numbers, own = np.flatnonzero(rigid), np.flatnonzero(body >= 0).astype(np.int64)
    nb = len(numbers)
    flat = np.zeros((nb, 3))
    held = assembly.held[numbers][:, [0, 2, 4]]
    return Rigid(
        assembly.centroids[numbers][:, [0, 2]], flat, flat.copy(), np.ones((nb, 3)), flat.copy(), held.copy(),
        flat.copy(), flat.copy(), flat.copy(), flat.copy(), own,
    )


class _Shapes:
    """Tables of the zones' shapes and materials, one for all that are equal.

    Parameters
    ----------
    place : nodes [m]
    state : "plane stress" or "plane strain"
    """

    def __init__(self, place: Array, state: str) -> None:
        self.place, self.state = place, state
        self.made: list[ZoneTables] = []
        self.elastic: list[Array] = []
        self.known: dict[Hashable, int] = {}

    def of(self, cell: Index, material: Material, thickness: float) -> int:
        """Where the tables of a zone stand in ``made``; they are made for the first zone of its kind.

        Zones are of one kind if size and form agree to nine digits, and thickness and material are the same.
        """
        arms = self.place[cell] - self.place[cell].mean(axis=0)
        size = np.abs(arms).max()
        form = np.round(arms / (1e-9 * size)).astype(int).ravel().tolist()
        key = (float(f"{size:.9e}"), *form, thickness, id(material))
        if key not in self.known:
            self.known[key] = len(self.made)
            self.elastic.append(Elasticity.of(material.young_modulus, material.poisson_ratio, self.state).matrix)
            self.made.append(zone_tables(arms, thickness, self.elastic[-1]))
        return self.known[key]

    def column(self, name: str) -> Array:
        """One table of all of them, by its name in :class:`ZoneTables`."""
        return np.ascontiguousarray(np.stack([getattr(t, name) for t in self.made]))


def make_zones(
    place: Array, cells: Index, materials: Sequence[Material | None], thickness: Array, plane: str
) -> tuple[QuadTable, Zones]:
    """Tables of all zone shapes and materials, and zones without strain.

    Equal shapes share a table.

    Parameters
    ----------
    place : nodes [m], shape (n, 2)
    cells : nodes of every zone, counter-clockwise, shape (e, 4)
    materials, thickness : of every zone [m]
    """
    shapes, rows, of_material = _Shapes(place, plane), list[Array](), dict[int, int]()
    e = len(cells)
    kind, row = np.zeros(e, np.int64), np.zeros(e, np.int64)
    for z, (cell, material) in enumerate(zip(cells, materials, strict=True)):
        assert material is not None
        kind[z] = shapes.of(cell, material, float(thickness[z]))
        if id(material) not in of_material:
            of_material[id(material)] = len(rows)
            rows.append(material_row(material, plane == PLANE_STRAIN, shapes.elastic[kind[z]]))
        row[z] = of_material[id(material)]
    zones = Zones(
        cells, kind, row, np.zeros((e, 4, 4)), np.zeros((e, 8)), np.zeros((e, 4)), np.zeros((e, 4), np.int64),
        np.zeros((e, 4)),
    )
    return QuadTable(**{name: shapes.column(name) for name in ZoneTables._fields}, material=np.stack(rows)), zones


def set_loads(model: ZonedModel, wrench: Array) -> None:
    """Apply a wrench per block [N, N m], shape (n, 6).

    On the nodes of a zoned block it is spread as the inertia of a rigid motion: the force by volume, and about their
    middle a turning field that gives the moment.
    """
    mesh, nodes, rigid = model.mesh, model.nodes, model.rigid
    volume = nodal_volume(model)
    nodes.load[:] = 0.0
    centroid = model.assembly.centroids[:, [0, 2]]
    number = {int(block): b for b, block in enumerate(np.flatnonzero(mesh.rigid))}
    for block in range(model.assembly.n_blocks):
        own_wrench = wrench[block, AXES] * SENSE
        if mesh.rigid[block]:
            rigid.load[number[block]] = own_wrench
            continue
        own = np.flatnonzero(mesh.block == block)
        v = volume[own]
        middle = v @ mesh.place[own] / v.sum()
        r = mesh.place[own] - middle
        force, moment = own_wrench[:2], own_wrench[2]
        lever = middle - centroid[block]
        nodes.load[own] = np.outer(v / v.sum(), force)
        turning = (moment - lever[0] * force[1] + lever[1] * force[0]) / (v @ (r * r).sum(axis=1))
        nodes.load[own] += v[:, None] * turning * np.column_stack([-r[:, 1], r[:, 0]])


def nodal_volume(model: ZonedModel) -> Array:
    """Volume of zones that goes with every node [m3], shape (n,)."""
    zones, tables = model.zones, model.tables
    out = np.zeros(len(model.nodes.place))
    # linear shares: a weight that is uniform in a zone goes to its nodes as their shape functions say
    s = 1.0 / np.sqrt(3.0)
    shape = shape_values(s * SQUARE)  # stress point, node
    np.add.at(out, zones.node, (tables.weight @ shape)[zones.kind])
    return out


def _scale_masses(model: ZonedModel) -> None:
    """Masses of nodes and rigid blocks as large as a step of 1 needs."""
    nodes, rigid = model.nodes, model.rigid
    reach = freedoms(model)
    k = (reach.T @ stiffness(model) @ reach).tocsr()
    free = np.flatnonzero(nodes.body < 0)
    mass = stable_masses(k, len(free))
    nodes.mass[free] = mass[: 2 * len(free) : 2]
    rigid.mass[~rigid.held] = mass[2 * len(free) :]
    # a smooth level joint is stiff across as soon as its block tilts a little: all directions as the stiffest one
    for part in (slice(0, 2), slice(2, None)):
        most = np.where(rigid.held[:, part], 0.0, rigid.mass[:, part]).max(axis=1, initial=0.0)
        rigid.mass[:, part] = np.where(most > 0.0, most, 1.0)[:, None]
