"""Faces that joints lie on, and outer faces of blocks of several pieces: by the areas and places of plain boxes."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.constants import GRAVITY
from limitmason.geometry import box
from limitmason.model.axles import axle_forces, extrados
from limitmason.model.face_touch import outer_faces_of

JOINT = lm.Joint(35.0)
GROUND = box((-1, -1, -1), (4, 2, 0))


def on_ground(*blocks, **options):
    return lm.Assembly.from_polyhedra([GROUND, *blocks], joint=JOINT, fixed=[0], **options)


def test_a_joint_touches_every_face_in_its_plane_that_it_lies_over():
    """The feet of two pieces are one joint: one of them was told to touch nothing."""
    model = on_ground([box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 2))])
    assert len(model.interfaces) == 1
    report = model.contact_report()
    assert [face.block for face in report.untouched if face.normal[2] < -0.5] == ["block-0"]
    # the lower piece has five outer faces, the upper one six, one of them the half of a side
    assert (report.n_faces, len(report.untouched)) == (6 + 5 + 6, 5 + 4 + 5)


def test_a_face_between_two_others_in_a_plane_is_not_touched_by_a_joint_that_ends_before_it():
    """Three prongs of one height with a slab over two: an axle on the third fell into nothing."""
    prongs = [box((k, 0, 0.5), (k + 0.5, 1, 1)) for k in range(3)]
    model = on_ground([box((0, 0, 0), (2.5, 1, 0.5)), *prongs], box((0, 0, 1), (1.5, 1, 1.2)))
    strips = [(s.block, s.start, s.end, s.z) for s in extrados(model)]
    assert strips == [(2, 0.0, 1.5, 1.2), (1, 0.5, 1.0, 0.5), (1, 1.5, 2.0, 0.5), (1, 2.0, 2.5, 1.0)]
    wrench = axle_forces(model, 2.25, 1e3, level=1.3, spread_deg=0.0).wrench
    assert -wrench[:, 2] == pytest.approx([0.0, 1e3, 0.0])


def test_places_of_untouched_faces_lie_on_the_surface_of_a_block():
    """A slab with a neck: its top was told as one face, whose middle lies within the neck."""
    report = on_ground([box((0, 0, 0), (3, 1, 1)), box((1, 0, 1), (2, 1, 2))]).contact_report()
    tops = [face for face in report.untouched if face.block == "block-1" and face.normal[2] > 0.5]
    assert sorted(tuple(face.place) for face in tops) == [(0.5, 0.5, 1.0), (1.5, 0.5, 2.0), (2.5, 0.5, 1.0)]
    assert report.n_faces == 6 + 7 + 5


@pytest.mark.parametrize(
    ("apart", "tolerance"), [(-5e-5, None), (-1e-5, None), (1e-5, None), (5e-5, None), (1e-3, 2e-3), (-1e-3, 2e-3)]
)
def test_loads_do_not_press_between_pieces_that_touch_within_the_tolerance(apart, tolerance):
    """Half the tolerance of contacts: fill weighed three times too much, and a pressure on top counted twice."""
    pieces = [box((0, 0, 0), (1, 1, 1)), box((0, 0, 1 + apart), (1, 1, 2))]
    model = on_ground(pieces, tolerance=tolerance)
    weight = lm.Loads.weight(model)
    fill, pressed = weight.with_backfill(model, 3.0, 1000.0), weight.with_pressure(model, 1, pressure=100.0)
    assert -(fill.dead - weight.dead)[1, 2] == pytest.approx(1000.0 * GRAVITY)
    assert -(pressed.live + pressed.dead - weight.dead)[1, 2] == pytest.approx(100.0)
    assert len(outer_faces_of(model, 1)) == 10
    report = model.contact_report()
    assert (report.n_faces, len(report.untouched)) == (16, 14)


def test_steps_thinner_than_the_tolerance_keep_their_faces():
    steps = [box((k / 3, 0, 1 + k * 1e-5), (1, 1, 1 + (k + 1) * 1e-5)) for k in range(3)]
    model = on_ground([box((0, 0, 0), (1, 1, 1)), *steps])
    tops = [face for face in model.blocks[1].outer_faces if np.ptp(face[:, 2]) == 0.0 and face[0, 2] >= 1.0]
    assert sum(np.prod(np.ptp(face[:, :2], axis=0)) for face in tops) == pytest.approx(1.0, rel=1e-9)


def test_pieces_out_of_line_within_the_tolerance_have_no_faces_there():
    step = np.array([2e-5, 0.0, 0.0])
    upper = box((0, 0, 1), (1, 1, 2))
    straight, out = (
        on_ground([box((0, 0, 0), (1, 1, 1)), (upper.vertices + by, upper.faces)]).contact_report()
        for by in (0.0 * step, step)
    )
    assert (out.n_faces, len(out.untouched)) == (straight.n_faces, len(straight.untouched)) == (16, 14)
