"""The catalogue of causes: what holds for every cause, and joint laws against exact solutions."""

import math
import pickle
import subprocess
import sys

import numpy as np
import pytest
from cause_models import MODEL, MU, PHI, SPECIMEN, block, extend, softening_wall, value, wall

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.causes.cause import Extension
from limitmason.diagnosis import Cause
from limitmason.errors import InputError, NotApplicable
from limitmason.study.run_fingerprint import fingerprint


def test_constants_are_those_of_the_package():
    made, weight = block()
    assert made.weights[made.block_index("column-1")] == pytest.approx(weight, rel=1e-12)


# ---- what holds for every cause ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", catalogue.ALL)
def test_every_cause_says_what_it_is(name):
    cause = catalogue.ALL[name]()
    assert isinstance(cause, Cause)
    for text in (cause.physics, cause.source, cause.isolate, cause.hidden_when, cause.unit):
        assert text
    assert cause.lever in catalogue.LEVERS
    low, high = cause.bounds
    narrow = catalogue.ALL[name](bounds=(cause.baseline, high) if high > cause.baseline else (low, cause.baseline))
    assert narrow.baseline in narrow.bounds
    # tables and disk caches know a cause by its content
    assert catalogue.ALL[name]() == cause
    assert hash(pickle.loads(pickle.dumps(cause))) == hash(cause)


@pytest.mark.parametrize("name", MODEL)
def test_the_baseline_size_recovers_the_model_exactly_and_small_sizes_tend_to_it(name):
    model = softening_wall()
    cause = catalogue.ALL[name]()
    options = {"specimen": SPECIMEN} if cause.reads_specimen else {}
    assembly, loads = cause.apply(cause.baseline, *model, **options)
    assert fingerprint(assembly, loads) == fingerprint(*model)
    base = value(*model)
    assert value(assembly, loads) == base
    for side in cause.sides:
        size = cause.baseline + 1e-5 * (side - cause.baseline)
        assembly, loads = cause.apply(size, *model, **options)
        if name != "open head joints":  # a staircase, whose first step is one joint
            assert fingerprint(assembly, loads) != fingerprint(*model)
        assert value(assembly, loads) == pytest.approx(base, rel=1e-4)


@pytest.mark.parametrize("name", MODEL)
def test_the_same_size_gives_the_same_model_and_leaves_the_old_one_alone(name):
    model = softening_wall()
    before = fingerprint(*model)
    size = catalogue.ALL[name]().sides[-1]
    assert fingerprint(*extend(name, size, model)) == fingerprint(*extend(name, size, model))
    assert fingerprint(*model) == before


@pytest.mark.parametrize(
    ("name", "sizes", "sign"),
    [
        ("weak base joint", (1.0, 0.7, 0.4), -1),
        ("head joint friction", (1.0, 0.5, 0.0), -1),
        ("cohesion", (0.0, 1.0, 3.0), 1),
        ("tension", (0.0, 1.0, 3.0), 1),
        ("finite compressive strength", (0.0, 2.0, 8.0), -1),
        ("wear", (0.0, 0.02, 0.05), -1),
        ("edge rounding", (0.0, 4.0, 10.0), -1),
        ("open head joints", (0.0, 0.4, 1.0), -1),
        ("out-of-plumb", (-2.0, 0.0, 2.0), -1),
        ("second-order displacement", (0.0, 5.0, 20.0), -1),
        ("overload magnitude", (0.7, 1.0, 1.3), 1),
        ("load direction", (-10.0, 0.0, 10.0), -1),
        ("block density", (0.8, 1.0, 1.2), -1),
    ],
)
def test_effects_have_the_sign_that_physics_gives_them(name, sizes, sign):
    model = wall(top=800.0 if name in ("overload magnitude", "block density") else 0.0)
    values = [value(*extend(name, s, model)) for s in sizes]
    assert (np.diff(values) * sign >= -1e-8).all()
    assert abs(values[-1] - values[0]) > 1e-4 * values[0]


