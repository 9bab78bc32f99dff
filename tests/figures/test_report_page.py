"""The report of a structure: everything a reader needs stands in one file, and what is not known is said."""

import re

import pytest

import limitmason as lm
from limitmason.cli import main
from limitmason.errors import InputError

JOINT = lm.Joint(60.0, name="<dry & sharp>")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    wall = lm.build.column(width=0.2, depth=0.3, height=1.0, courses=4, joint=JOINT)
    loads = lm.Loads.horizontal(wall)
    compared = lm.compare(wall, loads, ["associative", "mechanisms"], measured=(0.17, 0.19), title="Column")
    path = tmp_path_factory.mktemp("report") / "r.html"
    lm.figures.structure_report(wall, loads, compared, path, assumed=["friction from a handbook"])
    return path.read_text(encoding="utf-8")


def test_the_page_needs_nothing_else_and_holds_the_figures(page):
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert page.count("data:image/png;base64,") >= 4
    assert 'name="viewport"' in page


def test_it_says_number_kind_input_and_limits(page):
    # b / h of a slender column, by both theories
    assert page.count("0.2000") >= 2
    assert "exact for the law it names" in page
    assert "Collapse at no more than 0.2 times the live load" in page
    assert "&lt;dry &amp; sharp&gt;" in page
    assert "friction from a handbook" in page
    assert "0.1700 to 0.1900" in page
    assert "holds: associative" not in page  # a theorem: it could not be otherwise
    for heading in ("Geometry and supports", "Loads", "Joints", "Contacts", "Checks", "does not cover"):
        assert heading in page
    # weight by hand: 0.2 x 0.3 x 1.0 m at 2000 kg/m3
    assert f"{0.2 * 0.3 * 1.0 * 2000 * 9.81 / 1e3:.4g} kN" in page


def test_from_the_shell_with_the_assumptions_of_the_source(tmp_path, capsys):
    path = tmp_path / "wall.html"
    words = ["report", "ferris-tin-loi-2001/wall-1", "-o", str(path), "--methods", "mechanisms", "associative"]
    assert main(words) == 0
    text = path.read_text(encoding="utf-8")
    # the headline is the smallest bound: a weak one of a mechanism far above it is no end of a range
    assert "Collapse at no more than 0.643 times the live load (associative)." in text
    test = lm.experiments.load("ferris-tin-loi-2001", "wall-1")
    assert "0.6429" in text
    for assumption in test.assumptions:
        assert assumption.split("'")[0][:40] in text
    with pytest.raises(SystemExit):
        main(["report", "ferris-tin-loi-2001/wall-1", "-o", str(tmp_path / "wall.pdf")])
    assert "must end in .html; a browser prints it" in capsys.readouterr().err


def test_a_structure_that_cannot_stand_is_reported_too(tmp_path):
    # the upper block overhangs by more than half its length
    blocks = [[[0, 0], [1, 0], [1, 0.2], [0, 0.2]], [[0.7, 0.2], [1.7, 0.2], [1.7, 0.4], [0.7, 0.4]]]
    wall = lm.Assembly.from_polygons(blocks, thickness=0.2, joint=JOINT, fixed=[0])
    loads = lm.Loads.horizontal(wall)
    compared = lm.compare(wall, loads, ["associative"])
    path = lm.figures.structure_report(wall, loads, compared, tmp_path / "r.html")
    assert "No theory found a finite collapse multiplier." in path.read_text(encoding="utf-8")


def test_one_assumption_is_one_line_and_loads_of_another_structure_are_refused(tmp_path):
    made = lm.build.column(width=0.4, depth=0.4, height=1.0, courses=2, joint=lm.Joint(40.0))
    loads = lm.Loads.horizontal(made)
    compared = lm.compare(made, loads, ("associative",))
    page = lm.figures.structure_report(made, loads, compared, tmp_path / "page.html", assumed="dry joints")
    assert "<h2>Assumed</h2><ul><li>dry joints</li></ul>" in page.read_text(encoding="utf-8").replace("\n", "")
    other = lm.build.column(width=0.4, depth=0.4, height=1.0, courses=3, joint=lm.Joint(40.0))
    with pytest.raises(InputError, match="the loads are for 4 blocks"):
        lm.figures.structure_report(made, lm.Loads.horizontal(other), compared, tmp_path / "page.html")
