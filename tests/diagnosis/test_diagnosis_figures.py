"""What a user sees of a diagnosis: the picture, the maps and the page, held against the numbers they show."""

import base64
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest
from diagnosis_models import CAUSES, FRICTION, HEIGHTS, ROUNDING, blocks, data, kinds, pulled, specimens, study

import limitmason as lm
from limitmason.diagnosis import Cause, Noise, Study
from limitmason.diagnosis.verdict_text import headline
from limitmason.errors import InputError
from limitmason.figures.residuals import kinds_note, of_covariate, residual_panel

KINDS = ("none", "cause", "either", "two", "unexplained", "scatter")
TWIN = Cause("thickness <loss>", "twin", 0.0, (0.0, 0.02), "the same & more", "measurement", pulled)


@pytest.fixture(scope="module")
def verdicts():
    lists = {k: (*CAUSES, TWIN) if k == "either" else CAUSES for k in KINDS}
    return {k: s.diagnose(lists[k], draws=699) for k, s in kinds().items()}


@pytest.fixture(scope="module")
def pictures(verdicts):
    return {k: lm.figures.diagnosis(v, quantity="multiplier [-]", title="Blocks") for k, v in verdicts.items()}


def marked(figure, gid):
    return [a for a in figure.findobj(lambda artist: artist.get_gid() == gid)]


def texts(figure):
    return [t for t in figure.findobj(lambda artist: hasattr(artist, "get_text")) if t.get_text().strip()]


def beyond(figure):
    """Labels of ticks outside the limits of their axis, which are not drawn."""
    out = []
    for axis in [a for ax in figure.axes for a in (ax.xaxis, ax.yaxis)]:
        low, high = sorted(axis.get_view_interval())
        out += [
            label for t in axis.get_major_ticks() if not low <= t.get_loc() <= high for label in (t.label1, t.label2)
        ]
    return out


@pytest.mark.parametrize("kind", KINDS)
def test_the_verdict_stands_on_top(kind, verdicts, pictures):
    assert verdicts[kind].kind == {"cause": "behaves like", "two": "behaves like"}.get(kind, kind)
    (text,) = marked(pictures[kind], "verdict")
    words = headline(verdicts[kind])
    assert " ".join(text.get_text().split()).lower() == f"{words}.".lower()
    others = [t for t in texts(pictures[kind]) if t is not text and t.get_gid() != "title"]
    figure = pictures[kind]
    figure.canvas.draw()
    bottom = text.get_window_extent().y0
    assert all(t.get_window_extent().y1 <= bottom + 1 for t in others if t.get_visible())


@pytest.mark.parametrize("kind", KINDS)
def test_residuals_before_and_after_one_column_per_kept_explanation(kind, verdicts, pictures):
    verdict = verdicts[kind]
    shown = [np.sort(line.get_ydata()) for line in marked(pictures[kind], "points")]
    columns = [verdict.study.baseline(), *(verdict.predicted(names) for names in verdict.kept)]
    assert len(shown) == len(columns) * len(verdict.study.covariates)
    for predicted in columns:
        left = np.sort(100.0 * (verdict.study.measured / predicted - 1.0))
        assert sum(np.allclose(s, left, atol=1e-9) for s in shown) >= len(verdict.study.covariates)


def test_an_unexplained_misfit_highlights_its_covariate_and_no_other(verdicts, pictures):
    (frame,) = marked(pictures["unexplained"], "covariate")
    (points,) = [line for line in frame.lines if line.get_gid() == "points"]
    assert points.get_xdata() == pytest.approx(verdicts["unexplained"].study.covariates["humidity"])
    assert frame.get_xlabel() == "humidity"
    for kind in ("none", "scatter"):
        assert not marked(pictures[kind], "covariate")


@pytest.mark.parametrize("kind", KINDS)
def test_sizes_and_intervals_are_drawn_where_they_lie(kind, verdicts, pictures):
    verdict = verdicts[kind]
    at = [float(line.get_xdata()[0]) for line in marked(pictures[kind], "estimate")]
    ends = [tuple(map(float, line.get_xdata())) for line in marked(pictures[kind], "interval")]
    by_name = {c.name: c for c in verdict.listed}
    listed = [n for n in by_name if n in verdict.estimates]
    for name, x, (low, high) in zip(listed, at, ends, strict=True):
        bounds, e = by_name[name].bounds, verdict.estimates[name]
        width = bounds[1] - bounds[0]
        assert (x, low, high) == pytest.approx([(v - bounds[0]) / width for v in (e.size, e.low, e.high)])
    assert len(marked(pictures[kind], "unseen")) == (len(verdict.listed) if kind in ("none", "scatter") else 0)


