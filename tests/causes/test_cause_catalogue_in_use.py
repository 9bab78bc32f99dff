"""The catalogue of causes: its lists, every cause by every method, and causes in a study."""


import numpy as np
import pytest
from cause_models import MODEL, MU, block, extend, value, wall

import limitmason as lm
from limitmason import causes as catalogue
from limitmason.diagnosis import Cause, Measured, Noise, Study, simulate
from limitmason.diagnosis.simulator_calls import Extension
from limitmason.errors import NotApplicable, NotConverged
from limitmason.mechanics import law_table

# ---- lists -----------------------------------------------------------------------------------------------------------


def test_lists_hold_what_a_method_feels():
    assert "dilatancy" not in [c.name for c in catalogue.standard(method="limit")]
    assert "dilatancy" in [c.name for c in catalogue.standard(method="dem")]
    every = (lm.methods.LIMIT, *lm.methods.METHODS)
    spatial = {m: [c.name for c in catalogue.standard(plane=False, method=m)] for m in every}
    assert "torsion strength" in spatial["limit"]
    assert "torsion strength" not in spatial["non-associative"] + spatial["dem"]
    assert "second-order displacement" in spatial["non-associative"]
    for law in ("pushover", "sustained", "dem"):  # displaced blocks are theirs already
        assert "second-order displacement" not in spatial[law]
        assert "joint softness" in spatial[law]
    assert "finite compressive strength" not in spatial["limit"] + spatial["non-associative"]
    names = [c.name for c in catalogue.standard(plane=False, tilting=True, overload=True, covariates=["order"])]
    assert {"effective thickness", "torsion strength", "wear", "angle offset", "block density", "gain"} <= set(names)
    assert any(c.acts_on == "measurement" for c in catalogue.standard(method="mechanisms"))
    felt = {row["cause"]: row["felt by"] for row in catalogue.table()}
    assert len(felt) == len(catalogue.ALL)
    assert felt["rig compliance"] == "stiffness, drift at peak"
    assert felt["joint stiffness"] == "force, deformation, vibration, pattern"
    assert felt["cohesion"] == "force, deformation, pattern"
    with pytest.raises(ValueError, match="no cause 'wind'"):
        catalogue.standard(without=["wind"])
    with pytest.raises(ValueError, match="method"):
        catalogue.standard(method="fem")


@pytest.mark.parametrize("method", lm.methods.METHODS)
def test_a_method_declares_no_lever_whose_term_its_law_refuses_or_leaves_out(method):
    """Against the table of joint laws, which refuses and warns."""
    theory = method if method in law_table.THEORIES else lm.methods.NON_ASSOCIATIVE  # the sustained load begins there
    terms = {"cohesion": (law_table.COHESION,) * 2, "tension": (law_table.TENSION,) * 2,
             "dilatancy": (law_table.DILATANCY,) * 2,
             "crushing": (law_table.CORNER_CRUSHING, law_table.STRESS_BLOCK)}
    for lever, (space, plane) in terms.items():
        for in_plane, term in ((False, space), (True, plane)):
            taken = term.cell(theory).how in (law_table.Taken.TAKEN, law_table.Taken.PLASTIC)
            assert lm.methods.get_method(method).feels(lever, plane=in_plane) == taken, (lever, in_plane)


def test_looks_of_methods_are_told_apart():
    looks = [lm.methods.get_method(m).look for m in lm.methods.METHODS]
    for part in ("name", "colour", "marker"):
        assert len({getattr(look, part) for look in looks}) == len(looks), part


# that it is computed is asked here, not how well
SHORT = {
    "non-associative": {"search": "quick", "prove": False, "measure_jump": False},
    "dem": {"error_budget": ()},
    "pushover": {"contacts": "first"},
}


@pytest.mark.parametrize("plane", [True, False])
@pytest.mark.parametrize(
    "method",  # not the sustained load, a minute a size: its levers are checked against the table above
    [
        "mechanisms",
        *(pytest.param(m, marks=pytest.mark.slow) for m in ("associative", "non-associative", "dem", "pushover")),
    ],
)
def test_every_cause_of_the_list_is_computed_by_the_method_it_is_for(method, plane):
    joint = lm.Joint(35.0, normal_stiffness=1e10, shear_stiffness=4e9)

    def build(specimen):
        wall = lm.build.wall(length=0.4, courses=2, unit=(0.2, 0.1, 0.1), joint=joint)
        return wall, lm.Loads.horizontal(wall, (1, 0, 0) if plane else (0, 1, 0))

    run, specimen = simulate.collapse(build, method, **SHORT.get(method, {})), {"order": 2, "h": 0.2}
    listed = catalogue.standard(plane=plane, method=method, overload=True, covariates=["order"])
    for cause in listed:
        for size in cause.sides if cause.acts_on == "simulation" else ():
            steps = {"extend": Extension(((cause, size),), specimen)} if cause.apply else {cause.parameter: size}
            assert run(specimen, **steps) > 0.0, (cause.name, size)


