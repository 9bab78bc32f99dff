"""CSV files with units that every reader takes: names, a comment line of units, rows of numbers that stay numbers."""

import csv
import io
import math
from pathlib import Path

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments, study
from limitmason.errors import InputError
from limitmason.experiments.source_folder import folder, parse_table, read_description, read_table
from limitmason.storage import csv_table
from limitmason.storage.csv_table import parsed, table_text, write_table
from limitmason.storage.measured_table import read_measured, write_measured
from limitmason.study.table import Table

OLD = "stone,height,peak\n-,m,kN\ngranite,1.2,41.5\nsandstone,1.0,22.9\n"
NEW = "stone,height,peak\n# units: -,m,kN\n# a note\ngranite,1.2,41.5\nsandstone,1.0,22.9\n"


def read_by_numpy(path):
    """As a user without this package reads it."""
    return np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8", comments="#")


def test_numbers_are_numbers_to_a_reader_that_knows_no_units(tmp_path):
    (tmp_path / "new.csv").write_text(NEW)
    (tmp_path / "old.csv").write_text(OLD)
    assert read_by_numpy(tmp_path / "new.csv")["peak"].tolist() == [41.5, 22.9]
    assert read_by_numpy(tmp_path / "old.csv")["peak"].dtype.kind == "U"  # the reason for this form


def test_both_forms_say_the_same():
    old, new = (parse_table(text, "t") for text in (OLD, NEW))
    assert old == new
    assert new.units == {"stone": "-", "height": "m", "peak": "kN"}
    assert parsed(NEW, "t").lines == [4, 5]
    assert parsed(OLD, "t").lines == [3, 4]


def test_both_forms_are_measured_values(tmp_path):
    for name, text in (("old", OLD), ("new", NEW)):
        (tmp_path / f"{name}.csv").write_text(text)
        found = read_measured(tmp_path / f"{name}.csv")
        assert found.units["peak"] == "kN"
        assert found.column("peak") == (41.5, 22.9)
    (tmp_path / "bad.csv").write_text(NEW.replace("22.9", "tall"))
    with pytest.raises(InputError, match="row 5, column 'peak'"):
        read_measured(tmp_path / "bad.csv")
    (tmp_path / "bad.csv").write_text(NEW.replace("-,m,kN", "-,m"))
    with pytest.raises(InputError, match="row 2 has 2 cells"):
        read_measured(tmp_path / "bad.csv")


def test_cells_of_several_lines_are_read_as_they_were_written():
    rows = [["x\ny", "1"], ["p\n# q\n\nr", "2"], ['say "no", twice', "3"]]
    back = parsed(table_text({"word": "-", "x": "m"}, rows, note='a note, "half quoted'), "t")
    assert back.rows == rows
    assert back.lines == [4, 6, 10]


def test_what_is_written_is_read_again_whatever_the_words(tmp_path):
    rows = [["a, b", 1.5, 'say "so"'], ["no. #1", 2.5, "# none"], ["", 3.5, "line"]]
    units = {"word": "-", "x": "kN/m, mean", "note #": "-"}
    text = table_text(units, rows, note="two\nlines")
    back = list(csv.reader(io.StringIO(text)))
    assert [r for r in back if not r[0].startswith("# ")][1:] == [[str(c) for c in r] for r in rows]
    assert parsed(text, "t").units == list(units.values())
    # a reader that drops everything behind an unquoted sign loses nothing
    assert all('"' in line for line in text.splitlines()[4:] if "#" in line)
    with pytest.raises(InputError, match="2 cells"):
        write_table(tmp_path / "t.csv", units, [[1, 2]])
    with pytest.raises(InputError, match="take the names for a comment"):
        table_text({"# x": "m"}, [])
    with pytest.raises(InputError, match="units row"):
        parsed("x\n", "t")