def test_stiffness_of_joints_one_joint_and_units_is_multiplied_and_what_has_none_refuses():
    made, loads = softening_wall()
    every, _ = extend("joint stiffness", 0.5, (made, loads))
    assert {i.joint.normal_stiffness for i in every.interfaces} == {5e8}
    base, _ = extend("joint stiffness", 2.0, (made, loads), kinds=("base",))
    assert {(i.kind == "base", i.joint.shear_stiffness) for i in base.interfaces} == {(True, 8e8), (False, 4e8)}
    loose = catalogue.each_joint(made, bounds=(0.1, 1.0))
    with pytest.raises(lm.errors.InputError, match="kinds must be one of 'base', 'bed', 'head', got 'beds'"):
        catalogue.each_joint(made, kinds="beds")
    assert len(loose) == len(made.interfaces)
    assert loose[3].name == f"loose joint {made.joint_names[3]}"
    one, _ = loose[3].apply(0.1, made, loads)
    changed = [k for k, i in enumerate(one.interfaces) if i.joint.normal_stiffness != 1e9]
    assert changed == [3]
    softer, _ = extend("unit modulus", 0.4, (made, loads))
    assert {b.material.young_modulus for b in softer.blocks} == {2e9}
    bare = wall()
    for name, words in (("joint stiffness", "normal_stiffness"), ("unit modulus", "material"),
                        ("fracture energy", "loses strength"), ("strength kept", "loses strength")):
        with pytest.raises(NotApplicable, match=words):
            extend(name, 0.5, bare)
    with pytest.raises(ValueError, match="no joint between"):
        catalogue.joint_stiffness(joint=("base", "facade-05-01")).apply(0.5, made, loads)


def test_softening_changes_its_energies_or_what_is_left():
    made, loads = softening_wall()
    slow, _ = extend("fracture energy", 2.0, (made, loads))
    law = slow.interfaces[0].joint
    assert (law.fracture_energy_tension, law.fracture_energy_shear) == (10.0, 40.0)
    law = extend("strength kept", 0.25, (made, loads))[0].interfaces[0].joint
    assert (law.residual_cohesion, law.residual_tensile_strength) == (500.0, 250.0)


def test_a_cause_of_a_batch_belongs_to_its_specimens_alone():
    made, _ = block(b=2.0, h=0.5)
    model = made, lm.Loads.horizontal(made)
    cause = catalogue.of_batch(catalogue.joint_friction(), "B")
    assert (cause.name, cause.own) == ("joint friction of batch B", ("batch",))
    assert value(*cause.apply(0.8, *model, specimen={"batch": "B"})) == pytest.approx(0.8 * MU, rel=1e-7)
    assert cause.apply(0.8, *model, specimen={"batch": "A"}) == model
    with pytest.raises(ValueError, match="batch"):
        cause.apply(0.8, *model, specimen={})
    own = catalogue.of_batch(Cause("own", "own", 1.0, (0.5, 2.0), apply=lambda size, length: size * length), "B")
    read = [Extension(((own, 2.0),), {"batch": batch})(0.3) for batch in "AB"]
    assert read == [0.3, 0.6]  # a model of one object stays one, where it was a tuple for the others
    heavy = catalogue.of_batch(catalogue.block_density(), "new", covariate="delivery")
    assert pickle.loads(pickle.dumps(heavy)) == heavy
    changed, _ = heavy.apply(1.2, *model, specimen={"delivery": "new"})
    assert changed.weights == pytest.approx(1.2 * made.weights)
    names = {c.name for c in catalogue.standard(plane=False, overload=True, batches={"batch": "C", "operator": "x"})}
    of_c = {n for n in names if n.endswith("of batch C")}
    each = ("joint friction", "cohesion", "effective thickness", "block density", "shift")
    assert of_c == {f"{n} of batch C" for n in each}
    assert [n for n in names if n.endswith("operator x")] == ["shift of operator x"]
    for wrong in (catalogue.gain(), catalogue.torsion_strength()):
        with pytest.raises(ValueError, match="no change of the model"):
            catalogue.of_batch(wrong, "B")


