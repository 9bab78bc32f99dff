"""Forces by name: statics of a pushed block, a tied block and an arch, and the files they are written to."""

import sys
import types

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.errors import InputError
from limitmason.geometry import box
from limitmason.mechanics.joint_forces import COLUMNS
from limitmason.storage.csv_table import parsed


def rows_of(table, kind):
    return {row[1]: dict(zip(COLUMNS, row, strict=True)) for row in table.rows if row[0] == kind}


def test_a_block_that_turns_bears_on_its_edge_with_what_it_weighs_and_what_pushes_it():
    """Width 1, height 2: lambda = 1 / 2, at the edge, shear / (N tan(phi)) = .5 / tan(40 deg)."""
    solids = [box((-1, 0, -1), (2, 1, 0)), box((0, 0, 0), (1, 1, 2))]
    model = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(40.0), fixed=[0], names=["ground", "pier"])
    answer = lm.limit_analysis(model, lm.Loads.horizontal(model))
    table = lm.force_table(answer)
    (joint,), (support,) = (list(rows_of(table, kind).values()) for kind in ("joint", "support"))
    weight = model.weights[1]
    assert (joint["name"], support["name"]) == ("ground|pier", "ground")
    assert joint["normal"] == pytest.approx(weight, rel=1e-6)
    assert joint["shear"] == pytest.approx(0.5 * weight, rel=1e-6)
    assert joint["eccentricity"] == pytest.approx(0.5, rel=1e-6)
    assert joint["strength_used"] == pytest.approx(0.5 / np.tan(np.radians(40.0)), rel=1e-6)
    assert [support[c] for c in ("fx", "fy", "fz")] == pytest.approx([0.5 * weight, 0.0, -weight], abs=1e-5 * weight)
    # the line of the resultant passes through the edge
    line = np.array([1.0, 0.5, 0.0]) - [support[c] for c in "xyz"]
    assert np.cross(line, (0.5, 0.0, -1.0)) == pytest.approx(np.zeros(3), abs=1e-5)


def test_supports_bear_the_weight_and_a_tie_its_strength():
    arch = lm.build.arch(radius=1.0, thickness=0.3, width=0.5, voussoirs=8, joint=lm.Joint(40.0))
    found = lm.stability(arch, tilts=())
    supports = rows_of(lm.force_table(found.state), "support")
    assert set(supports) == {"base-left", "base-right"}
    weight = arch.weights[~arch.fixed].sum()
    assert sum(row["fz"] for row in supports.values()) == pytest.approx(-weight, rel=1e-6)
    ground = [((-4, 0, -1), (2, 1, 0)), ((-4, 0, 0), (-3, 1, 2))]
    solids = [box(*corners) for corners in (*ground, ((0, 0, 0), (1, 1, 2)))]
    tied = lm.Assembly.from_polyhedra(solids, joint=lm.Joint(40.0), fixed=[0, 1], names=["ground", "rock", "pier"])
    tied = tied.with_ties([lm.Tie("pier", (0, 0.5, 1.5), "rock", (-3, 0.5, 1.5), yield_force=500.0)])
    answer = lm.limit_analysis(tied, lm.Loads.horizontal(tied))
    row = rows_of(lm.force_table(answer), "tie")["pier~rock"]
    assert row["fx"] == pytest.approx(-500.0, rel=1e-6)
    assert row["strength_used"] == pytest.approx(1.0, rel=1e-6)


def test_tables_go_to_files_and_frames(tmp_path, monkeypatch):
    arch = lm.build.arch(radius=1.0, thickness=0.3, width=0.5, voussoirs=4, joint=lm.Joint(40.0))
    table = lm.force_table(lm.limit_analysis(arch, lm.Loads.horizontal(arch)))
    table.to_csv(tmp_path / "forces.csv")
    read = parsed((tmp_path / "forces.csv").read_text(), "forces")
    assert read.header == list(COLUMNS)
    assert len(read.rows) == len(arch.interfaces) + 2
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"limitmason\[pandas\]"):
        table.to_dataframe()


