"""Figures in space, forces, comparisons and the package: what is drawn is what was computed, nothing is dropped."""

import functools
import math
import subprocess
import sys

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
    texts,
)
from matplotlib.colors import to_rgba
from matplotlib.text import Text

import limitmason as lm
from limitmason import Assembly, figures
from limitmason.answers.results import Resultants
from limitmason.figures import outline, painter, style
from limitmason.geometry import box
from limitmason.geometry.rotation import rotation_matrices
from limitmason.mechanics.joint_forces import joint_forces
from limitmason.mechanics.thrust_line import thrust_lines

# ---- space ------------------------------------------------------------------------------------------------------


def test_painter_never_paints_a_block_over_one_in_front_of_it():
    # a long slab under small blocks: sorted by mean depth it would hide those at its far end
    solids = [box((-10, 0, -1), (10, 4, 0))] + [box((x, y, 0), (x + 1, y + 1, 1)) for x in (-9, 0, 8) for y in (0, 2)]
    for azimuth in (-60.0, 30.0, 125.0, 200.0):
        view = painter.camera(azimuth, 25.0)
        order = painter.back_to_front(solids, painter.piece_faces(solids), view)
        assert sorted(order) == list(range(len(solids)))
        place = np.argsort(order)
        assert place[0] < place[1:].min()
        for a in range(1, len(solids)):
            for b in range(1, len(solids)):
                ahead = (solids[b].vertices - solids[a].vertices)[0] @ view.towards
                overlap = [np.ptp(view.project(np.vstack([solids[a].vertices, solids[b].vertices])), axis=0),
                           np.ptp(view.project(solids[a].vertices), axis=0)]
                if ahead > 0 and (overlap[0] < 1.99 * overlap[1]).all():
                    assert place[a] < place[b]


def test_painter_order_agrees_with_depth_along_random_rays():
    rng = np.random.default_rng(5)
    cells = [(i, j, k) for i in range(4) for j in range(4) for k in range(4) if rng.random() < 0.5]
    solids = [box(np.array(c, dtype=float), np.array(c) + (1.0, 0.9, 0.8)) for c in cells]
    view = painter.camera(-37.0, 31.0)
    faces = painter.piece_faces(solids)
    place = np.argsort(painter.back_to_front(solids, faces, view))
    for _ in range(300):
        origin = rng.uniform(0, 4, 3)
        hits = []
        for k in range(len(solids)):
            # a ray against half-spaces: enters where the last of them begins, leaves where the first of them ends
            slope, gap = faces.normal[k] @ view.towards, faces.offset[k] - faces.normal[k] @ origin
            near = max((gap / slope)[slope < 0])
            far = min((gap / slope)[slope > 0])
            if near < far:
                hits.append((far, k))
        seen = [k for _, k in sorted(hits)]
        assert [place[k] for k in seen] == sorted(place[k] for k in seen)


@pytest.mark.parametrize("number", [1, 2])
def test_a_mode_shape_hides_no_stone_behind_one_that_it_presses_into(number):
    # blocks of a mode overlap where joints are closed: three of a corner once hid each other in a ring, and the ring
    # was broken anywhere. Along every ray the nearest stone is seen, where it leads by more than they overlap
    joint = lm.Joint(33.0, normal_stiffness=4e9, shear_stiffness=1.6e9)
    wall = lm.build.wall(length=1.6, courses=8, unit=(0.4, 0.2, 0.2), plan="U", return_length=0.8, joint=joint)
    shape = lm.modes(wall, number).shape[number - 1]
    shape = shape * 0.1 / np.abs(shape[:, :3]).max()
    solids = [
        p._replace(vertices=b.centroid + u[:3] + (p.vertices - b.centroid) @ turn.T)
        for b, u, turn in zip(wall.blocks, shape, rotation_matrices(shape[:, 3:]), strict=True)
        for p in b.parts
    ]
    view, rng = painter.camera(*painter.VIEWPOINT_DEG), np.random.default_rng(2)
    faces = painter.piece_faces(solids)
    place = np.argsort(painter.back_to_front(solids, faces, view))
    slope, told = faces.normal @ view.towards, 0
    for start in rng.uniform((0.0, 0.0, 0.0), (1.6, 0.8, 1.6), (2000, 3)):
        at = (faces.offset - faces.normal @ start) / slope
        near, far = np.where(slope < 0, at, -np.inf).max(axis=1), np.where(slope > 0, at, np.inf).min(axis=1)
        seen = sorted(((far[k], k) for k in np.flatnonzero(near < far)), reverse=True)
        if len(seen) > 1 and seen[0][0] > seen[1][0] + 0.03:
            told += 1
            assert place[seen[0][1]] == max(place[k] for _, k in seen)
    assert told > 1000