def test_a_missing_unit_weighs_less_and_touches_less():
    made, weight = block(b=0.2, h=1.0)
    less, loads = catalogue.missing_unit().apply(0.25, made, lm.Loads.horizontal(made))
    assert less.weights.sum() - made.weights.sum() == pytest.approx(-0.25 * weight)
    assert loads.live[made.block_index("column-1"), 0] == pytest.approx(0.75 * weight)
    assert less.arrays.area == pytest.approx(0.75 * made.arrays.area)
    masonry, push = wall()
    name = masonry.blocks[5].name
    one, _ = catalogue.missing_unit(unit=name).apply(0.5, masonry, push)
    touched = [name in (masonry.blocks[i.block_a].name, masonry.blocks[i.block_b].name) for i in masonry.interfaces]
    assert one.arrays.area / masonry.arrays.area == pytest.approx(np.where(touched, 0.5, 1.0))


@pytest.mark.parametrize(("plan", "bond", "run", "across"), [
    ("U", "running", "facade", 1), ("U", "running", "return-left", 0), ("straight", "header", "facade", 1),
])
def test_a_unit_is_missing_from_both_sides_of_the_wall_that_it_stands_in(plan, bond, run, across):
    sides = {} if plan == "straight" else {"return_length": 1.6}
    made = lm.build.wall(
        length=1.6, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0), plan=plan, bond=bond, **sides
    )
    name = f"{run}-02-03"
    model = made, lm.Loads.horizontal(made)
    thin, _ = catalogue.missing_unit(unit=name).apply(0.5, *model)
    part, k = np.array([1.0, 1.0, 1.0]), made.block_index(name)
    part[across] = 0.5
    middle = made.blocks[k].centroid[across]
    beds = [(a, b) for a, b in zip(made.interfaces, thin.interfaces, strict=True)
            if k in (a.block_a, a.block_b) and abs(a.normal[2]) > 0.5]
    assert beds
    for before, after in beds:
        assert np.ptp(after.polygon, axis=0) == pytest.approx(part * np.ptp(before.polygon, axis=0), abs=1e-12)
        ends = after.polygon[:, across]
        assert 0.5 * (ends.min() + ends.max()) == pytest.approx(middle)
    given, _ = catalogue.missing_unit(unit=name, direction=np.eye(3)[across]).apply(0.5, *model)
    assert given.arrays.area == pytest.approx(thin.arrays.area, rel=1e-12)


@pytest.mark.parametrize(("bond", "name", "across"), [
    ("english", "facade-01-01", 1), ("english", "return-left-02-01", 0), ("header", "facade-01-02", 1),
])
def test_a_header_at_a_corner_is_missing_from_the_sides_of_its_own_wall(bond, name, across):
    made = lm.build.wall(
        length=1.6, courses=4, unit=(0.4, 0.2, 0.2), joint=lm.Joint(33.0), plan="L", bond=bond, return_length=1.6
    )
    thin, _ = catalogue.missing_unit(unit=name).apply(0.5, made, lm.Loads.horizontal(made))
    part, k = np.array([1.0, 1.0, 1.0]), made.block_index(name)
    part[across] = 0.5
    for before, after in zip(made.interfaces, thin.interfaces, strict=True):
        if k in (before.block_a, before.block_b) and abs(before.normal[2]) > 0.5:
            assert np.ptp(after.polygon, axis=0) == pytest.approx(part * np.ptp(before.polygon, axis=0), abs=1e-12)


def test_bond_is_cohesion_and_tension_of_mortar():
    made, loads = softening_wall()
    law = extend("bond strength", 0.5, (made, loads))[0].interfaces[0].joint
    assert (law.cohesion, law.tensile_strength) == (1e3, 5e2)
    with pytest.raises(NotApplicable, match="no bond"):
        extend("bond strength", 0.5, wall())


