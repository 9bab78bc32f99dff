"""What an object shows of itself: a short line in a terminal, words and a picture in a notebook."""

import pickle

import pytest

import dem
import limitmason as lm
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


def test_a_short_line_does_not_make_two_structures_the_same_to_a_store():
    # same counts, sizes and names, another bond: values on disk of one must not be taken for the other's
    other = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT, start="half")
    rough = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=lm.Joint(34.0))
    texts = {fingerprint({"wall": w}) for w in (WALL, other, rough)}
    assert len(texts) == 3
    again = lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT)
    assert fingerprint({"wall": again}) == fingerprint({"wall": WALL})