def test_cut_edges_between_convex_pieces_are_not_drawn_in_space():
    portal = make_portal().blocks[1]
    edges = [e for piece in outline.visible_edges(portal.parts, 1e-4) for e in piece]
    # in a re-entrant corner the pieces on both sides have the edge
    unique = {tuple(np.round(sorted([e.start.tolist(), e.end.tolist()]), 6).ravel().tolist()) for e in edges}
    length = sum(float(np.linalg.norm(np.subtract(e[3:], e[:3]))) for e in unique)
    # a prism over eight corners: both outlines, and eight edges across
    perimeter = 3 + 2 * 1.8 + 2 * 1.0 + 3 * 1.0
    assert length == pytest.approx(2 * perimeter + 8 * 0.6, rel=1e-3)
    # two boxes that overlap in part of a face: the edge in the corner between them is real
    lap = [box((0, 0, 0), (2, 1, 1)), box((0, 0, 1), (1, 1, 2))]
    ends = {tuple(np.round(sorted([e.start.tolist(), e.end.tolist()]), 9).ravel().tolist())
            for piece in outline.visible_edges(lap, 1e-4) for e in piece}
    assert (1, 0, 1, 1, 1, 1) in ends
    assert (0, 0, 1, 1, 0, 1) not in ends
    assert (0, 0, 1, 0, 1, 1) not in ends


def test_only_faces_towards_the_viewer_are_painted_and_cuts_are_not():
    assembly = make_portal()
    figure = figures.assembly(assembly, view="3d")
    paths, colours = artist(figure, "blocks").get_paths(), artist(figure, "blocks").get_facecolors()
    filled = [p for p, c in zip(paths, colours, strict=True) if c[3] > 0]
    parts = assembly.blocks[1].parts
    view = painter.camera(-58.0, 22.0)
    faces = painter.piece_faces(parts)
    expected = 3 + 3 + int((np.nan_to_num(faces.normal @ view.towards) > 1e-9).sum())
    cut = expected - len(filled)
    # every cut is one face of two pieces, and the viewer sees one side of it
    assert cut == len(parts) - 1


