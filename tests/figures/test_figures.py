"""Mechanisms in elevation: what is drawn is what was computed; blocks stay rigid, marks stand where joints move."""

import math
from dataclasses import replace

import numpy as np
import pytest
from figure_models import (
    GROUND,
    JOINT,
    artist,
    has,
    legend_labels,
    make_column,
    make_portal,
    make_prediction,
    rocking,
    sliding,
    texts,
)
from matplotlib.figure import Figure

import limitmason as lm
from limitmason import Assembly, Loads, figures, settlement_analysis
from limitmason.figures import outline
from limitmason.geometry import box
from limitmason.mechanics import rigid_motion

# ---- mechanism in elevation -------------------------------------------------------------------------------------


def test_displaced_blocks_are_congruent_to_the_originals_and_keep_the_hinge():
    assembly = make_column()
    figure = figures.mechanism(assembly, rocking(assembly, [1, 2, 3]), scale=0.3)
    assert isinstance(figure, Figure)
    before = artist(figure, "ghost").get_paths()
    after = artist(figure, "blocks").get_paths()
    assert len(before) == len(after) == 3
    for p, q in zip(before, after, strict=True):
        distance = [np.linalg.norm(x.vertices[:, None] - x.vertices[None], axis=2) for x in (p, q)]
        assert np.allclose(*distance, atol=1e-12)
    # the toe of the lowest block is the hinge; the heel rises
    corners = {tuple(v): w for v, w in zip(before[0].vertices.round(9).tolist(), after[0].vertices, strict=True)}
    assert np.allclose(corners[1.0, 0.0], (1.0, 0.0), atol=1e-12)
    assert corners[0.0, 0.0][1] > 0.1
    # clockwise about y: the top goes to +x
    assert after[2].vertices[:, 0].max() > 1.3


def test_largest_displacement_is_the_stated_fraction_of_the_structure():
    assembly = make_column()
    for fraction in (0.02, 0.08):
        figure = figures.mechanism(assembly, sliding(assembly, [2, 3]), scale=fraction)
        shift = artist(figure, "blocks").get_paths()[0].vertices - artist(figure, "ghost").get_paths()[0].vertices
        assert np.allclose(np.linalg.norm(shift, axis=1), fraction * math.sqrt(3.0 * 1.0))
    # the drawing does not depend on how a solver scales its rates
    one, ten = (figures.mechanism(assembly, make_prediction(assembly, f * rocking(assembly, [3], (1, 0.25, 2))
                .mechanism.twists)) for f in (1.0, 10.0))
    assert np.allclose(artist(one, "blocks").get_paths()[0].vertices, artist(ten, "blocks").get_paths()[0].vertices)


def test_rotation_is_bounded_however_large_the_scale():
    assembly = make_column(1)
    turned = rigid_motion.drawn_motion(assembly, rocking(assembly, [1]).mechanism.twists, 50.0)
    angle = math.acos(0.5 * (np.trace(turned.rotation[1]) - 1.0))
    assert angle == pytest.approx(0.35)
    with pytest.raises(ValueError, match="scale must be positive"):
        figures.mechanism(assembly, rocking(assembly, [1]), scale=0.0)


def test_finite_motion_is_a_rotation_about_the_instantaneous_axis():
    rng = np.random.default_rng(3)
    centroids, twists = rng.normal(size=(5, 3)), rng.normal(size=(5, 6))
    twists[0, 3:] = 0.0
    twists[1, 3:] *= 1e-6
    small = rigid_motion.finite_motion(centroids, twists, 1e-6)
    points = centroids + rng.normal(size=(5, 3))
    rate = twists[:, :3] + np.cross(twists[:, 3:], points - centroids)
    assert np.allclose((small.moved(points, np.arange(5)) - points) / 1e-6, rate, atol=1e-5)
    # following the same twist twice as long equals going on from where the block is, with the twist it carries along
    half, full = rigid_motion.finite_motion(centroids, twists, 0.4), rigid_motion.finite_motion(centroids, twists, 0.8)
    middle = half.moved(centroids, np.arange(5))
    spin = twists[:, 3:]
    velocity = twists[:, :3] + np.cross(spin, middle - centroids)
    again = rigid_motion.finite_motion(middle, np.hstack([velocity, spin]), 0.4)
    there = half.moved(points, np.arange(5))
    assert np.allclose(again.moved(there, np.arange(5)), full.moved(points, np.arange(5)), atol=1e-9)
    assert np.allclose(full.rotation @ np.swapaxes(full.rotation, 1, 2), np.eye(3))


