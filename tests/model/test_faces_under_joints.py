"""Faces that joints lie on, and outer faces of blocks of several pieces: by the areas and places of plain boxes."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.constants import GRAVITY
from limitmason.geometry import box

JOINT = lm.Joint(35.0)
GROUND = box((-1, -1, -1), (4, 2, 0))


def on_ground(*blocks, **options):
    return lm.Assembly.from_polyhedra([GROUND, *blocks], joint=JOINT, fixed=[0], **options)


@pytest.mark.parametrize("apart", [-5e-5, -1e-5, 1e-5, 5e-5])
def test_loads_do_not_press_between_pieces_that_touch_within_the_tolerance(apart):
    """Half the tolerance of contacts: fill weighed three times too much, and a pressure on top counted twice."""
    model = on_ground([box((0, 0, 0), (1, 1, 1)), box((0, 0, 1 + apart), (1, 1, 2))])
    weight = lm.Loads.weight(model)
    fill, pressed = weight.with_backfill(model, 3.0, 1000.0), weight.with_pressure(model, 1, pressure=100.0)
    assert -(fill.dead - weight.dead)[1, 2] == pytest.approx(1000.0 * GRAVITY)
    assert -(pressed.live + pressed.dead - weight.dead)[1, 2] == pytest.approx(100.0)
    assert len(model.blocks[1].outer_faces) == 10


def test_steps_thinner_than_the_tolerance_keep_their_faces():
    steps = [box((k / 3, 0, 1 + k * 1e-5), (1, 1, 1 + (k + 1) * 1e-5)) for k in range(3)]
    model = on_ground([box((0, 0, 0), (1, 1, 1)), *steps])
    tops = [face for face in model.blocks[1].outer_faces if np.ptp(face[:, 2]) == 0.0 and face[0, 2] >= 1.0]
    assert sum(np.prod(np.ptp(face[:, :2], axis=0)) for face in tops) == pytest.approx(1.0, rel=1e-9)
