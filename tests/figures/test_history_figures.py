"""Figures and files of a simulation: what is drawn and written is where the blocks are."""

import types
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from scipy.spatial.transform import Rotation

import dem
import limitmason as lm
from limitmason import figures
from limitmason.errors import InputError
from limitmason.figures.crack_patterns import point_text
from limitmason.figures.deformation import cracked_joints, rigid_motion
from limitmason.geometry import box
from limitmason.geometry.rotation import rotation_matrices, rotation_vectors

JOINT = lm.Joint(35.0)
COLUMN = lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=3, joint=JOINT)
TOP = COLUMN.n_blocks - 1


def turned(angle, axis=(0.0, 1.0, 0.0)):
    return np.array([np.cos(0.5 * angle), *(np.sin(0.5 * angle) * np.array(axis))])


def at_rest(samples=None):
    """Displacements and quaternions of the column at rest, for one state or for several samples."""
    shape = () if samples is None else (samples,)
    quaternion = np.zeros((*shape, COLUMN.n_blocks, 4))
    quaternion[..., 0] = 1.0
    return np.zeros((*shape, COLUMN.n_blocks, 3)), quaternion


def artist(figure, gid):
    return next(a for a in figure.findobj() if a.get_gid() == gid)


@pytest.fixture(scope="module")
def pushed():
    """A column whose top block is pushed 20 mm: it slides at mu times its weight."""
    stages = [dem.Settle(tolerance=1e-4), dem.Drive(displacement={TOP: {"x": 0.02}}, steps=4000)]
    return dem.simulate(COLUMN, stages, contact_points=(2, 2), sample=200)


# ---- rotations ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-4, 0.3, 2.0, 3.1])
def test_rotation_of_a_quaternion_and_of_its_vector_are_the_same(angle):
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    q = turned(angle, axis)
    assert rotation_vectors(q) == pytest.approx(angle * axis, abs=1e-14)
    assert rotation_vectors(-q) == pytest.approx(angle * axis, abs=1e-14)
    r = rotation_matrices(angle * axis)
    assert r @ r.T == pytest.approx(np.eye(3), abs=1e-14)
    x = np.array([0.3, 0.5, -0.7])
    along = (axis @ x) * axis
    # Rodrigues
    expected = along + np.cos(angle) * (x - along) + np.sin(angle) * np.cross(axis, x)
    assert r @ x == pytest.approx(expected, abs=1e-14)


# ---- curves ---------------------------------------------------------------------------------------------------------


def test_load_displacement_curve_of_a_sliding_block_ends_at_its_friction(pushed):
    figure = figures.load_displacement(pushed)
    x, y = artist(figure, "curve").get_data()
    assert x[-1] == pytest.approx(20.0, rel=1e-9)
    assert y[-1] == pytest.approx(1e-3 * JOINT.tan_phi * COLUMN.weights[TOP], rel=1e-3)


def test_every_measured_level_has_a_line_of_its_own():
    panel = lm.experiments.load("brick-panels-opening", "S1")
    figure = figures.load_displacement({"a": ([0.0, 1e-3], [0.0, 4e3])}, measured=panel)
    lines = [line for line in figure.axes[0].lines if str(line.get_gid()).startswith("measured")]
    assert len(lines) == len(panel.measured) == 2
    assert len({str(line._unscaled_dash_pattern) for line in lines}) == len(lines)


def test_load_displacement_takes_arrays_points_and_levels(pushed):
    named = {"dem": pushed, "test": ([0.0, 1e-3], [0.0, 2e3])}
    figure = figures.load_displacement(named, points=[("peak", 5e-3, 1500.0)], levels={"limit analysis": 1200.0})
    assert artist(figure, "curve test").get_ydata() == pytest.approx([0.0, 2.0])
    assert [float(v[0]) for v in artist(figure, "point peak").get_data()] == pytest.approx([5.0, 1.5])
    assert artist(figure, "level limit analysis").get_ydata()[0] == pytest.approx(1.2)
    shown = {t.get_text() for t in figure.legends[0].get_texts()}
    assert shown == {"dem", "test", "peak", "limit analysis"}


def test_curves_that_do_not_fit_together_are_named():
    with pytest.raises(ValueError, match="'a' has displacements of shape"):
        figures.load_displacement({"a": ([0.0, 1.0], [1.0])})
    with pytest.raises(ValueError, match="neither a history nor a pair"):
        figures.load_displacement({"a": 3.0})
    undriven = types.SimpleNamespace(assembly=COLUMN, reaction_blocks=[0], curve=None)
    with pytest.raises(ValueError, match="name the driven block"):
        figures.load_displacement(undriven)
    with pytest.raises(ValueError, match="'b' has shape"):
        figures.history_curves({"step": [0, 1], "b": [1.0]}, ["b"])


