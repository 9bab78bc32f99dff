"""Ties as elements of the model: strengths, refusals, copies, files, drawings."""

import numpy as np
import pytest
from walls import on_slab, stack

import limitmason as lm
from limitmason import figures, formats
from limitmason.errors import InputError
from limitmason.study.run_fingerprint import fingerprint

ROD = {"yield_force": 2e3}
TOP = (0.0, 0.5, 0.8)


def pier(**tie):
    wall = stack([(0.3, 0.5)] * 2, mu=0.7)
    return wall.with_ties([lm.Tie("block-2", TOP, None, (-1.0, 0.5, 0.8), **(tie or ROD))])


def test_strength_is_the_least_of_yield_bond_and_anchor_plate():
    tie = lm.Tie("a", (0, 0, 0), "b", (3, 4, 0), area=2e-4, yield_stress=235e6, bond_force=40e3, anchor_force=45e3)
    assert tie.strengths == pytest.approx({"yield": 47e3, "bond": 40e3, "anchor plate": 45e3})
    assert tie.strength == 40e3
    assert tie.governed_by == "bond"
    assert tie.length == pytest.approx(5.0)
    assert tie.direction == pytest.approx([0.6, 0.8, 0.0])
    assert np.isnan(tie.axial_stiffness)
    assert lm.Tie("a", (0, 0, 0), "b", (0, 0, 2), area=1e-4, modulus=2e11, **ROD).axial_stiffness == pytest.approx(1e7)
    assert str(tie) == "tie from 'a' to 'b', 5 m, 40 kN (bond)"


@pytest.mark.parametrize("changes, message", [
    ({"yield_force": None}, "no strength"),
    ({"yield_force": 0.0}, "yield_force must be positive"),
    ({"yield_force": np.nan}, "yield_force must be positive"),
    ({"yield_force": np.inf}, "leave out what does not govern"),
    ({"bond_force": "much"}, "bond_force must be a number"),
    ({"yield_stress": 1e8, "area": 1e-4}, "yield_force or yield_stress"),
    ({"modulus": 1e11}, "modulus needs the area"),
    ({"area": 1e-4}, "area is not used"),
    ({"area": 1e-4, "modulus": 1e11, "stiffness": 1e7}, "stiffness or modulus"),
    ({"point_a": (0.0, 0.5)}, "point_a must be three finite coordinates"),
    ({"point_a": (0.0, np.inf, 0.5)}, "point_a must be three finite coordinates"),
    ({"point_b": TOP}, "its two ends coincide"),
    ({"point_b": (TOP[0] + 1e-12, *TOP[1:])}, "its two ends coincide"),
])
def test_what_is_no_tie_is_refused(changes, message):
    given = {"block_a": "block-2", "point_a": TOP, "block_b": None, "point_b": (-1.0, 0.5, 0.8), **ROD, **changes}
    with pytest.raises(InputError, match=message):
        lm.Tie(**given)


@pytest.mark.parametrize("tie, message", [
    (lm.Tie("block-9", TOP, None, (-1, 0.5, 0.8), **ROD), "block-9"),
    (lm.Tie("block-2", TOP, "block-2", (0.3, 0.5, 0.8), **ROD), "both ends are on block 'block-2'"),
    (lm.Tie("block-0", (0, 0, -0.1), None, (-1, 0, 0), **ROD), "both ends are held"),
    (lm.Tie("block-2", (0, 0.5, 2.5), None, (-1, 0.5, 2.5), **ROD), "1.5 m outside block 'block-2'"),
    (lm.Tie("block-2", TOP, "block-1", (0, 0.5, -4.0), **ROD), "outside block 'block-1'"),
    ("rod", "must be a Tie, got"),
])
def test_ties_that_do_not_fit_the_assembly_are_refused(tie, message):
    wall = stack([(0.3, 0.5)] * 2)
    with pytest.raises(ValueError, match=message):
        wall.with_ties([tie])


def test_a_tie_to_the_ground_needs_a_block_that_is_wholly_held():
    wall = stack([(0.3, 0.5)] * 2)
    partly = wall.with_supports([lm.Support("block-0", translations=True)])
    with pytest.raises(ValueError, match="no block is wholly held"):
        partly.with_ties([lm.Tie("block-2", TOP, None, (-1.0, 0.5, 0.8), **ROD)])


def test_ties_can_be_taken_away_and_do_not_touch_the_faces():
    tied = pier()
    bare = tied.with_ties(())
    assert bare.links is bare.arrays
    assert len(tied.arrays.area) == len(tied.interfaces)
    assert len(tied.links.area) == len(tied.interfaces) + 1
    # pulled from end b to end a, block b is the ground
    assert tied.links.normal[-1] == pytest.approx([1.0, 0.0, 0.0])
    assert fingerprint(tied) != fingerprint(bare)