@pytest.mark.parametrize("push", [-1.0, 1.0])
def test_joints_of_a_wall_that_leaves_its_plane_gape_in_elevation_as_its_front_does(push):
    """It turns about an edge of its foot: closed in front when it comes, open by one gap all along when it goes."""
    wall = lm.build.wall(length=1.6, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(35.0))
    found = lm.limit_analysis(wall, lm.Loads.horizontal(wall, (0, push, 0)))
    figure = figures.mechanism(wall, found, view="elevation", scale=0.05)
    for gap in artist(figure, "opening").get_paths():
        below, above = gap.vertices[:2, 1], gap.vertices[2:4, 1]
        assert np.ptp(below) < 1e-9
        assert np.ptp(above) < 1e-9
        assert above[0] > 1e-3 if push > 0.0 else abs(above[0]) < 1e-9


def test_opening_and_sliding_joints_are_told_apart_and_marked_where_they_are():
    assembly = make_column()
    rock = figures.mechanism(assembly, rocking(assembly, [2, 3], (1, 0.25, 1)))
    assert has(rock, "opening")
    assert not has(rock, "sliding")
    (gap,) = artist(rock, "opening").get_paths()
    # the wedge: closed at the hinge (1, 1), open at the other side
    corners = gap.vertices[:4]
    assert (np.linalg.norm(corners - (1.0, 1.0), axis=1) < 1e-9).sum() == 2
    slide = figures.mechanism(assembly, sliding(assembly, [3], (1.0, 0.0, 0.3)))
    assert has(slide, "sliding")
    assert not has(slide, "opening")
    assert "joint slides" in legend_labels(slide)
    assert "joint opens" not in legend_labels(slide)
    faces = artist(slide, "sliding faces").get_segments()
    assert len(faces) == 2
    assert np.allclose(np.ptp(faces[0], axis=0), (1.0, 0.0))
    plain = figures.mechanism(assembly, sliding(assembly, [3]), joints=False, ghost=False)
    assert not has(plain, "sliding")
    assert not has(plain, "ghost")


def test_blocks_are_sorted_into_moving_still_and_fixed():
    assembly = make_column()
    figure = figures.mechanism(assembly, sliding(assembly, [3]))
    assert [len(artist(figure, g).get_paths()) for g in ("blocks", "still", "fixed")] == [1, 2, 1]
    assert artist(figure, "fixed").get_hatch()
    kinds = {"block moves", "block stands still", "fixed"}
    assert kinds | {"before", "joint slides"} == set(legend_labels(figure))
    # where no free block stands still there is nothing to tell apart
    assert not kinds & {"block moves"} & set(legend_labels(figures.mechanism(assembly, sliding(assembly, [1, 2, 3]))))


def test_an_arrow_shows_the_resultant_of_the_live_loads_on_its_line_of_action():
    assembly = make_column()

    def arrow(loads):
        figure = figures.mechanism(assembly, replace(sliding(assembly, [3]), loads=loads))
        found = [a for a in figure.axes[0].texts if a.get_gid() == "load"]
        assert ("live load" in legend_labels(figure)) == bool(found)
        return found

    (body,) = arrow(Loads.horizontal(assembly, (-1, 0, 0)))
    assert body.xyann == pytest.approx(assembly.centroids[1:].mean(axis=0)[[0, 2]])  # three equal blocks
    assert body.xy[0] < body.xyann[0]
    assert body.xy[1] == pytest.approx(body.xyann[1])
    # a point load is drawn on its own line, not through the centroid of the block it acts on
    at = assembly.blocks[3].vertices.max(axis=0)
    (point,) = arrow(Loads.weight(assembly).with_point_load(assembly, 3, (0.0, 0.0, -7.0), at=at))
    assert point.xyann[0] == pytest.approx(at[0])
    assert point.xy[1] < point.xyann[1]
    couple = np.zeros((4, 6))
    couple[1, 0], couple[3, 0] = 5.0, -5.0
    assert not arrow(Loads(np.zeros((4, 6)), couple))
    assert not arrow(Loads.weight(assembly))
    assert not arrow(None)


def test_an_arrow_that_would_end_off_the_page_ends_where_the_load_acts():
    assembly = make_column()

    def drawn(at):
        force = Loads.weight(assembly).with_point_load(assembly, 3, (0.0, 0.0, 7.0), at=at)
        figure = figures.mechanism(assembly, replace(sliding(assembly, [3]), loads=force))
        return figure, [a for a in figure.axes[0].texts if a.get_gid() == "load"]

    top = assembly.blocks[3].vertices.max(axis=0)
    _, (arrow,) = drawn(top)
    assert arrow.xy == pytest.approx(top[[0, 2]])
    assert arrow.xyann[1] < arrow.xy[1]
    # a line of action beside the page has no arrow, and no entry in the legend
    figure, none = drawn(top + (50.0, 0.0, 0.0))
    assert not none
    assert "live load" not in legend_labels(figure)


