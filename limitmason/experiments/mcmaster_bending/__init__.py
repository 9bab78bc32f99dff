"""Four-point bending of block masonry wallettes, McMaster University, as modelled by Godio, Stefanou and Sab 2017.

25 wallettes of Gazzola and Drysdale, five orientations of the bed joints. Their mean strengths are only in a figure
(Fig. 9), so no measured value is packaged; the properties are those of the paper's Table 4.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.arrays import Array
from limitmason.checks import positive
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.experiments import source_folder
from limitmason.experiments.experiment import Experiment, Quantity, TargetValue, chosen_options, with_source
from limitmason.experiments.recipe import Recipe
from limitmason.geometry import box, polygon_area_centroid, prism
from limitmason.geometry.polygon import clip_convex
from limitmason.model.assembly import Assembly
from limitmason.model.joint import Joint
from limitmason.model.load import Loads

NAME = "mcmaster-bending"
SUPPORTS, LOADED = ("support-left", "support-right"), ("load-left", "load-right")
_DEEP = 0.03  # depth of the bars [m]
_HARD = 75.0  # stiffness of their contact over that of the joints, as of a bar as wide as the wallette is thick [-]
_SLIVER = 0.04  # pieces below this part of a block are left out [-]; chosen
_NARROW = 0.025  # and those narrower than this [m]; chosen
_STEEPEST = 89.9  # of the axis of a block [deg]: contact grids find the thickness across its horizontal part
_UNIT_STRESS = 1e6  # flexural stress of the live load [Pa]: the multiplier is the stress in MPa

OPTIONS = source_folder.read_options(NAME)


specimens = source_folder.names_in(NAME, "wallettes.csv")
"""One per orientation of the bed joints to the span: "theta-0", "theta-15", ..."""


def load(specimen: str, **options: Any) -> Experiment:
    """The experiment of one orientation of the bed joints.

    Parameters
    ----------
    specimen : for example "theta-90"
    options : of the assembly, see ``OPTIONS``
    """
    table = source_folder.read_table(NAME, "wallettes.csv")
    row = table.row(specimen)
    chosen = chosen_options(OPTIONS, options, NAME)
    given = source_folder.read_parameters(NAME)
    span = float(given["length"]) / 1e3
    bar = chosen["bar_width"]
    if not 0.0 < chosen["load_span"] < chosen["support_span"] <= span - bar:
        raise InputError(
            f"load_span {chosen['load_span']:g} m and support_span {chosen['support_span']:g} m must grow in this "
            f"order and fit on the wallette of {span:g} m"
        )
    if not 0.0 < bar < 0.5 * (chosen["support_span"] - chosen["load_span"]):
        raise InputError(f"bar_width must be positive and less than a shear span, got {bar!r} m")
    positive("block_scale", chosen["block_scale"])
    if not 0.0 <= chosen["bond_shift"] < 1.0:
        raise InputError(f"bond_shift must be a part of a course, from 0 up to 1, got {chosen['bond_shift']!r}")
    if chosen["density"] is not None:
        positive("density (None leaves the weight out)", chosen["density"])
    closed_form = table.quantities(row, {"plastic tension": "fxt_plastic"})
    return Experiment(
        source=source_folder.read_source(NAME), specimen=specimen, recipe=RECIPE, options=chosen, option_table=OPTIONS,
        row=row, multiplier_to_measured=Quantity(1.0, "MPa"), open_options={"load_span": (0.5, 0.8)},
        title=f"Block wallette in four-point bending, bed joints at {row['theta']} deg to the span",
        parameters={**given, **table.quantities(row, {"orientation": "theta"}), "failure": row["failure"]},
        measured=table.quantities(row, {"fxt": "fxt"}),
        recomputed=closed_form,
        assumptions=(
            f"The spans are assumed: supports {chosen['support_span']:g} m and loads {chosen['load_span']:g} m apart; "
            "not found in the sources.",
            "The bond is assumed to be centred: a bed joint and a head joint meet at the centre of the wallette; "
            f"pieces below {100 * _SLIVER:g} % of a block or narrower than {1e3 * _NARROW:g} mm are left out.",
            "The weight of the wallette is assumed to be left out: neither its density nor its position is given."
            if chosen["density"] is None
            else f"The wallette is assumed to lie flat with {chosen['density']:g} kg/m3; neither is in the sources.",
            f"Supports and loads are assumed as bars {1e3 * bar:g} mm wide; the left support is a pin (friction of the "
            "joints, no cohesion), the others have no friction; none resists tension, and their contact is 75 times as "
            "stiff.",
            "After failure a joint is assumed to lose cohesion and tensile strength at once and to keep its friction."
            if chosen["residual"] == "none"
            else "Joints are assumed perfectly plastic in tension and shear.",
        ),
        targets=(TargetValue("plastic tension", "recomputed", "associative"),) if closed_form else (),
    )


def assembly(test: Experiment) -> Assembly:
    """The wallette of a ``test`` upright in the x-z plane, span along x, 0 < y < t.

    Two bars support it at y = 0 and are fixed, two load it at y = t.
    """
    given, options = test.parameters, test.options
    length, width = (float(given[k]) / 1e3 for k in ("length", "width"))
    thickness = thickness_of(test)
    long, high = (float(given[k]) / 1e3 * options["block_scale"] for k in ("block length", "block height"))
    pieces = cut_bond(length, width, long, high, float(np.deg2rad(given["orientation"])), options["bond_shift"])
    # in the order of SUPPORTS and LOADED: left, then right
    bar = options["bar_width"]
    bars = [
        box((side * 0.5 * span - 0.5 * bar, y, -0.5 * width), (side * 0.5 * span + 0.5 * bar, y + _DEEP, 0.5 * width))
        for span, y in ((options["support_span"], -_DEEP), (options["load_span"], thickness))
        for side in (-1.0, 1.0)
    ]
    names = [f"block-{k}" for k in range(len(pieces))]
    angle = np.deg2rad(min(float(given["orientation"]), _STEEPEST))
    axis = np.array([np.cos(angle), 0.0, np.sin(angle)])
    lost = ("residual_cohesion", "residual_tensile_strength") if options["residual"] == "none" else ()
    brittle: dict[str, Any] = dict.fromkeys(lost, 0.0)
    stiffness: dict[str, Any] = {
        "normal_stiffness": float(given["normal stiffness"]) * 1e9,
        "shear_stiffness": float(given["tangential stiffness"]) * 1e9,
    }
    mortar = Joint(
        float(given["friction angle"]), dilatancy_angle_deg=options["dilatancy_deg"],
        cohesion=float(given["cohesion"]) * 1e6, tensile_strength=float(given["tensile strength"]) * 1e6,
        name="mortar joint", **stiffness, **brittle,
    )
    # a narrow bar would sink in by more than the wallette bends
    hard = {k: _HARD * v for k, v in stiffness.items()}
    pin, roller = Joint(float(given["friction angle"]), name="pin", **hard), Joint(0.0, name="roller", **hard)
    whole = Assembly.from_polyhedra(
        [prism(q, 0.0, thickness) for q in pieces] + bars, joint=mortar, fixed=SUPPORTS,
        names=[*names, *SUPPORTS, *LOADED], axes=[axis] * len(pieces) + [None] * 4,
        recipe={"blocks cut from a bond": len(pieces)},
    )
    left_support = len(pieces)  # bars come after the blocks, this one first

    def law(a: int, b: int, joint: Joint) -> Joint:
        """Law between blocks a and b: that of mortar, or of the bar that one of them is."""
        bar = max(a, b)
        if bar < left_support:
            return joint
        return pin if bar == left_support else roller

    laid = (replace(i, joint=law(i.block_a, i.block_b, i.joint)) for i in whole.interfaces)
    return with_source(whole.with_interfaces(laid), test)


def loads(test: Experiment, wall: Assembly, sense: float) -> Loads:
    """Weight along the loads, where there is a density, and live line loads.

    These are along -y, and make a flexural stress 6 M / (b t^2) of 1 MPa between them.

    Parameters
    ----------
    test : the experiment
    wall : its assembly
    sense : 1; -1 is refused

    Raises
    ------
    InputError
        For the other sense: the wallette rests on its supports and would be lifted off them.
    """
    if sense < 0.0:
        raise InputError(f"{NAME} has no loads in direction '-': the wallette is pressed against its supports")
    force = line_load(test, _UNIT_STRESS)
    dead = np.zeros((wall.n_blocks, 6))
    if test.options["density"] is not None:
        own = np.array([b.name.startswith("block-") for b in wall.blocks])
        volume = np.array([b.volume for b in wall.blocks])
        dead[own, 1] = -test.options["density"] * GRAVITY * volume[own]
    found = Loads(dead, np.zeros_like(dead), "four-point bending")
    for bar in LOADED:
        found = found.with_point_load(wall, bar, (0.0, -force, 0.0))
    return found


def thickness_of(test: Experiment) -> float:
    """Thickness of the blocks of a ``test`` [m].

    It is scaled with them where the options say so.
    """
    scale = test.options["block_scale"] if test.options["scale_thickness"] else 1.0
    return scale * float(test.parameters["block thickness"]) / 1e3


def line_load(test: Experiment, stress: float) -> float:
    """Force of one of the two line loads at a flexural stress between them [N].

    The stress is 6 M / (b t^2).

    Parameters
    ----------
    test : the experiment
    stress : that stress [Pa]
    """
    options = test.options
    width, thickness = float(test.parameters["width"]) / 1e3, thickness_of(test)
    arm = 0.5 * (options["support_span"] - options["load_span"])  # M is the force times this
    return stress * width * thickness**2 / 6.0 / arm


def cut_bond(
    length: float, width: float, unit_length: float, unit_height: float, angle: float, shift: float = 0.0
) -> list[Array]:
    """Running bond, turned by an angle and cut to a rectangle about the origin.

    Parameters
    ----------
    length : of the rectangle [m]
    width : of the rectangle [m]
    unit_length : of a block with its joints [m]
    unit_height : of a block with its joints [m]
    angle : of the bed joints to the length [rad]
    shift : of the bed joints from the origin, in courses, 0 <= shift < 1 [-]

    Returns
    -------
    convex counter-clockwise outlines [m], each shape (n, 2), without slivers
    """
    window = 0.5 * np.array([[-length, -width], [length, -width], [length, width], [-length, width]])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    # enough of the bond to cover the rectangle at any angle, and one more for shift and stagger
    reach = 0.5 * float(np.hypot(length, width))
    rows, columns = (int(np.ceil(reach / size)) + 1 for size in (unit_height, unit_length))
    out = []
    for row in range(-rows, rows):
        stagger = 0.5 * unit_length * (row % 2)  # half a block in every second course
        for column in range(-columns - 1, columns + 1):
            low = np.array([column * unit_length + stagger, (row + shift) * unit_height])
            corners = low + np.array([[0, 0], [unit_length, 0], [unit_length, unit_height], [0, unit_height]])
            piece = clip_convex(corners @ turn.T, window)
            if len(piece) > 2 and not _is_sliver(piece, unit_length * unit_height):
                out.append(piece)
    return out


def _is_sliver(piece: Array, whole: float) -> bool:
    """Whether a piece is too small, or too narrow, to be a block.

    ``piece`` is its outline [m], shape (n, 2), and ``whole`` the area of a block [m2]. The width is area over length.
    """
    area = abs(polygon_area_centroid(piece)[0])
    longest = np.linalg.norm(piece[:, None] - piece[None], axis=2).max()
    return bool(area < _SLIVER * whole or area < _NARROW * longest)


RECIPE = Recipe(specimens, load, assembly, loads, shown=source_folder.read_shown(NAME))