def test_every_cause_of_the_list_for_modes_moves_a_frequency():
    joint = lm.Joint(35.0, normal_stiffness=1e10, shear_stiffness=4e9)
    model = lm.build.wall(length=0.4, courses=2, unit=(0.2, 0.1, 0.1), joint=joint)
    model = model, lm.Loads.horizontal(model)
    wanted = {"frequency 1": "modes"}
    plain = lm.answer(*model, wanted)["frequency 1"]
    listed = [c for c in catalogue.standard(method="modes", overload=True) if c.acts_on == "simulation"]
    assert {"edge rounding", "joint softness", "stiffness of base joints", "block density"} <= {c.name for c in listed}
    for cause in listed:
        moved = lm.answer(*Extension(((cause, cause.sides[-1]),), {})(*model), wanted)["frequency 1"]
        assert abs(moved / plain - 1.0) > 1e-3, cause.name


# ---- in a study ------------------------------------------------------------------------------------------------------


def stack(specimen, *, friction_coefficient=0.7):
    """One block, which rocks at b/h or slides."""
    joint = lm.Joint.from_friction_coefficient(friction_coefficient)
    made = lm.build.column(width=specimen["b"], depth=0.3, height=specimen["h"], courses=1, joint=joint)
    return made, lm.Loads.horizontal(made)


STACKS = [{"b": b, "h": h, "order": k + 1} for k, (b, h) in enumerate([(0.1, 0.5), (0.2, 0.5), (0.5, 0.4), (0.1, 0.8)])]


def test_ready_simulator_builds_extends_and_predicts():
    run = simulate.collapse(stack)
    assert run(STACKS[1]) == pytest.approx(0.4, abs=1e-8)
    assert run(STACKS[2], friction_coefficient=0.6) == pytest.approx(0.6, abs=1e-8)
    rounded = Extension(((catalogue.edge_rounding(), 5.0),), STACKS[0])
    assert run(STACKS[0], extend=rounded) == pytest.approx(0.09 / 0.5, abs=1e-8)
    assert run.model(STACKS[0], extend=rounded)[0].n_blocks == 2
    kilonewton = simulate.collapse(stack, measured_as=lambda s, value: 10.0 * s["h"] * value)
    assert kilonewton(STACKS[1]) == pytest.approx(10.0 * 0.5 * 0.4, abs=1e-7)
    overturned = Extension(((catalogue.edge_rounding(), 49.9999),), STACKS[0])
    assert run(STACKS[0], extend=overturned) == simulate.FLOOR
    with pytest.raises(TypeError, match="wind"):
        run(STACKS[0], wind=1.0)
    with pytest.raises(ValueError, match="method"):
        simulate.collapse(stack, "fem")
    with pytest.raises(ValueError, match="does not take the parameter 'wind'"):
        Study(STACKS, run).table(Cause("wind", "wind", 0.0, (0.0, 1.0)))


def test_packaged_experiments_are_simulated_in_their_own_unit():
    test = lm.experiments.load("minho-dry-stone-2005-2009", "SW.30.1")
    run = simulate.packaged("minho-dry-stone-2005-2009")
    force = value(test.assembly(), test.loads()) * test.multiplier_to_measured
    assert run({"specimen": "SW.30.1"}) == pytest.approx(force, rel=1e-9)
    assert run({"specimen": "SW.30.1"}, friction=0.3) < force


def closed_form(specimen, *, friction_coefficient=0.7, extend=None):
    """The block's own formula on the extended model: slides, or rocks about the end of its contact."""
    made, loads = stack(specimen, friction_coefficient=friction_coefficient)
    made, loads = (made, loads) if extend is None else extend(made, loads)
    x, k = made.arrays, made.block_index("column-1")
    toe = x.corners.max(axis=0)[[0, 2]] - x.centroid[k][[0, 2]]  # from the centroid, at the base
    dead, live = loads.dead[k], loads.live[k]
    sliding = (-dead[2] * x.tan_phi[0] - dead[0]) / (live[0] + live[2] * x.tan_phi[0])
    moment = [f[4] - (toe[1] * f[0] - toe[0] * f[2]) for f in (dead, live)]
    return min(sliding, -moment[0] / moment[1])


