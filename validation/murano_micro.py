"""The U walls stone by stone: elastic stones and the joints of the DEM, followed by the engine of capacity curves.

The source's finite element micro-model has elastic stones and interfaces too; neither its stones' modulus nor its bond
is in the text. Here the bond is that of the blocks (assumed), the joints those that the source calibrated in 3DEC.
"""

from collections.abc import Callable

import numpy as np

from limitmason.arrays import Array
from limitmason.capacity import PushoverCurve, Steps, pushover
from limitmason.deformable.levels import LUMPED, RIGID, SIMPLY_DEFORMABLE
from limitmason.experiments.experiment import Experiment
from limitmason.experiments.murano_u_walls import control_block
from limitmason.model.assembly import Assembly
from limitmason.model.material import Material

STONE = Material(young_modulus=20e9, poisson_ratio=0.2, name="granite")
"""Of the stones: a granite, assumed. From 10 to 50 GPa REGW's stiffness moves from 45.6 to 49.0 kN/mm."""

POINTS = (3, 3)
"""Contact points of a joint, along the stone and across it: the fewest that bend as the face does."""

ASSUMPTIONS = (
    f"The modulus of the stones is assumed, {STONE.young_modulus / 1e9:g} GPa with nu = {STONE.poisson_ratio:g}, a "
    "granite: it is not in the source's text.",
    "Stones strain and bend in the shapes of the DEM's simply deformable blocks; "
    f"{POINTS[0]} x {POINTS[1]} points a joint.",
)


def micro_model(test: Experiment, stone: Material = STONE) -> Assembly:
    """The blocks of "DS" or "REGW" with elastic stones."""
    return test.assembly().with_material(stone)


def push_micro(
    test: Experiment,
    to: float,
    *,
    blocks: str = SIMPLY_DEFORMABLE,
    stone: Material = STONE,
    wall: Assembly | None = None,
    start: PushoverCurve | None = None,
    steps: Steps | None = None,
    progress: Callable[[str], None] | None = None,
) -> PushoverCurve:
    """Capacity curve of a wall under its airbag.

    The multiplier is the airbag's force [kN].

    Parameters
    ----------
    test : "DS" or "REGW"; its ``residual`` says what a joint that fails loses
    to : mean displacement of the facade along the airbag's pressure, from the state under dead load [m]
    blocks : how stones deform, see :func:`limitmason.pushover`
    stone : what they are made of, not of rigid ones
    wall : the blocks with other joints than the experiment's
    start, steps, progress : as for :func:`limitmason.pushover`
    """
    wall = test.assembly() if wall is None else wall
    wall = wall if blocks == RIGID else wall.with_material(stone)
    contacts = "first" if blocks in (RIGID, LUMPED) else None
    return pushover(
        wall, test.loads(), to=to, blocks=blocks, contact_model="grid", grid=POINTS, contacts=contacts, start=start,
        steps=steps, progress=progress,
    )


def at_the_top(curve: PushoverCurve, test: Experiment) -> Array:
    """Displacement of the facade's top at mid-span from the state under dead load, outwards [m], shape (n,)."""
    moved = curve.displacement_of(control_block(test))[:, 1]
    return np.asarray(moved[0] - moved)
