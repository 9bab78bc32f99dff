"""The law of a point that softens or crushes: the DEM's kernel, its tangent, and damage by closed forms."""

import numpy as np
import pytest

from dem import kernels
from dem.kernels.joint_strength import plain_peak_of, softening_of
from dem.kernels.sums import point_sums
from limitmason.capacity.point_law import ElastoplasticLaw, PlasticHistory, return_map, virgin
from limitmason.mechanics.law import PointLaw, Softening


def law_of(m, tan_psi, by_opening, by_slip, rest=(0.4, 0.02, 0.03), tension=0.2, crushing=np.inf):
    one = np.ones(m)
    peak = PointLaw(0.6 * one, tan_psi * one, 0.3 * one, tension * one, crushing * one)
    left = PointLaw(rest[0] * one, tan_psi * one, rest[1] * one, rest[2] * one, peak.crushing)
    return ElastoplasticLaw(peak, 2.0 * one, 3.0 * one, Softening(left, by_opening * one, by_slip * one))


@pytest.mark.parametrize(
    ("by_opening", "by_slip", "tension", "opens", "off"),
    [
        pytest.param(1.5, 0.0, 0.2, 0.7, 6e-3, marks=pytest.mark.slow),
        (1.5, 0.0, 0.8, 0.95, 0.04),
        pytest.param(0.0, 1.2, 0.2, 0.25, 6e-3, marks=pytest.mark.slow),
        pytest.param(1.5, 1.2, 0.2, 0.7, 0.025, marks=pytest.mark.slow),
    ],
)
def test_small_steps_come_to_the_same_as_the_softening_kernel(by_opening, by_slip, tension, opens, off):
    """The kernel counts damage by slip on the displacement beyond the strength: the same while the point is pressed.

    Where it is open the kernel's count leaves out that the tension, and with it the shear strength, falls too: up to
    two hundredths of damage. Beyond the tip of the cone both differ by the step.
    """
    rest = (0.6, 0.02, 0.03)
    law = law_of(1, 0.0, by_opening, by_slip, rest, tension)
    beyond = 0.0 if by_slip == 0.0 else 1.0 / (1.0 / by_slip - (0.3 - rest[1]) / 3.0)
    row = np.zeros((1, kernels.LAW_SIZE))
    entries = {
        "kn": 2.0, "ks": 3.0, "tan_phi": 0.6, "cohesion": 0.3, "tension": tension, "crushing": np.inf,
        "rest_tan_phi": rest[0], "rest_cohesion": rest[1], "rest_tension": rest[2], "by_opening": by_opening,
        "by_slip": beyond,
    }
    for name, value in entries.items():
        row[0, getattr(kernels.LAW, name)] = value
    points = kernels.Points(np.zeros(1), np.zeros(1), np.ones(1), *(np.zeros(1) for _ in range(5)))
    joint = plain_peak_of(row, 0), softening_of(row, 0)
    old, stress, damage = virgin(1, 3), [], []
    s = np.linspace(0.0, 1.0, 401)
    # pressed, slid, pulled open while sliding, closed, slid on
    for e1, e2, w in np.column_stack([0.9 * s, 0.4 * s, -0.3 + opens * np.sin(4.0 * s)]):
        found = return_map(law, old, np.array([[w, e1, e2]]))
        old = found.history
        still = (0.0,) * 6
        dem = point_sums(
            points, 0, 1, ((e1, e2, w), still, (0.0, 0.0, 1.0)), *joint, 0.0, None, still, None, None, False
        )
        stress.append(np.abs(found.stress[0] - [dem[2], dem[0], dem[1]]).max())
        damage.append(abs(float(old.damage[0]) - float(points.damage[0])))
    assert float(old.damage[0]) > 0.5
    assert max(damage) < off
    assert max(stress) < 0.5 * off + 5e-3


