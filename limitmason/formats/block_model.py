"""Block models and problems of COMPAS (compas_dem): read, written, and solved by the methods of this package.

    from limitmason import formats
    results = formats.solve_problem(problem, "associative")
    results.metadata["multiplier"], results.metadata["certificate"]

Needs the extra ``limitmason[compas]``. Units of both are SI, z up, compression positive.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import numpy as np

from limitmason.answers.results import Prediction
from limitmason.constants import GRAVITY
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.motion import largest_rates
from limitmason.methods import LIMIT, predict
from limitmason.model import Assembly, Joint, Loads

SHOWN = 0.01
"""Largest displacement of a mechanism in the results, over the size of the structure [-]."""


def _needs(name: str) -> Any:
    from importlib import import_module

    try:
        return import_module(name)
    except ImportError:
        message = f"block models of COMPAS need {name.partition('.')[0]}: pip install 'limitmason[compas]'"
        raise ImportError(message) from None


def from_block_model(model: Any, joint: Joint, *, density: float | None = None) -> Assembly:
    """Assembly of a block model.

    Contacts are found anew where plane faces meet, within this package's tolerance.

    Parameters
    ----------
    model : ``compas_dem.models.BlockModel``; blocks are named by their node in its graph, supports are held
    joint : law of every joint
    density : of blocks without a material [kg/m3]

    Raises
    ------
    InputError
        For a model without blocks, a block without a density, and solids that :meth:`Assembly.from_polyhedra` refuses.
    """
    elements = list(model.elements())
    if not elements:
        raise InputError("the block model has no blocks")
    solids, densities, names = [], [], []
    for element in elements:
        vertices, faces = element.modelgeometry.to_vertices_and_faces()
        own = density if element.material is None else element.material.density
        if own is None:
            raise InputError(f"block {element.graphnode} has no material with a density: set one, or give density=")
        solids.append((np.asarray(vertices, dtype=float), [list(f) for f in faces]))
        densities.append(float(own))
        names.append(str(element.graphnode))
    fixed = [n for n, e in zip(names, elements, strict=True) if e.is_support]
    return Assembly.from_polyhedra(solids, joint=joint, density=densities, fixed=fixed, names=names)


def to_block_model(assembly: Assembly) -> Any:
    """The blocks of an assembly as a ``compas_dem.models.BlockModel``.

    Densities and supports are passed on.

    Joints, ties and loads are left out: there they belong to a problem. Contacts are computed by the model itself.

    Raises
    ------
    NotApplicable
        For blocks of several convex pieces and blocks that are held in some directions only, which it cannot hold.
    """
    models, mesh = _needs("compas_dem.models"), _needs("compas.datastructures")
    material = _needs("compas_dem.material.generic")
    model, of_density = models.BlockModel(), {}
    for i, block in enumerate(assembly.blocks):
        if len(block.parts) > 1:
            raise NotApplicable(f"block {block.name!r} has {len(block.parts)} convex pieces, a COMPAS block is one")
        if assembly.held[i].any() and not assembly.fixed[i]:
            raise NotApplicable(f"block {block.name!r} is held in some directions, a COMPAS support in all")
        vertices, faces = block.parts[0]
        node = model.add_block_from_mesh(mesh.Mesh.from_vertices_and_faces(vertices.tolist(), [list(f) for f in faces]))
        element = model.graph.node_element(node)
        element.is_support, element.name = bool(assembly.fixed[i]), block.name
        if block.density not in of_density:
            of_density[block.density] = material.GenericMaterial(density=block.density)
            model.add_material(of_density[block.density])
        model.assign_material(of_density[block.density], element=element)
    return model


def joint_of(problem: Any) -> Joint:
    """The Mohr-Coulomb law of a problem's contacts as a joint, without dilatancy.

    Raises
    ------
    InputError
        Where the problem has no contact model.
    """
    law = problem.contact_properties.contact_model
    if law is None:
        raise InputError("the problem has no contact model: set_contact_model('MohrCoulomb', mu=...), or give joint=")
    return Joint(law.phi, cohesion=float(law.c or 0.0), tensile_strength=float(law.t_c or 0.0))


def loads_of(problem: Any, assembly: Assembly, live: str | Iterable[str] | None = None) -> Loads:
    """Loads of a problem: the weight of all blocks is dead, its groups of boundary conditions live or dead.

    Parameters
    ----------
    problem : ``compas_dem.problem.Problem``
    assembly : of its model, see :func:`from_block_model`
    live : names of the groups that the multiplier scales; None for all of them, the others are dead

    Raises
    ------
    InputError
        For names of no group, a block that is not there, groups with different gravities, and no live group.
    NotApplicable
        For prescribed displacements.
    """
    groups = list(problem.boundary_conditions)
    known = [g.name for g in groups]
    wanted = set(known) if live is None else {live} if isinstance(live, str) else set(live)
    if not wanted <= set(known) or not groups or not wanted:
        raise InputError(f"live names the groups {sorted(wanted)}; the problem has {', '.join(known) or 'none'}")
    pulls = {float(g.g) for g in groups}
    if len(pulls) > 1:
        raise InputError(f"the groups of boundary conditions have different gravities: {sorted(pulls)}")
    loads = Loads.weight(assembly).scaled(dead=pulls.pop() / GRAVITY)
    blocks = {e.graphnode: e for e in problem.model.elements()}
    for group in groups:
        case = "live" if group.name in wanted else "dead"
        if group.displacements:
            raise NotApplicable(
                f"group {group.name!r} prescribes displacements: settlement_analysis, dem.push and pushover take them"
            )
        for body in group.body_forces:
            loads = loads.with_body_force(assembly, np.asarray(body.acceleration, float) / GRAVITY, case=case)
        for point in group.point_loads:
            _known(point.block_index, blocks, group.name)
            force = point.force or (0.0, 0.0, 0.0)
            loads = loads.with_point_load(assembly, str(point.block_index), force, at=point.point, case=case)
            if point.moment is not None:
                wrench = np.zeros((assembly.n_blocks, 6))
                wrench[assembly.block_index(str(point.block_index)), 3:] = point.moment
                none = np.zeros_like(wrench)
                loads = loads + (Loads(none, wrench) if case == "live" else Loads(wrench, none))
        for spread in group.surface_loads:
            _known(spread.block_index, blocks, group.name)
            mesh = blocks[spread.block_index].modelgeometry
            force = np.asarray(spread.load, float) * mesh.face_area(spread.face_index)
            at = np.asarray(mesh.face_polygon(spread.face_index).centroid, float)
            loads = loads.with_point_load(assembly, str(spread.block_index), force, at=at, case=case)
    return loads


def _known(node: int, blocks: Any, group: str) -> None:
    if node not in blocks:
        raise InputError(f"group {group!r} loads block {node}, which the model does not have")


def solve_problem(
    problem: Any,
    method: str = LIMIT,
    *,
    live: str | Iterable[str] | None = None,
    joint: Joint | None = None,
    density: float | None = None,
    **options: Any,
) -> Any:
    """Solve a COMPAS problem by a method of this package, as its own solvers do.

    Results with forces and motion.

    Parameters
    ----------
    problem : ``compas_dem.problem.Problem``
    method : "associative", "non-associative", "dem", "mechanisms" or another of ``lm.methods.available_methods()``
    live : see :func:`loads_of`
    joint : instead of the problem's contact model, where it lacks what the method needs (dilatancy, stiffness)
    density : see :func:`from_block_model`
    options : of the method

    Notes
    -----
    ``Problem.solve`` of compas_dem 0.6 takes six solvers by name (LMGC90, 3DEC, CRA, RBE, PRD, BLA) and offers no place
    to register another one; so this function stands beside it and returns what it returns.

    Returns
    -------
    compas_dem.problem.Results
        ``metadata`` holds multiplier, bound, status, certificate, whether it is accepted, warnings and what to cite.
        ``transformation`` of a block is its motion in the mechanism, the largest displacement a hundredth of the
        structure; resultants of an edge act on its second block, compression positive.

    Raises
    ------
    InputError, NotApplicable, NotConverged
        As the functions above and the method itself.
    ImportError
        Without the extra ``limitmason[compas]``.
    """
    kept = problem.contact_properties.joint_model
    assembly = from_block_model(problem.model, joint_of(problem) if joint is None else joint, density=density)
    loads = loads_of(problem, assembly, live)
    found = predict(assembly, loads, method, **options)
    notes = list(found.warnings)
    if kept is not None and joint is None:
        notes.append("the joint model (kn, kt in N/m) is left out: a stiffness per area is needed, give joint=")
    results = _needs("compas_dem.problem").Results(model_id=str(problem.model.guid), problem_id=str(problem.guid))
    results.metadata |= {
        "solver": "limitmason", "method": found.method, "multiplier": float(found.collapse_multiplier),
        "bound": str(found.bound), "solver_status": str(found.status), "warnings": notes,
        "cite": list(found.cite().keys),
    }  # fmt: skip
    if found.certificate is not None:
        results.metadata["certificate"] = asdict(found.certificate)
        results.metadata["accepted"] = bool(found.certificate.accepted)
    _write_motion(results, assembly, found)
    _write_forces(results, assembly, found)
    return results


def _write_motion(results: Any, assembly: Assembly, found: Prediction) -> None:
    geometry = _needs("compas.geometry")
    twists = np.zeros((assembly.n_blocks, 6)) if found.mechanism is None else np.array(found.mechanism.twists)
    corners = np.vstack([b.vertices for b in assembly.blocks])
    fastest = float(largest_rates(assembly, twists).max(initial=0.0))
    scale = SHOWN * float(np.linalg.norm(np.ptp(corners, axis=0))) / max(fastest, 1e-300)
    for block, twist in zip(assembly.blocks, scale * twists, strict=True):
        angle = float(np.linalg.norm(twist[3:]))
        turn = geometry.Rotation.from_axis_and_angle(
            (twist[3:] / angle).tolist() if angle > 0.0 else [0.0, 0.0, 1.0], angle, point=block.centroid.tolist()
        )
        moved = geometry.Translation.from_vector(twist[:3].tolist()) * turn
        results.set_node(int(block.name), "transformation", geometry.Transformation(moved.matrix))


def _write_forces(results: Any, assembly: Assembly, found: Prediction) -> None:
    forces = found.resultants
    if forces is None:
        return
    geometry = _needs("compas.geometry")
    contact = _needs("compas_dem.interactions").FrictionContact
    x = assembly.arrays
    for k, joint in enumerate(assembly.interfaces):
        edge = tuple(int(assembly.blocks[n].name) for n in (joint.block_a, joint.block_b))
        rows = np.flatnonzero(forces.point_interface == k)
        axes = np.stack([x.tangent_1[k], x.tangent_2[k], x.normal[k]])
        local = forces.point_force[rows] @ axes.T
        total = forces.point_force[rows].sum(axis=0)
        polygon = np.asarray(joint.polygon, dtype=float)
        frame = geometry.Frame(polygon.mean(axis=0).tolist(), axes[0].tolist(), axes[1].tolist())
        table = [{"c_np": max(n, 0.0), "c_nn": max(-n, 0.0), "c_u": u, "c_v": v} for u, v, n in local.tolist()]
        points = forces.point_position[rows].tolist()
        values: dict[str, Any] = {
            "contact_polygon": geometry.Polygon(polygon.tolist()), "contact_frame": frame, "contact_points": points,
            "face_contact": True, "force_magnitude": float(np.linalg.norm(total)), "resultant_global": total.tolist(),
            "resultant_local": local.sum(axis=0).tolist(), "force_normal": local[:, 2].tolist(),
            "force_tangent1": local[:, 0].tolist(), "force_tangent2": local[:, 1].tolist(),
        }  # fmt: skip
        if len(rows) == len(polygon):
            drawn = contact(points=[geometry.Point(*p) for p in points], frame=frame)
            drawn.forces = table
            values["contact_data"] = drawn
        for name, value in values.items():
            results.set_edge(edge, name, value)