@pytest.mark.parametrize("kind", KINDS)
def test_predicted_against_measured_before_and_after(kind, verdicts, pictures):
    verdict = verdicts[kind]
    (before,) = marked(pictures[kind], "before")
    assert before.get_xdata() == pytest.approx(verdict.study.measured)
    assert before.get_ydata() == pytest.approx(verdict.study.baseline())
    after = marked(pictures[kind], "after")
    assert len(after) == bool(verdict.kept)
    if after:
        assert after[0].get_ydata() == pytest.approx(verdict.predicted())


def test_twins_are_framed_in_the_map(verdicts, pictures):
    assert len(marked(pictures["either"], "twin")) == 2  # one pair, both ways
    assert not marked(pictures["cause"], "twin")
    map_ = verdicts["either"].study.confusable(verdicts["either"].listed, sd=0.04)
    figure = lm.figures.confusable(map_, title="Twelve blocks")
    count = len(map_.names)
    assert len(marked(figure, "cell")) == count**2
    numbers = sorted(float(t.get_text().strip(">")) for t in marked(figure, "d2"))
    off = map_.d2[~np.eye(count, dtype=bool)]
    assert numbers == pytest.approx(sorted(min(v, 99.0) for v in off), abs=0.5)
    assert any("thickness <loss> and" in t.get_text() or "and thickness <loss>" in t.get_text() for t in texts(figure))


def test_a_rehearsal_shows_every_trial_once():
    made = study()
    result = made.rehearse(CAUSES, n=12, seed=1)
    assert sum(row["trials"] for row in result.table()) == 12
    named = sum(row.get("named", 0) + row.get("wrong name", 0) for row in result.counts.values())
    assert sum(sum(row.values()) for row in result.answers.values()) == named
    assert all(row.get(name, 0) == result.counts[name].get("named", 0) for name, row in result.answers.items())
    assert str(result) == result.report()


def many_causes():
    shifts = [
        Cause(f"shift of the laboratory number {k}", f"s{k}", 1.0, (0.5, 2.0), "sensor", "measurement", shift(k))
        for k in range(16)
    ]
    covariates = {f"a covariate with a long name {k}": np.roll(HEIGHTS, k) for k in range(7)}
    labels = {"first course": ["a whole block", "half of a block", "a quarter of a block"] * 4}
    values = data(ROUNDING, 0.012)
    return Study(
        specimens(), made_blocks, values, Noise(0.04), covariates={**labels, **covariates}
    ).diagnose(shifts, draws=99, pairs=False)


def shift(k):
    return lambda size, prediction, specimen: prediction * size ** (1.0 + 0.01 * k * specimen["height"])


def made_blocks(specimen):
    return specimen["width"] / specimen["height"]


@pytest.mark.slow
def test_nothing_is_written_over_the_edge_of_the_page(pictures):
    crowded = many_causes()
    assert len(crowded.kept) > 4
    map_ = crowded.study.confusable(crowded.listed)
    crowd = lm.figures.diagnosis(crowded)
    for figure in [*pictures.values(), crowd, lm.figures.confusable(map_)]:
        figure.canvas.draw()
        width, height = figure.canvas.get_width_height()
        hidden = {id(t) for t in beyond(figure)}
        for text in texts(figure):
            if id(text) in hidden:
                continue
            if text.get_visible() and text.get_window_extent().width > 0:
                box = text.get_window_extent()
                inside = box.x0 >= -2 and box.y0 >= -2 and box.x1 <= width + 2 and box.y1 <= height + 2
                assert inside, (text.get_text(), box, (width, height))