def test_readings_of_displacements_follow_their_laws():
    # springs in row; a wall that turns about its base; a drift that grows by the same share from test to test
    rig = catalogue.rig_compliance()
    assert 1.0 / rig.apply(2e-8, 5e7, {}, quantity="stiffness") == pytest.approx(1.0 / 5e7 + 2e-8)
    assert rig.apply(2e-8, 1e-3, {"peak": 1e4}, quantity="drift at peak") == pytest.approx(1e-3 + 2e-4)
    point = catalogue.control_point()
    assert point.apply(0.2, 3.0, {"height": 2.0}, quantity="drift at peak") == pytest.approx(3.3)
    assert point.apply(0.2, 3.0, {"height": 2.0}, quantity="stiffness") == pytest.approx(3.0 / 1.1)
    with pytest.raises(ValueError, match="below the base"):
        point.apply(-0.5, 3.0, {"height": 0.4}, quantity="stiffness")
    assert catalogue.displacement_gain().apply(1.25, 1.0, {}, quantity="stiffness") == pytest.approx(0.8)
    drift = catalogue.sensor_drift()
    assert drift.apply(0.01, 2.0, {"order": 11}) == pytest.approx(2.0 * math.exp(0.1))
    assert drift.own == ("order",)
    moved = {"gain of displacements", "rig compliance", "wrong control point"}
    every = {m: {c.name for c in catalogue.standard(method=m, covariates=["height"])} & moved
             for m in ("limit", "modes", "pushover")}
    assert every == {"limit": set(), "modes": set(), "pushover": moved}


def test_every_cause_is_one_declared_function_that_says_which_methods_feel_it():
    for name, declared in catalogue.ALL.items():
        assert getattr(catalogue, declared.__name__) is declared
        assert declared().lever == declared.lever
        assert declared.__doc__
        assert pickle.loads(pickle.dumps(declared)) is declared
        assert "baseline" not in (declared.function.__code__.co_names), name  # the guard stands in one place
    with pytest.raises(TypeError, match="has no option 'kind'; it takes: kinds"):
        catalogue.cohesion(kind=("bed",))
    with pytest.raises(ValueError, match="lever must be one of"):
        catalogue.declare("x", parameter="x", lever="wind", baseline=0.0, bounds=(0.0, 1.0), physics="")(abs)
    with pytest.raises(AttributeError, match="no attribute 'wind'"):
        catalogue.wind  # noqa: B018
    assert catalogue.second_order_displacement().analyses > 0


@catalogue.declare("heavier top", parameter="top_factor", lever="weights", baseline=1.0, bounds=(1.0, 2.0),
                   physics="a capping that was not drawn")
def heavier_top(size, assembly, loads, *, blocks=("column-1",)):
    """The blocks named weigh size times as much."""
    return catalogue.block_density(blocks=blocks).apply(size, assembly, loads)


def test_a_cause_of_ones_own_is_one_declared_function():
    made, weight = block()
    model = (made, lm.Loads.horizontal(made))
    cause = heavier_top((1.0, 1.5))
    assert (cause.name, cause.bounds, cause.lever) == ("heavier top", (1.0, 1.5), "weights")
    assert cause.apply(1.0, *model) == model  # untouched, not rebuilt
    assert cause.apply(1.5, *model)[0].weights.sum() - made.weights.sum() == pytest.approx(0.5 * weight)
    assert pickle.loads(pickle.dumps(cause)) == cause
    assert "heavier top" not in catalogue.ALL


@pytest.mark.slow
def test_a_cause_declared_in_a_script_reaches_its_worker_processes(tmp_path):
    script = tmp_path / "script.py"
    script.write_text("""
import limitmason as lm
from limitmason.causes import declare
from limitmason.diagnosis import Study

@declare("heavier", parameter="factor", lever="weights", baseline=1.0, bounds=(1.0, 2.0), physics="a cap")
def heavier(size, weight, *, power=1.0):
    return weight * size**power

def simulate(specimen, *, extend=None):
    value = 0.1 * specimen["h"]
    return extend(value) if extend else value

if __name__ == "__main__":
    study = Study([{"h": float(k)} for k in range(1, 6)], simulate, levels=3, n_jobs=2)
    print(study.predicted([heavier(power=2.0)], [1.5]))
""")
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, cwd=tmp_path)
    assert done.stdout.split() == ["[0.225", "0.45", "0.675", "0.9", "1.125]"], done.stderr


