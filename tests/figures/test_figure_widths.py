"""One column of a journal is an option of every figure, enlarged axes say so, and lines of a study are lines."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from walls import running_bond

import limitmason as lm
from limitmason import figures, study
from limitmason.codes import GroundSpectrum
from limitmason.continuum import Box, Continuum
from limitmason.errors import InputError, NotApplicable
from limitmason.figures import notebook, style
from limitmason.figures.crack_patterns import one_a_sample
from limitmason.figures.studies import colours_of
from limitmason.methods import available_methods

WALL = running_bond(3, 4)
LOADS = lm.Loads.horizontal(WALL)


def texts(figure):
    """All words of a figure with their boxes in pixels."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    return [(t.get_text(), t.get_window_extent(renderer)) for t in figure.findobj(lambda a: hasattr(a, "get_text"))
            if t.get_visible() and t.get_text().strip()]


def drawn():
    answer = lm.limit_analysis(WALL, LOADS)
    runs = study.Table(tuple({"peak": float(p)} for p in np.random.default_rng(1).normal(5.0, 0.4, 60)))
    curve = lm.Curve(np.linspace(0.0, 0.01, 30), 1e3 * np.sin(np.linspace(0.0, 2.0, 30)))
    rows = [{"phi": a, "psi": b, "multiplier": 0.3 + 0.01 * a} for a in (20, 25, 30) for b in (0, 10)]
    yield "mechanism", lambda: figures.mechanism(WALL, answer, title="Mechanism of a wall of three units")
    yield "assembly", lambda: figures.assembly(WALL, title="Wall")
    yield "side by side", lambda: figures.side_by_side(lm.compare(WALL, LOADS, ("associative", "mechanisms")))
    yield "study", lambda: figures.study_lines(rows, "phi", caption="a caption that is longer than one narrow column")
    yield "histogram", lambda: figures.histogram(runs, "peak", label="peak [kN]")
    yield "curve", lambda: curve.plot()
    rng = np.random.default_rng(2)
    ten = lm.mac(rng.uniform(0.0, 1.0, (10, 30)), rng.uniform(0.0, 1.0, (10, 30)))
    yield "criterion", lambda: figures.mac_matrix(ten)
    slab = Continuum.from_boxes([Box(np.zeros(3), np.array([2.0, 0.2, 0.6]))], lm.Material(2e9, 0.2, 2000.0), size=0.2)
    yield "map of a solid", lambda: figures.solid_map(slab, np.arange(float(len(slab.mesh))), label="stress [MPa]")


@pytest.mark.parametrize("name, draw", list(drawn()), ids=lambda v: v if isinstance(v, str) else "")
def test_a_figure_is_as_wide_as_asked_for_and_keeps_its_words_inside(name, draw):
    usual = draw().get_size_inches()[0]
    with figures.print_style(width=style.SINGLE_COLUMN):
        narrow = draw()
    width = narrow.get_size_inches()[0]
    assert width <= 89.0 / 25.4 + 1e-9
    assert width == pytest.approx(89.0 / 25.4) or usual < 89.0 / 25.4 or name in ("mechanism", "assembly")
    page = width * narrow.dpi
    words = [(t, box) for t, box in texts(narrow) if any(c.isalpha() for c in t)]  # ticks beyond an axis are not drawn
    outside = [t for t, box in words if box.x0 < -2.0 or box.x1 > page + 2.0]
    assert not outside
    assert draw().get_size_inches()[0] == usual, "the width holds in the block alone"


def test_widths_of_no_page_and_figures_of_several_panels_are_refused():
    for wrong in (20.0, 400.0):
        with pytest.raises(InputError, match="60 to 183 mm"), figures.print_style(width=wrong):
            pass
    with figures.print_style(width=89.0), pytest.raises(NotApplicable, match="several panels"):
        style.needs_a_page("diagnosis")
    style.needs_a_page("diagnosis")
    # a notebook then shows the words alone
    one = np.ones(3)
    test = SimpleNamespace(vertical=one, horizontal=one, ratio=one, steps=one, tilt_deg=10.0 * one, collapse=1,
                           collapse_multiplier=0.2)
    assert "<svg" in notebook.html(test)
    with figures.print_style(width=89.0):
        assert notebook.html(test) == ""