def test_history_curves_draw_every_quantity_and_leave_non_positive_values_out_of_a_log_axis(pushed):
    figure = figures.history_curves(pushed, ("kinetic", "friction"), units={"kinetic": "J", "friction": "J"})
    assert artist(figure, "curve friction").get_ydata() == pytest.approx(pushed["friction"])
    assert figure.axes[0].get_ylabel() == "[J]"
    figure = figures.history_curves({"step": [0, 1, 2], "f": [0.0, 1.0, 10.0]}, iter(["f"]), log=True)
    assert np.isnan(artist(figure, "curve f").get_ydata()).tolist() == [True, False, False]


def test_units_of_a_history_stand_on_its_diagrams_without_being_given(pushed):
    """They are those of its table: joules on the axis, metres and radians, which differ, beside their names."""
    axes = figures.history_curves(pushed, ["kinetic", "elastic"], against="time").axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [s]", "[J]")
    axes = figures.history_curves(pushed, ["tilt", "largest slip", "multiplier"]).axes[0]
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("step", "")
    assert [line.get_label() for line in axes.get_lines()] == ["tilt [rad]", "largest slip [m]", "multiplier"]


# ---- deformed shapes ------------------------------------------------------------------------------------------------


def test_deformed_shape_is_where_the_history_says_the_blocks_are():
    shift, quaternion = at_rest()
    shift[TOP], quaternion[TOP] = (0.1, 0.0, 0.05), turned(0.6)
    figure = figures.deformed(COLUMN, (shift, quaternion))
    path = artist(figure, "blocks").get_paths()[-1]
    fake = types.SimpleNamespace(assembly=COLUMN, shift=shift[None], quaternion=quaternion[None], _column=int)
    corners = dem.History.corners(fake)[TOP][:, [0, 2]]
    drawn = path.vertices[:4]
    for corner in corners:
        assert np.linalg.norm(drawn - corner, axis=1).min() < 1e-12


def test_enlarged_shape_turns_by_a_larger_angle_and_keeps_blocks_rigid():
    shift, quaternion = at_rest()
    quaternion[TOP] = turned(0.01)
    path = artist(figures.deformed(COLUMN, (shift, quaternion), scale=50.0), "blocks").get_paths()[-1]
    sides = np.linalg.norm(np.diff(path.vertices[:5], axis=0), axis=1)
    assert sorted(sides) == pytest.approx([0.2, 0.2, 0.4, 0.4])
    slope = np.diff(path.vertices[:5], axis=0)[np.argmax(sides)]
    assert abs(np.arctan(slope[1] / slope[0])) == pytest.approx(0.5)


@pytest.mark.parametrize("move, opens, slides", [((0, 0, 0.01), 1, 0), ((0.01, 0, 0), 0, 1), ((0.02, 0, 0.01), 0, 1)])
def test_joint_is_marked_by_the_larger_of_opening_and_slip(move, opens, slides):
    shift, quaternion = at_rest()
    shift[TOP] = move
    marks = cracked_joints(COLUMN, rigid_motion(COLUMN, shift, rotation_vectors(quaternion), 1.0), None)
    assert (marks.opens.sum(), marks.slides.sum()) == (opens, slides)


def test_joint_of_a_structure_turned_as_a_whole_is_not_marked():
    shift, quaternion = at_rest()
    quaternion[:] = turned(0.5)
    r = rotation_matrices(np.array([0.0, 0.5, 0.0]))
    shift[:] = COLUMN.centroids @ r.T - COLUMN.centroids
    marks = cracked_joints(COLUMN, rigid_motion(COLUMN, shift, rotation_vectors(quaternion), 1.0), None)
    assert not marks.opens.any()
    assert not marks.slides.any()


@pytest.mark.parametrize("view", ["elevation", "3d"])
def test_states_histories_and_arrays_give_the_same_figure(pushed, view):
    shown = [
        figures.deformed(COLUMN, s, view=view)
        for s in (pushed, pushed.state, (pushed.shift[-1], pushed.quaternion[-1]))
    ]
    assert all(isinstance(f, Figure) for f in shown)
    pictures = [np.asarray(f.canvas.buffer_rgba()) for f in shown if f.canvas.draw() is None]
    assert all(np.array_equal(pictures[0], p) for p in pictures[1:])


