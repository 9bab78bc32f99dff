"""Mutants: physics broken on purpose must make the named tests fail; a test that lets one pass has no teeth."""

import dataclasses
import inspect
from pathlib import Path

import numpy as np
import pytest

import dem
import limitmason as lm
from dem import kernels
from dem.model import initial_state
from limitmason.limit import associative, torsion
from limitmason.limit.program import static_theorem
from limitmason.limit.program.clarabel_solver import Carried
from limitmason.mechanics.equilibrium import equilibrium_matrix

pytestmark = pytest.mark.slow

TESTS = Path(__file__).resolve().parents[1]
WRENCHES = (
    "dem/test_dem_conservation.py::"
    "test_one_statics_block_wrenches_equal_the_equilibrium_matrix_times_contact_forces[grid0]"
)
SLENDER = (
    "dem/test_dem_collapse.py::test_slender_block_overturns_at_its_slenderness_with_any_number_of_edge_points[grid0]"
)


class Outcome:
    """What became of the tests that ran: the errors of those that failed, and how many there were."""

    def __init__(self):
        self.ran, self.errors = 0, []

    def pytest_runtest_makereport(self, item, call):
        if call.when == "call":
            self.ran += 1
        if call.excinfo is not None:
            self.errors.append(call.excinfo)


def caught(*names):
    """Each test, named by its path below ``tests`` and its case, runs here, with what is broken, and fails."""
    for name in names:
        outcome = Outcome()
        # without the collections of garbage at its end, which walk through all that the suite has imported
        left_out = ("cacheprovider", "xdist", "unraisableexception")
        without = [word for plugin in left_out for word in ("-p", f"no:{plugin}")]
        code = pytest.main([str(TESTS / name), *without], plugins=[outcome])
        assert outcome.ran == 1, f"{name}: pytest ended with {code!r} and ran {outcome.ran} tests instead of one"
        assert len(outcome.errors) == 1, f"{name} lets it pass"
        # as a test fails, not for an error of the mutant itself
        assert isinstance(outcome.errors[0].value, (AssertionError, ValueError, dem.UnstableError)), outcome.errors[0]


def test_a_test_that_passes_or_does_not_exist_is_not_called_caught():
    with pytest.raises(AssertionError, match="lets it pass"):
        caught("limit/test_joint_law.py::test_cohesion_adds_to_sliding")
    with pytest.raises(AssertionError, match="ran 0 tests"):
        caught("limit/test_joint_law.py::test_of_that_name_there_is_none")


def test_dropped_lever_arm(monkeypatch):
    def without_arm(assembly, points, *, plane=None):
        if plane is None:
            arm_free = dataclasses.replace(points, position=assembly.centroids[points.block_b])
            return equilibrium_matrix(assembly, arm_free, plane=plane)
        moved = dataclasses.replace(points, position=points.position - 0.1 * points.directions[:, 1])
        return equilibrium_matrix(assembly, moved, plane=plane)

    monkeypatch.setattr(static_theorem, "equilibrium_matrix", without_arm)
    caught("limit/test_closed_forms.py::test_stack_rocks_about_the_lowest_joint[None]")
    caught("limit/test_certificate.py::test_associative_prediction_is_certified[corner]")
    caught("limit/test_certificate.py::test_associative_prediction_is_certified[wall in plane]")


def test_flipped_normal(monkeypatch):
    def flipped(assembly, points, *, plane=None):
        directions = points.directions.copy()
        directions[points.interface == points.interface[0]] *= -1.0
        return equilibrium_matrix(assembly, dataclasses.replace(points, directions=directions), plane=plane)

    monkeypatch.setattr(static_theorem, "equilibrium_matrix", flipped)
    caught("limit/test_closed_forms.py::test_stack_rocks_about_the_lowest_joint[None]")


def test_friction_five_per_cent_high(monkeypatch):
    monkeypatch.setattr(lm.Joint, "tan_phi", property(lambda self: 1.05 * np.tan(np.radians(self.friction_angle_deg))))
    caught("limit/test_closed_forms.py::test_single_block_slides_or_rocks[1.0-0.2]")
    caught("limit/test_joint_law.py::test_cohesion_adds_to_sliding")


def test_contact_areas_five_per_cent_high(monkeypatch):
    original = static_theorem.contact_points

    def larger(*arguments, **options):
        points = original(*arguments, **options)
        return dataclasses.replace(points, area=1.05 * points.area)

    monkeypatch.setattr(static_theorem, "contact_points", larger)
    caught("limit/test_joint_law.py::test_cohesion_adds_to_sliding")
    caught("limit/test_joint_law.py::test_tension_is_plastic_and_says_so")


def test_crushing_strength_left_out(monkeypatch):
    from limitmason.limit.program import cones

    original = cones.make_cones

    def without(problem_, *, torsion=None):
        none = problem_.stress_block._make(column[:0] for column in problem_.stress_block)
        return original(problem_._replace(stress_block=none), torsion=torsion)

    monkeypatch.setattr(associative, "make_cones", without)
    caught("limit/test_joint_law.py::test_crushing_toe_in_plane_is_exact[500000.0-100000.0]")


def test_tilting_the_wrong_way(monkeypatch):
    original = lm.Loads.tilting.__func__
    monkeypatch.setattr(lm.Loads, "tilting", classmethod(lambda cls, a, axis: original(cls, a, -np.asarray(axis))))
    caught("limit/test_closed_forms.py::test_tilting_table_turns_the_weight_towards_the_lower_side")