@pytest.mark.parametrize("tension", [0.2, 0.8])
@pytest.mark.parametrize("components", [2, 3])
def test_the_tangent_of_a_softening_and_crushing_point_is_the_derivative_of_its_stress(tension, components):
    rng = np.random.default_rng(5)
    m = 400
    law = law_of(m, 0.3, 0.9, 0.7, tension=tension, crushing=0.5)
    old = PlasticHistory(
        0.1 * rng.normal(size=(m, components - 1)), 0.05 * np.abs(rng.normal(size=m)), rng.uniform(0, 0.9, m)
    )
    at = 0.4 * rng.normal(size=(m, components))
    found = return_map(law, old, at)
    assert (found.history.damage > old.damage).mean() > 0.3
    assert (found.stress[:, 0] >= 0.5 - 1e-12).mean() > 0.05
    numeric = np.zeros((m, components, components))
    for k in range(components):
        step = np.zeros(components)
        step[k] = 1e-7
        ends = [return_map(law, old, at + sign * step).stress for sign in (1.0, -1.0)]
        numeric[:, :, k] = -(ends[0] - ends[1]) / 2e-7
    close = np.abs(numeric - found.tangent).max(axis=(1, 2)) < 1e-4
    assert close.mean() > 0.99  # but for points within the step of a kink


def derivative(law, old, at, step=1e-5):
    """-d(stress)/d(displacement) from either side, by differences extrapolated to no step, shape (2, m, c, c)."""
    found, m, c = return_map(law, old, at).stress, *at.shape
    sides = np.zeros((2, 2, m, c, c))
    for i, sign in enumerate((1.0, -1.0)):
        for j, part in enumerate((1.0, 0.5)):
            for k in range(c):
                moved = at + sign * part * step * np.eye(c)[k]
                sides[i, j, :, :, k] = (found - return_map(law, old, moved).stress) / (sign * part * step)
    return 2.0 * sides[:, 1] - sides[:, 0]


@pytest.mark.parametrize("softens", [False, True])
@pytest.mark.parametrize("components", [2, 3])
def test_the_tangent_is_the_derivative_wherever_the_law_has_one(components, softens):
    """All terms at random, in a third of the points without shear: where no shear can be held it was ks for 0."""
    rng, m = np.random.default_rng(3), 2000
    mu, cohesion, tension = rng.choice([0.0, 0.6], m), rng.choice([0.0, 0.3], m), rng.choice([0.0, 0.2, 0.8], m)
    peak = PointLaw(mu, mu * rng.choice([0.0, 0.5, 1.0], m), cohesion, tension, rng.choice([0.5, np.inf], m))
    rest = PointLaw(0.8 * mu, peak.tan_psi, 0.1 * cohesion, 0.1 * tension, peak.crushing)
    soft = Softening(rest, rng.choice([0.0, 0.9], m), rng.choice([0.0, 0.7], m)) if softens else None
    law = ElastoplasticLaw(peak, 2.0 * np.ones(m), 3.0 * np.ones(m), soft)
    slip = 0.1 * rng.normal(size=(m, components - 1))
    damage = softens * rng.uniform(0.0, 0.9, m)
    old, at = PlasticHistory(slip, 0.05 * np.abs(rng.normal(size=m)), damage), 0.4 * rng.normal(size=(m, components))
    still = rng.random(m) < 0.3
    at[still, 1:] = slip[still]
    found = return_map(law, old, at)
    sides = derivative(law, old, at)
    smooth = np.abs(sides[0] - sides[1]).max(axis=(1, 2)) < 1e-6
    assert smooth.mean() > 0.97
    kinds = still, found.history.lift > old.lift, found.stress[:, 0] > 0.5 - 1e-12, found.stress[:, 0] < 0.0
    assert min((kind & smooth).mean() for kind in kinds) > 0.05
    assert found.tangent[smooth] == pytest.approx(sides.mean(axis=0)[smooth], abs=1e-6)


