"""An assembly as zones, contact points and rigid blocks: what the zones' kernels see, with masses and loads."""

from collections.abc import Iterable, Sequence

import numpy as np

from dem.kernels import LAW, LAW_SIZE
from dem.kernels import zone_plasticity as of
from dem.kernels.arrays import Index
from dem.kernels.zone_arrays import Z_SIZE, Nodes, QuadTable, Rigid, Zones
from dem.model.joints import Grid, JointOptions, losses, make_laws
from dem.zones.attach import make_contacts, make_sides
from dem.zones.element import SQUARE, ZoneTables, shape_values, zone_tables
from dem.zones.mesh import make_mesh
from dem.zones.zoned_model import AXES, SENSE, ZonedModel, free_stiffness, stable_masses
from limitmason.arrays import Array, Flags
from limitmason.checks import choice
from limitmason.deformable import PLANE_STRAIN, PLANE_STRESS, Elasticity
from limitmason.errors import InputError
from limitmason.mechanics.law import unit_tension
from limitmason.mechanics.law_table import refuse_ties
from limitmason.model import Assembly, Loads, Material

LEVEL = 1e-9
"""Load across the plane, over the largest load, up to which it is rounding [-]."""

ALIKE = 1e-9
"""Part of its size by which the nodes of two zones of one kind may differ [-]."""


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
    loads : dead loads act at once, spread over the zones of a block, see :func:`set_loads`
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
    refuse_ties(assembly, "a block cut into zones", "use rigid blocks")
    mesh = make_mesh(assembly, zone_size, stiff)
    if mesh.rigid.all():
        raise InputError(
            "no block has a material: give assembly.with_material(limitmason.Material(young_modulus=..., "
            "poisson_ratio=..., density=...)), or run rigid blocks"
        )
    laws, warnings = make_laws(assembly, loads.dead, options)
    if laws[:, LAW.dash].any():
        raise InputError("joint_options: zoned runs have local damping alone; leave the dashpot out")
    for name, wrench in (("dead", loads.dead), ("live", loads.live)):
        free = ~assembly.fixed
        outside = np.abs(wrench[free][:, [1, 3, 5]]).max(initial=0.0)
        if outside > LEVEL * max(np.abs(wrench[free]).max(initial=0.0), 1e-300):
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
    # number among the rigid blocks of the one that carries each node, -1 for a node of a zone
    body = np.full(n, -1, dtype=np.int64)
    for b, block in enumerate(np.flatnonzero(mesh.rigid)):
        body[mesh.block == block] = b
    zero = np.zeros((n, 2))
    nodes = Nodes(
        place=mesh.place, shift=zero, velocity=zero.copy(), mass=np.ones(n), load=zero.copy(), force=zero.copy(),
        body=body, before=zero.copy(), held=np.zeros((n, 2), bool),
    )
    model = ZonedModel(
        assembly=assembly, mesh=mesh, nodes=nodes, rigid=_rigid_blocks(assembly, mesh.rigid, body), law=law,
        soft=soft, interface=interface, total=np.zeros(Z_SIZE), dt=1.0, plane=plane, warnings=warnings,
        lost=losses(assembly, laws), tables=tables, zones=zones, sides=sides, contacts=contacts,
    )
    set_loads(model, loads)
    _scale_masses(model)
    return model


def _rigid_blocks(assembly: Assembly, rigid: Flags, body: Index) -> Rigid:
    """Rigid blocks at rest, without loads, with masses of 1.

    Parameters
    ----------
    rigid : whether a block is rigid, shape (n_blocks,)
    body : number among the rigid blocks of the one that carries each node, -1 for a node of a zone, shape (n,)
    """
    numbers, carried = np.flatnonzero(rigid), np.flatnonzero(body >= 0).astype(np.int64)
    nb = len(numbers)
    zero = np.zeros((nb, 3))
    held = assembly.held[numbers][:, AXES]
    return Rigid(
        centre=assembly.centroids[numbers][:, [0, 2]].copy(), shift=zero, velocity=zero.copy(), mass=np.ones((nb, 3)),
        load=zero.copy(), arms=np.zeros((nb, 2, 2)), held=held.copy(), drive=zero.copy(), before=zero.copy(),
        net=zero.copy(), total=zero.copy(), node=carried,
    )


def make_zones(
    place: Array, cells: Index, materials: Sequence[Material | None], thickness: Array, plane: str
) -> tuple[QuadTable, Zones]:
    """Tables of all zone shapes and materials, and zones without strain.

    Equal shapes share a table.

    Parameters
    ----------
    place : nodes [m], shape (n, 2)
    cells : nodes of every zone, counter-clockwise, shape (e, 4)
    materials : of every zone
    thickness : of every zone [m], shape (e,)
    plane : "plane stress" or "plane strain"
    """
    arms = place[cells] - place[cells].mean(axis=1, keepdims=True)
    size = np.abs(arms).max(axis=(1, 2))
    # materials that are used, and the row of each zone's among them
    known = {id(m): m for m in materials if m is not None}
    row = np.array([list(known).index(id(m)) for m in materials], dtype=np.int64)
    # zones are of one kind if size and form agree to nine digits, and thickness and material are the same. All of
    # these numbers are columns of ``key``
    form = np.round(arms / (ALIKE * size[:, None, None])).reshape(len(cells), -1)
    key = np.column_stack([[float(f"{s:.9e}") for s in size], form, thickness, row])
    _, first, kind = np.unique(key, axis=0, return_index=True, return_inverse=True)
    elastic = [Elasticity.of(m.young_modulus, m.poisson_ratio, plane).matrix for m in known.values()]
    made = [zone_tables(arms[z], float(thickness[z]), elastic[row[z]]) for z in first]
    rows = [material_row(m, plane == PLANE_STRAIN, e) for m, e in zip(known.values(), elastic, strict=True)]
    tables = {name: np.ascontiguousarray([getattr(t, name) for t in made]) for name in ZoneTables._fields}
    e = len(cells)
    zones = Zones(
        node=cells, kind=kind.ravel().astype(np.int64), material=row, spent=np.zeros((e, 4, 4)),
        relief=np.zeros((e, 8)), amplitude=np.zeros((e, 4)), flag=np.zeros((e, 4), np.int64), plastic=np.zeros((e, 4)),
    )
    return QuadTable(**tables, material=np.stack(rows)), zones