def test_joint_laws_change_by_a_function_on_the_kinds_named():
    made, _ = wall()
    asked = []

    def weaker(joint):
        asked.append(joint)
        return lm.Joint(20.0)

    changed = made.with_joints(weaker, kinds=("base", "head"))
    assert len(asked) == 1  # one law in the wall: asked once, shared afterwards
    assert {(i.kind, i.joint.friction_angle_deg) for i in changed.interfaces} == {
        ("base", 20.0), ("head", 20.0), ("bed", 36.0)}
    assert {i.joint.friction_angle_deg for i in made.with_joints(weaker).interfaces} == {20.0}
    slippery = made.with_joints(lm.Joint(10.0), ["bed"]).interfaces
    assert {i.kind for i in slippery if i.joint.friction_angle_deg == 10.0} == {"bed"}
    with pytest.raises(ValueError, match="single word 'bed'"):
        made.with_joints(weaker, kinds="bed")
    with pytest.raises(ValueError, match="a table names its joints itself"):
        made.with_joints({"bed": lm.Joint(20.0)}, kinds=("bed",))


# ---- the law of the joints -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("factor", [0.8, 0.4])
def test_weak_base_slides_at_its_own_friction(factor):
    made, _ = block(b=2.0, h=0.5)
    model = (made, lm.Loads.horizontal(made))
    assert value(*model) == pytest.approx(MU, abs=1e-8)
    assert value(*extend("weak base joint", factor, model)) == pytest.approx(factor * MU, abs=1e-8)


def test_weak_base_leaves_the_other_joints():
    made = lm.build.column(width=2.0, depth=1.0, unit_height=0.2, courses=2, joint=lm.Joint(PHI))
    loads = lm.Loads.weight(made).with_body_force(made, (1, 0, 0), blocks=["column-2"])
    # the upper block alone is pushed: its own bed joint governs until the base, under twice the weight, is weaker
    assert value(*extend("weak base joint", 0.6, (made, loads))) == pytest.approx(MU, abs=1e-8)
    assert value(*extend("weak base joint", 0.4, (made, loads))) == pytest.approx(0.8 * MU, abs=1e-8)


def test_friction_falls_with_stress_by_the_power_law():
    made, weight = block(b=2.0, h=0.5)
    stress = weight / (2.0 * 0.3)
    got = value(*extend("stress-dependent friction", 0.2, (made, lm.Loads.horizontal(made)), reference_stress=2e4))
    assert got == pytest.approx(MU * (stress / 2e4) ** -0.2, rel=1e-8)


def test_dead_load_stress_balances_the_weight_and_springs_follow_their_law():
    made, loads = wall(top=500.0)
    normal = catalogue.dead_load_stress(made, loads) * made.arrays.area
    base = np.array([i.kind == "base" for i in made.interfaces])
    assert normal[base].sum() == pytest.approx(-loads.dead[~made.fixed, 2].sum(), rel=1e-9)
    b, h, t, kn = 0.4, 1.0, 0.3, 1e8
    made, weight = block(b, h, t)
    push = np.asarray(lm.Loads.horizontal(made).live)
    u, _ = catalogue.elastic_displacements(made, push, normal_stiffness=kn)
    k = made.block_index("column-1")
    turn = weight * 0.5 * h / (kn * t * b**3 / 12.0)
    assert u[k, 4] == pytest.approx(turn, rel=1e-9)
    assert u[k, 0] == pytest.approx(weight / (0.4 * kn * b * t) + turn * 0.5 * h, rel=1e-9)


def test_cohesion_adds_its_force_to_sliding():
    made, weight = block(b=2.0, h=0.5)
    got = value(*extend("cohesion", 1.5, (made, lm.Loads.horizontal(made))))
    assert got == pytest.approx(MU + 1.5e3 * 2.0 * 0.3 / weight, rel=1e-8)


def test_tension_holds_the_heel_of_a_rocking_block():
    b, h, t, ft = 0.2, 1.0, 0.3, 2e3
    made, weight = block(b, h, t)
    got = value(*extend("tension", 2.0, (made, lm.Loads.horizontal(made))))
    # plastic: half the face at each end, ft A b / 2 about the toe against the weight's lever
    assert got == pytest.approx(b / h + ft * b * t * b / (weight * h), rel=1e-8)