@pytest.mark.parametrize(("letters", "width"), [(40, 60.0), (60, 89.0), (110, None), (12, None)])
def test_long_names_of_causes_leave_room_for_the_map(letters, width):
    names = [f"{'a cause of many words ' * 5}"[: letters - 1] + str(k) for k in range(6)]
    far = SimpleNamespace(names=names, d2=np.full((6, 6), 12.0), twins=(), invisible=())
    with figures.print_style(width=width):
        figure = figures.confusable(far)
    words = [t for t, box in texts(figure) if t.startswith("a cause") and box.x0 >= 0.0]
    assert len(words) == 6
    assert all(("…" in t) == (letters > 12) for t in words)
    assert figure.axes[0].get_position().width * figure.get_size_inches()[0] > 0.3


def test_a_verdict_by_peaks_is_as_wide_as_asked_for_and_one_of_two_panels_refuses():
    verdict = lm.assess(WALL, LOADS, GroundSpectrum(0.15, 2.45, 0.28), confidence_factor=1.0)
    with figures.print_style(width=120.0):
        assert figures.assessment(verdict).get_size_inches()[0] == pytest.approx(120.0 / 25.4)
        with pytest.raises(NotApplicable, match="several panels"):
            figures.assessment(replace(verdict, curve=lm.Curve(np.array([0.0, 1.0]), np.array([1.0, 0.0]))))


def test_an_axis_that_enlarges_a_small_spread_says_so():
    close = [{"points": n, "multiplier": 0.5 * (1.0 + 0.01 * k / 3)} for k, n in enumerate((2, 4, 8, 16))]
    said = [t for t, _ in texts(figures.study_lines(close, "points")) if "enlarged" in t]
    assert len(said) == 1
    share = float(said[0].split("spans ")[1].split(" %")[0])
    assert 1.0 <= share <= 1.2  # 1 % of spread and matplotlib's margins of 5 % on each side
    wide = [{"points": n, "multiplier": 0.1 * n} for n in (2, 4, 8)]
    assert not [t for t, _ in texts(figures.study_lines(wide, "points")) if "enlarged" in t]


@pytest.mark.parametrize("ends, words", [((0.0, 1.0), ""), ((-0.01, 0.01), ""), ((0.5, 1.0), ""), ((0.0, 0.0), "")])
def test_an_axis_that_shows_zero_or_much_of_its_values_says_nothing(ends, words):
    assert style.enlarged(*ends) == words


def test_a_study_without_methods_has_no_line_called_none():
    one = figures.study_lines([{"a": 1.0, "multiplier": 0.5}, {"a": 2.0, "multiplier": 0.9}], "a")
    assert not one.legends
    assert "None" not in " ".join(t for t, _ in texts(one))


def test_rows_of_two_parameters_are_a_line_for_each_value_and_never_a_zigzag():
    rows = [{"phi": a, "psi": b, "seconds": 0.1 * a + b, "multiplier": 0.01 * a + 0.02 * b}
            for a in (20, 25, 30, 35) for b in (0, 5, 10)]
    figure = figures.study_lines(rows, "phi")
    lines = [x for x in figure.axes[0].lines if x.get_gid() == "line"]
    assert len(lines) == 3
    for line in lines:
        assert (np.diff(line.get_xdata()) > 0.0).all()
    assert [t.get_text() for t in figure.legends[0].get_texts()] == ["psi 0", "psi 5", "psi 10"]
    named = figures.study_lines(rows, "phi", by="psi")  # one column by its name
    assert [t.get_text() for t in named.legends[0].get_texts()] == ["psi 0", "psi 5", "psi 10"]
    # where no column tells repeated values apart they are points
    repeated = [{"phi": a, "multiplier": 0.01 * a + e} for a in (20, 30) for e in (0.0, 0.013, 0.031)]
    (points,) = [x for x in figures.study_lines(repeated, "phi").axes[0].lines if x.get_gid() == "line"]
    assert points.get_linestyle() == "None"
    with pytest.raises(InputError, match="'age'"):
        figures.study_lines(rows, "phi", by=("age",))


