"""Predicted beside measured: one row, one store, one table printer; an experiment is one folder."""

import json
import re
import sys
from pathlib import Path

import every_case
import numpy as np
import pytest

import limitmason as lm
from limitmason import comparison, experiments
from limitmason.answers.curve import Curve
from limitmason.comparison.rows import STORED, Row
from limitmason.display.text_table import aligned, markdown
from limitmason.errors import InputError
from limitmason.experiments import registry
from limitmason.geometry import box

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = Path(lm.__file__).parent

# ---- an experiment is one folder -------------------------------------------------------------------------------------


def test_no_source_is_named_outside_its_folder():
    words = [w for source in experiments.sources() for w in (source, source.replace("-", "_"))]
    guilty = []
    for path in [p for top in ("limitmason", "dem", "mechanisms") for p in (ROOT / top).rglob("*.py")]:
        text = path.read_text(encoding="utf-8")
        if "kept for one release" in text.split('"""')[1]:
            continue
        # examples in docstrings and help may name one
        code = re.sub(r'"""[\s\S]*?"""', "", text)
        own = path.parent.name if path.parent.parent == ROOT / "limitmason" / "experiments" else ""
        if path.parent == ROOT / "limitmason" / "comparison":
            # what needs stores of runs stands above a series: a module may be of one, from which alone it imports
            of = set(re.findall(r"^from limitmason\.experiments\.(\w+)(?:\.\w+)? import ", code, re.MULTILINE))
            own = "".join(of & set(words)) if len(of & set(words)) == 1 else own
        named = {w for w in words if re.search(rf"['\"/.]{w}\b", code)}
        guilty += [f"{path.relative_to(ROOT)}: {w}" for w in named if w.replace("-", "_") != own]
    assert guilty == []


MODULE = '''
"""A block on a slope, as a source of its own."""

from limitmason.answers.curve import Curve
from limitmason.experiments import Departure, Experiment, Recipe, Settings, Shown, TargetValue, Variant
from limitmason.experiments.source_folder import read_source, read_table
from limitmason.geometry import box
from limitmason.model import Assembly, Joint, Loads

NAME = "one-block-1999"


def specimens():
    return tuple(r["specimen"] for r in read_table(NAME, "blocks.csv").rows)


def load(specimen, **options):
    table = read_table(NAME, "blocks.csv")
    row = table.row(specimen)
    friction = float(options.get("friction", 0.5))
    return Experiment(
        read_source(NAME), specimen, "a block", RECIPE, {"height": table.quantity(row, "height")},
        table.quantities(row, {"lambda": "multiplier"}), targets=(TargetValue("lambda", "measured"),),
        options={"friction": friction},
    )


def assembly(test):
    ground = box((-2.0, -2.0, -1.0), (3.0, 3.0, 0.0))
    block = box((0.0, 0.0, 0.0), (1.0, 1.0, float(test.parameters["height"])))
    joint = Joint.from_friction_coefficient(test.options["friction"])
    return Assembly.from_polyhedra([ground, block], joint=joint, fixed=[0])


def loads(test, wall, sense):
    return Loads.horizontal(wall, (sense, 0.0, 0.0))


def curve(test):
    return Curve([0.0, 1.0], [0.0, 2.0], displacement_unit="mm", load_unit="kN", label=test.specimen)


RECIPE = Recipe(
    specimens, load, assembly, loads, curve,
    Shown(
        variants=(Variant(), Variant("rough", {"friction": 0.9})), settings=Settings((2, 2)), stubborn=("tall",),
        left_out={"mechanisms": "it is too small for them"}, departures=(Departure("rough", "below", "It rocks."),),
        assumed="Weightless air is assumed.",
    ),
)
'''
SOURCE = {
    "name": "one-block-1999", "title": "One block", "kind": "experiment", "citation": "Nobody 1999", "doi": "",
    "url": "", "licence": "MIT", "references": {"n": "Nobody"}, "caveats": [], "files": {},
}