@pytest.mark.slow
def test_full_dilatancy_is_the_associative_value_and_none_is_below_it():
    model = wall()
    upper = value(*model)
    full = lm.limit_analysis(*extend("dilatancy", 1.0, model), flow_rule="non-associative").collapse_multiplier
    none = lm.limit_analysis(*model, flow_rule="non-associative").collapse_multiplier
    assert full == pytest.approx(upper, rel=1e-6)
    assert none < 0.99 * upper
    half = extend("dilatancy", 0.5, model)[0]
    assert {i.joint.dilatancy_angle_deg for i in half.interfaces} == {18.0}


def test_crushing_takes_the_stress_block_from_the_lever_arm():
    b, h, t, fc = 0.2, 1.0, 0.3, 0.2e6
    made, weight = block(b, h, t)
    got = value(*extend("finite compressive strength", 1e6 / fc, (made, lm.Loads.horizontal(made))))
    moment = weight * b / 2.0 - weight**2 / (2.0 * fc * t)
    assert got == pytest.approx(moment / (weight * h / 2.0), rel=1e-7)
    # a second step adds compliances, 1/fc + 1/fc
    twice = extend("finite compressive strength", 5.0, extend("finite compressive strength", 5.0, (made, None)))[0]
    assert twice.interfaces[0].joint.compressive_strength == pytest.approx(1e5)


def test_wear_counts_the_tests_before():
    made, _ = block(b=2.0, h=0.5)
    model = (made, lm.Loads.horizontal(made))
    cause = catalogue.wear()
    for order in (1, 4):
        extended = cause.apply(0.03, *model, specimen={"order": order})
        assert value(*extended) == pytest.approx(MU * math.exp(-0.03 * (order - 1)), abs=1e-8)
    with pytest.raises(ValueError, match="order"):
        cause.apply(0.03, *model, specimen={"height": 1.0})
    # an extension of a study hands the specimen on
    assert value(*Extension(((cause, 0.03),), {"order": 4})(*model)) == pytest.approx(MU * math.exp(-0.09), abs=1e-8)


def test_causes_that_take_their_direction_from_a_vertical_live_load_do_not_apply():
    # a diagnosis then sets them aside and goes on
    bare, _ = wall()
    model = bare, lm.Loads.weight(bare).with_point_load(bare, bare.blocks[-1].name, (0.0, 0.0, -1e3))
    for cause in (catalogue.out_of_plumb(), catalogue.load_direction()):
        with pytest.raises(NotApplicable, match="live load"):
            cause.apply(1.0, *model)
    with pytest.raises(lm.errors.InputError, match="horizontal direction"):
        catalogue.out_of_plumb(direction=(0.0, 0.0, 1.0)).apply(1.0, *model)


def test_one_covariate_by_name_is_read_whole_and_no_letter_by_letter():
    names = [c.name for c in catalogue.standard(covariates="order", without="gain")]
    assert {"wear", "sensor drift"} <= set(names)
    assert "gain" not in names


@pytest.mark.parametrize(("call", "message"), [
    (lambda: catalogue.joint_stiffness(kinds="base"), "several names"),
    (lambda: catalogue.joint_stiffness(kinds=()), "several names"),
    (lambda: catalogue.joint_stiffness(kinds=("base",), joint=("a", "b")), "leave kinds out"),
    (lambda: catalogue.joint_softness(shear_ratio=0.0).apply(1.0, *block()), "shear_ratio must be positive"),
    (lambda: catalogue.eccentric_overload(direction=(0, 0, 0)).apply(1.0, *wall()), "not zero"),
    (lambda: catalogue.eccentric_overload(direction=(0, 0, 1)).apply(1.0, *wall()), "horizontal direction"),
    (lambda: catalogue.wear(order="date").apply(0.1, *wall(), specimen={"date": "May"}), "'date' .* must be a number"),
    (lambda: catalogue.sensor_drift(order="date").apply(0.1, 1.0, {"date": "May"}), "'date' .* must be a number"),
    (lambda: catalogue.gain(1.2), "smallest and a largest size"),
    (lambda: catalogue.gain(("low", 2.0)), "bounds must be numbers"),
])
def test_wrong_options_of_causes_are_named(call, message):
    with pytest.raises(InputError, match=message):
        call()


def test_a_number_of_a_test_may_come_as_text():
    assert catalogue.sensor_drift().apply(0.1, 1.0, {"order": "2"}) == pytest.approx(math.exp(0.1))