def test_no_two_methods_have_one_colour():
    methods = [*available_methods(), "monolith", "of another program", "of a third one"]
    rows = [{"method": m, "a": a, "multiplier": 0.1 * a + k} for k, m in enumerate(methods) for a in (1.0, 2.0)]
    lines = [x for x in figures.study_lines(rows[:14], "a").axes[0].lines if x.get_gid() == "line"]
    assert len({x.get_color() for x in lines}) == len(lines) == 7
    # those of their own keep it, whoever stands beside them
    assert colours_of(["of another program", "associative"])["associative"] == style.BLUE
    assert colours_of(["of another program"])["of another program"] == style.BLUE


def test_moments_that_fall_on_one_sample_are_one_picture():
    assert one_a_sample([(3, "first crack"), (9, "peak"), (9, "end"), (4, 4)]) == [
        (3, "first crack"), (9, "peak and end"), (4, "sample 4")
    ]


def test_a_table_is_drawn_over_the_column_that_varies_and_names_its_unit():
    fixed = {"mu": 0.6, "low": 0.4, "high": 0.5}
    rows = [{"method": m, "psi": p, "multiplier": 0.4 + 0.01 * p, **fixed} for m in "ab" for p in (0.0, 9.0)]
    table = study.Table(tuple(rows), {"psi": "deg"})
    figure = table.plot()
    assert figure.axes[0].get_xlabel() == "psi [deg]"
    lines = [x for x in figure.axes[0].lines if x.get_gid() == "line"]
    assert [list(x.get_xdata()) for x in lines] == [[0.0, 9.0]] * 2
    with pytest.raises(InputError, match=r"name the column to draw over.*there are mu, load"):
        study.Table(({"mu": 1.0, "load": 2.0},)).plot()


def test_the_page_of_several_panels_may_be_asked_for_by_its_width():
    with figures.print_style(width=160):
        style.needs_a_page("diagnosis")
    with pytest.raises(InputError, match="width must be"), figures.print_style(width="89"):
        pass


def test_a_study_draws_numbers_alone_and_nothing_below_zero_on_a_logarithmic_axis():
    rows = [{"phi": phi, "multiplier": 0.3 + 0.01 * phi, "low": None, "high": None} for phi in (-5.0, 0.0, 20.0, 30.0)]
    with pytest.raises(InputError, match="'phi' has values below zero"):
        figures.study_lines(rows, "phi", log=True)
    figure = figures.study_lines([*rows[1:], {"phi": np.nan, "multiplier": 0.1}], "phi", log=True)
    line = next(a for a in figure.axes[0].lines if a.get_gid() == "line")
    assert line.get_xdata().tolist() == [10.0, 20.0, 30.0]  # zero at the left edge
    with pytest.raises(InputError, match="'name' holds 'wall'"):
        figures.study_lines([{"name": "wall", "multiplier": 0.3}], "name")
    with pytest.raises(InputError, match="no row has finite values"):
        figures.study_lines([{"phi": np.nan, "multiplier": 0.3}], "phi")
    with pytest.raises(InputError, match="pairs"):
        figures.study_lines(rows, "phi", published={"source": []})


def test_lines_on_axes_of_the_caller_have_their_legend_there():
    axes = Figure().subplots(1, 2)
    for ax in axes:
        figures.study_lines([{"method": "dem", "phi": phi, "multiplier": 0.3} for phi in (20.0, 30.0)], "phi", ax=ax)
    assert not axes[0].figure.legends
    assert all(ax.get_legend() is not None for ax in axes)
