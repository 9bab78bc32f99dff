"""Causes in the contact faces: where blocks really touch."""

from dataclasses import replace

from limitmason.build.variants import with_head_joints_gaping, with_part_of_thickness, without_head_joints
from limitmason.causes.declare import Model, declare
from limitmason.causes.wrenches import Direction
from limitmason.model import Assembly, Loads


@declare(
    "edge rounding", parameter="rounding_mm", lever="faces", baseline=0.0, bounds=(0.0, 10.0), unit="mm",
    physics="edges are rounded or broken off: contact ends pulled in by size, hinges move inwards",
    source="rounded corners of LMGC90 and UDEC on the walls of Ferris and Tin-Loi 2001 (contact ends pulled in)",
    isolate="tilt single blocks of several widths: the loss of lever arm does not depend on the width",
    hidden_when="one block size: twin of effective thickness out of plane, of lost overlap in plane",
)
def edge_rounding(size: float, assembly: Assembly, loads: Loads, *, plane_normal: Direction | None = None) -> Model:
    """Worn or rounded edges.

    Every contact polygon pulled in from its edges by the size [mm].

    Parameters
    ----------
    plane_normal : for a wall that works in its plane the normal of that plane, (0, 1, 0): edges along the wall's
        faces then stay, and contact ends alone are pulled in, as in the published rounded-corner runs; None pulls in
        all edges
    """
    pulled = assembly.with_contact_ends_pulled_in(1e-3 * size, direction=plane_normal)
    return replace(pulled, recipe={}), loads  # closed forms read whole faces from the recipe


@declare(
    "effective thickness", parameter="thickness_share", lever="faces", baseline=1.0, bounds=(0.6, 1.0),
    physics="faces are convex or out of square: contact over the middle share of the thickness",
    source="lever arm of the strip in contact; that it is centred is assumed",
    isolate="tilt single blocks of several widths: the loss of lever arm is in proportion to the width",
    hidden_when="the wall works in its plane (no effect without cohesion or crushing); one thickness: twin of edge "
    "rounding",
)
def effective_thickness(
    share: float, assembly: Assembly, loads: Loads, *, direction: Direction = (0.0, 1.0, 0.0)
) -> Model:
    """Faces that touch over the middle part of the thickness only.

    Width in contact = size x thickness [-].

    Parameters
    ----------
    direction : across the wall
    """
    return with_part_of_thickness(assembly, share, direction), loads


@declare(
    "lost overlap", parameter="overlap_loss_mm", lever="faces", baseline=0.0, bounds=(0.0, 20.0), unit="mm",
    physics="units are short or laid with gaps: bed joints stop size / 2 before every head joint, an overlap v becomes "
    "v - size; free ends of the wall stay",
    source="stepped cracks rise by the course height h per overlap v (Casapulla)",
    isolate="a wall built with gaps in its head joints on purpose",
    hidden_when="failure at the base or at free ends; near twin of torsion strength, and of edge rounding in plane",
)
def lost_overlap(size: float, assembly: Assembly, loads: Loads) -> Model:
    """Units shorter than drawn.

    Bed joints end half the size [mm] before every head joint, overlaps lose the size.
    """
    return with_head_joints_gaping(assembly, 1e-3 * size), loads


@declare(
    "open head joints", parameter="open_head_share", lever="faces", baseline=0.0, bounds=(0.0, 1.0),
    physics="head joints gape: a share of them carries neither pressure nor shear",
    source="dry joints laid with gaps; that they are spread evenly is assumed",
    isolate="a wall with and one without wedges in its head joints",
    hidden_when="the mechanism opens the head joints anyway",
)
def open_head_joints(share: float, assembly: Assembly, loads: Loads) -> Model:
    """A share of the head joints [-] that carries nothing, spread over the wall.

    The same joints are opened every time.

    The prediction is a staircase of the size: give the study few levels. It holds for small displacements: blocks that
    move towards each other would touch again.
    """
    return without_head_joints(assembly, share), loads


@declare(
    "torsion strength", parameter="torsion_limit", lever="torsion", baseline=0.0, bounds=(0.0, 1.5),
    physics="pressure spreads over the face instead of gathering in its corners, so friction has a shorter arm: "
    "torsion <= mu N r_m / size about the centre of pressure",
    source="polar mean radius of a face under uniform pressure (Casapulla)",
    isolate="twist one block on another under several eccentric weights",
    hidden_when="no face twists (plane problems); sizes below 0.5; near twin of lost overlap in bending walls",
    by_simulator=True,
)
def torsion_strength(size: float, assembly: Assembly, loads: Loads) -> Model:
    """Faces that twist off more easily.

    Size is the torsion of uniform pressure over the torsion strength [-].

    0 leaves the pressure free (0.7071 mu N a on a square), 1 limits torsion to that of uniform pressure (0.3826 mu N
    a), 2 to half of it; below about 0.5 nothing is cut on a square. It is no edit of the model: it is passed on to
    limit analysis as ``torsion_limit``.
    """
    raise TypeError("torsion strength is a setting of limit analysis: pass torsion_limit=size to it")
