"""What an object shows of itself: a short line in a terminal, words and a picture in a notebook."""

import pickle
from enum import Enum
from functools import partial

import numpy as np
import pytest

import dem
import limitmason as lm
import mechanisms
from limitmason.errors import InputError
from limitmason.study import fingerprint

JOINT = lm.Joint(33.0)
WALL = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT)
LOADS = lm.Loads.horizontal(WALL)


@pytest.fixture(scope="module")
def answer():
    return lm.limit_analysis(WALL, LOADS)


def test_lines_are_short_and_say_what_counts(answer):
    history = dem.simulate(WALL, [dem.Settle()])
    shown = [WALL, WALL.blocks[1], WALL.interfaces[0], LOADS, answer, answer.mechanism, answer.resultants, history]
    for thing in shown:
        line = repr(thing)
        assert len(line) < 250, line
        assert "\n" not in line
    assert f"{WALL.n_blocks} blocks" in repr(WALL)
    assert f"{answer.collapse_multiplier:.6g}" in repr(answer)
    # weight by hand: three courses of 1.2 x 0.2 x 0.2 m at 2000 kg/m3
    assert f"{3 * 1.2 * 0.2 * 0.2 * 2000 * lm.constants.GRAVITY / 1e3:.4g} kN" in repr(WALL)


def test_a_joint_is_written_as_it_is_made():
    joint = lm.Joint(33.0, cohesion=1e5, tensile_strength=5e4, name="mortar")
    assert eval(repr(joint), {"Joint": lm.Joint, "inf": float("inf")}) == joint
    assert repr(lm.Joint(33.0)) == "Joint(friction_angle_deg=33.0)"


def test_a_notebook_shows_words_and_picture(answer):
    for thing in (WALL, answer):
        page = thing._repr_html_()
        assert "<svg" in page
        assert str(thing).splitlines()[0].replace("<", "&lt;").replace(">", "&gt;")[:40] in page
    # columns of text stand below each other where the page has a proportional font, and words begin at the left
    assert 'font-family: monospace">limit analysis' in answer._repr_html_()
    assert '<td style="text-align: left">phi [deg]' in JOINT._repr_html_()
    forces = lm.force_table(answer)
    assert forces._repr_html_().count("<tr>") == len(forces.rows) + 1
    assert "<th>fx [N]</th>" in forces._repr_html_()
    table = lm.study.Table(({"a": 1.5, "b": "<x>"},), {"a": "m"}, ("a note",))
    assert table._repr_html_() == (
        "<table><thead><tr><th>a [m]</th><th>b</th></tr></thead><tbody><tr><td>1.5</td><td>&lt;x&gt;</td></tr></tbody>"
        "</table><br>a note"
    )


def test_an_answer_draws_itself_and_says_when_it_cannot(answer):
    figure = answer.plot(title="wall")
    assert figure.axes
    column = lm.build.column(width=0.2, depth=0.3, height=1.0, courses=2, joint=lm.Joint(60.0))
    curve = lm.pushover(column, lm.Loads.horizontal(column), to=0.01)
    assert curve.plot().axes[0].get_ylabel().startswith("multiplier")
    copy = pickle.loads(pickle.dumps(answer))
    assert copy.collapse_multiplier == answer.collapse_multiplier
    with pytest.raises(InputError, match="without its assembly"):
        copy.plot()
    assert copy.plot(structure=WALL).axes
    assert "<svg" not in copy._repr_html_()


def test_answers_of_every_kind_draw_themselves(answer):
    # columns of text stand below each other where the page has a proportional font, and words begin at the left
    assert 'font-family: monospace">limit analysis' in answer._repr_html_()
    assert '<td style="text-align: left">phi [deg]' in JOINT._repr_html_()
    forces = lm.force_table(answer)
    assert forces._repr_html_().count("<tr>") == len(forces.rows) + 1
    assert "<th>fx [N]</th>" in forces._repr_html_()
    table = lm.study.Table(({"psi": 0.0, "multiplier": 0.4}, {"psi": 30.0, "multiplier": 0.5}), {"psi": "deg"})
    assert table.plot("psi").axes[0].get_xlabel().startswith("psi")
    modes = lm.modes(WALL)
    assert modes.plot(2).axes
    region = lm.load_region(WALL, lm.Loads.weight(WALL), [LOADS, lm.Loads.horizontal(WALL, (0, 1, 0))], tolerance=0.3)
    for shown in (modes, lm.mac(modes, modes), lm.compare(WALL, LOADS, ("associative", "mechanisms")), region):
        assert shown.plot().axes, type(shown)
        assert "<svg" in shown._repr_html_(), type(shown)


