"""Figures of modes and solids: what they draw comes from what they are given."""

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.figure import Figure

import limitmason as lm
from limitmason import figures
from limitmason.continuum import Continuum
from limitmason.errors import InputError
from limitmason.figures.modes import _drawn
from limitmason.geometry import box

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
def test_shapes_that_are_one_up_to_a_factor_are_drawn_whatever_rounding_makes_of_the_criterion():
    shapes = np.random.default_rng(0).normal(size=(20, 8, 3))
    found = lm.mac(shapes, 3.7 * shapes)
    assert found.values.max() > 1.0
    assert {t.get_text() for t in figures.mac_matrix(found).axes[0].texts} >= {"1.00"}


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


def test_a_mode_reaches_as_far_as_is_stated_also_where_a_block_turns_about_itself():
    cubes = [box((-1, -1, -1), (2, 2, 0)), box((0, 0, 0), (1, 1, 1))]
    block = lm.Assembly.from_polyhedra(cubes, joint=JOINT, fixed=[0])
    found = lm.modes(block, 5)
    corners = block.blocks[1].vertices - block.centroids[1]
    for number in range(1, 6):
        u = _drawn(found, number, 0.06)[1]
        moved = np.linalg.norm(u[:3] + np.cross(u[3:], corners), axis=1)
        assert moved.max() == pytest.approx(0.06)  # of an extent of 1 m


def test_the_caption_of_a_mode_states_no_length_and_takes_more_words(wall, solid):
    for found in (lm.modes(wall, 1), lm.modes(solid, 1)):
        axes = Figure().add_subplot()
        figures.mode_shape(found, 1, ax=axes, caption="as built")
        (caption,) = [t.get_text() for t in axes.texts if t.get_gid() == "caption"]
        assert caption.startswith("participating mass")
        assert caption.replace("\n", " ").endswith("as built")
        assert "displacement" not in caption


@pytest.mark.parametrize("value", [1e6, -2e5, 0.0])
def test_bricks_of_one_value_have_the_colour_that_the_bar_gives_it(solid, value):
    figure = figures.solid_map(solid, np.full(len(solid.mesh), value), label="stress [Pa]")
    (bricks,) = [c for c in figure.axes[0].collections if c.get_gid() == "bricks"]
    low, high = figure.axes[-1].get_ylim()
    on_bar = np.array(colormaps["viridis"]((value - low) / (high - low))[:3])
    shade = bricks.get_facecolors()[:, :3] / on_bar  # of every face, the same for red, green and blue
    assert np.ptp(shade, axis=1).max() < 1e-9


def test_a_map_refuses_limits_scales_and_colours_that_it_cannot_use(solid):
    values = np.arange(len(solid.mesh), dtype=float)
    still = np.zeros_like(solid.mesh.nodes)
    for options, told in (
        ({"values": values, "limits": (5.0, 1.0)}, "lowest, highest"),
        ({"values": values, "limits": (1.0,)}, "lowest, highest"),
        ({"values": values, "limits": "ab"}, "limits must be numbers"),
        ({"limits": (0.0, 1.0)}, "of the colours"),
        ({"displacement": still, "scale": -1.0}, "scale must be positive"), ({"colours": "no map"}, "colour map"),
    ):
        with pytest.raises(InputError, match=told):
            figures.solid_map(solid, **options)