@pytest.fixture
def one_block(tmp_path, monkeypatch):
    """A folder elsewhere on the path of the package: nothing in the library is told of it."""
    folder = tmp_path / "one_block_1999"
    folder.mkdir()
    (folder / "__init__.py").write_text(MODULE)
    (folder / "source.json").write_text(json.dumps(SOURCE))
    # b / h = 0.25 turns over before it slides; b / h = 2 slides
    (folder / "blocks.csv").write_text("specimen,height,multiplier,source\n-,m,-,-\ntall,4,0.25,n\nflat,0.5,0.5,n\n")
    monkeypatch.setattr(experiments, "__path__", [*experiments.__path__, str(tmp_path)])
    registry.sources.cache_clear()
    yield "one-block-1999"
    registry.sources.cache_clear()
    sys.modules.pop("limitmason.experiments.one_block_1999", None)


def test_a_folder_is_a_full_source(one_block):
    assert one_block in experiments.sources()
    assert experiments.specimens(one_block) == ("tall", "flat")
    test = experiments.load(one_block, "tall")
    assert [r.ratio for r in comparison.run(test)] == pytest.approx([1.0])
    assert test.with_options(friction=0.1).options["friction"] == 0.1
    assert test.curve().peak.load == 2.0
    cases = every_case.cases(one_block)
    assert [c.name for c in cases] == ["tall", "flat", "tall, rough", "flat, rough"]
    assert [every_case.settings_of(c).search for c in cases] == ["standard", "quick", "quick", "quick"]
    found = every_case.solve_cases(cases, ("associative", "mechanisms"))
    page = every_case.as_markdown(found, (), version="0")
    assert "Weightless air is assumed." in page
    assert "| flat | lambda 0.5 | 0.5 × 1.00 |" in page
    assert "- tall ... flat, rough (4): not covered by mechanisms: it is too small for them" in page
    assert experiments.recipe_of(one_block).shown.reason_for("tall, rough", "below by 1 %") == "It rocks."
    assert experiments.recipe_of(one_block).shown.reason_for("tall", "below by 1 %") == ""
    assert f"{one_block} tall" in "\n".join(every_case.table_rows([test]))


def test_every_departure_written_on_the_page_is_stated_in_the_folder_of_its_source():
    page = (ROOT / "docs" / "methods.md").read_text(encoding="utf-8")
    known = {d.reason for s in experiments.sources() for d in experiments.recipe_of(s).shown.departures}
    written = re.findall(r"^- .*?: (?:the DEM lies .*?%|DEM [a-z ]+)\. (.*)$", page, re.MULTILINE)
    assert written
    assert set(written) <= known
    assert every_case.UNEXPLAINED not in page


def test_values_of_a_copy_of_the_same_model_are_no_references():
    test = experiments.load("ferris-tin-loi-2001", "wall-1")
    copies = {t.quantity for t in test.targets if t.copy}
    assert copies == {"HybriDFEM associative", "HybriDFEM non-associative", "HybriDFEM rounded"}
    shown = [r.label for c in every_case.cases("ferris-tin-loi-2001") for r in c.references]
    assert shown
    assert not any("HybriDFEM" in label for label in shown)


# ---- one row ---------------------------------------------------------------------------------------------------------


def test_every_table_is_made_of_the_same_rows(one_block):
    test = experiments.load(one_block, "tall")
    (row,) = comparison.run(test, "associative")
    (answer,) = lm.compare(test.assembly(), test.loads(), "associative", measured=0.25).rows
    assert type(row) is type(answer) is Row
    assert (row.multiplier, row.ratio, row.bound, row.unit) == (
        answer.multiplier, answer.ratio, answer.bound, answer.unit
    )
    assert row.predicted == pytest.approx(0.25, rel=1e-6)