def test_measured_values_are_read_as_they_were_written(tmp_path):
    rows = [{"peak; mean": 41.5}, {"peak; mean": 22.9}]
    # rows that can be gone through once only, a name with a separator, and a note that looks like units
    write_measured(tmp_path / "a.csv", {"peak; mean": "kN"}, iter(rows), note="units: as in the paper")
    assert read_measured(tmp_path / "a.csv").rows == rows
    for wrong, message in (
        ([], "rows: give at least one"), ([3], r"rows\[0\] must be a Mapping, got 3"),
        ([{"a": math.inf}], r"rows\[0\] has inf for 'a'"),
    ):
        with pytest.raises(InputError, match=message):
            write_measured(tmp_path / "b.csv", {"a": "m"}, wrong)
    assert not (tmp_path / "b.csv").exists()


def test_every_writer_of_the_package_is_read_by_numpy(tmp_path):
    study.Table(({"x": 1.5, "n": 2}, {"x": 2.5, "n": 3}), {"x": "m"}).write_csv(tmp_path / "study.csv")
    write_measured(tmp_path / "measured.csv", {"peak": "kN"}, [{"peak": 41.5}, {"peak": 22.9}], note="made up")
    units, cells = lm.Curve([0.0, 1e-3], [0.0, 2e3]).tabulated()  # as `limitmason pushover --csv` writes it
    csv_table.write_table(tmp_path / "curve.csv", units, cells)
    wall = experiments.load("ferris-tin-loi-2001", "wall-1")
    rows = lm.comparison.run(wall, "associative", quantities=["associative", "non-associative"])
    lm.comparison.write_rows([r for r in rows for _ in range(2)], tmp_path / "rows.csv")
    for name, column in (("study", "x"), ("measured", "peak"), ("curve", "load"), ("rows", "predicted")):
        path = tmp_path / f"{name}.csv"
        assert read_by_numpy(path)[column].dtype.kind in "fi", name
        assert path.read_text().splitlines()[1].startswith(csv_table.UNITS)
        assert len(parsed(path.read_text(), name).rows) >= 2


def test_no_other_module_writes_csv():
    package = Path(lm.__file__).parent
    writers = [p.name for p in package.rglob("*.py") if "csv.writer" in p.read_text(encoding="utf-8")]
    assert writers == []


@pytest.mark.parametrize("source", experiments.sources())
def test_packaged_tables_have_their_units_in_a_comment(source):
    for name in read_description(source)["files"]:
        text = (folder(source) / name).read_text(encoding="utf-8")
        assert text.splitlines()[1].startswith(csv_table.UNITS)
        table = read_table(source, name)
        assert set(table.units) == set(text.splitlines()[0].split(","))


@pytest.mark.parametrize("table", [
    "a;b\n# units: m;kN\n0.5;1,250\n2.5;12,5\n",
    "a\tb\n# units: m\tkN\n0.5\t1,250\n",
    "a;b\n# units: m;N\n0,5;1.250\n",
])
def test_numbers_with_a_point_and_others_with_a_comma_are_refused(tmp_path, table):
    (tmp_path / "data.csv").write_text(table, encoding="utf-8")
    with pytest.raises(InputError, match="write numbers with one decimal sign"):  # 1,250 is 1.25 or 1250
        read_measured(tmp_path / "data.csv")


def test_labels_with_points_may_stand_beside_decimal_commas(tmp_path):
    (tmp_path / "data.csv").write_text("wall;b\n# units: -;kN\n1.1;1,25\n", encoding="utf-8")
    assert read_measured(tmp_path / "data.csv").columns == {"wall": (1.1,), "b": (1.25,)}


def test_units_that_contradict_and_values_that_are_none_are_refused(tmp_path):
    path = tmp_path / "data.csv"
    for text, message in (
        ("a,b\n# units: m,kN\n# units: mm,N\n1,2\n", "rows 2 and 3 give different units"),
        ("a,b\n# units: m,kN\nnan,2\n", "row 3, column 'a' is 'nan'"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            read_measured(path)
    path.write_text("a,b\n  # units: m,kN\n1,2\n", encoding="utf-8")
    assert read_measured(path).units == {"a": "m", "b": "kN"}


def test_numbers_of_numpy_are_written_as_numbers_to_the_last_bit(tmp_path):
    values = np.random.default_rng(1).normal(size=50) * 10.0 ** np.arange(-25, 25)
    Table(tuple({"x": v} for v in values)).write_csv(tmp_path / "x.csv")
    assert np.array_equal(read_measured(tmp_path / "x.csv").columns["x"], values)