def test_caption_states_multiplier_bound_flow_rule_and_doubt():
    assembly = make_column()
    good = texts(figures.mechanism(assembly, sliding(assembly, [3]), title="Pier"))
    for part in ("Pier", "λ = 0.3217", "exact for the associative law", "limit analysis, associative"):
        assert part in good.replace("\n", " ")
    assert "status" not in good
    twists = sliding(assembly, [3]).mechanism.twists
    doubtful = texts(figures.mechanism(assembly, make_prediction(assembly, twists, status="almost solved")))
    assert "status: almost solved" in doubtful.replace("\n", " ")


def test_axes_are_in_metres_with_equal_aspect_and_show_every_displaced_block():
    assembly = make_column()
    (ax,) = figures.mechanism(assembly, rocking(assembly, [1, 2, 3]), scale=0.3).axes
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "z [m]")
    points = np.concatenate([p.vertices for p in artist(ax.figure, "blocks").get_paths()])
    assert ax.get_xlim()[0] < points[:, 0].min()
    assert points[:, 0].max() < ax.get_xlim()[1]
    assert points[:, 1].max() < ax.get_ylim()[1]
    # the page was made for the drawing: the axes' box has its proportions
    width, height = ax.get_position().size * ax.figure.get_size_inches()
    assert width / height == pytest.approx(np.ptp(ax.get_xlim()) / np.ptp(ax.get_ylim()), rel=1e-6)


def test_concave_block_shows_one_outline_without_the_cuts_between_its_pieces():
    assembly = make_portal()
    assert len(assembly.blocks[1].parts) > 1
    figure = figures.mechanism(assembly, sliding(assembly, [1, 2]))
    path = artist(figure, "blocks").get_paths()[0]
    assert len(path.vertices) == 9  # eight corners, closed
    plane = outline.elevation_plane(np.array([0.0, 1.0, 0.0]))
    (loop,) = outline.elevation_loops(assembly.blocks[1], plane, assembly.tolerance)
    x, z = loop[:, 0], loop[:, 2]
    assert 0.5 * (x * np.roll(z, -1) - np.roll(x, -1) * z).sum() == pytest.approx(3 * 1.8 - 1)


def test_wrong_or_missing_mechanism_is_an_error():
    assembly = make_column()
    with pytest.raises(ValueError, match="no mechanism to draw: its status is 'cannot stand under dead load'"):
        figures.mechanism(assembly, make_prediction(assembly, None, status="cannot stand under dead load"))
    with pytest.raises(ValueError, match=r"twists of shape \(2, 6\), the assembly 4 blocks"):
        figures.mechanism(assembly, make_prediction(assembly, np.zeros((2, 6))))
    with pytest.raises(ValueError, match="view must be one of"):
        figures.mechanism(assembly, sliding(assembly, [3]), view="top")
    nan = np.zeros((4, 6))
    nan[2, 0] = math.nan
    with pytest.raises(ValueError, match="twist of block 'block-2' is not finite"):
        figures.mechanism(assembly, make_prediction(assembly, nan))


def test_without_a_threshold_every_joint_that_moves_is_marked():
    column = make_column()
    moved, all_marked = (figures.mechanism(column, sliding(column, [3]), **o) for o in ({}, {"threshold": 0.0}))
    assert has(moved, "sliding")
    assert has(all_marked, "sliding")
    assert not has(all_marked, "opening")


def test_nothing_moving_is_drawn_without_marks():
    figure = figures.mechanism(make_column(), make_prediction(None, np.zeros((4, 6))))
    assert not has(figure, "ghost")
    assert not has(figure, "opening")


@pytest.mark.slow
def test_three_thousand_blocks_take_a_handful_of_artists():
    rows, columns = 40, 75
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    outlines = [np.array([[0, -1], [columns, -1], [columns, 0], [0, 0]], dtype=float)]
    outlines += [corners + (i, k) for k in range(rows) for i in range(columns)]
    assembly = Assembly.from_polygons(outlines, thickness=1.0, joint=JOINT, fixed=[0])
    figure = figures.mechanism(assembly, sliding(assembly, range(1501, 3001)))
    assert len(artist(figure, "blocks").get_paths()) == 1500
    assert len([c for c in figure.axes[0].collections]) < 12