def test_a_capacity_curve_and_its_states_give_the_figure_of_their_displacements():
    curve = lm.pushover(COLUMN, lm.Loads.horizontal(COLUMN), to=0.01)
    last = curve.states[-1]
    placed = (last.shift, Rotation.from_matrix(np.eye(3) + last.turn).as_quat()[:, [3, 0, 1, 2]])
    wanted = artist(figures.deformed(COLUMN, placed), "blocks").get_paths()
    for shown, options in ((curve, {}), (curve, {"sample": len(curve) - 1}), (last, {})):
        paths = artist(figures.deformed(COLUMN, shown, **options), "blocks").get_paths()
        for path, other in zip(paths, wanted, strict=True):
            assert path.vertices == pytest.approx(other.vertices, abs=1e-12)
    with pytest.raises(InputError, match="sample 999 is not one of the"):
        figures.deformed(COLUMN, curve, sample=999)
    with pytest.raises(InputError, match="kept no states"):
        figures.deformed(COLUMN, lm.Curve([0.0, 1.0], [0.0, 1.0]))


def test_bad_states_are_named():
    shift, quaternion = at_rest()
    with pytest.raises(ValueError, match="do not belong to"):
        figures.deformed(COLUMN, (shift[1:], quaternion[1:]))
    with pytest.raises(ValueError, match="scale must be"):
        figures.deformed(COLUMN, (shift, quaternion), scale=0.0)
    with pytest.raises(InputError, match="crack must not be negative"):
        figures.deformed(COLUMN, (shift, quaternion), crack=-1e-3)
    with pytest.raises(InputError, match="quaternion of block 'column-1' is not of length 1"):
        figures.deformed(COLUMN, (shift, quaternion * [[1.0], [0.0], *[[1.0]] * (len(shift) - 2)]))
    shift[1, 0] = np.nan
    with pytest.raises(ValueError, match="position of block '.*' is not finite"):
        figures.deformed(COLUMN, (shift, quaternion))


# ---- films and series -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("view", ["elevation", "3d"])
def test_film_shows_the_motion_from_first_to_last_sample(pushed, tmp_path, view):
    path = figures.animate(COLUMN, pushed, tmp_path / "film.gif", frames=5, dpi=50, view=view)
    with Image.open(path) as film:
        assert film.n_frames == 5
        first = np.asarray(film.convert("L"), dtype=float)
        film.seek(4)
        last = np.asarray(film.convert("L"), dtype=float)
    assert first.shape == last.shape
    assert np.abs(first - last).max() > 50


def test_film_needs_samples():
    with pytest.raises(ValueError, match="no sample"):
        figures.animate(COLUMN, types.SimpleNamespace(shift=[], quaternion=[]), "film.gif")
    for wrong, told in (({"frames": 0}, "frames"), ({"fps": 0}, "fps"), ({"history": COLUMN}, "by samples"),
                        ({"model": "wall"}, "model must be an Assembly")):
        still = types.SimpleNamespace(shift=np.zeros((1, COLUMN.n_blocks, 3)), quaternion=UPRIGHT[None])
        with pytest.raises(InputError, match=told):
            figures.animate(**{"model": COLUMN, "history": still, "path": "film.gif", **wrong})


UPRIGHT = np.tile([1.0, 0.0, 0.0, 0.0], (COLUMN.n_blocks, 1))


class Taken:
    """A writer of films that keeps where the highest block is drawn."""

    def __init__(self):
        self.right = []

    @contextmanager
    def saving(self, figure, path, dpi):
        self.axes = figure.axes[0]
        yield

    def grab_frame(self):
        paths = [p for c in self.axes.collections if c.get_gid() in ("blocks", "still") for p in c.get_paths()]
        self.right.append(max(paths, key=lambda p: p.vertices[:, 1].max()).vertices[:, 0].max())


def test_a_block_that_comes_back_is_seen_to_move(tmp_path):
    shift = np.zeros((3, COLUMN.n_blocks, 3))
    shift[1, -1, 0], shift[2, 1, 0] = 0.3, 0.01
    film, writer = types.SimpleNamespace(shift=shift, quaternion=np.stack([UPRIGHT] * 3)), Taken()
    figures.animate(COLUMN, film, tmp_path / "new" / "film.gif", view="elevation", writer=writer)
    assert np.diff(writer.right) == pytest.approx([0.3, -0.3])