def test_dead_load_not_checked(monkeypatch):
    monkeypatch.setattr(associative, "stands_under_dead_load", lambda *a, **k: Carried(True, None, None, 0.0))
    topples = "test_a_structure_that_topples_by_itself_cannot_stand_even_if_a_push_would_right_it"
    caught(f"limit/test_bounds.py::{topples}[direction1]")


def test_polar_radius_five_per_cent_high(monkeypatch):
    original = torsion.polar_mean_radius
    monkeypatch.setattr(torsion, "polar_mean_radius", lambda *a: 1.05 * original(*a))
    caught("limit/test_joint_law.py::test_torsion_of_a_square_face[options0]")


def test_torsion_about_the_centroid_instead_of_the_pressure(monkeypatch):
    original = torsion.torsion_limits

    def centred(problem_, force):
        limit = original(problem_, force)
        return limit._replace(pole=problem_.assembly.arrays.centre[limit.interface])

    monkeypatch.setattr(torsion, "torsion_limits", centred)
    caught("limit/test_joint_law.py::test_eccentric_block_slides_at_exactly_mu_under_the_torsion_limit")


def test_a_lost_contact(monkeypatch):
    original = lm.Assembly._with_contacts

    def losing(self, *arguments):
        found = original(self, *arguments)
        return dataclasses.replace(found, interfaces=found.interfaces[:-1])

    monkeypatch.setattr(lm.Assembly, "_with_contacts", losing)
    caught("geometry/test_contacts.py::test_running_bond_counts[5-10-55-140]")
    caught("geometry/test_contacts.py::test_t_junction_gives_one_patch_per_neighbour")


def test_mechanism_of_another_wall(monkeypatch):
    # velocities scaled block by block no longer fit together: the certificate must see it
    from limitmason.limit.program.static_theorem import Problem

    original = Problem.twists

    def torn(self, dual):
        return original(self, dual) * np.linspace(0.9, 1.1, self.assembly.n_blocks)[:, None]

    monkeypatch.setattr(Problem, "twists", torn)
    caught("limit/test_certificate.py::test_associative_prediction_is_certified[wall in plane]")


def joints_changed(monkeypatch, change):
    """Every state of the DEM is made with joints that ``change`` has worked on."""
    original = initial_state.make_joints

    def changed(*arguments, **options):
        points, joints, *rest = original(*arguments, **options)
        return (points, change(joints), *rest)

    monkeypatch.setattr(initial_state, "make_joints", changed)


def test_dem_with_a_flipped_normal(monkeypatch):
    def flip(joints):
        frame = joints.frame.copy()
        frame[-1, 2] *= -1.0
        return joints._replace(frame=frame)

    joints_changed(monkeypatch, flip)
    caught(WRENCHES)
    caught(SLENDER)


def test_dem_with_a_dropped_lever_arm(monkeypatch):
    joints_changed(monkeypatch, lambda joints: joints._replace(arm_b=np.zeros_like(joints.arm_b)))
    caught(WRENCHES)
    caught("dem/test_dem_collapse.py::test_stack_of_five_equal_blocks_overturns_at_a_fifth_of_its_slenderness")


def test_dem_with_friction_five_per_cent_high(monkeypatch):
    monkeypatch.setattr(lm.Joint, "tan_phi", property(lambda self: 1.05 * np.tan(np.radians(self.friction_angle_deg))))
    caught("dem/test_dem_collapse.py::test_block_on_a_slope_slides_at_the_friction_angle")


def test_dem_with_three_times_the_stable_step(monkeypatch):
    steps, masses = initial_state.stable_step, initial_state.scaled_masses
    monkeypatch.setattr(initial_state, "stable_step", lambda *a, **k: 3.0 * steps(*a, **k))
    monkeypatch.setattr(initial_state, "scaled_masses", lambda k, dt, safety: masses(k, dt, 3.0 * safety))
    caught("dem/test_dem_conservation.py::test_halving_the_time_step_quarters_the_error_of_the_position")
    caught(SLENDER)


def test_dem_that_restarts_from_a_stop_with_a_whole_kick(monkeypatch):
    # interpreted: what it calls is compiled
    source = inspect.getsource(kernels.advance.py_func).split("\n", 1)[1]
    assert source.count("0.5 * dt if kinetic_stop") == 1
    space = dict(vars(kernels.stepping))
    exec(source.replace("0.5 * dt if kinetic_stop", "dt if kinetic_stop"), space)
    monkeypatch.setattr(kernels, "advance", space["advance"])
    caught("dem/test_dem_conservation.py::test_stops_at_peaks_of_the_kinetic_energy_take_energy_from_every_mode")


def test_dem_whose_breaking_joints_release_half_of_what_they_stored(monkeypatch):
    original = kernels.advance

    def forgetful(points, joints, bodies, total, *rest):
        before = total[kernels.E_FRACTURE]
        original(points, joints, bodies, total, *rest)
        total[kernels.E_FRACTURE] = 0.5 * (before + total[kernels.E_FRACTURE])

    monkeypatch.setattr(kernels, "advance", forgetful)
    caught("dem/test_dem_fracture.py::test_pulling_a_softening_joint_apart_costs_the_area_below_its_curve")
    caught("dem/test_dem_fracture.py::test_energy_balances_while_joints_break_in_bending_shear_and_both[0.0-moves0]")