def test_moving_joints_are_marked_in_space_on_what_the_viewer_sees():
    assembly = make_column()
    figure = figures.mechanism(assembly, rocking(assembly, [3], (0.5, 0.0, 2.0), (1, 0, 0)), view="3d")
    edges = artist(figure, "blocks").get_edgecolors()
    opening = np.array(to_rgba(style.OPENING))
    marks = [p for p, e in zip(artist(figure, "blocks").get_paths(), edges, strict=True) if np.allclose(e, opening)]
    # seen from a corner: two edges of the open joint on the block above, two on the block below
    assert sum(len(p.vertices) // 2 for p in marks) == 4
    assert "joint opens" in legend_labels(figure)


def test_triad_has_the_length_it_states():
    figure = figures.assembly(make_column(), view="3d")
    stated = float(artist(figure, "scale").get_text().removeprefix("axes ").removesuffix(" m"))
    arrows = [a for a in figure.axes[0].texts if getattr(a, "arrow_patch", None) is not None]
    drawn = sorted(float(np.linalg.norm(np.subtract(a.xy, a.xyann))) for a in arrows)
    view = painter.camera(-58.0, 22.0)
    assert drawn == pytest.approx(sorted(stated * np.linalg.norm(view.project(np.eye(3)), axis=1)))


# ---- forces -----------------------------------------------------------------------------------------------------


def stacked_forces(assembly, offsets):
    """Weight passed down a column, at the given distances of the centre of pressure from the middle."""
    x = assembly.arrays
    order = np.argsort(x.centre[:, 2])
    k = len(order)
    position, owner, force = [], [], []
    for level, (row, e) in enumerate(zip(order, offsets, strict=True)):
        total = 1000.0 * (k - level)
        for end, share in ((0.0, 0.5 - e), (1.0, 0.5 + e)):
            position.append((end, 0.25, x.centre[row, 2]))
            owner.append(row)
            force.append((0.0, 0.0, total * share))
    zero = np.zeros(k)
    return Resultants(
        zero, np.zeros((k, 2)), np.zeros((k, 2)), zero, np.array(position), np.array(owner), np.full(len(owner), 0.25),
        np.array(force),
    )


def test_line_of_thrust_joins_the_centres_of_pressure_from_the_foot_up():
    assembly = make_column().renumbered([0, 3, 1, 2])
    resultants = stacked_forces(assembly, (0.4, 0.2, 0.05))
    prediction = make_prediction(assembly, None, resultants)
    figure = figures.contact_forces(assembly, prediction)
    points = artist(figure, "centres of pressure").get_offsets()
    assert np.allclose(points, [(0.9, 0.0), (0.7, 1.0), (0.55, 2.0)])
    segments = artist(figure, "thrust line").get_segments()
    assert np.allclose(np.concatenate(segments), [(0.9, 0), (0.7, 1), (0.7, 1), (0.55, 2)])
    width = artist(figure, "thrust line").get_linewidths()
    assert width[0] / width[1] == pytest.approx(2.5 / 1.5)
    assert {"3 kN", "line of thrust"} <= set(legend_labels(figure))
    bare = figures.contact_forces(assembly, prediction, thrust_line=False)
    assert not has(bare, "thrust line")
    assert len(artist(bare, "forces").get_segments()) == 3


def test_segments_follow_the_resultant_and_turn_blue_at_the_friction_limit():
    assembly = make_column(1)
    for tangent, blue in ((0.5, False), (JOINT.tan_phi, True)):
        force = np.array([[1000.0 * tangent, 0.0, 1000.0]])
        resultants = Resultants(
            np.zeros(1), np.zeros((1, 2)), np.zeros((1, 2)), np.zeros(1), np.array([[0.3, 0.25, 0.0]]), np.array([0]),
            np.array([0.5]), force,
        )
        figure = figures.contact_forces(assembly, make_prediction(assembly, None, resultants))
        lines = artist(figure, "forces")
        (segment,) = lines.get_segments()
        assert np.allclose(segment.mean(axis=0), (0.3, 0.0))
        along = segment[1] - segment[0]
        assert along[0] / along[1] == pytest.approx(tangent)
        assert np.allclose(lines.get_colors()[0], to_rgba(style.BLUE if blue else style.BLACK))
        assert ("at friction limit" in legend_labels(figure)) == blue


def test_a_wall_has_no_line_of_thrust():
    outlines = [GROUND] + [[[i, k], [i + 1, k], [i + 1, k + 1], [i, k + 1]] for k in range(2) for i in range(2)]
    wall = Assembly.from_polygons([np.array(o, dtype=float) for o in outlines], thickness=1, joint=JOINT, fixed=[0])
    k = len(wall.interfaces)
    x = wall.arrays
    resultants = Resultants(
        np.ones(k), np.zeros((k, 2)), np.zeros((k, 2)), np.zeros(k), x.centre, np.arange(k), x.area, 1e3 * x.normal
    )
    found = joint_forces(wall, make_prediction(wall, None, resultants))
    assert found.carries.all()
    assert thrust_lines(wall, found) == []


def test_line_of_thrust_of_an_arch_runs_from_springing_to_springing():
    angle = np.linspace(math.pi, 0.0, 8)
    inner, outer = (r * np.column_stack([np.cos(angle), np.sin(angle)]) for r in (1.0, 1.3))
    outlines = [np.array([inner[i], inner[i + 1], outer[i + 1], outer[i]]) for i in range(7)]
    feet = [np.array([[s * 0.9, -0.3], [s * 1.4, -0.3], [s * 1.4, 0.0], [s * 0.9, 0.0]]) for s in (-1, 1)]
    order = [3, 0, 5, 1, 6, 2, 4]
    arch = Assembly.from_polygons([outlines[i] for i in order] + feet, thickness=1.0, joint=JOINT, fixed=[7, 8])
    x = arch.arrays
    k = len(x.centre)
    resultants = Resultants(
        np.ones(k), np.zeros((k, 2)), np.zeros((k, 2)), np.zeros(k), x.centre, np.arange(k), x.area, 1e3 * x.normal
    )
    (line,) = thrust_lines(arch, joint_forces(arch, make_prediction(arch, None, resultants)))
    polar = np.arctan2(line.centre[:, 2], line.centre[:, 0])
    assert len(polar) == 8
    assert (np.diff(polar) > 0).all() or (np.diff(polar) < 0).all()
    assert sorted(line.interfaces) == list(range(8))


def test_forces_in_space_and_missing_resultants():
    assembly = make_column()
    prediction = make_prediction(assembly, None, stacked_forces(assembly, (0.1, 0.1, 0.1)))
    figure = figures.contact_forces(assembly, prediction, view="3d")
    points = artist(figure, "centres of pressure").get_offsets()
    expected = painter.camera(-58.0, 22.0).project(np.array([(0.6, 0.25, z) for z in (0, 1, 2)]))
    assert np.allclose(points, expected)
    with pytest.raises(ValueError, match="no joint forces"):
        figures.contact_forces(assembly, make_prediction(assembly, None))


# ---- comparison -------------------------------------------------------------------------------------------------

ROWS = [("a", 1.0, 1.05, "one"), ("b", 2.0, 2.4, "one"), ("c", 4.0, (3.0, 5.0), "two"), ("d", 3.0, math.nan, "two")]


def test_comparison_has_line_of_agreement_band_and_every_point():
    figure = figures.predicted_against_published(ROWS, quantity="V [kN]", published="measured")
    x, y = artist(figure, "1:1").get_data()
    assert np.array_equal(x, y)
    (ax,) = figure.axes
    assert (ax.get_xlim(), ax.get_aspect()) == (ax.get_ylim(), 1.0)
    band = artist(figure, "band").get_paths()[0].vertices
    slopes = (band[:, 1] / np.where(band[:, 0] > 0, band[:, 0], np.nan))[band[:, 0] > 1]
    assert np.nanmin(slopes) == pytest.approx(0.9)
    assert np.nanmax(slopes) == pytest.approx(1.1)
    points = [line for line in ax.lines if line.get_gid() == "points"]
    assert sorted(xy for line in points for xy in zip(*line.get_data(), strict=True)) == [(1, 1.05), (2, 2.4), (4, 4)]
    assert len({line.get_color() for line in points}) == len({line.get_marker() for line in points}) == 2
    bar = artist(figure, "range").get_segments()
    assert np.allclose(bar, [[(4, 3), (4, 5)]])
    said = texts(figure).replace("\n", " ")
    assert "3 values · 2 within ±10 %" in said
    assert "1 without a finite value not shown" in said
    assert ax.get_xlabel() == "measured V [kN]"
    assert legend_labels(figure) == ["one", "two"]


def test_a_value_on_the_edge_of_the_band_is_inside_in_any_unit():
    x, y = 766136.87, 842750.557  # 10 % apart as written, and 1e-11 more in floating point
    assert y - x > 0.1 * x
    assert "1 within ±10 %" in texts(figures.predicted_against_published([("a", x, y)]))


def test_names_beside_points_keep_apart_on_small_axes_too():
    figure = style.blank(6.0, 2.0)
    ax = figure.add_axes((0.05, 0.2, 0.25, 0.75))
    figures.predicted_against_published([(f"wall {y}", 1.0, y) for y in (0.9, 1.0, 1.009, 1.018, 1.1)], ax=ax)
    figure.canvas.draw()
    boxes = [Text.get_window_extent(t) for t in ax.texts if t.get_gid() == "label"]  # without lines to the points
    assert len(boxes) == 5
    assert not any(a.overlaps(b) for i, a in enumerate(boxes) for b in boxes[:i])


@pytest.mark.parametrize("labels, shown", [("all", "abc"), ("auto", "abc"), ("outside", "b"),
    pytest.param("none", "", marks=pytest.mark.slow)])
def test_comparison_names_points(labels, shown):
    (ax,) = figures.predicted_against_published(ROWS, labels=labels).axes
    assert "".join(sorted(t.get_text() for t in ax.texts if t.get_gid() == "label")) == shown


def test_comparison_errors_name_the_row():
    with pytest.raises(ValueError, match=r"row 1: expected \(label"):
        figures.predicted_against_published([("a", 1, 1), ("b", 2)])
    with pytest.raises(ValueError, match=r"row 0 \(a\): 'x' is not a number"):
        figures.predicted_against_published([("a", "x", 1)])
    with pytest.raises(ValueError, match=r"row 0 \(a\): a range is"):
        figures.predicted_against_published([("a", 1, (3, 2, 1))])
    with pytest.raises(ValueError, match="none of the 1 rows"):
        figures.predicted_against_published([("a", math.nan, 1)])
    # a range with an end that is not known has no value, whichever end it is
    for ends in ((1.0, math.nan), (math.nan, 1.0)):
        told = texts(figures.predicted_against_published([("a", ends, 1.0), ("b", 1.0, 1.0)]))
        assert "1 without a finite value not shown" in " ".join(told.split())
    with pytest.raises(ValueError, match="row 'a' is not positive"):
        figures.predicted_against_published([("a", 0.0, 1.0), ("b", 1.0, 1.0)], log=True)


def test_comparison_on_logarithmic_axes():
    (ax,) = figures.predicted_against_published([("a", 0.01, 0.02), ("b", 100.0, 90.0)], log=True).axes
    assert (ax.get_xscale(), ax.get_yscale()) == ("log", "log")


# ---- the package ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", ["png", pytest.param("pdf", marks=pytest.mark.slow), "svg"])
def test_figures_are_written_for_print(tmp_path, suffix):
    assembly = make_column()
    path = tmp_path / f"wall.{suffix}"
    figures.mechanism(assembly, rocking(assembly, [2, 3], (1, 0.25, 1))).savefig(path)
    assert path.stat().st_size > 3000


def test_text_stays_inside_the_page():
    assembly = make_column(8)
    figure = figures.mechanism(assembly, rocking(assembly, range(1, 9)), title="A slender pier")
    figure.canvas.draw()
    width, height = figure.get_size_inches()
    ink = figure.get_tightbbox()
    assert 0.0 <= ink.x0 < ink.x1 <= width
    assert 0.0 <= ink.y0 < ink.y1 <= height
    # caption, drawing and legend do not overlap
    caption = next(t for t in figure.texts if t.get_gid() == "caption").get_window_extent()
    drawing = figure.axes[0].get_tightbbox()
    legend = figure.legends[0].get_window_extent()
    assert caption.y0 > figure.axes[0].get_window_extent().y1
    assert drawing.y0 > legend.y1


def test_drawing_leaves_matplotlib_settings_alone():
    import matplotlib as mpl

    before = dict(mpl.rcParams)
    figures.assembly(make_column())
    assert dict(mpl.rcParams) == before


@functools.cache
def loaded_with(module):
    """Names of the modules that a fresh process holds after one import."""
    code = f"import sys, {module}; print(*sys.modules)"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()


@pytest.mark.parametrize(
    "module, absent",
    [("limitmason", "matplotlib"), ("limitmason", "cvxpy"),
        pytest.param("limitmason.figures", "matplotlib.pyplot", marks=pytest.mark.slow),
     # neither pyplot nor the simulation
     *(pytest.param("limitmason.figures", name, marks=pytest.mark.slow) for name in ("cvxpy", "dem", "numba"))],
)
def test_import_is_light(module, absent):
    assert module in loaded_with(module)
    assert absent not in loaded_with(module)


def test_a_cycle_brings_nothing_forward_that_it_hides():
    # 0 is behind 1, 1 behind 2, 2 behind 0; 2 is behind 3 and 3 behind 4, though 4 lies farthest away by its middle
    depth = np.array([3.0, 4.0, 5.0, 2.0, 1.0])
    order = painter._sorted_by_depth(5, [0, 1, 2, 2, 3], [1, 2, 0, 3, 4], depth, [0.3, 0.1, 0.2, 1.0, 1.0])
    assert order == [2, 0, 1, 3, 4]  # the least sure, 1 behind 2, is given up
