"""Mutants of a capacity curve: each takes a term out of the path, and the certificate of its steps must notice."""

import math

import numpy as np
import pytest

import limitmason as lm
from limitmason import experiments
from limitmason.capacity import Steps, path, step_equilibrium
from limitmason.capacity import system as equations
from limitmason.capacity.kinematics import at_rest

PHI = math.degrees(math.atan(0.65))


@pytest.mark.slow
def test_a_path_in_the_reference_geometry_is_refused(monkeypatch):
    real = equations.contact

    def undeformed(bodies, pose):
        at, reference = real(bodies, pose), real(bodies, at_rest(len(pose.shift)))
        return at._replace(directions=reference.directions, arm_a=reference.arm_a, arm_b=reference.arm_b)

    monkeypatch.setattr(equations, "contact", undeformed)
    w = lm.build.column(width=0.2, depth=0.2, height=1.0, courses=1, joint=lm.Joint(60.0))
    curve = lm.pushover(w, lm.Loads.horizontal(w), to=0.01, stiffness=1e8)
    assert len(curve) > 5
    assert not all(c.accepted for c in curve.certificates)


def test_a_path_that_does_not_commit_its_history_is_refused(monkeypatch):
    real = step_equilibrium.node_of

    def forgetful(solved, *arguments, **options):
        node = real(solved, *arguments, **options)
        return node._replace(history=node.history._replace(slip=np.zeros_like(node.history.slip)))

    monkeypatch.setattr(step_equilibrium, "node_of", forgetful)
    w = lm.build.column(width=0.4, depth=0.4, height=0.2, courses=1, joint=lm.Joint(25.0))
    curve = lm.pushover(w, lm.Loads.horizontal(w), to=0.01, stiffness=1e8, steps=Steps(most=30))
    assert not all(c.accepted for c in curve.certificates)


def test_a_path_with_the_associative_lift_left_in_is_refused(monkeypatch):
    real = equations.return_map

    def dilating(law, old, displacement):
        s = law.strength
        return real(law._replace(strength=s._replace(tan_psi=s.tan_phi)), old, displacement)

    monkeypatch.setattr(equations, "return_map", dilating)
    w = lm.build.column(width=0.4, depth=0.4, height=0.2, courses=1, joint=lm.Joint(25.0))
    curve = lm.pushover(w, lm.Loads.horizontal(w), to=0.01, stiffness=1e8)
    assert not all(c.accepted for c in curve.certificates)


def test_a_path_that_drops_the_lift_of_open_points_is_refused(monkeypatch):
    real = equations.return_map

    def dropping(law, old, displacement):
        found = real(law, old, displacement)
        lift = np.where(found.stress[:, 0] <= 0.0, old.lift, found.history.lift)
        return found._replace(history=found.history._replace(lift=lift))

    monkeypatch.setattr(equations, "return_map", dropping)
    test = experiments.load("ferris-tin-loi-2001", "wall-1", dilatancy_deg=PHI * (1 - 1e-12))
    curve = lm.pushover(test.assembly(), test.loads(), stiffness=1e10)
    assert not all(c.accepted for c in curve.certificates)


def test_a_block_that_lifts_itself_is_refused(monkeypatch):
    real = path.step_equilibrium.step

    def lifted(system, node, *arguments, **options):
        raised = node._replace(history=node.history._replace(lift=node.history.lift + 1e-6))
        return real(system, raised, *arguments, **options)

    monkeypatch.setattr(path.step_equilibrium, "step", lifted)
    w = lm.build.column(width=0.4, depth=0.4, height=0.2, courses=1, joint=lm.Joint(25.0))
    curve = lm.pushover(w, lm.Loads.horizontal(w), to=0.01, stiffness=1e8)
    assert not all(c.accepted for c in curve.certificates)
    assert min(c.dissipation for c in curve.certificates) < -1e-3