@pytest.mark.parametrize(("by_slip", "damage"), [(0.3, 0.2), (0.1, 0.098 / 0.99)])
def test_slip_damages_until_the_tip_of_the_cone_comes_to_the_tension(by_slip, damage):
    """A tension of 0.4 under a tip of 0.5 (1 - h), ft 0.8: h = 1 - 0.4 / 0.5 at most; less slip leaves h to its rate.

    Half of such points kept a damage of 0, since the demand falls to nothing where the tip has come to the tension.
    """
    law = law_of(2, 0.0, 0.0, by_slip, (0.6, 0.0, 0.0), 0.8)
    pulled = return_map(law, virgin(2, 2), np.array([[0.2, 0.0], [0.2, 0.0]])).history
    found = return_map(law, pulled, np.array([[0.2, 1.0], [0.2, -1.0]]))
    assert np.asarray(found.history.damage) == pytest.approx([damage] * 2, abs=1e-12)
    assert found.stress[:, 0] == pytest.approx([-0.4] * 2)
    assert np.abs(found.stress[:, 1]) == pytest.approx([0.3 * (1.0 - damage) - 0.24] * 2, abs=1e-12)


@pytest.mark.parametrize("steps", [1, 7])
@pytest.mark.parametrize("beyond", [1.0, 1.7])
def test_slip_on_the_way_to_the_tip_of_the_cone_counts_however_long_the_step(steps, beyond):
    """Opened and sheared as one, a point is at the tip when 0.4 a = 0.5 (1 - h), with all of a slipped: h = 0.3 a."""
    law, old = law_of(1, 0.0, 0.0, 0.3, (0.6, 0.0, 0.0), 0.8), virgin(1, 2)
    for a in np.linspace(0.0, beyond, steps + 1)[1:]:
        old = return_map(law, old, a * np.array([[0.2, 1.0]])).history
    assert old.damage[0] == pytest.approx(0.3 * 0.5 / 0.55, abs=1e-12)


def test_one_step_and_many_spend_the_same_on_a_straight_opening():
    """The law of the end of a step: how far it goes does not change what it costs."""
    law = law_of(1, 0.0, 1.5, 0.0)
    one = return_map(law, virgin(1, 2), np.array([[0.4, 0.0]]))
    old = virgin(1, 2)
    for w in np.linspace(0.0, 0.4, 50):
        many = return_map(law, old, np.array([[w, 0.0]]))
        old = many.history
    assert one.stress[0] == pytest.approx(many.stress[0], abs=1e-12)
    assert one.history.damage[0] == pytest.approx(old.damage[0], abs=1e-12)
    closed = (1.5 * (0.4 - 0.1)) / (1.0 - 1.5 * 0.17 / 2.0)
    assert one.history.damage[0] == pytest.approx(closed, abs=1e-12)


@pytest.mark.parametrize("lift", [0.0, 0.1])
def test_opening_that_dilation_made_before_damages_nothing(lift):
    """h = r (w - lift - t (1 - h) / kn) of a pull alone, solved for h: opening by dilation carries no tension."""
    one = np.ones(1)
    peak, rest = PointLaw(0.6 * one, 0.3 * one, 0.5 * one, 0.2 * one, np.inf * one), PointLaw(
        0.6 * one, 0.3 * one, 0.0 * one, 0.0 * one, np.inf * one
    )
    law = ElastoplasticLaw(peak, 2.0 * one, 3.0 * one, Softening(rest, 1.5 * one, 0.0 * one))
    old = PlasticHistory(np.zeros((1, 1)), lift * one, 0.0 * one)
    found = return_map(law, old, np.array([[0.3, 0.0]]))
    damage = 1.5 * (0.3 - lift - 0.2 / 2.0) / (1.0 - 1.5 * 0.2 / 2.0)
    assert found.history.damage == pytest.approx([damage])
    assert found.stress[0] == pytest.approx([-0.2 * (1.0 - damage), 0.0])
