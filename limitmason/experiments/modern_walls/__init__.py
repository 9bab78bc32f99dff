"""Walls of modern masonry tested in plane: 198 walls of 25 campaigns, from the database of EPFL (EESD).

Geometry, materials and load of every wall; responses of 146, those of 52 are kept back. The blocks are rigid; a unit
may crack across its middle. Missing inputs are distributions (``inputs``), of which the median is built.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.build import wall as running_wall
from limitmason.checks import count, positive
from limitmason.errors import InputError
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.modern_walls.inputs import complete, has_shear_span, inputs_of
from limitmason.experiments.recipe import Recipe
from limitmason.mechanics.pier_strength import SLENDEREST
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads
from limitmason.model.stages import Drive
from limitmason.model.support import Support

NAME = "modern-walls"
BEAM = "beam"
DENSITY = 1000.0  # assumed [kg/m3]
THIN = 0.02  # height of a beam whose centroid is nearly at the top of the wall [m]
FORCE = 1e3  # live load [N]: the multiplier is the horizontal force in kN
FILLED = ("F", "TF")  # marks of head joints with mortar in the table
HELD = 0.5  # height of zero moment over that of a wall whose two ends are held against rotation
CANTILEVER = 1.0  # height of zero moment over that of a wall that is free to turn at its top
_CRACK_FRICTION = 30.0  # friction angle of a crack by the diagonal strength [deg]; chosen
_UNIT_FRICTION = 45.0  # the same of a crack by the strength of the unit [deg]; chosen
_UNIT_COHESION, _UNIT_TENSION = 0.06, 0.03  # of such a crack over the strength of the unit fb [-]; chosen
_FITS = 0.05  # change of the length of a unit that needs no mention [-]; chosen

OPTIONS = source_folder.read_options(NAME)

ENERGIES: Mapping[str, tuple[float, float]] = {"mortar": (0.02e-3, 0.12e-3), "crack": (0.04e-3, 0.4e-3)}
"""GfI / ft and GfII / c [m], assumed: about the middle of what tests of bond and units by van der Pluijm are reported
to give (Lourenço 1996), which was not looked up again. Shear of a crack takes ten times GfI / ft."""

LEAST_ENERGY = 1.5
"""Fracture energy over what the elastic joint has stored at its strength, at least: below 1 its curve runs back."""

CODE_MODULI = 1000.0, 0.4
"""E / fc and G / E where they are not printed: EN 1996-1-1, 3.7.2 and 3.7.3."""

MODELS: Mapping[str, Mapping[str, Any]] = {
    "first": {},
    "laws": {
        "tension_share": 0.0, "head_share": 0.0, "head_friction": 0.0, "unfilled_friction": 0.0,
        "cracks": "diagonal strength",
    },
    "extended": {
        "cohesion_share": 0.6, "tension_share": 0.0, "head_share": 0.0, "head_friction": 0.5, "unfilled_friction": 0.0,
        "cracks": "diagonal strength", "crack_factor": 1.6,
    },
    "pushover": {"cracks": "diagonal strength", "energy_share": 1.0, "rotation": "as tested"},
    "dem": {"cracks": "diagonal strength", "energy_share": 1.0, "rotation": "as tested"},
}
"""Options of the block models.