# ---- view -------------------------------------------------------------------------------------------------------


def test_auto_view_is_elevation_in_plane_and_space_out_of_plane():
    assembly = make_column()
    assert has(figures.mechanism(assembly, sliding(assembly, [3])), "ghost")
    side = figures.mechanism(assembly, sliding(assembly, [3], (0, 1, 0)))
    assert side.axes[0].get_xlabel().endswith("y [m]")  # one column moves in the plane it is seen in from the side
    out = figures.mechanism(assembly, sliding(assembly, [3], (1, 1, 0)))
    assert has(out, "scale")  # the triad of a drawing in space
    assert not out.axes[0].axison
    assert has(figures.mechanism(assembly, sliding(assembly, [3]), view="3d"), "scale")
    assert figures.mechanism(assembly, sliding(assembly, [3], (1, 1, 0)), view="elevation").axes[0].axison
    twist = rocking(assembly, [3], (0.5, 0.25, 2), (0, 0, 1))
    assert has(figures.mechanism(assembly, twist), "scale")


def test_auto_view_finds_the_plane_of_a_turned_wall_but_not_of_two_leaves():
    c, s = math.cos(0.4), math.sin(0.4)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    flat = make_portal()
    turned = flat.transformed(turn)
    plane = outline.wall_plane(turned)
    assert np.allclose(np.abs(plane.normal), np.abs(turn @ (0, 1, 0)))
    assert figures.assembly(turned).axes[0].axison
    leaves = [box((-1, -1, -1), (3, 3, 0))]
    leaves += [box((x, y, 0), (x + 1, y + 1, 1)) for x in (0, 1) for y in (0, 1)]
    two = Assembly.from_polyhedra(leaves, joint=JOINT, fixed=[0])
    assert outline.wall_plane(two) is None
    assert not figures.assembly(two).axes[0].axison


def test_a_wall_that_only_slides_is_seen_in_its_plane_whatever_rounding_turns_its_blocks():
    wall = make_portal()
    slides = sliding(wall, [2], (1, 0, 0))
    noise = 1e-13 * np.array([0, 0, 0, 0.3, 1.0, 0.7])
    assert outline.wall_plane(wall, slides.mechanism.twists + noise) is not None
    assert outline.wall_plane(wall, rocking(wall, [2], (0.5, 0, 2), (0, 0, 1)).mechanism.twists) is None


def test_labels_name_every_block():
    figure = figures.assembly(make_column(names=["ground", "low", "middle", "top"]), labels=True)
    assert {"ground", "low", "middle", "top"} <= set(texts(figure).split("\n"))


def test_names_with_dollar_signs_are_drawn_as_they_are(tmp_path):
    outlines = [np.array(o, dtype=float) for o in (GROUND, [[0, 0], [1, 0], [1, 1], [0, 1]])]
    named = Assembly.from_polygons(
        outlines, thickness=0.5, joint=JOINT, fixed=[0], names=["5 $ or 6 $", r"$\block$"]
    )
    figures.assembly(named, labels=True).savefig(tmp_path / "named.png")
    settling = replace(rocking(named, [1]), method=r"settlement of $\block$")
    figures.mechanism(named, settling).savefig(tmp_path / "named.png")


def test_given_axes_are_drawn_on():
    assembly = make_column()
    own = Figure(figsize=(6, 3))
    left, right = own.subplots(1, 2)
    assert figures.mechanism(assembly, sliding(assembly, [3]), ax=left, title="left") is own
    assert figures.mechanism(assembly, sliding(assembly, [3], (1, 1, 0)), ax=right) is own
    assert len(own.axes) == 2
    assert left.collections
    assert right.collections
    assert left.get_title(loc="left") == "left"
    assert own.get_size_inches().tolist() == [6, 3]


def test_a_support_that_settles_is_drawn_whole():
    """A part of it was below the page."""
    posts = [box((x, 0, -0.2), (x + 1, 1, 0)) for x in (0, 3)]
    beam = Assembly.from_polyhedra([*posts, box((0, 0, 0), (4, 1, 1))], joint=JOINT, fixed=[0, 1])
    for direction in ("-z", "+z"):
        figure = figures.mechanism(beam, settlement_analysis(beam, 1, direction=direction), scale=0.1)
        drawn = np.concatenate([p.vertices for p in artist(figure, "fixed").get_paths()])
        (left, right), (bottom, top) = figure.axes[0].get_xlim(), figure.axes[0].get_ylim()
        assert (drawn > (left, bottom)).all()
        assert (drawn < (right, top)).all()