def test_a_short_line_does_not_make_two_structures_the_same_to_a_store():
    # same counts, sizes and names, another bond: values on disk of one must not be taken for the other's
    other = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT, start="half")
    rough = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=lm.Joint(34.0))
    texts = {fingerprint({"wall": w}) for w in (WALL, other, rough)}
    assert len(texts) == 3
    again = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT)
    assert fingerprint({"wall": again}) == fingerprint({"wall": WALL})


ROOMS = (lm, dem, mechanisms, *(getattr(lm, name) for name in lm._MODULES))
WORDS = (Enum, BaseException, str, float)
CLASSES = {
    getattr(room, name) for room in ROOMS for name in room.__all__
    if isinstance(getattr(room, name), type) and not issubclass(getattr(room, name), WORDS)
}


@pytest.mark.parametrize("kind", sorted(CLASSES, key=lambda k: f"{k.__module__}.{k.__name__}"))
def test_every_public_class_has_a_text_of_its_own_and_an_html_form(kind):
    assert callable(kind._repr_html_)
    assert kind.__repr__ is not object.__repr__
    # what a dataclass or a named tuple makes by itself prints every array in full
    assert not hasattr(kind.__repr__, "__wrapped__")
    code = getattr(kind.__repr__, "__code__", None)
    assert code is None or "limitmason" in code.co_filename or kind.__module__.partition(".")[0] in code.co_filename


def test_an_object_without_words_shows_its_fields_and_what_they_mean(answer):
    damping = dem.Damping(local=0.3)
    assert repr(damping) == "Damping(local=0.3)"
    page = damping._repr_html_()
    assert '>local</td><td style="text-align: left">0.3</td>' in page
    assert "combined damping" in page  # the docstring's words stand beside the number
    # a terminal shows no array in full, however many blocks there are
    curve = lm.pushover(WALL, LOADS, to=1e-4)
    tie = lm.Tie(1, (0, 0, 0), 2, (0, 0.1, 0.5), yield_force=10.0, stiffness=1e6)
    test = lm.experiments.load("pavia-tilting", "S1")
    for thing in (curve, curve.energy, answer.certificate, WALL.arrays, test, tie, lm.causes.gain()):
        assert len(repr(thing)) < 700
        assert "array(" not in repr(thing)
        assert "<table" in thing._repr_html_() or "<pre" in thing._repr_html_()
    assert repr(answer.certificate) == "<Certificate: accepted>"
    assert repr(test) == "<Experiment: pavia-tilting/S1>"


def test_long_fields_stand_by_kind_and_size():
    target = lm.CurveTarget(lm.Curve(np.linspace(0, 1, 40), np.linspace(0, 1, 40), "m", "N"), 0.05)
    assert repr(target) == "CurveTarget(curve=curve 40 samples to 1 m, largest load 1 N at 1 m, scatter=0.05)"
    box = lm.continuum.Box(np.zeros(3), np.ones(3))
    assert repr(box) == "Box(low=[0, 0, 0], high=[1, 1, 1])"
    assert "<array 8 x 3>" in repr(WALL.blocks[1].parts[0])
    drive = dem.Drive({1: {"x": 1.0}}, steps=np.int64(7))
    assert repr(drive) == "Drive(displacement={1: {'x': 1.0}}, steps=7)"
    assert eval(repr(drive), {"Drive": dem.Drive}) == drive
    assert "<f>" in repr(lm.causes.Cause("a", "b", 0.0, (0.0, 1.0), apply=partial(lambda x: x))).replace("partial", "f")


def test_long_tables_are_cut_in_the_middle_with_a_count():
    table = lm.study.Table(tuple({"n": k} for k in range(200)))
    lines = str(table).splitlines()
    assert len(lines) == 1 + 30 + 1 + 10 + 1
    assert lines[1:3] == ["0", "1"]
    assert lines[31] == "..."
    assert lines[-1] == "160 of 200 rows are not shown: write_csv and to_dataframe have them"
    assert table._repr_html_().count("<tr>") == 1 + 41
    assert len(str(lm.study.Table(table.rows[:40])).splitlines()) == 41
    bay = lm.build.wall(length=4.0, courses=8, unit=(0.4, 0.2, 0.2), joint=JOINT)
    forces = lm.force_table(lm.limit_analysis(bay, lm.Loads.horizontal(bay)))
    assert len(forces.rows) > 100
    assert f"# {len(forces.rows) - 40} of {len(forces.rows)} rows are not shown" in str(forces)


def test_a_region_of_one_load_is_words_without_a_picture():
    region = lm.load_region(WALL, lm.Loads.weight(WALL), [LOADS], tolerance=0.3)
    page = region._repr_html_()
    assert "safe loads horizontal (1, 0, 0): closed" in page
    assert "<svg" not in page