CAUSES = [
    catalogue.weak_base_joint(bounds=(0.5, 1.0)),
    catalogue.edge_rounding(bounds=(0.0, 8.0)),
    catalogue.wear(),
    catalogue.out_of_plumb(),
    catalogue.gain(),
    catalogue.angle_offset(),
]
FRICTION = {"friction_coefficient": Measured(0.7, 0.03)}


def test_the_closed_form_of_these_tests_is_limit_analysis():
    run = simulate.collapse(stack)
    for cause in CAUSES:
        if not cause.transforms:
            for specimen in STACKS[1:3]:
                extension = Extension(((cause, cause.sides[-1]),), specimen)
                assert closed_form(specimen, extend=extension) == pytest.approx(
                    run(specimen, extend=extension), rel=1e-7
                )


@pytest.mark.slow
def test_few_calls_of_a_slow_simulator_agree_with_all_of_them():
    def study(**options):
        return Study(STACKS, closed_form, None, Noise(0.04), FRICTION, **options)

    slow, full = study(**simulate.SLOW), study(levels=5, nuisance_levels=3)
    n, spent = len(STACKS), []
    for cause in CAUSES:
        before = slow.simulator.calls
        few, many = slow.table(cause), full.table(cause)
        spent.append(slow.simulator.calls - before)
        # what may be left out of a table is half the noise
        assert np.max(np.abs(few.values - many.values)) < 0.5 * 0.04
    # where specimens slide or rock as the base allows they are tabulated in full; else 7 n calls for one side, 9 n for
    # two, and 3 n for the baseline; every cause once more at its baseline, to check nesting
    assert spent[0] > 7 * n + 3 * n
    assert spent[0] <= 10 * n + 2 + 2 * 8
    assert spent[1] <= 7 * n + 1
    assert spent[3] <= 9 * n + 1
    assert spent[4:] == [0, 0]
    assert slow.simulator.calls < full.simulator.calls


