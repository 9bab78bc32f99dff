"""Terms added to the joint law: every kind of block follows them, files keep them, what does not know them says so."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from joint_terms import Weaker, Wear, stack

import limitmason as lm
from dem.model.joints import JointOptions, make_laws
from dem.model.state import State
from limitmason import formats
from limitmason.errors import InputError
from limitmason.mechanics import law_table
from limitmason.model.joint_term import ADDED


@pytest.fixture
def registered(monkeypatch):
    monkeypatch.setitem(ADDED, "wear", "joint_terms:Wear")
    monkeypatch.setitem(ADDED, "weaker", "joint_terms:Weaker")


def test_a_term_that_is_not_registered_given_twice_or_no_term_is_refused(registered):
    with pytest.raises(InputError, match="a term is given twice: wear"):
        lm.Joint(30.0, terms=(Wear(1e-3), Wear(2e-3)))
    with pytest.raises(InputError, match="'weaker' changes the strength of a joint that has not slipped"):
        lm.Joint(30.0, cohesion=1e4, terms=(Weaker(),))
    with pytest.raises(InputError, match="Wear: cohesion_over = -1"):
        Wear(-1.0)
    ADDED.pop("wear")
    with pytest.raises(InputError, match="Wear is no term of the joint law yet: register it"):
        lm.Joint(30.0, terms=(Wear(1e-3),))


def test_the_dem_refuses_a_term_that_came_too_late(registered):
    wall = stack(lm.Joint(30.0, normal_stiffness=1e9, terms=(Wear(1e-3),)))
    with pytest.raises(InputError, match="'wear' of the joint law was registered after dem was imported"):
        make_laws(wall, lm.Loads.weight(wall).dead, JointOptions())


def test_files_keep_terms_and_models_differ_by_them(registered, tmp_path):
    joint = lm.Joint(30.0, cohesion=1e4, terms=(Wear(1e-3, friction_over=0.5),))
    wall = stack(joint)
    formats.write_json(tmp_path / "wall.json", wall)
    back = formats.read_json(tmp_path / "wall.json").assembly
    assert back.interfaces[0].joint == joint
    assert back.fingerprint.digest == wall.fingerprint.digest
    other = wall.with_joints(lm.Joint(30.0, cohesion=1e4, terms=(Wear(2e-3, friction_over=0.5),)))
    with pytest.raises(InputError, match="another wear's cohesion_over now .0.002., not 0.001"):
        other.fingerprint.check_same(wall.fingerprint, "the state")
    with pytest.raises(InputError, match="wear's"):
        stack(lm.Joint(30.0, cohesion=1e4)).fingerprint.check_same(wall.fingerprint, "the state")
    ADDED.pop("wear")
    with pytest.raises(InputError, match="no term 'wear' of the joint law is registered; known: weaker"):
        formats.read_json(tmp_path / "wall.json")


def test_the_table_has_a_row_for_an_added_term(registered):
    row = next(line for line in law_table.page().splitlines() if line.startswith("| wear |"))
    assert row.count("refused") == len(law_table.THEORIES)


# kernels in Python, without the compiler: a block slides under its weight, on every kind of block
SLIDE = """
import os, sys
os.environ["NUMBA_DISABLE_JIT"] = "1"
sys.path.insert(0, sys.argv[1])
import numpy as np
import limitmason as lm
from limitmason.model.joint_term import ADDED
ADDED["wear"] = "joint_terms:Wear"
from joint_terms import Wear, stack
import dem
law = lm.Joint(30.0, cohesion=5e4, normal_stiffness=1e9, shear_stiffness=1e9, terms=(Wear(4e-3, friction_over=8e-3),))
wall = stack(law).with_material(lm.Material(young_modulus=1e10, poisson_ratio=0.2, density=2000.0), blocks=[1])
assert "wears off (cohesion_over 0.004" in lm.mechanics.model_notes.lost_in_failure(wall)[0]
moved = 2e-3
for blocks, stress in (("rigid", None), ("simply deformable", "plane stress"), ("simply deformable", "solid")):
    given = {"blocks": blocks, "stress": stress} if stress else {}
    h = dem.simulate(wall, [dem.Settle(), dem.Drive({1: {"x": moved, "y": 0.0, "ry": 0.0}}, steps=300)],
                     contact_points=(2, 2), sample=100, detect_every=None, **given)
    slip = np.hypot(h.state.points.slip_1, h.state.points.slip_2).mean()
    print(slip, abs(h.reaction[-1, list(h.reaction_blocks).index(1), 0]))
h.state.save(sys.argv[2])
"""


@pytest.mark.slow
def test_every_kind_of_block_follows_a_term(tmp_path):
    here = str(Path(__file__).parents[1] / "builders")
    file = tmp_path / "state.npz"
    done = subprocess.run(
        [sys.executable, "-c", SLIDE, here, str(file)], capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr
    rows = np.array([[float(v) for v in line.split()] for line in done.stdout.split("\n")[:-1]])
    weight = 2000.0 * 9.81 * 0.2 * 0.1 * 0.2
    for slip, force in rows:
        exact = 5e4 * 0.04 * (1.0 - slip / 4e-3) + weight * np.tan(np.deg2rad(30.0)) * (1.0 - slip / 8e-3)
        assert force == pytest.approx(exact, rel=1e-2)
    with pytest.raises(InputError, match=r"with the terms \['wear'\] added to the joint law, now there are \[\]"):
        State.load(file)
