"""The joint law has one home: its closed forms, who reads it, and one table of which theory takes which term."""

import ast
import dataclasses
import re
from pathlib import Path

import numpy as np
import pytest
from walls import on_slab

import dem
import limitmason as lm
import mechanisms
from dem.kernels import LAW as ROW
from dem.model.joints import JointOptions, make_laws
from limitmason import methods
from limitmason.errors import NotApplicable
from limitmason.mechanics import law_table
from limitmason.mechanics.law import PointLaw, interface_law, peak_law, residual_law, tension_corner
from limitmason.mechanics.law_table import FIELDS, THEORIES, Taken
from limitmason.mechanics.stress_block import stress_blocks

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("limitmason", "dem", "mechanisms")

LAW = PointLaw(*(np.array([v, v]) for v in (0.5, 0.2, 30.0, 40.0, 500.0)))
"""tan(phi) 0.5, tan(psi) 0.2, c 30 N, t 40 N below the apex at 60 N, fc 500 N."""


def on_a_slab(joint, height=0.2):
    return on_slab([((0.0, 0.0, 0.0), (0.4, 0.2, height))], joint=joint, density=2000.0)


# ---- closed forms


def test_the_corner_is_the_strength_or_the_apex():
    corner = tension_corner(np.array([1.0, 3.0, 2.0, 0.0]), np.array([1.0, 1.0, 1.0, 0.0]), np.array([0.5, 0.5, 0, 0]))
    assert corner.tolist() == [1.0, 2.0, 2.0, 0.0]
    assert LAW.apex.tolist() == [60.0, 60.0]
    assert LAW.corner_cohesion.tolist() == [10.0, 10.0]
    assert LAW.corner_crushing.tolist() == [540.0, 540.0]
    # at the apex itself the cone alone limits tension, whatever the unit of force
    for scale in (1e-3, 1.0, 1e7):
        apex = LAW._replace(tension=LAW.apex).over(np.full(2, scale / 3.0)).in_units_of(scale)
        assert not apex.cut_off.any()
        assert LAW.over(np.full(2, scale)).cut_off.all()


def test_forces_on_the_law_have_no_excess_and_others_their_distance():
    normal, shear = np.array([100.0, -40.0]), np.array([80.0, 10.0])
    assert LAW.excess(normal, shear).tolist() == [0.0, 0.0]
    assert LAW.excess(normal, shear + 7.0).tolist() == [7.0, 7.0]
    assert LAW.excess(np.array([-45.0, 503.0]), np.zeros(2)).tolist() == [5.0, 3.0]
    corner = LAW.from_corner()
    assert corner.excess(normal + LAW.tension, shear + 7.0).tolist() == [7.0, 7.0]


@pytest.mark.parametrize("opening", [-0.3, 0.1, 0.25, 1.0])
def test_dissipation_is_the_most_that_any_force_within_the_law_does(opening):
    # support function: max of T slip - N e_n over |T| <= c + tan(phi) N, -t <= N <= fc
    slip = 0.4
    normal = np.linspace(-40.0, 500.0, 5401)
    most = ((30.0 + 0.5 * normal) * slip - normal * opening).max()
    assert LAW.dissipation(np.full(2, opening), np.full(2, slip)) == pytest.approx([most, most], rel=1e-12)


def test_states_that_follow_the_flow_rule_leave_nothing_and_others_their_power():
    slip, along = 0.3, np.array([[0.6, 0.8], [0.6, 0.8]])
    normal = np.array([100.0, 500.0])
    shear = -LAW.shear_strength(normal)[:, None] * along
    opening = np.array([0.2 * slip, -0.05])  # dilates by tan(psi); the second crushes at its capacity
    short, power = LAW.without_crushing(np.array([0])).flow_residual(normal, shear, opening, slip * along)
    assert short == pytest.approx([0.0, 0.0], abs=1e-15)
    assert power == pytest.approx([0.0, 0.0], abs=1e-12)
    # without crushing a point that closes violates the rate; with it, the force that is missing to fc does power
    short, power = LAW.without_crushing().flow_residual(normal, shear, opening, slip * along)
    assert short[1] == pytest.approx(0.05 + 0.2 * slip)
    _, power = LAW.flow_residual(normal - 10.0, shear, opening, slip * along)
    assert power[1] == pytest.approx(10.0 * (0.05 + 0.2 * slip) + 0.5 * 10.0 * slip)