def test_a_row_in_another_unit_keeps_its_multiplier():
    row = Row("dem", 2.0, 1.5, 3.0).in_unit(10.0)
    assert (row.multiplier, row.predicted, row.low, row.high) == (2.0, 20.0, 15.0, 30.0)
    assert row.in_unit(1.0).high == 3.0
    assert Row.refused("dem", "no joints").refusal == "no joints"
    assert row.refusal is None


# ---- one store -------------------------------------------------------------------------------------------------------

def two_blocks():
    solids = [box((-1, -1, -1), (2, 2, 0)), box((0, 0, 0), (0.5, 0.5, 1)), box((0, 0, 1), (0.5, 0.5, 2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), density=2048.0, fixed=[0])
    return a, lm.Loads.horizontal(a)


@pytest.mark.exact
def test_an_answer_is_found_in_the_store_and_one_that_lacks_a_field_is_refused_by_the_file(tmp_path):
    fresh, said = lm.compare(*two_blocks(), "mechanisms", store=tmp_path, measured=0.5), []
    found = lm.compare(*two_blocks(), "mechanisms", store=tmp_path, measured=0.5, progress=said.append)
    assert said == ["[1/1] mechanisms: 0.25 (from the store)"]
    one, two = fresh["mechanisms"], found["mechanisms"]
    assert [str(getattr(one, n)) for n in STORED] == [str(getattr(two, n)) for n in STORED]
    assert (two.ratio, two.bound.kind) == (0.5, one.bound.kind)
    path = tmp_path / "answers.jsonl"
    path.write_text(path.read_text().replace('"seconds"', '"minutes"'))
    with pytest.raises(InputError, match=r"answers.jsonl .* without 'seconds'"):
        lm.compare(*two_blocks(), "mechanisms", store=tmp_path)


# ---- one printer -----------------------------------------------------------------------------------------------------


def test_only_one_file_lays_out_tables_as_text():
    printers = {
        str(p.relative_to(LIBRARY))
        for p in LIBRARY.rglob("*.py")
        if re.search(r'"\| "|zip\(\*lines', p.read_text(encoding="utf-8")) and "diagnosis" not in p.parts
    }
    assert printers == {"display/text_table.py"}
    assert aligned([["a", "b"], ["ccc", "1"]], "<>") == "a    b\nccc  1"
    assert markdown([["a", "b"], ["1", "2"]]) == ["| a | b |", "| --- | --- |", "| 1 | 2 |"]


# ---- curves ----------------------------------------------------------------------------------------------------------


def test_curves_are_drawn_in_mm_and_kn_whatever_their_units():
    test = Curve([0.0, 2.0], [0.0, 3.0], displacement_unit="mm", load_unit="kN", label="test")
    model = Curve([0.0, 2e-3], [0.0, 3e3], label="model")
    for curves in ([test, model], {"test": test, "model": model}):
        ax = lm.figures.load_displacement(curves).axes[0]
        drawn = {line.get_gid(): line.get_xydata() for line in ax.lines if line.get_gid()}
        assert drawn["curve test"] == pytest.approx(np.array([[0.0, 0.0], [2.0, 3.0]]))
        assert drawn["curve model"] == pytest.approx(drawn["curve test"])
    assert [line.get_gid() for line in lm.figures.load_displacement(test).axes[0].lines][-1] == "curve test"
    with pytest.raises(ValueError, match="is in rad and N m"):
        lm.figures.load_displacement(Curve([0.0], [1.0], displacement_unit="rad", load_unit="N m"))


# ---- stages of loading live below dem --------------------------------------------------------------------------------


def test_stages_can_be_stated_without_dem_and_are_those_of_dem():
    import dem
    from limitmason.model import base_motion, stages

    for name in ("Settle", "Ramp", "Tilt", "Drive", "Hold", "Servo", "Damping", "Stage"):
        assert getattr(dem, name) is getattr(stages, name)
    assert dem.BaseMotion is base_motion.BaseMotion