def test_copies_take_ties_along():
    tied = pier()
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = tied.transformed(2.0 * turn, (1.0, 0.0, 0.0))
    assert moved.ties[0].ends == pytest.approx(tied.ties[0].ends @ (2.0 * turn).T + (1.0, 0.0, 0.0))
    other = tied.renumbered([2, 0, 1])
    assert other.block_index(other.ties[0].block_a) == 0
    assert other.links.block_a[-1] == 0
    assert other.links.block_b[-1] == other.block_index("block-0")


def test_a_file_keeps_every_number_of_a_tie(tmp_path):
    wall = stack([(0.3, 0.5)] * 2)
    ties = [
        lm.Tie(2, (0.1, 0.5, 1 / 3), None, (-1.1, 0.5, 0.8), area=1e-4 / 3, yield_stress=235e6, modulus=2e11, name="x"),
        lm.Tie("block-1", (0, 0, 0.2), "block-2", (0, 0.7, 0.9), bond_force=1e3 / 7, anchor_force=25.0, stiffness=1e6),
    ]
    tied = wall.with_ties(ties)
    formats.write_json(tmp_path / "tied.json", tied, lm.Loads.horizontal(tied))
    back = formats.read_json(tmp_path / "tied.json").assembly
    assert len(back.ties) == 2
    for one, two in zip(tied.ties, back.ties, strict=True):
        assert one.strengths == two.strengths
        assert one.ends.tolist() == two.ends.tolist()
        assert (one.block_a, one.block_b, one.name) == (two.block_a, two.block_b, two.name)
        assert one.axial_stiffness == two.axial_stiffness


def test_a_wrong_tie_in_a_file_is_named(tmp_path):
    file = tmp_path / "wrong.json"
    formats.write_json(file, pier())
    text = file.read_text()
    file.write_text(text.replace('"yield_force": 2000.0', '"yield_force": -1.0'))
    with pytest.raises(InputError, match="yield_force must be positive"):
        formats.read_json(file)
    file.write_text(text.replace('"yield_force"', '"yeild_force"'))
    with pytest.raises(ValueError, match="yeild_force"):
        formats.read_json(file)


def test_a_ring_beam_fastens_every_point_to_the_block_it_lies_in():
    house = on_slab([((0, 0, 0), (2, 0.3, 1)), ((0, 1, 0), (0.3, 3, 1)), ((1.7, 1, 0), (2, 3, 1))])
    line = [(0.15, 2.5, 1.0), (0.15, 0.15, 1.0), (1.85, 0.15, 1.0), (1.85, 2.5, 1.0)]
    beam = lm.ring_beam(house, line, yield_force=1e3)
    assert [(t.block_a, t.block_b) for t in beam] == [("block-2", "block-1"), ("block-1", "block-3")]
    assert [t.name for t in beam] == ["ring beam 1", "ring beam 3"]
    assert len(lm.ring_beam(house, line, closed=True, yield_force=1e3)) == 3
    with pytest.raises(ValueError, match="closed ring beam needs three points"):
        lm.ring_beam(house, line[:2], closed=True, yield_force=1e3)
    with pytest.raises(ValueError, match="lies in no block"):
        lm.ring_beam(house, [(0.15, 0.5, 1.0), (0.15, 0.15, 1.0)], yield_force=1e3)
    with pytest.raises(ValueError, match="joins two blocks"):
        lm.ring_beam(house, line[1:3], yield_force=1e3)


def drawn(figure, gid):
    return [a for ax in figure.axes for a in ax.get_children() if a.get_gid() == gid]


def test_drawings_show_ties_that_hold_and_ties_that_yield():
    tied = pier()
    loads = lm.Loads.horizontal(tied)
    away = lm.limit_analysis(tied, loads)
    towards = lm.limit_analysis(tied, lm.Loads.horizontal(tied, (-1, 0, 0)))
    assert len(drawn(figures.assembly(tied), "ties")) == 1
    for view in ("elevation", "3d"):
        assert len(drawn(figures.mechanism(tied, away, view=view), "yielding ties")) == 1
        assert not drawn(figures.mechanism(tied, towards, view=view), "yielding ties")
    assert len(drawn(figures.contact_forces(tied, away), "yielding ties")) == 1
    segment = drawn(figures.assembly(tied), "ties")[0].get_segments()[0]
    assert np.ptp(segment[:, 0]) == pytest.approx(1.0)