class Page(HTMLParser):
    """Tags, their balance and the visible text."""

    def __init__(self):
        super().__init__()
        self.open, self.links, self.text = [], [], []

    def handle_starttag(self, tag, attrs):
        self.links += [v for k, v in attrs if k in ("src", "href")]
        if tag not in ("meta", "img", "!doctype"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("style", "title"):
            self.text.append(data)


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_needs_nothing_else_and_says_the_verdict_first(kind, verdicts, pictures, tmp_path):
    verdict = verdicts[kind]
    pool = [{**s, "humidity": 0.1 * i} for i, s in enumerate(specimens())]
    path = lm.figures.diagnosis_page(
        verdict, tmp_path / "page.html", figure=pictures[kind], next_tests=verdict.next_tests(pool, k=2), checks=False,
        notes=["The friction is assumed."], units={"height": "m"},
    )
    source = path.read_text()
    page = Page()
    page.feed(source)
    assert not page.open
    assert page.links
    assert all(link.startswith("data:image/png;base64,") for link in page.links)
    assert base64.b64decode(page.links[0].partition(",")[2])[:4] == b"\x89PNG"
    assert not re.search(r"https?:|@import|<script|<link", source)
    words = " ".join("".join(page.text).split())
    first = headline(verdict)
    places = [words.index(part) for part in (first[1:], "Conditional on the list", "What it means", "The picture",
              "The causes considered", "What it rests on", "Next tests", "The specimens")]
    assert places == sorted(places)
    assert all(c.name in words for c in verdict.listed)
    assert "The friction is assumed." in words
    assert f"{verdict.study.measured[0]:.4g}" in words
    assert ("leave group out" in words) == bool(verdict.kept)
    twins = verdict.study.confusable(verdict.listed, sd=verdict.noise_sd).twins
    assert (
        "Twins on this design, which no data of it can tell apart: " + (" and ".join(twins[0]) if twins else "none")
        in words
    )


def test_the_report_names_what_the_verdict_hangs_on_and_what_goes_together():
    values = data(seed=8)
    values[3] *= np.exp(7 * 0.04)
    named = [{**s, "specimen": f"W{i}"} for i, s in enumerate(specimens())]
    made = Study(named, made_blocks, values, Noise(0.04), covariates={"height": HEIGHTS, "weight": 3.0 * HEIGHTS})
    verdict = made.diagnose(CAUSES[1:], draws=299, pairs=False)
    assert verdict.kind != "none"
    text = verdict.report()
    assert "hangs on specimen W3" in text
    assert repr(verdict) == f"<Diagnosis of 12 specimens, {verdict}>"
    humid = study(data(seed=5) * np.exp(0.5 * HEIGHTS), covariates={"height": HEIGHTS, "weight": 3.0 * HEIGHTS})
    assert "goes with" in "".join(humid.diagnose(CAUSES[2:], draws=299, pairs=False).warnings)


def test_noise_from_replicates_is_the_pooled_one():
    # two pairs: sd^2 = sum of (difference / 2)^2 * 2 over 2 degrees of freedom
    noise = Noise.from_replicates([1.0, np.exp(0.1), 2.0, 2.0 * np.exp(0.06), 5.0], list("aabbc"))
    assert noise.dof == 2
    assert noise.sd == pytest.approx(np.sqrt((0.1**2 / 2 + 0.06**2 / 2) / 2))
    with pytest.raises(ValueError, match="no configuration"):
        Noise.from_replicates([1.0, 2.0], ["a", "b"])
    with pytest.raises(ValueError, match="0.04 is 4 %"):
        Noise(4.0)


def test_every_kind_of_data_has_its_own_line_and_marker():
    age, kinds = np.tile(np.arange(6.0), 2), ["force"] * 6 + ["vibration"] * 6
    values = np.concatenate([3.0 * age[:6] - 2.0, 1.0 - 0.5 * age[6:]])
    ax = plt.figure().add_subplot()
    residual_panel(ax, 2.0, age, values, (-20.0, 20.0), 1.0, "k", "linear", first=True, kinds=kinds)
    lines = [line for line in ax.lines if line.get_gid() == "trend"]
    slopes = [np.polyfit(*line.get_data(), 1) for line in lines]
    assert slopes == [pytest.approx([3.0, -2.0]), pytest.approx([-0.5, 1.0])]
    points = [line for line in ax.lines if line.get_gid() == "points"]
    assert [p.get_ydata().tolist() for p in points] == [values[:6].tolist(), values[6:].tolist()]
    assert len({p.get_marker() for p in points}) == 2
    assert len({line.get_linestyle() for line in lines}) == 2
    assert kinds_note(kinds) == "circles force, squares vibration"
    plt.close("all")


def test_names_with_dollar_signs_are_written_as_they_are_and_a_file_is_no_folder(tmp_path):
    made = [{**s, r"$\size$": s["height"]} for s in specimens()]
    long = r"$\edge$ of a stone whose name, as that of one joint of many, is long"  # leaves room for the axis of sizes
    causes = (Cause(long, "rounding", 0.0, (0.0, 0.02), "edges", unit="m"), *CAUSES[1:])
    told = Study(made, blocks, data(ROUNDING, 0.018), Noise(0.04), nuisance=FRICTION, covariates=[r"$\size$", "batch"])
    found = told.diagnose(causes, draws=199)
    lm.figures.diagnosis(found).savefig(tmp_path / "picture.png")
    lm.figures.confusable(found.distances).savefig(tmp_path / "picture.png")
    for folder in (tmp_path / "picture.png", tmp_path / "picture.png" / "inside"):
        with pytest.raises(InputError, match=r"picture.png is a file"):
            lm.figures.diagnosis_folder(SimpleNamespace(answer=found), folder)


def test_a_covariate_is_the_one_of_the_verdict_whatever_its_name():
    """A name with " in " was cut there, and its panel of residuals showed no trend."""
    columns = {"height in m": HEIGHTS, "courses": np.arange(len(HEIGHTS)) % 2}
    tall = study(data(seed=5) * np.exp(0.5 * HEIGHTS), covariates=columns).diagnose(CAUSES[2:], draws=299, pairs=False)
    assert tall.covariate == "height in m"
    assert [of_covariate(tall, name) for name in columns] == [True, False]
