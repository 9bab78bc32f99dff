"""Figures of modes and solids: what they draw comes from what they are given."""

import numpy as np
import pytest

import limitmason as lm
from limitmason import figures
from limitmason.continuum import Continuum
from limitmason.errors import InputError

JOINT = lm.Joint(35.0, normal_stiffness=2e9, shear_stiffness=8e8)


@pytest.fixture(scope="module")
def wall():
    return lm.build.wall(length=1.2, height=0.6, unit=(0.4, 0.2, 0.2), joint=JOINT)


@pytest.fixture(scope="module")
def solid(wall):
    return Continuum.from_assembly(wall, lm.Material(5e8, 0.2, 2000.0), size=0.2)


def test_matrix_shows_every_value_and_frames_the_best_of_each_row(wall, solid):
    found = lm.mac(lm.modes(wall, 3), lm.modes(solid, 4))
    figure = figures.mac_matrix(found, names=("blocks", "solid"), title="Shapes", caption="plain")
    axes = figure.axes[0]
    values = [float(t.get_text()) for t in axes.texts]
    assert values == pytest.approx(found.values.ravel(), abs=0.006)
    framed = [(p.get_y(), p.get_x()) for p in axes.patches if p.get_gid() == "best"]
    assert [int(x) for _, x in framed] == [j for _, j, value in found.pairs if value >= 0.5]


@pytest.mark.exact
def test_a_shape_that_is_like_none_is_not_called_alike():
    # the third shape is orthogonal to both of the others
    shapes = np.array([(1.0, 1.0, 1.0), (1.0, -1.0, 0.0), (1.0, 1.0, -2.0)])
    found = lm.mac(shapes, shapes[:2], sensors=[((0, 0, z), "y") for z in (1, 2, 3)])
    framed = [p for p in figures.mac_matrix(found).axes[0].patches if p.get_gid() == "best"]
    assert [(int(p.get_y()), int(p.get_x())) for p in framed] == [(0, 0), (1, 1)]
    assert [line.split()[2] for line in str(found).splitlines()[1:4]] == ["1", "2", "none"]


@pytest.mark.parametrize("kind", ["blocks", "solid"])
def test_mode_is_drawn_with_its_frequency(kind, wall, solid):
    found = lm.modes(wall if kind == "blocks" else solid, 2)
    figure = figures.mode_shape(found, 2)
    assert any(f"{found.frequency[1]:.2f} Hz" in t.get_text() for t in figure.texts)
    with pytest.raises(InputError, match="between 1 and 2"):
        figures.mode_shape(found, 3)


def test_map_paints_only_free_faces_that_the_viewer_sees(solid):
    values = np.arange(len(solid.mesh), dtype=float)
    figure = figures.solid_map(solid, values, label="number [-]", viewpoint_deg=(-60.0, 30.0))
    bricks = next(c for c in figure.axes[0].collections if c.get_gid() == "bricks")
    # front, right side and top of 6 x 3 x 1 bricks
    assert len(bricks.get_paths()) == 6 * 3 + 3 * 1 + 6 * 1
    assert figure.axes[1].get_ylabel() == "number [-]"
    with pytest.raises(InputError, match="one per brick"):
        figures.solid_map(solid, values[1:])
    with pytest.raises(InputError, match="displacements"):
        figures.solid_map(solid, scale=3.0)