@pytest.mark.slow
def test_a_study_of_assemblies_resumes_from_disk_in_parallel_and_knows_options_of_causes(tmp_path):
    options = {"cache": tmp_path / "calls.jsonl", **simulate.SLOW}

    def study(**more):
        return Study(STACKS, closed_form, None, Noise(0.04), FRICTION, **options, **more)

    causes = CAUSES[1:3]
    first = study(n_jobs=2)
    first.design(causes)
    header, *lines = options["cache"].read_text().splitlines()
    assert len(lines) == first.simulator.calls
    options["cache"].write_text("\n".join([header, *lines[: len(lines) // 2]]) + "\n")  # killed half-way
    again = study()
    again.design(causes)
    assert again.simulator.calls == len(lines) - len(lines) // 2
    third = study()
    assert np.array_equal(third.design(causes).origin, first.design(causes).origin)
    assert third.simulator.calls == 0
    third.table(catalogue.edge_rounding(bounds=(0.0, 8.0), plane_normal=(0.0, 1.0, 0.0)))
    assert third.simulator.calls > 0  # another edge rounding than the one on disk


def test_a_cause_that_cannot_be_computed_is_set_aside_by_name_and_the_study_goes_on():
    run = simulate.collapse(stack, in_plane=False)  # in space limit analysis refuses crushing at the corners
    crushing = catalogue.finite_compressive_strength()
    listed = [catalogue.edge_rounding(), crushing, catalogue.gain()]
    measured = [0.2, 0.4, 0.7, 0.125]
    study = Study(STACKS, run, measured, Noise(0.04), covariates=["b", "h"], causes=tuple(listed), **simulate.SLOW)
    diagnosis = study.diagnose(draws=99)
    assert [c.name for c in diagnosis.listed] == ["edge rounding", "gain"]
    assert list(diagnosis.aside) == [crushing.name]
    assert "use contact_model='grid'" in diagnosis.aside[crushing.name]
    assert "finite compressive strength (the joint between" in diagnosis.report(checks=False)
    assert diagnosis.record()["set aside"] == diagnosis.aside
    same = study.diagnose([listed[0], listed[2]], draws=99)
    assert not same.aside
    assert (same.kind, same.verdict.p) == (diagnosis.kind, diagnosis.verdict.p)  # as if it had never been listed
    assert study.confusable().names == ("edge rounding", "gain")
    with pytest.raises(NotApplicable, match="no cause of the list can be computed; finite compressive strength"):
        study.diagnose([crushing])

    def broken(specimen, *, extend=None):
        raise NotConverged("the model itself has no answer")

    with pytest.raises(NotConverged, match="the model itself"):
        Study(STACKS, broken, measured, Noise(0.04)).diagnose(listed)


def assemblies():
    """One of every kind: a packaged wall with openings, a loaded one with a beam, an arch, a corner of walls."""
    opening = lm.experiments.load("ferris-tin-loi-2001", "wall-4")
    beam = lm.experiments.load("minho-dry-stone-2005-2009", "SW.30.1")
    joint = lm.Joint(35.0)
    arch = lm.build.arch(radius=2.0, thickness=0.6, width=0.5, voussoirs=11, joint=joint)
    corner = lm.build.wall(length=0.8, courses=3, unit=(0.4, 0.2, 0.2), joint=joint, plan="L", return_length=0.8)
    return {
        "opening": (opening.assembly(), opening.loads()),
        "beam": (beam.assembly(), beam.loads()),
        "arch": (arch, lm.Loads.horizontal(arch)),
        "corner": (corner, lm.Loads.horizontal(corner, (0, -1, 0))),
    }


@pytest.mark.parametrize("kind", [pytest.param("opening", marks=pytest.mark.slow),
    pytest.param("beam", marks=pytest.mark.slow), "arch", "corner"])
def test_every_cause_works_on_any_assembly(kind):
    model = assemblies()[kind]
    base = value(*model)
    for name in MODEL:
        if kind == "corner" and name in ("finite compressive strength", "second-order displacement"):
            continue  # crushing in 3-D needs a grid, sway its time: both have their own tests
        if name in ("joint stiffness", "unit modulus", "fracture energy", "strength kept", "bond strength"):
            continue  # of rigid blocks on rigid joints there is nothing to change, and they say so: tested beside
        cause = catalogue.ALL[name]()
        size = cause.baseline + 0.2 * (cause.sides[-1] - cause.baseline)
        found = lm.limit_analysis(*extend(name, size, model))
        assert found.status in ("solved", "cannot stand under dead load"), name
        if found.status == "solved":
            assert 0.3 * base < found.collapse_multiplier < 2.0 * base, name


def test_mechanisms_feel_the_base_joint_and_refuse_a_recipe_that_no_longer_holds():
    made, _ = block(b=2.0, h=0.5)
    extended = extend("weak base joint", 0.6, (made, lm.Loads.horizontal(made)))
    assert lm.predict(*extended, "mechanisms").collapse_multiplier == pytest.approx(0.6 * MU, rel=1e-9)
    assert not extend("edge rounding", 5.0, wall())[0].recipe


BLOCKS = [{"b": b, "h": h, "order": k + 1} for k, (b, h) in enumerate(
    [(0.06, 0.3), (0.06, 0.5), (0.1, 0.3), (0.1, 0.6), (0.16, 0.4), (0.16, 0.8), (0.25, 0.5), (0.25, 1.0), (0.5, 0.4),
     (0.08, 0.4), (0.2, 0.6), (0.6, 0.5)])]


@pytest.mark.slow
def test_a_planted_cause_of_the_catalogue_is_named_sized_and_its_twins_are_known_without_data():
    rounding = catalogue.edge_rounding(bounds=(0.0, 12.0))
    # the truth by limit analysis, the candidates by the closed form
    run = simulate.collapse(stack)
    truth = np.array([run(s, extend=Extension(((rounding, 6.0),), s)) for s in BLOCKS])
    measured = truth * np.exp(0.03 * np.random.default_rng(5).standard_normal(len(BLOCKS)))
    study = Study(BLOCKS, closed_form, measured, Noise(0.03), FRICTION, ["b", "h"], **simulate.SLOW)
    causes = [rounding, catalogue.out_of_plumb(), catalogue.angle_offset(), catalogue.gain(), catalogue.rig_friction()]
    twins = study.confusable(causes).twins
    assert ("out-of-plumb", "angle offset") in twins
    assert not any("edge rounding" in pair for pair in twins)
    diagnosis = study.diagnose(causes, seed=0)
    # its effect goes with the width alone: a smooth dependence on that comes too near for the name to be earned
    assert (diagnosis.kind, diagnosis.causes) == ("behaves like", ("edge rounding",))
    assert diagnosis.identification.excess > 0.0
    assert diagnosis.estimates["edge rounding"].size == pytest.approx(6.0, rel=0.15)


def test_a_cause_without_a_lever_is_felt_by_modes_and_a_reading_of_frequencies_by_modes_alone():
    own = Cause("own", "own", 1.0, (0.5, 2.0))
    assert [catalogue.acts_on(own, method) for method in ("limit", "modes")] == [True, True]  # modes did not
    for reads in ("vibration", "frequency 1"):
        clock = Cause("clock", "clock", 1.0, (0.9, 1.1), acts_on="measurement", apply=lambda size, p, s: size * p,
                      reads=(reads,))
        assert [catalogue.acts_on(clock, method) for method in ("limit", "dem", "modes")] == [False, False, True]
    assert [catalogue.acts_on(catalogue.gain(), method) for method in ("limit", "modes")] == [True, False]
