"""Predicted beside measured: one row, one store, one table printer; an experiment is one folder."""

import importlib
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments, validation
from limitmason.curve import Curve
from limitmason.experiments import registry
from limitmason.geometry import box
from limitmason.study import RowStore, fingerprint
from limitmason.study.store import DocumentStore
from limitmason.text_table import aligned, markdown
from limitmason.validation.comparing import SCHEMA
from limitmason.validation.page import UNEXPLAINED
from limitmason.validation.rows import Row

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
        named = {w for w in words if re.search(rf"['\"/.]{w}\b", code)}
        guilty += [f"{path.relative_to(ROOT)}: {w}" for w in named if w.replace("-", "_") != own]
    assert guilty == []


MODULE = '''
"""A block on a slope, as a source of its own."""

from limitmason.curve import Curve
from limitmason.experiments import Departure, Experiment, Quantity, Recipe, Settings, Shown, Target, Variant
from limitmason.experiments.tables import read_source, read_table
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
        read_source(NAME), specimen, "a block", {"height": table.quantity(row, "height")},
        table.quantities(row, {"lambda": "multiplier"}), {}, {}, (),
        (Target("lambda", "measured"),), Quantity(1.0, "-"), RECIPE, options={"friction": friction},
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
}  # fmt: skip


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
    assert [r.ratio for r in experiments.run(test)] == pytest.approx([1.0])
    assert test.with_options(friction=0.1).options["friction"] == 0.1
    assert test.curve().peak.load == 2.0
    cases = validation.cases(one_block)
    assert [c.name for c in cases] == ["tall", "flat", "tall, rough", "flat, rough"]
    assert [validation.settings_of(c).search for c in cases] == ["standard", "quick", "quick", "quick"]
    found = validation.solve_cases(cases, ("associative", "mechanisms"))
    page = validation.as_markdown(found, (), version="0")
    assert "Weightless air is assumed." in page
    assert "| flat | lambda 0.5 | 0.5 × 1.00 |" in page
    assert "- tall ... flat, rough (4): not covered by mechanisms: it is too small for them" in page
    assert experiments.recipe_of(one_block).shown.reason_for("tall, rough", "below by 1 %") == "It rocks."
    assert experiments.recipe_of(one_block).shown.reason_for("tall", "below by 1 %") == ""
    assert f"{one_block} tall" in "\n".join(validation.table_rows([test]))


def test_every_departure_written_on_the_page_is_stated_in_the_folder_of_its_source():
    page = (ROOT / "docs" / "methods.md").read_text(encoding="utf-8")
    known = {d.reason for s in experiments.sources() for d in experiments.recipe_of(s).shown.departures}
    written = re.findall(r"^- .*?: (?:the DEM lies .*?%|DEM [a-z ]+)\. (.*)$", page, re.MULTILINE)
    assert written
    assert set(written) <= known
    assert UNEXPLAINED not in page


def test_values_of_a_copy_of_the_same_model_are_no_references():
    test = experiments.load("ferris-tin-loi-2001", "wall-1")
    copies = {t.quantity for t in test.targets if t.copy}
    assert copies == {"HybriDFEM associative", "HybriDFEM non-associative", "HybriDFEM rounded"}
    shown = [r.label for c in validation.cases("ferris-tin-loi-2001") for r in c.references]
    assert shown
    assert not any("HybriDFEM" in label for label in shown)


# ---- one row ---------------------------------------------------------------------------------------------------------


def test_every_table_is_made_of_the_same_rows(one_block):
    test = experiments.load(one_block, "tall")
    (row,) = experiments.run(test, "associative")
    (answer,) = lm.compare(test.assembly(), test.loads(), "associative", measured=0.25).rows
    assert type(row) is type(answer) is Row
    assert (row.multiplier, row.ratio, row.bound, row.unit) == (
        answer.multiplier, answer.ratio, answer.bound, answer.unit
    )  # fmt: skip
    assert row.predicted == pytest.approx(0.25, rel=1e-6)


def test_a_row_in_another_unit_keeps_its_multiplier():
    row = Row("dem", 2.0, 1.5, 3.0).in_unit(10.0)
    assert (row.multiplier, row.predicted, row.low, row.high) == (2.0, 20.0, 15.0, 30.0)
    assert row.in_unit(1.0).high == 3.0
    assert Row.refused("dem", "no joints").refusal == "no joints"
    assert row.refusal is None


# ---- one store -------------------------------------------------------------------------------------------------------

OLD_ANSWER = """{
 "schema": "limitmason-answer",
 "method": "mechanisms",
 "multiplier": 0.25,
 "low": NaN,
 "high": NaN,
 "range_is": "",
 "bound": "overturning: upper: admissible as a contact field",
 "status": "solved",
 "seconds": 0.10213006400044833,
 "details": {
  "governing": "overturning",
  "catalogue": {
   "overturning": 0.25,
   "sliding": 0.5773502691896257
  },
  "smallest_upper_bound": 0.25,
  "smallest_upper_bound_of": "overturning"
 },
 "warnings": []
}
"""
"""Written by version 0.1 for two blocks of 0.5 x 0.5 x 1 m, one on the other, on a slab (bound shortened)."""
OLD_NAME = "mechanisms-1a1f2eb4aa2139d7af42416f.json"
OLD_ROWS = (
    '{"schema": "limitmason-rows", "version": 1, "key": '
    '"e12a0bf9812a4dd5599cefb59f2dd310b750c2b11052b10ef4a7234b32c08935"}\n'
    '{"number": 0, "row": {"multiplier": 0.1, "status": "solved", "low": NaN}}\n'
    '{"number": 2, "row": {"multiplier": 0.3333333333333333}}\n'
)


def two_blocks():
    solids = [box((-1, -1, -1), (2, 2, 0)), box((0, 0, 0), (0.5, 0.5, 1)), box((0, 0, 1), (0.5, 0.5, 2))]
    a = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(30.0), density=2048.0, fixed=[0])
    return a, lm.Loads.horizontal(a)


def test_an_answer_stored_by_version_0_1_is_found_and_read(tmp_path):
    (tmp_path / OLD_NAME).write_text(OLD_ANSWER)
    said = []
    result = lm.compare(*two_blocks(), "mechanisms", store=tmp_path, measured=0.5, progress=said.append)
    found = result["mechanisms"]
    assert "0.25000" in result.table()
    assert said == ["[1/1] mechanisms: 0.25 (from the store)"]
    assert (found.ratio, found.seconds) == (0.5, 0.10213006400044833)
    assert found.details["smallest_upper_bound_of"] == "overturning"
    # and what is written now is what was written then
    kept = DocumentStore(tmp_path / "new", SCHEMA)
    kept.write(kept.folder / OLD_NAME, found.stored())
    assert (kept.folder / OLD_NAME).read_text() == OLD_ANSWER
    assert [p.name for p in kept.folder.iterdir()] == [OLD_NAME]


def test_rows_stored_by_version_0_1_are_read(tmp_path):
    path = tmp_path / "rows.jsonl"
    path.write_text(OLD_ROWS)
    store = RowStore(path, fingerprint("a study", 1, (0.5, None)))
    assert list(store.rows) == [0, 2]
    assert store.rows[2] == {"multiplier": 1.0 / 3.0}
    path.write_text(OLD_ROWS + '{"number": 3, "ro')  # cut off by a kill
    again = RowStore(path, store.key)
    assert list(again.rows) == [0, 2]
    assert path.read_text() == OLD_ROWS
    assert list(tmp_path.iterdir()) == [path]


# ---- one printer -----------------------------------------------------------------------------------------------------


def test_only_one_file_lays_out_tables_as_text():
    printers = {
        str(p.relative_to(LIBRARY))
        for p in LIBRARY.rglob("*.py")
        if re.search(r'"\| "|zip\(\*lines', p.read_text(encoding="utf-8")) and "diagnosis" not in p.parts
    }
    assert printers == {"text_table.py"}
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


# ---- former names, for one release -----------------------------------------------------------------------------------


@pytest.mark.parametrize("old, name", [
    ("packaged", "solve_cases"), ("packaged", "cases"), ("side_by_side", "compare"), ("side_by_side", "SideBySide"),
    ("experiments.minho", "measured_curve"), ("experiments.pavia", "specimen"), ("experiments.murano", "control_block"),
    ("experiments.mcmaster", "line_load"),
])  # fmt: skip
def test_former_modules_warn_and_work(old, name):
    sys.modules.pop(f"limitmason.{old}", None)
    with pytest.warns(DeprecationWarning, match=f"limitmason.{old} is now limitmason"):
        module = importlib.import_module(f"limitmason.{old}")
    assert callable(getattr(module, name))


def test_experiments_hand_on_what_compares():
    for name in ("run", "table", "as_text", "summary_table"):
        assert getattr(experiments, name) is getattr(validation, name)
    assert experiments.Comparison is Row
    with pytest.raises(AttributeError, match="no attribute 'runn'"):
        experiments.runn  # noqa: B018


# ---- stages of loading live below dem --------------------------------------------------------------------------------


def test_stages_can_be_stated_without_dem_and_are_those_of_dem():
    import dem
    from limitmason.model import stages

    for name in ("Settle", "Ramp", "Tilt", "Drive", "BaseMotion", "Hold", "Servo", "Damping", "Stage"):
        assert getattr(dem, name) is getattr(stages, name)