def test_every_table_becomes_a_data_frame_with_its_units(monkeypatch):
    wall = lm.build.wall(length=0.8, courses=2, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0))
    loads = lm.Loads.horizontal(wall)
    answer = lm.limit_analysis(wall, loads)
    curve, modes = lm.Curve(np.arange(3.0), np.arange(3.0), "mm", "kN", errors={"rate": np.zeros(3)}), lm.modes(wall)
    tables = {
        "joint": lm.force_table(answer), "lambda": lm.study.Table(({"lambda": 1.0}, {"n": 2}), {"n": "-"}),
        "multiplier": lm.compare(wall, loads, ("associative", "mechanisms")), "load": curve, "frequency": modes,
        "MAC": lm.mac(modes, modes), "kinetic": dem.simulate(wall, dem.Settle(tolerance=1e-3)),
    }

    class Frame:  # as far as pandas.DataFrame(rows, columns=...) goes
        def __init__(self, rows, columns):
            self.columns, self.attrs = columns, {}
            self.cells = {c: [row[k] for row in rows] for k, c in enumerate(columns)}

    monkeypatch.setitem(sys.modules, "pandas", types.SimpleNamespace(DataFrame=Frame))
    for column, table in tables.items():
        frame = table.to_dataframe()
        found = column if column in frame.cells else frame.columns[0]
        assert set(frame.attrs["units"]) == set(frame.columns)
        assert len(frame.cells[found]) > 0
        assert column in frame.cells or column == "joint"
    assert tables["load"].to_dataframe().attrs["units"] == {"displacement": "mm", "load": "kN", "rate": "-"}
    assert tables["lambda"].to_dataframe().cells == {"lambda": [1.0, None], "n": [None, 2]}
    status = tables["multiplier"].to_dataframe().cells["status"]
    assert [type(s) for s in status] == [str, str]
    np.testing.assert_allclose(tables["frequency"].to_dataframe().cells["frequency"], modes.frequency)


def test_answers_without_forces_or_structure_are_refused():
    arch = lm.build.arch(radius=1.0, thickness=0.05, width=0.5, voussoirs=8, joint=lm.Joint(40.0))
    falls = lm.limit_analysis(arch, lm.Loads.horizontal(arch))
    with pytest.raises(InputError, match="no joint forces"):
        lm.force_table(falls)
    with pytest.raises(InputError, match="give the assembly"):
        lm.force_table(lm.Prediction("other", 1.0, "estimate", "solved"))


def test_forces_are_told_of_the_structure_that_was_solved_alone():
    """Joints between held blocks are no part of a settlement: the supports were said to bear another load than W."""
    strip = [box((k, 0, -1), (k + 1, 1, 0)) for k in range(4)]
    made = lm.Assembly.from_polyhedra([*strip, box((0, 0, 0), (4, 1, 0.5))], joint=lm.Joint(30.0), fixed=range(4))
    found = lm.settlement_analysis(made, [2, 3])
    borne = [row["fz"] for row in rows_of(lm.force_table(found), "support").values()]
    assert -sum(borne) == pytest.approx(made.weights[4], rel=1e-9)
    for told in (lm.force_table, lambda answer, model: lm.figures.contact_forces(model, answer)):
        with pytest.raises(InputError, match="has 7 joints and 0 ties: give the structure"):
            told(found, made)


def test_forces_of_a_smaller_structure_are_not_told_of_a_larger_one():
    small, large = (lm.build.column(width=0.4, depth=0.3, height=1.0, courses=n, joint=lm.Joint(40.0)) for n in (2, 3))
    answer = lm.limit_analysis(small, lm.Loads.horizontal(small))
    for ask in (lm.force_table, lambda a, m: lm.figures.contact_forces(m, a)):
        with pytest.raises(InputError, match="forces of 2 joints and ties, the assembly has 3 joints and 0 ties"):
            ask(answer, large)