def test_the_stress_block_is_that_of_a_section_and_its_power_the_most_it_can_do():
    # |M| = N L / 2 - N^2 / (2 fc b): compressed at fc over N / (fc b) from one end; here with tension t besides
    length, width, fc, t = 2.0, 0.5, 800.0, 60.0
    area = np.array([length * width])
    law = PointLaw(np.array([0.7]), np.zeros(1), np.array([1e3]), np.array([t]), np.array([fc])).over(area)
    block = stress_blocks(law, np.array([[0, 1]]))
    for share in (0.05, 0.3, 0.8):
        pressed = share * (fc + t) * length * width  # N' = N + t A
        moment = 0.5 * pressed * length - pressed**2 / (2.0 * (fc + t) * width)
        n = pressed - t * area[0]
        ends = np.array([[0.5 * n + moment / length, 0.5 * n - moment / length]])
        assert block.excess(ends) == pytest.approx([0.0], abs=1e-9 * pressed)
        assert block.excess(ends + [[1.0, -1.0]])[0] > 0.5
    total = np.linspace(0.0, 1.0, 100_001) * block.capacity[0]
    least = total**2 / (2.0 * block.capacity[0])  # of the end that is pressed less
    for g in ([0.3, -0.2], [-0.1, 0.4], [0.2, 0.1], [-0.3, -0.2]):
        forces = [(least, total - least), (total - least, least)]
        half = 0.5 * t * area[0]
        most = max((-(a - half) * g[0] - (b - half) * g[1]).max() for a, b in forces)
        assert block.power(np.array([g])) == pytest.approx([most], rel=1e-8)
    with np.errstate(all="raise"):  # pushed in evenly, in units in which its strength is large
        even = block.in_units_of(1e-9).power(np.array([[-0.2, -0.2]]))
    assert even == pytest.approx([0.2e9 * (block.capacity[0] - t * area[0])], rel=1e-12)


def test_the_law_inside_shares_the_corner_and_lies_inside():
    inside = LAW.inside()
    normal = np.linspace(-40.0, 500.0, 50)
    for k in range(2):
        assert inside.tension[k] == LAW.tension[k]
        true, reduced = (law.cohesion[k] + law.tan_phi[k] * normal for law in (LAW, inside))
        assert (reduced <= true + 1e-12).all()
        assert reduced[0] == pytest.approx(true[0])


def test_peak_and_residual_law_are_what_the_dem_runs():
    brittle = lm.Joint(35.0, 20.0, cohesion=2e5, tensile_strength=9e5, residual_friction_angle_deg=30.0,
                       residual_cohesion=1e4, residual_tensile_strength=1e6)
    wall = on_a_slab(brittle)
    rows, _ = make_laws(wall, lm.Loads.weight(wall).dead, JointOptions(residual_dilatancy_angle_deg=40.0))
    # the DEM takes tension above the apex, at the peak and after it
    peak = peak_law([brittle], convex=False)
    rest = residual_law([brittle], np.tan(np.deg2rad([40.0])), convex=False)
    assert (peak.tension[0], rest.tension[0]) == (9e5, 1e6)
    assert (rows[0, ROW.cohesion], rows[0, ROW.tension]) == (peak.cohesion[0], peak.tension[0])
    assert rows[0, [ROW.rest_cohesion, ROW.rest_tension, ROW.rest_tan_phi, ROW.rest_tan_psi]].tolist() == [
        rest.cohesion[0], rest.tension[0], rest.tan_phi[0], rest.tan_psi[0],
    ]
    assert rest.tan_psi[0] == rest.tan_phi[0]  # never more than the friction left
    # the convex law cuts both at the apex
    assert interface_law(wall.arrays, convex=False).tension[0] == 9e5
    assert interface_law(wall.arrays).tension[0] == peak_law([brittle]).tension[0]
    assert peak_law([brittle]).tension[0] == pytest.approx(2e5 / np.tan(np.deg2rad(35.0)))
    assert residual_law([brittle]).tension[0] == pytest.approx(1e4 / np.tan(np.deg2rad(30.0)))


# ---- one home


def _worked_out(text):
    """Lines that work out the tension corner or the shear strength from the terms of the law."""
    terms, lines = re.compile("cohesion|tensile_strength"), text.splitlines()
    # none without one of them, and to read a file or to write a node anew takes long
    for node in ast.walk(ast.parse(text)) if terms.search(text) else ():
        kind = isinstance(node, ast.BinOp | ast.Call)
        if not kind or not terms.search("\n".join(lines[node.lineno - 1 : node.end_lineno])):
            continue
        words = ast.unparse(node)
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
            over = ast.unparse(node.right)
            if "cohesion" in ast.unparse(node.left) and ("tan_phi" in over or over in ("mu", "friction")):
                yield node.lineno, words
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
            sides = {"cohesion" in ast.unparse(s) for s in (node.left, node.right)}
            slope = re.search(r"tan_phi(\[\w+\])? \*", words)
            if len(sides) == 2 and slope:
                yield node.lineno, words
        elif isinstance(node, ast.Call):
            name = ast.unparse(node.func)
            divides = name == "np.divide" and "cohesion" in words and "tan_phi" in words
            if divides or (name in ("min", "np.minimum") and "tensile_strength" in words):
                yield node.lineno, words