*first*: every strength at its printed value, plastic without end. *laws*: the bond's tension is gone once a joint has
opened; head joints carry no shear (Mann and Mueller 1982 leave them out); units crack by the diagonal strength of the
masonry (Turnsek and Cacovic 1971); nothing is fitted. *extended*: shares of cohesion and of the friction of filled
heads and the factor of the cracks are **fitted** to walls of this table: ``docs/measured-walls.md``. *pushover*,
*dem*: every strength at its printed value, and lost over assumed fracture energies; nothing is fitted.
"""


specimens = source_folder.names_in(NAME, "walls.csv")
"""Numbers of the walls in the database, "1" to "198"."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of a wall.

    Parameters
    ----------
    specimen : its number in the database, for example "189"
    options : of the assembly, see ``OPTIONS``
    """
    table, responses = source_folder.read_table(NAME, "walls.csv"), source_folder.read_table(NAME, "responses.csv")
    row, names = table.row(specimen), source_folder.read_description(NAME)["quantities"]
    response = next((r for r in responses.rows if r["specimen"] == specimen), None)
    measured = {} if response is None else responses.quantities(response, names["measured"])
    chosen_for_it = chosen_options(OPTIONS, options, NAME)
    chosen_for_it["coarse"] = count(f"{NAME}: coarse", chosen_for_it["coarse"])
    inputs = inputs_of(row)
    units, said = units_per_course(row)
    assumed = [k for k, i in inputs.items() if i.kind == "assumed"]
    assumptions = [
        f"Running bond without joint thickness is assumed, {units:g} units in a course, height divided by the courses; "
        + said,
        f"A rigid beam {OPTIONS['beam_height'].default:g} m high is assumed, on which N acts at its centroid "
        "and the horizontal force at the height of zero moment. It is free to turn; the option rotation holds it where "
        "both ends were held.",
        f"Density {DENSITY:g} kg/m3 is assumed; sigma0 acts on the top.",
        "The joints are assumed to have fv0 and mu, to crush at fc and to lose nothing; what else they have is an "
        "option. Kinds of inputs are assumed from their values.",
        *((f"Not in the source, so assumed as a distribution: {', '.join(assumed)}.",) if assumed else ()),
        *(("Head joints are not in the source: dry ones are assumed.",) if not row["head_joints"] else ()),
    ]
    chosen = {name: inputs[key] for name, key in names["inputs"].items()}
    shown = {name: Quantity(one.value, one.unit, str(one)) for name, one in chosen.items()}
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen_for_it,
        option_table=OPTIONS, row=row, measured=measured, assumptions=tuple(assumptions),
        title=f"{row['test_unit']} of {row['campaign']}: {row['unit_type']}, {row['bed_joints']} bed joints, "
        f"head joints {row['head_joints'] or 'unknown'}; "
        f"{'all inputs in the source' if complete(row) else 'inputs missing'}",
        parameters={
            **table.quantities(row, names["parameters"]), **shown, "unit type": row["unit_type"],
            "bed joints": row["bed_joints"], "head joints": row["head_joints"] or "unknown",
            "void ratio": row["void_ratio"] or "unknown", "H0 over H": row["H0_over_H"], "campaign": row["campaign"],
            "failure type": "kept back" if response is None else response["failure_mode"],
        },
        targets=tuple(TargetValue(f"Vmax{s}", "measured", direction=s) for s in "+-" if f"Vmax{s}" in measured),
        multiplier_to_measured=Quantity(FORCE / 1e3, "kN"),
        no_model="" if has_shear_span(row) or chosen_for_it["shear_span"] is not None
        else f"wall {specimen} has {row['H0_over_H']!r} for its shear span",
    )


def units_per_course(row: Any) -> tuple[float, str]:
    """Units in a course, a multiple of a half, and in words how they fit the length.

    Parameters
    ----------
    row : of the table of walls, with the length of the wall L [m] and that of a unit lb [mm]
    """
    printed = 1e3 * float(row["L"]) / float(row["lb"])
    units = max(1.0, round(2.0 * printed) / 2.0)
    change = 1e3 * float(row["L"]) / units / float(row["lb"]) - 1.0
    if abs(change) < _FITS:
        return units, f"a unit with its joint is {change:+.1%} of the printed length."
    return units, (f"the units do not fit the wall: {printed:.2f} of them, rounded to whole halves, which makes a unit "
                   f"{change:+.1%} of the printed length.")


def value(test: Experiment, name: str) -> float:
    """An input of a ``test`` by name, as chosen, or the median.

    Its unit is that of the table.
    """
    given = test.options[name]
    return inputs_of(test.row)[name].value if given is None else float(given)


def assembly(test: Experiment) -> Assembly:
    """The wall of a ``test`` on its slab under the rigid beam."""
    options, row = test.options, test.row
    if value(test, "sigma0") >= value(test, "fc"):
        raise InputError(f"{test.name}: the load sigma0 = {value(test, 'sigma0'):g} MPa is above fc = "
                         f"{value(test, 'fc'):g} MPa; the wall crushes under it")
    units, courses = units_per_course(row)[0], int(row["courses"])
    if options["coarse"] != 1:
        # one block for several units and courses: still whole halves, and two courses at least for a bond
        units = max(1.0, round(2.0 * units / options["coarse"]) / 2.0)
        courses = max(2, round(courses / options["coarse"]))
    length = float(row["L"])
    unit = length / units, float(row["H"]) / courses, float(row["t"])
    cracks = None if options["cracks"] == "none" else elastic(test, crack_joint(test), 0.5 * unit[0], "crack")
    wall = running_wall(
        length=length, courses=courses, unit=unit, joint=elastic(test, _mortar(test, 1.0, 1.0), unit[1], "mortar"),
        joints={"head": elastic(test, head_joint(test), 0.5 * unit[0], "mortar")}, density=DENSITY,
        top_beam=options["beam_height"], staggering=None if options["overlap"] == 0.5 else options["overlap"] * unit[0],
        beam_density=0.0, unit_cracks=cracks,
    )
    if options["rotation"] == "as tested" and shear_span(test) == HELD:
        wall = replace(wall, supports=(*wall.supports, Support(BEAM, dofs=("ry",))))
    return with_source(wall, test)


def elastic(test: Experiment, joint: Joint, spacing: float, kind: str) -> Joint:
    """The joint with stiffness and fracture energies, where options ask for them.

    The blocks are rigid, so that joints deform for them: kn = E / spacing, ks = 2 G / spacing. Bed joints and vertical
    planes each give half of the shear of a wall.

    Parameters
    ----------
    test : the experiment
    joint : law with strengths [Pa]
    spacing : of such joints across their plane [m]
    kind : of ``ENERGIES``: "mortar" or "crack"
    """
    energy, share = test.options["energy_share"], test.options["modulus_share"]
    if energy is None and share is None:
        return joint
    # E and G over the spacing [Pa/m]
    normal, shear = (v * (1.0 if share is None else share) / spacing for v in moduli(test))
    found = replace(joint, normal_stiffness=normal, shear_stiffness=2.0 * shear)
    if energy is None:
        return found
    opening, sliding = (energy * length for length in ENERGIES[kind])
    ft, c = joint.tensile_strength, joint.cohesion
    # the elastic joint has stored ft^2 / (2 kn) and c^2 / (2 ks), with ks = 2 G / spacing, at its strength
    by_opening = max(opening * ft, LEAST_ENERGY * ft**2 / (2.0 * normal)) if ft else None
    by_slip = max(sliding * c, LEAST_ENERGY * c**2 / (4.0 * shear)) if c else None
    return replace(found, fracture_energy_tension=by_opening, fracture_energy_shear=by_slip)


def moduli(test: Experiment) -> tuple[float, float]:
    """E and G of the wall of an experiment [Pa], printed or of ``CODE_MODULI`` with fc as chosen."""
    over_strength, shear_share = CODE_MODULI
    row = test.row
    modulus = 1e6 * (float(row["E"]) if row["E"] else over_strength * value(test, "fc"))
    return modulus, 1e6 * float(row["G"]) if row["G"] else shear_share * modulus


def head_joint(test: Experiment) -> Joint:
    """Law of a head joint of an experiment: filled, or with friction alone."""
    options = test.options
    if test.row["head_joints"] in FILLED:
        return _mortar(test, options["head_share"], options["head_friction"])
    return _mortar(test, 0.0, options["unfilled_friction"])


def crack_joint(test: Experiment) -> Joint:
    """Law of a crack across a unit of a ``test``.

    "unit strength": 45 degrees, c = 0.06 fb, tension 0.03 fb.

    "diagonal strength": 30 degrees, tension ft and c = k ft / b sqrt(1 + s0 / ft), with b = H / L from 1 to 1.5. With
    k = 2 that is the diagonal cracking of :func:`mechanisms.wall_forces` where head joints carry nothing: half of a
    vertical section is joints, so that its units have twice the mean shear.
    """
    options, strength = test.options, 1e6 * value(test, "fc")
    if options["cracks"] == "unit strength":
        fb = 1e6 * value(test, "fb")
        friction_deg, cohesion, tension = _UNIT_FRICTION, _UNIT_COHESION * fb, _UNIT_TENSION * fb
    else:
        ft, stress = 1e6 * positive(f"{test.name}: ft of cracks", value(test, "ft"), "MPa"), 1e6 * value(test, "sigma0")
        slenderness = min(max(float(test.row["H"]) / float(test.row["L"]), 1.0), SLENDEREST)
        friction_deg = _CRACK_FRICTION
        cohesion = options["crack_factor"] * ft / slenderness * math.sqrt(1.0 + stress / ft)
        tension = min(ft, cohesion / math.tan(math.radians(friction_deg)))  # no more than the apex of the cone
    return Joint(
        friction_deg, dilatancy_angle_deg=options["dilatancy_deg"], cohesion=options["crack_share"] * cohesion,
        tensile_strength=options["crack_share"] * tension, compressive_strength=strength, name="crack in a unit",
    )


def _mortar(test: Experiment, share: float, friction: float) -> Joint:
    """Joint of mortar of a ``test``, dry without any share of the cohesion.

    ``share`` is that of the cohesion fv0 [-], ``friction`` the factor of the friction coefficient mu [-].
    """
    options, fv0 = test.options, share * 1e6 * value(test, "fv0")
    return Joint.from_friction_coefficient(
        # nothing can dilate more than its friction angle
        friction * value(test, "mu"), dilatancy_angle_deg=options["dilatancy_deg"] if friction else 0.0,
        cohesion=options["cohesion_share"] * fv0, tensile_strength=options["tension_share"] * fv0,
        compressive_strength=1e6 * value(test, "fc"), name="mortar joint" if share else "dry joint",
    )


def shear_span(test: Experiment) -> float:
    """Height of zero moment over that of the wall of a ``test`` [-]."""
    if test.no_model:
        raise InputError(f"{test.name}: {test.no_model}; give the option shear_span")
    given = test.options["shear_span"]
    return float(test.row["H0_over_H"] if given is None else given)


def axial_force(test: Experiment) -> float:
    """Vertical force on the wall of an experiment, N = sigma0 L t [N]."""
    return 1e6 * value(test, "sigma0") * float(test.row["L"]) * float(test.row["t"])


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """N dead at the beam's centroid, and 1 kN live at the height of zero moment.

    Parameters
    ----------
    test : the experiment
    wall : its assembly
    sense : 1 for a live load along x, -1 against it
    """
    beam = wall.block_index(BEAM)
    height = shear_span(test) * float(test.row["H"])
    dead = Loads.weight(wall).with_precompression(wall, axial_force(test), block=BEAM).dead
    live = np.zeros_like(dead)
    # as a wrench on the beam: a force above or below its centroid has a moment about y
    live[beam] = sense * FORCE * np.array([1.0, 0.0, 0.0, 0.0, height - wall.centroids[beam, 2], 0.0])
    return Loads(dead, live, f"{FORCE:g} N at {height:g} m")


def drive(test: Experiment) -> Drive:
    """The beam pushed sideways, free to rise, as the test of an experiment was driven.

    It is free to turn on a cantilever, and held by a support where both ends of the wall were held. The drive acts at
    the beam's centroid. That of a thin beam, ``beam_height`` of ``THIN``, is at the zero moment of a cantilever.

    Raises
    ------
    InputError
        For another height of zero moment, at which a drive of the beam does not act.
    """
    if shear_span(test) == CANTILEVER or (shear_span(test) == HELD and test.options["rotation"] == "as tested"):
        return Drive({BEAM: {"x": 1.0}})
    raise InputError(f"{test.name} is no cantilever: push it by its loads (H0 / H = {shear_span(test):g}), or, of 0.5, "
                     "with rotation='as tested'")


def curve(test: Experiment) -> Curve:
    """Measured envelope of a ``test`` in the positive sense, thinned.

    The displacement is the drift [%], the load in [kN].

    Raises
    ------
    InputError
        Where none was found; the message names the walls that have one.
    """
    table = source_folder.read_table(NAME, "envelopes.csv")
    own = [r for r in table.rows if r["specimen"] == test.specimen and r["sense"] == "pos"]
    if not own:
        known = ", ".join(dict.fromkeys(r["specimen"] for r in table.rows))
        raise InputError(f"no envelope of {test.name} was found; there are those of {known}")
    drift, force = (np.array([float(r[k]) for r in own]) for k in ("drift", "force"))
    order = np.argsort(drift, kind="stable")
    return Curve(
        drift[order], force[order], displacement_unit="%", load_unit="kN", label=f"wall {test.specimen}",
        source=str(test.source),
    )


RECIPE = Recipe(
    specimens, load, assembly, loads, curve, source_folder.read_shown(NAME), drive, page="docs/measured-walls.md"
)