def test_cracks_are_drawn_of_walls_alone():
    leaves = [box((x, y, z), (x + 1, y + 1, z + 1)) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    two = lm.Assembly.from_polyhedra(leaves, joint=lm.Joint(30.0), fixed=[0, 2, 4, 6])
    rest = np.zeros((8, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (8, 1))
    curve = types.SimpleNamespace(
        assembly=two, failed=np.zeros((1, 12)), opening=np.zeros((1, 12)), slip=np.zeros((1, 12)), states=[rest],
        point=lambda _: lm.answers.CurvePoint(0, 0.0, 0.0),
    )
    with pytest.raises(InputError, match="no plane of its own"):
        figures.cracks(curve, at=("end",))
    for draw in (figures.cracks, figures.plasticity):
        with pytest.raises(InputError, match="at must be a list, got 'peak'"):  # no moment 'p'
            draw(types.SimpleNamespace(assembly=two, failed=(), zones=("one",)), at="peak")
    with pytest.raises(InputError, match="name at least one moment"):
        figures.plasticity(types.SimpleNamespace(zones=("one",)), at=())


def test_a_moment_is_told_in_the_units_of_its_curve():
    for units, words in ((("m", "N"), "peak: 5 kN at 2 mm"), (("mm", "kN"), "peak: 5 kN at 2 mm")):
        x, y = (0.002, 5e3) if units[0] == "m" else (2.0, 5.0)
        assert point_text(lm.Curve([0.0, x], [0.0, y], *units), 1, "peak") == words


def test_labels_that_begin_with_an_underscore_stay_out_of_the_legend():
    pair = np.array([0.0, 1e-3]), np.array([0.0, 1e3])
    figure = figures.load_displacement({"_run 1": pair, "run 2": pair}, levels={"_peak": 500.0})
    labels = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    assert labels == ["run 2"]


def test_what_cannot_be_drawn_beside_curves_is_refused_by_name():
    curve = lm.Curve([0.0, 1e-3], [0.0, 1e3])
    for options, told in (
        ({"block": 3}, "block=3 is that of a history"), ({"points": [("a", 1.0)]}, "a point is"),
        ({"points": [("a", "1", 2.0)]}, "displacement of point 'a'"),
    ):
        with pytest.raises(InputError, match=told):
            figures.load_displacement(curve, **options)
    with pytest.raises(InputError, match="give the number of a sample, 0 to 1, got 2"):
        curve.point(2)


def test_a_caption_stands_above_axes_of_the_caller_too():
    axes = Figure().add_subplot()
    figures.load_displacement(lm.Curve([0.0, 1e-3], [0.0, 1e3]), ax=axes, title="Pier", caption="of brick")
    assert axes.get_title(loc="left") == "Pier"
    assert [t.get_text() for t in axes.texts if t.get_gid() == "caption"] == ["of brick"]


def test_a_capacity_curve_is_drawn_as_multiplier_or_beside_forces():
    loads = lm.Loads.horizontal(COLUMN)
    curve = lm.pushover(COLUMN, loads, to=0.01)
    alone = figures.load_displacement(curve)
    assert alone.axes[0].get_ylabel() == "multiplier λ [-]"
    assert np.allclose(artist(alone, f"curve {curve.label}").get_ydata(), curve.load)
    beside = figures.load_displacement(curve, measured=lm.Curve([0.0, 0.01], [0.0, 500.0], label="test"))
    weight = float(loads.live[~COLUMN.fixed, 0].sum())
    assert np.allclose(artist(beside, f"curve {curve.label}").get_ydata(), 1e-3 * weight * curve.load)
    force = curve.as_force()
    assert np.allclose(force.multiplier, curve.load)
    assert force.load_unit == "N"
    live = np.zeros_like(loads.live)
    live[[TOP, TOP - 1], 0] = 1.0, -1.0
    couple = lm.Loads(loads.dead, live)
    with pytest.raises(InputError, match="no resultant"):
        lm.pushover(COLUMN, couple, control=(TOP, "x"), to=1e-4).as_force()


def test_every_record_has_its_figure(pushed):
    assert "note: " in str(lm.pushover(COLUMN, lm.Loads.horizontal(COLUMN)))  # the stiffness that no joint names
    assert len(lm.modes(COLUMN).plot(number=2).axes)
    shown = pushed.plot()
    top = artist(shown, "curve x").get_ydata()
    assert np.allclose(top, 1e3 * pushed.displacement_of(TOP)[:, 0])
    assert shown.axes[0].get_xlabel() == "step"  # in quasi-static mode time counts steps
    shaken = dem.simulate(COLUMN, dem.Hold(duration=0.01), mode="dynamic", sample=5)
    assert shaken.plot().axes[0].get_xlabel() == "time [s]"
    with pytest.raises(InputError, match="nothing recorded"):
        replace(pushed, shift=pushed.shift[:0], quaternion=pushed.quaternion[:0]).plot()
    with pytest.raises(InputError, match="no figure of a History with 'kinetic'"):
        pushed.plot("kinetic")
    assert "<svg" in pushed._repr_html_()
    assert "<svg" in lm.modes(COLUMN)._repr_html_()


def test_rotation_of_a_block_carries_its_corners(pushed):
    turn = rotation_matrices(pushed.rotation_of(TOP)[-1])
    corners = COLUMN.blocks[TOP].vertices
    moved = COLUMN.centroids[TOP] + pushed.displacement_of(TOP)[-1] + (corners - COLUMN.centroids[TOP]) @ turn.T
    assert np.allclose(moved, pushed.corners(-1)[TOP], atol=1e-12)
