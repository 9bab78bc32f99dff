"""The call: from a model and its loads to a capacity curve."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from limitmason.answers.references import data_behind
from limitmason.answers.results import Prediction
from limitmason.arrays import Array, Flags, Index
from limitmason.capacity import path
from limitmason.capacity.certified import certified_curve
from limitmason.capacity.contact_generations import Generations
from limitmason.capacity.contact_search.crossing import faces_that_meet
from limitmason.capacity.contacts import (
    PathContacts,
    carried_firmly,
    firmness,
    first_contacts,
    points_of_path,
    turned_over,
)
from limitmason.capacity.controls import as_one_assembly, control_row, refuse_undriven, turns_back, with_moving_support
from limitmason.capacity.deformable import CondensedShapes, deformation, lumped, plane_of
from limitmason.capacity.initial_gaps import begun_with, of_forces, of_gaps
from limitmason.capacity.kinematics import at_rest, make_bodies
from limitmason.capacity.outcomes import PathEnd
from limitmason.capacity.papers import PAPERS
from limitmason.capacity.path_loads import PathLoads
from limitmason.capacity.path_state import Structure
from limitmason.capacity.path_warnings import followed_warnings, landed_warnings, stiffness_warnings
from limitmason.capacity.point_law import ElastoplasticLaw
from limitmason.capacity.refusals import (
    refuse,
    refuse_other_classes,
    refuse_partial_rotations,
    refuse_with_initial,
)
from limitmason.capacity.result import PushoverCurve
from limitmason.capacity.slip_softening import softening_by_plastic_slip
from limitmason.capacity.start import begin
from limitmason.capacity.step_length import Steps, senses
from limitmason.capacity.system import System
from limitmason.capacity.ties import make_ties
from limitmason.checks import choice, finite, listener
from limitmason.deformable.levels import LUMPED, RIGID, RITZ, SIMPLY_DEFORMABLE
from limitmason.display.progress import watched
from limitmason.errors import InputError, NotApplicable
from limitmason.mechanics.contact_points import ContactPoints, Grid
from limitmason.mechanics.default_stiffness import joint_stiffness
from limitmason.mechanics.equilibrium import degrees_of_freedom
from limitmason.mechanics.joint_shapes import soft_block_warnings
from limitmason.mechanics.law import interface_law
from limitmason.mechanics.law_table import refuse_ties
from limitmason.mechanics.model_notes import tension_above_apex
from limitmason.mechanics.plane import Plane, contacts_stay_in_plane
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.model.support_motion import Group
from limitmason.storage.interrupts import handed_on

ANEW, FIRST = "anew", "first"


@of_model
@watched("pushover")
def pushover(
    assembly: Assembly,
    loads: Loads,
    *,
    control: str | tuple[Group, str] = "live",
    to: float | None = None,
    blocks: str = RIGID,
    stress: str | None = None,
    contact_model: str | None = None,
    grid: Grid | float | Mapping[str, Grid] | None = None,
    contacts: str | None = None,
    gaps: ArrayLike | None = None,
    stiffness: float | tuple[float, float] | None = None,
    steps: Steps | None = None,
    start: PushoverCurve | None = None,
    initial: Prediction | None = None,
    progress: Callable[[str], None] | None = None,
) -> PushoverCurve:
    """Capacity curve of blocks with elastic, unilateral, frictional joints.

    Load against displacement.

    The joint law, the contact points and the stiffness are those of the DEM; rotations are finite. The dead load is
    applied first, to the unstressed structure.

    Parameters
    ----------
    assembly, loads : the problem; loads keep their direction and act at points that move with their blocks
    control : what is prescribed: "live", the mean displacement along the live forces, sum(live . shift) / sum |live|,
        of the blocks' centroids, also where a force acts off them (:meth:`.PushoverCurve.displacement_of` is at a
        point); or (block, "x"), "y" or "z" of its centroid, of the mean over the block where it deforms. A block that
        is held along this axis is a support that moves: the loads are then dead only, and the load of the curve is the
        force along the axis with which the support acts on the structure [N]. A list of wholly held blocks moves as
        one, and is one block of the curve's structure, under the name of its first
    to : control displacement from the state under dead load [m]; negative for the other sense; None goes on until the
        load has fallen 0.2 % below its first limit point, or stayed below it for 0.02 blocks, at most to half a block;
        a support needs a number; 0 without live loads ends in the state under dead load, the curve's only sample
    blocks : "rigid"; "lumped", rigid with the compliance of the units' material in the joints
        (:func:`limitmason.mechanics.lumped_units.with_lumped_units`); "simply deformable", blocks that strain and bend,
        the shapes of :func:`dem.push`'s; "ritz", elastic bodies in polynomials, condensed to their joint points
        (:func:`limitmason.deformable.polynomial_block`). Blocks without a material, and held ones, stay rigid
    stress : of blocks that deform: "plane stress", the default of a problem in one plane; "plane strain"; or "solid"
        in space, the default of all others
    contact_model, grid : as in :func:`limitmason.mechanics.contact_points.contact_points`; "grid" where a grid is
        given; the model of ``initial`` where this is given (its ``grid`` is to be repeated). Else what the joints need:

        - "lobatto" with 15 points on a side where joints crush or lose strength. Corners alone carry twice and three
          times as much.
        - "lobatto" with 7 points on a side in space where other joints have plastic cohesion or tension. At the corners
          alone cohesion resists twisting 1.85 times as much as on a square face.
        - Else "vertices": rigid blocks rock on the ends of their joints, as in limit analysis. Faces of finite
          stiffness give way there, which lowers the largest load by up to 20 %. Where a stiffness is named the curve
          warns from 1.5 % on. Two points on a side also turn three times too stiffly, which every such curve says.
    contacts : "anew" as in the notes, the default for rigid and lumped blocks; "first" keeps the points of the
        undeformed joints for ever, the default for blocks that deform. Named, it also keeps the frame of a joint on its
        block a, as :func:`dem.collapse` and programs of contact pairs do; else the firmer block carries it
    gaps : opening of every contact point in the reference pose [m], 0 or more, in the order of
        :func:`limitmason.mechanics.contact_points.contact_points` with the same settings; faces that touch by default.
        See :func:`imperfection_ensemble`
    stiffness : kn, or (kn, ks), of every joint [Pa/m]; by default that of the joints, else the DEM's default
    steps : see :class:`Steps`
    start : curve whose last state is gone on from, for the same model, contact points and dead load; its live load must
        be the same up to a factor, which may be negative, unless that state bears none, as of ``to=0``. ``to`` counts
        from the state under dead load, as before
    initial : prediction of limit analysis on the same points, with whose joint forces the path begins, at its
        multiplier in the reference pose and along its mechanism: joints misfit by what their springs need for these
        forces. The way to states that no path from the unstressed structure reaches; see :mod:`.initial_gaps`
    progress : called with a line per step

    Returns
    -------
    PushoverCurve
        ``status`` is "reached", "limit point passed", "slides on at constant load", "overturned" (the multiplier came
        back to zero), "open joints still bear bond", "stopped", "interrupted" (by Ctrl-C) or "cannot stand
        under dead load". The first limit point at psi < phi is that of the path from the unstressed wall: an estimate,
        no bound.

    Raises
    ------
    NotApplicable
        For joints whose tension unloads to the origin, for blocks of which some rotations are held, in space, for
        contacts found anew between blocks that deform, and for ties of such blocks.
    InputError
        For a live load without forces, and for a control, length or stiffness that makes no sense.

    Notes
    -----
    A contact point stays under the corner of the block that makes it, its normal on the face of the other. Corners that
    leave a face or come to another are found after each step (an event of the curve), as are places where sides of two
    faces cross in space. Points inside a grid stay with the block that carries them until they have left the face; in
    space they then go on at its side. A path of rigid blocks ends, and names two of them, where these would go through
    each other without a point. Blocks deform by small strains, in axes that turn with them. Body forces act
    on no shape, exactly: under its own weight a block is strained by its joints. Point loads and pressures work on a
    shape by its mean gradient, as if they were spread over the block: what is local at them is left out. Ties
    are unstressed in the reference pose, or bear the tensions of ``initial``; they follow their ends at any rotation,
    yield at their strength and hang loose when they shorten.

    Joints without residual values and fracture energies are perfectly plastic, and tension that opens one leaves no
    damage: a path ends where open joints still bear such a bond to an effect, and names the joint. Over fracture
    energies strength is lost along the step, which ends on the falling law. Where it is lost at once the step ends at
    the first point that reaches its strength; that point and those it overloads break at the same displacement: two
    samples, the second a jump with its energy in ``curve.breaks``. The load then often recovers: with such joints
    ``to=None`` ends where a fifth of the largest load is lost, to ``steps.peak``.
    """
    begun, say = time.perf_counter(), listener("progress", progress, "a line of text") or (lambda _: None)
    # what is refused first; then the model as it is followed, its points and springs, its equations, and the path
    refuse(assembly)
    refuse_other_classes(steps, start, initial)
    deforming = blocks in (SIMPLY_DEFORMABLE, RITZ)
    anew = finds_contacts_anew(assembly, blocks, contacts)
    if blocks == LUMPED:
        assembly = lumped(assembly, stiffness)
    loads, settles = _settling(loads, control, to)
    assembly, loads, control = as_one_assembly(assembly, loads, control)
    assembly, loads, moving = with_moving_support(assembly, loads, control, to)
    if initial is not None:
        refuse_with_initial(deforming, not_as_built=not (gaps is None and start is None and moving is None))
    plane, stress = followed_in(assembly, loads, blocks, stress, anew=anew and initial is None)
    points, of_points = points_of_path(assembly, plane, contact_model, grid, initial)
    if plane is None:
        refuse_partial_rotations(assembly)
    kn, ks, warnings = joint_stiffness(assembly, loads.dead, stiffness)
    ties, of_ties = make_ties(assembly)
    apex = tension_above_apex(assembly, taken=True)
    warnings += [*of_points, *of_ties, *filter(None, [apex]), *soft_block_warnings(assembly, kn, blocks)]
    basis, free = degrees_of_freedom(assembly, plane)
    weight, size = _units(assembly, loads, free, moving)
    row, ratio = control_row(assembly, control, basis, free, loads.live @ basis * free)
    misfit = of_gaps(points, gaps) if initial is None else of_forces(points, initial, kn, ks)
    named = (assembly.arrays.normal_stiffness > 0.0) | (stiffness is not None)
    too_stiff = stiffness_warnings(assembly, points, named)
    firm, shapes = firmness(assembly, loads), None
    points, first = _framed(assembly, points, kn, ks, misfit, None if contacts == FIRST else firm)
    if anew:
        shapes, first = faces_that_meet(assembly, first, plane, size, firm)
    length = weight / float((first.kn * first.area).mean())
    bent = deformation(assembly, loads, points, blocks, stress, plane, kn, ks) if deforming else None
    equations = partial(
        _equations, assembly, loads, plane=plane, bent=bent, control=row, weight=weight, size=size, length=length,
        ties=ties,
    )
    structure = Structure(assembly, loads, first, weight, size, length, deformation=bent, tie_stiffness=ties.stiffness)
    generations, origin = Generations(shapes, equations, [structure]), at_rest(assembly.n_blocks)
    if initial is None:
        generations, nodes, origin = begin(generations, start, say, held=None if moving is None else 0.0, ratio=ratio)
    else:
        nodes = begun_with(generations.systems[0], initial, to, ratio, steps or Steps())
    if not nodes:
        return _falls(generations, warnings)
    if initial is None and start is None and moving is None:
        refuse_undriven(generations.systems[0], nodes[0], control)
    if settles:
        return certified_curve(generations, nodes, origin, PathEnd.REACHED, warnings + too_stiff, unit=None)
    end, begins = None if to is None else generations.systems[0].controlled(origin) + to, nodes[-1].control
    status, said = path.follow(generations, nodes, end, ratio, steps or Steps(), say, loading=moving is None)
    warnings += said + too_stiff + landed_warnings(generations, nodes)
    warnings += turns_back(control, loads) if status == PathEnd.STOPPED else []
    if initial is None:
        standard = contact_model is None and grid is None
        warnings += followed_warnings(generations, nodes, contact_model, standard, named=bool(named.any()))
    say(f"{status} after {len(nodes) - 1} steps, {time.perf_counter() - begun:.1f} s")
    _, toward = senses(begins, end, ratio)
    unit = None if moving is None else ratio
    return certified_curve(generations, nodes, origin, status, warnings, unit=unit, toward=toward)


whole_pushover = handed_on()(pushover)
"""The same for callers that go on with the curve: a path that is interrupted is a KeyboardInterrupt."""


def _settling(loads: Loads, control: str | tuple[Group, str], to: float | None) -> tuple[Loads, bool]:
    """Loads that a path is followed under, and whether it only settles under the dead load.

    A path to ``to=0`` without live loads settles. The dead load then stands in for the live one, which a control needs,
    at multiplier 0.

    Parameters
    ----------
    loads : dead and live
    control : as in :func:`pushover`
    to : displacement to which the path goes [m], not 0 beside live loads; None where it ends by itself
    """
    settles = to is not None and finite("to [m]", to) == 0.0 and not loads.live.any() and control == "live"
    if to == 0.0 and not settles:
        raise InputError(f"to must be a displacement [m] that is not zero, or None, got {to!r}")
    return (replace(loads, live=loads.dead, live_arms=loads.dead_arms) if settles else loads), settles


def finds_contacts_anew(assembly: Assembly, blocks: str, contacts: str | None) -> bool:
    """Whether contacts are found anew on the way.

    Refuses what blocks that deform do not take, whose contacts stay.

    Parameters
    ----------
    blocks : kind of blocks by name
    contacts : "anew", "first", or None for the default of the kind
    """
    choice("contacts", contacts, (ANEW, FIRST, None))
    deforming = blocks in (SIMPLY_DEFORMABLE, RITZ)
    if deforming:
        refuse_ties(assembly, f"a capacity curve of {blocks} blocks", "use blocks='rigid', or assembly.with_ties(())")
    if deforming and contacts == ANEW:
        raise NotApplicable(f"contacts are not found anew between {blocks} blocks: leave contacts out")
    return contacts == ANEW or (contacts is None and not deforming)


def followed_in(
    assembly: Assembly, loads: Loads, blocks: str, stress: str | None, *, anew: bool
) -> tuple[Plane | None, str]:
    """Plane in which a path is followed, None in space, and the state of stress of its blocks.

    Where contacts are found anew it is followed in space unless all that blocks may meet stays in the plane.

    Parameters
    ----------
    blocks, stress : as of :func:`pushover`
    anew : whether contacts are found anew
    """
    plane, stress = plane_of(assembly, loads, blocks, stress)
    stays = plane is None or not anew or contacts_stay_in_plane(assembly, plane)
    return (plane if stays else None), stress


def _framed(
    assembly: Assembly, points: ContactPoints, kn: Array, ks: Array, misfit: Array | None, firm: Index | None
) -> tuple[ContactPoints, PathContacts]:
    """Points, and the same with law and stiffness, framed by the firmer of two blocks.

    Without ``firm`` frames are carried by block a, as in the DEM. Tension counts as in the DEM too: ft beyond the apex
    of the cone is not cut.

    Parameters
    ----------
    assembly, points : the model, and its contact points carried by their block a
    kn, ks : stiffness of every interface [Pa/m], shape (k,)
    misfit : displacement of b against a in the reference pose, opening and along the tangents, which the springs have
        to close [m], shape (m, c); None for joints that fit
    firm : rank of every block, the higher the firmer, shape (n,); None for frames on block a
    """
    law, softens = interface_law(assembly.arrays, convex=False), softening_by_plastic_slip(assembly, kn, ks)
    first = first_contacts(points, law, kn, ks, misfit, softens)
    if firm is None:
        return points, first
    return carried_firmly(points, firm), turned_over(first, firm[first.block_b] > firm[first.block_a])


def _units(assembly: Assembly, loads: Loads, free: NDArray, moving: tuple[int, int] | None) -> tuple[float, float]:
    """Mean load [N] and median size [m] of the blocks that move freely, the units of a path.

    Parameters
    ----------
    free : which degrees of freedom are free, shape (n, d)
    moving : number of the block of a support that moves, which does not count, and its axis; None without one
    """
    mine: Flags = np.asarray(free.any(axis=1))
    if moving is not None:
        mine[moving[0]] = False
    dead, live = (float(np.linalg.norm(w[mine, :3], axis=1).mean()) for w in (loads.dead, loads.live))
    # without dead loads the mean live load is the unit of force
    return dead or live, float(np.median(np.cbrt(assembly.arrays.volume[mine])))


def _falls(generations: Generations, warnings: list[str]) -> PushoverCurve:
    """The curve of a structure that does not stand: one sample at load and displacement 0, without a state.

    Parameters
    ----------
    generations : contacts and equations of the path, part by part
    warnings : what is known so far
    """
    said = "no equilibrium under the dead load was found: is it carried, and is every block held?"
    return PushoverCurve(
        np.zeros(1), np.zeros(1), load_unit="-", label="pushover", status=PathEnd.CANNOT_STAND,
        warnings=(*warnings, said), source="limitmason", generations=generations,
        references=(*PAPERS, *data_behind(generations.structures[0].assembly.recipe)),
    )


def _equations(
    assembly: Assembly, loads: Loads, s: Structure, *, plane: Plane | None, bent: CondensedShapes | None, **options: Any
) -> System:
    """Equations of a structure with its present contacts, joint law and loads.

    It is a function of the module and no closure, so that a curve can be sent to other processes.

    Parameters
    ----------
    s : the structure, of which only the contact points with their law are read
    plane : in which blocks move; None in space
    bent : shapes of blocks that deform; None for rigid blocks
    options : ``control``, ``weight``, ``size``, ``length`` and ``ties`` of :class:`System`, the same for all contacts
    """
    p = s.points
    bodies = make_bodies(assembly, p, plane, bent)
    return System(
        bodies, ElastoplasticLaw(p.law, p.kn, p.ks, p.softening),
        PathLoads.of(loads, bodies.basis, bodies.free, None if bent is None else bent.gradients),
        springs=np.zeros((assembly.n_blocks, 0)) if bent is None else bent.stiffness, **options,
    )
