"""Causes in the contact faces: where blocks really touch."""

from dataclasses import dataclass, replace

from limitmason.build.variants import with_head_joints_gaping, with_part_of_thickness, without_head_joints
from limitmason.diagnosis.cause import Cause
from limitmason.model import Assembly, Loads

Bounds = tuple[float, float]
Direction = tuple[float, float, float]
FACES = ("limit", "dem")


@dataclass(frozen=True)
class PulledIn:
    """Contact polygons pulled in from their edges by the size in mm."""

    direction: Direction | None

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if size == 0.0:
            return assembly, loads
        pulled = assembly.with_contact_ends_pulled_in(1e-3 * size, direction=self.direction)
        return replace(pulled, recipe={}), loads  # closed forms read whole faces from the recipe


def edge_rounding(bounds: Bounds = (0.0, 10.0), *, plane_normal: Direction | None = None) -> Cause:
    """Worn or rounded edges: every contact polygon pulled in from its edges by the size [mm].

    Parameters
    ----------
    plane_normal : for a wall that works in its plane the normal of that plane, (0, 1, 0): edges along the wall's
        faces then stay, and contact ends alone are pulled in, as in the published rounded-corner runs; None pulls in
        all edges
    """
    return Cause(
        "edge rounding", "rounding_mm", 0.0, bounds, "edges are rounded or broken off: contact ends pulled in by size, "
        "hinges move inwards", apply=PulledIn(plane_normal), unit="mm",
        source="rounded corners of LMGC90 and UDEC on the walls of Ferris and Tin-Loi 2001 (contact ends pulled in)",
        isolate="tilt single blocks of several widths: the loss of lever arm does not depend on the width",
        hidden_when="one block size: twin of effective thickness out of plane, of lost overlap in plane",
        methods=FACES,
    )  # fmt: skip


@dataclass(frozen=True)
class PartOfThickness:
    """Contact over the middle share of the thickness."""

    direction: Direction

    def __call__(self, share: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        if share == 1.0:
            return assembly, loads
        return with_part_of_thickness(assembly, share, self.direction), loads


def effective_thickness(bounds: Bounds = (0.6, 1.0), *, direction: Direction = (0.0, 1.0, 0.0)) -> Cause:
    """Faces that touch over the middle part of the thickness only: width in contact = size x thickness [-].

    Parameters
    ----------
    direction : across the wall
    """
    return Cause(
        "effective thickness", "thickness_share", 1.0, bounds, "faces are convex or out of square: contact over the "
        "middle share of the thickness", apply=PartOfThickness(direction), unit="-",
        source="lever arm of the strip in contact; that it is centred is assumed",
        isolate="tilt single blocks of several widths: the loss of lever arm is in proportion to the width",
        hidden_when="the wall works in its plane (no effect without cohesion or crushing); one thickness: twin of edge "
        "rounding",
        methods=FACES,
    )  # fmt: skip


@dataclass(frozen=True)
class Gaping:
    """Units that stop short of the head joints; the gap is given in mm."""

    def __call__(self, size: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        return (assembly, loads) if size == 0.0 else (with_head_joints_gaping(assembly, 1e-3 * size), loads)


def lost_overlap(bounds: Bounds = (0.0, 20.0)) -> Cause:
    """Units shorter than drawn: bed joints end half the size [mm] before every head joint, overlaps lose the size."""
    return Cause(
        "lost overlap", "overlap_loss_mm", 0.0, bounds, "units are short or laid with gaps: bed joints stop size / 2 "
        "before every head joint, an overlap v becomes v - size; free ends of the wall stay", apply=Gaping(), unit="mm",
        source="stepped cracks rise by the course height h per overlap v (Casapulla)",
        isolate="a wall built with gaps in its head joints on purpose",
        hidden_when="failure at the base or at free ends; near twin of torsion strength, and of edge rounding in plane",
        methods=FACES,
    )  # fmt: skip


@dataclass(frozen=True)
class OpenHeads:
    """A share of the head joints without contact."""

    def __call__(self, share: float, assembly: Assembly, loads: Loads) -> tuple[Assembly, Loads]:
        """Extended model."""
        return (assembly, loads) if share == 0.0 else (without_head_joints(assembly, share), loads)


def open_head_joints(bounds: Bounds = (0.0, 1.0)) -> Cause:
    """A share of the head joints [-] that carries nothing, spread over the wall, the same ones every time.

    The prediction is a staircase of the size: give the study few levels. It holds for small displacements: blocks that
    move towards each other would touch again.
    """
    return Cause(
        "open head joints", "open_head_share", 0.0, bounds, "head joints gape: a share of them carries neither "
        "pressure nor shear", apply=OpenHeads(), unit="-",
        source="dry joints laid with gaps; that they are spread evenly is assumed",
        isolate="a wall with and one without wedges in its head joints",
        hidden_when="the mechanism opens the head joints anyway",
        methods=FACES,
    )  # fmt: skip


def torsion_strength(bounds: Bounds = (0.0, 1.5)) -> Cause:
    """Faces that twist off more easily: size is the torsion of uniform pressure over the torsion strength [-].

    0 leaves the pressure free (0.7071 mu N a on a square), 1 limits torsion to that of uniform pressure (0.3826 mu N
    a), 2 to half of it; below about 0.5 nothing is cut on a square. It is passed on to limit analysis as
    ``torsion_limit``.
    """
    return Cause(
        "torsion strength", "torsion_limit", 0.0, bounds, "pressure spreads over the face instead of gathering in its "
        "corners, so friction has a shorter arm: torsion <= mu N r_m / size about the centre of pressure",
        unit="-", source="polar mean radius of a face under uniform pressure (Casapulla)",
        isolate="twist one block on another under several eccentric weights",
        hidden_when="no face twists (plane problems); sizes below 0.5; near twin of lost overlap in bending walls",
        methods=("limit, associative",),
    )  # fmt: skip