def test_the_law_is_worked_out_in_its_home_only():
    guilty = [
        f"{path.relative_to(ROOT)}:{line}: {words}"
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        if path != ROOT / "limitmason" / "mechanics" / "law.py" and path.parent.name != "kernels"
        for line, words in _worked_out(path.read_text(encoding="utf-8"))
    ]
    assert guilty == []
    # and the check has teeth
    home = (ROOT / "limitmason" / "mechanics" / "law.py").read_text(encoding="utf-8")
    assert len(list(_worked_out(home))) >= 3


def test_the_kernels_name_the_entries_of_the_law():
    sources = [p.read_text(encoding="utf-8") for p in sorted((ROOT / "dem" / "kernels").glob("*.py"))]
    assert len(sources) > 5
    assert re.findall(r"law\[(?:j, )?\d+\]", "".join(sources)) == []


def test_results_are_not_read_out_of_provenance_or_words():
    reads = re.compile(r"provenance\.get\(|(?<!`)provenance\[[^]]*\](?! *=[^=])|in \w+\.provenance")
    old_files = ROOT / "limitmason" / "formats" / "answers.py"  # what 0.1 wrote is found nowhere else
    paths = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py")) if p != old_files]
    guilty = [str(p.relative_to(ROOT)) for p in paths if reads.search(p.read_text(encoding="utf-8"))]
    assert guilty == []
    words = re.compile(r"bound\.(split|startswith|partition)\(")
    paths += [ROOT / "README.md", *sorted((ROOT / "examples").glob("*.py"))]
    assert [str(p.relative_to(ROOT)) for p in paths if words.search(p.read_text(encoding="utf-8"))] == []


# ---- one table


def test_every_theory_says_what_it_does_with_every_term():
    assert set(THEORIES) >= set(methods.COMPARED_METHODS)
    for term in FIELDS:
        assert set(term.takes) == set(THEORIES), term.name
        for theory, cell in term.takes.items():
            if cell.how is Taken.REFUSED:
                assert cell.why, (theory, term.name)
                assert cell.remedy, (theory, term.name)
            else:
                assert not cell.remedy


def test_the_page_of_the_documentation_is_current():
    text = (ROOT / "docs" / "laws.md").read_text(encoding="utf-8")
    assert text == law_table.page(), "write limitmason.mechanics.law_table.page() to docs/laws.md"


WEAK = lm.Joint(35.0, 10.0, compressive_strength=1e6)
REFUSALS = {
    "corners in space": (WEAK, lambda w, p: lm.limit_analysis(w, p, in_plane=False), "contact_model='grid'"),
    "stress block": (
        WEAK, lambda w, p: lm.limit_analysis(w, p, "non-associative", search="quick"), "contact_model='grid'",
    ),
    "proof": (
        WEAK,
        lambda w, p: lm.limit_analysis(w, p, "non-associative", contact_model="grid", prove=True),
        "without prove=True",
    ),
    "proven range": (WEAK, lambda w, p: lm.proven_range(w, p), "without prove=True"),
    "own solver, stress block": (
        WEAK, lambda w, p: lm.limit_analysis(w, p, solver="interior-point"), "solver='clarabel'",
    ),
    "own solver, no friction": (
        lm.Joint(0.0, cohesion=1e4), lambda w, p: lm.limit_analysis(w, p, solver="interior-point"), "solver='clarabel'",
    ),
}


@pytest.mark.parametrize("name", REFUSALS)
def test_a_refusal_names_the_joint_and_what_to_do(name):
    joint, call, remedy = REFUSALS[name]
    wall = on_a_slab(joint)
    with pytest.raises(NotApplicable, match=f"the joint between '.*' and '.*' has .*{re.escape(remedy)}"):
        call(wall, lm.Loads.horizontal(wall))


def test_psi_equal_to_phi_takes_the_stress_block():
    wall = on_a_slab(dataclasses.replace(WEAK, dilatancy_angle_deg=35.0))
    loads = lm.Loads.horizontal(wall)
    same = lm.limit_analysis(wall, loads, "non-associative").collapse_multiplier
    assert same == lm.limit_analysis(wall, loads).collapse_multiplier


def test_residual_values_are_left_out_with_a_warning_where_the_theory_knows_none():
    brittle = lm.Joint(35.0, cohesion=2e3, tensile_strength=1e3, residual_cohesion=0.0)
    for joint, warned in ((brittle, True), (dataclasses.replace(brittle, residual_cohesion=None), False)):
        wall = on_a_slab(joint)
        loads = lm.Loads.horizontal(wall)
        found = [
            lm.limit_analysis(wall, loads), lm.limit_analysis(wall, loads, "non-associative", search="quick"),
            mechanisms.overturning(wall, loads=loads),
        ]
        for prediction in found:
            assert any("residual values of the joints are left out" in w for w in prediction.warnings) is warned
        runs = dem.collapse(wall, loads, contact_points=(2, 2), error_budget=())
        assert not any("residual values" in w for w in runs.warnings)