def material_row(material: Material, plane_strain: bool, elastic: Array) -> Array:
    """Numbers by which the kernels know a material of zones, shape (MAT_SIZE,).

    Parameters
    ----------
    material : elastic, or with cohesion and friction too: then it yields
    plane_strain : whether strain across the plane is held
    elastic : stress xx, zz, xz, yy by strain xx, zz, 2 xz, of :class:`limitmason.deformable.Elasticity` [Pa], shape
        (4, 3)
    """
    row = np.zeros(of.MAT_SIZE)
    row[of.MAT_STRAIN] = float(plane_strain)
    row[of.MAT_D], row[of.MAT_DN], row[of.MAT_G] = elastic[0, 0], elastic[0, 1], elastic[2, 2]
    # without strengths a material never yields; k and k_psi as without friction
    row[of.MAT_K], row[of.MAT_KPSI], row[of.MAT_C], row[of.MAT_FT] = 1.0, 1.0, np.inf, np.inf
    if material.cohesion is not None and material.friction_angle_deg is not None:
        sin, sin_psi = np.sin(np.deg2rad([material.friction_angle_deg, material.dilatancy_angle_deg]))
        row[of.MAT_K], row[of.MAT_KPSI] = (1.0 + sin) / (1.0 - sin), (1.0 + sin_psi) / (1.0 - sin_psi)
        row[of.MAT_C] = 2.0 * material.cohesion * np.sqrt(row[of.MAT_K])
        row[of.MAT_FT] = unit_tension(material)
        row[of.MAT_YIELDS] = 1.0
    return row


def set_loads(model: ZonedModel, loads: Loads) -> None:
    """Apply the dead loads to a model.

    On a zoned block they are spread by volume over its nodes, which carry them along: f(x) = F / V + A (x - middle),
    with A such that the sum of r f^T is that of the loads. A couple without arms is a turning field about the middle.
    """
    mesh, nodes, rigid = model.mesh, model.nodes, model.rigid
    volume = nodal_volume(model)
    nodes.load[:] = 0.0
    centroid = model.assembly.centroids[:, [0, 2]]
    number = {int(block): b for b, block in enumerate(np.flatnonzero(mesh.rigid))}
    arms = loads.dead_arms[:, [0, 2]][:, :, [0, 2]]
    wrench = loads.dead[:, AXES] * SENSE  # x, z and moment from x to z
    for block in range(model.assembly.n_blocks):
        if mesh.rigid[block]:
            rigid.load[number[block]], rigid.arms[number[block]] = wrench[block], arms[block]
            continue
        own = np.flatnonzero(mesh.block == block)
        v = volume[own]
        # nodes from their middle; the loads' sum of r f^T is about the centroid
        middle = v @ mesh.place[own] / v.sum()
        r = mesh.place[own] - middle
        force, p = wrench[block, :2], arms[block]
        # moment from x to z that the arms do not hold; A that gives the arms about the middle, and a turning field
        couple = wrench[block, 2] - (p[0, 1] - p[1, 0])
        spread = np.linalg.solve((v * r.T) @ r, p - np.outer(middle - centroid[block], force))
        turning = couple / (v @ (r * r).sum(axis=1)) * np.array([[0.0, 1.0], [-1.0, 0.0]])
        nodes.load[own] = v[:, None] * (force / v.sum() + r @ (spread + turning))


def nodal_volume(model: ZonedModel) -> Array:
    """Volume of the zones of a model that goes with every node [m3], shape (n,)."""
    zones, tables = model.zones, model.tables
    out = np.zeros(len(model.nodes.place))
    # linear shares: a weight that is uniform in a zone goes to its nodes as their shape functions say
    s = 1.0 / np.sqrt(3.0)
    shape = shape_values(s * SQUARE)  # stress point, node
    np.add.at(out, zones.node, (tables.weight @ shape)[zones.kind])
    return out


def _scale_masses(model: ZonedModel) -> None:
    """Write masses of nodes and rigid blocks as large as a step of 1 needs."""
    nodes, rigid = model.nodes, model.rigid
    free = np.flatnonzero(nodes.body < 0)
    mass = stable_masses(free_stiffness(model), len(free))
    nodes.mass[free] = mass[: 2 * len(free) : 2]
    rigid.mass[~rigid.held] = mass[2 * len(free) :]
    # a smooth level joint is stiff across as soon as its block tilts a little: all directions as the stiffest one. It
    # is 1 where all are held; displacements and turns are taken apart
    for part in (slice(0, 2), slice(2, None)):
        most = np.where(rigid.held[:, part], 0.0, rigid.mass[:, part]).max(axis=1, initial=0.0)
        rigid.mass[:, part] = np.where(most > 0.0, most, 1.0)[:, None]
