"""The law of cracking and crushing: energies, directions, unloading, its tangent, and Willam's rotating path."""

import numpy as np
import pytest

import limitmason as lm
from limitmason.continuum.rotating_crack import respond, virgin
from limitmason.continuum.uniaxial_curves import curves_of, envelope
from limitmason.deformable import SOLID, Elasticity
from limitmason.errors import InputError

MASONRY = lm.Material(
    8e8, 0.3, 2400.0, tensile_strength=8e4, tensile_energy=12.0, compressive_strength=8e5, compressive_energy=1300.0
)
WIDTH = 0.1


def curves(n=1, material=MASONRY, width=WIDTH):
    return curves_of([material], np.zeros(n, dtype=int), np.full(n, width))


def tensors(stress):
    return stress[..., [[0, 3, 5], [3, 1, 4], [5, 4, 2]]]


def uniaxial_path(direction, strains):
    """Stress along a direction when only that direction carries stress: the lateral strains are solved for."""
    c, memory = curves(), virgin(1)
    d = np.asarray(direction) / np.linalg.norm(direction)
    frame = np.linalg.qr(np.column_stack([d, np.eye(3)[:, (np.argmax(np.abs(d)) + np.array([1, 2])) % 3]]))[0]
    found, lateral = [], np.zeros(2)
    for e in strains:
        for _ in range(40):
            local = np.diag([e, *lateral])
            t = frame @ local @ frame.T
            voigt = np.array([[t[0, 0], t[1, 1], t[2, 2], 2 * t[0, 1], 2 * t[1, 2], 2 * t[2, 0]]])
            answer = respond(c, voigt, memory)
            s = frame.T @ tensors(answer.stress[0]) @ frame
            if np.abs(np.diag(s)[1:]).max() < 1e-6:
                break
            lateral -= np.diag(s)[1:] / MASONRY.young_modulus * (1 - MASONRY.poisson_ratio)
        memory = answer.memory
        found.append(s[0, 0])
    return np.array(found), answer


@pytest.mark.slow
@pytest.mark.parametrize("direction", [(1, 0, 0), (0, 0, 1), (1, 1, 0), (1, -2, 3)])
def test_area_under_tension_is_the_fracture_energy_over_the_band_in_every_direction(direction):
    strains = np.concatenate([np.linspace(0, 2e-4, 41), np.geomspace(2.05e-4, 0.03, 140)])
    stress, answer = uniaxial_path(direction, strains)
    assert stress.max() == pytest.approx(MASONRY.tensile_strength, rel=0.02)
    area = float((0.5 * (stress[1:] + stress[:-1]) * np.diff(strains)).sum())
    assert area == pytest.approx(MASONRY.tensile_energy / WIDTH, rel=5e-3)  # trapezoids
    assert answer.memory.lost[0] == pytest.approx(MASONRY.tensile_energy / WIDTH, rel=1e-6)


def test_compression_peaks_at_its_strength_and_loses_its_energy_beyond():
    fc, e = MASONRY.compressive_strength, MASONRY.young_modulus
    peak = 5 * fc / (3 * e)
    end = peak + 1.5 * MASONRY.compressive_energy / (WIDTH * fc)
    strains = -np.linspace(0, end, 4001)[:, None] * np.array([[1.0, 0.0, 0.0]])
    stress, slope, area = envelope(curves(len(strains)), strains)
    assert stress[:, 0].min() == pytest.approx(-fc, rel=1e-6)
    assert -strains[stress[:, 0].argmin(), 0] == pytest.approx(peak, rel=1e-3)
    beyond = area[-1, 0] - envelope(curves(), np.array([[-peak, 0.0, 0.0]]))[2][0, 0]
    assert beyond == pytest.approx(MASONRY.compressive_energy / WIDTH, rel=1e-9)
    # stress is the derivative of the area, slope that of the stress
    assert np.gradient(area[:, 0], strains[:, 0])[1:-1] == pytest.approx(stress[1:-1, 0], abs=1e-3 * fc)
    inner = slope[2:-2, 0]
    assert np.gradient(stress[:, 0], strains[:, 0])[2:-2] == pytest.approx(inner, abs=2e-3 * e)


def test_undamaged_it_is_hookes_law_and_a_crack_has_no_lateral_contraction():
    rng = np.random.default_rng(0)
    strain = rng.normal(size=(50, 6)) * 1e-5
    answer = respond(curves(50), strain, virgin(50))
    stiffness = Elasticity.of(MASONRY.young_modulus, MASONRY.poisson_ratio, SOLID).matrix
    assert answer.stress == pytest.approx(strain @ stiffness, rel=1e-9, abs=1e-6)
    assert np.broadcast_to(stiffness, (50, 6, 6)) == pytest.approx(answer.tangent, rel=1e-6, abs=10.0)
    opened = respond(curves(), np.array([[0.02, 0.0, 0.0, 0.0, 0.0, 0.0]]), virgin(1))
    assert np.abs(opened.stress).max() < 1e-3 * MASONRY.tensile_strength
    assert opened.crack[0] == pytest.approx(0.02, rel=1e-3)


def test_consistent_tangent_is_the_derivative_of_the_stress_and_symmetric():
    rng = np.random.default_rng(1)
    for scale in (5e-5, 3e-4, 2e-3):
        strain = rng.normal(size=(20, 6)) * scale
        tangent = respond(curves(20), strain, virgin(20)).tangent
        numeric = np.zeros_like(tangent)
        for k in range(6):
            ahead, behind = strain.copy(), strain.copy()
            ahead[:, k] += 1e-9
            behind[:, k] -= 1e-9
            ends = [respond(curves(20), x, virgin(20)).stress for x in (ahead, behind)]
            numeric[:, :, k] = (ends[0] - ends[1]) / 2e-9
        assert tangent == pytest.approx(numeric, abs=2e-6 * MASONRY.young_modulus)
        assert tangent == pytest.approx(np.swapaxes(tangent, 1, 2), abs=1e-9 * MASONRY.young_modulus)


def test_law_turns_with_the_material():
    rng = np.random.default_rng(2)
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    memory, turned_memory = virgin(30), virgin(30)
    for scale in (4e-4, 2e-4, 8e-4):  # loaded, partly unloaded, loaded on
        e = rng.normal(size=(30, 3, 3)) * scale
        e = 0.5 * (e + np.swapaxes(e, 1, 2))
        t = q @ e @ q.T
        first, second = (
            respond(curves(30), np.stack([x[:, 0, 0], x[:, 1, 1], x[:, 2, 2], 2 * x[:, 0, 1], 2 * x[:, 1, 2],
                                          2 * x[:, 2, 0]], axis=1), m)
            for x, m in ((e, memory), (t, turned_memory))
        )
        assert tensors(second.stress) == pytest.approx(q @ tensors(first.stress) @ q.T, abs=1e-6 * 8e4)
        assert (first.memory.lost >= memory.lost - 1e-12).all()
        memory, turned_memory = first.memory, second.memory


def test_unloading_runs_to_the_origin_and_a_closed_crack_carries_compression():
    strain = np.array([[6e-4, 0.0, 0.0, 0.0, 0.0, 0.0]])
    smooth = lm.Material(8e8, 0.0, 0.0, tensile_strength=8e4, tensile_energy=12.0)
    c = curves(1, smooth)
    first = respond(c, strain, virgin(1))
    back = respond(c, 0.4 * strain, first.memory)
    assert back.stress[0, 0] == pytest.approx(0.4 * first.stress[0, 0])
    assert back.memory.lost == pytest.approx(first.memory.lost)
    pressed = respond(c, -0.1 * strain, first.memory)
    assert pressed.stress[0, 0] == pytest.approx(-0.1 * 6e-4 * 8e8)


@pytest.mark.slow
def test_willams_path_turns_the_crack_and_ends_without_stress():
    # tension to the strength with lateral contraction, then strain increments .5 : .75 : 1 (x, y, shear): axes of
    # stress and strain stay together, no principal stress exceeds ft, and all stress fades
    nu, e, ft = 0.2, 1e10, 1e6
    c = curves(1, lm.Material(e, nu, 0.0, tensile_strength=ft, tensile_energy=100.0), 0.1)
    memory = virgin(1)
    strain = np.array([ft / e, -nu * ft / e, -nu * ft / e, 0.0, 0.0, 0.0])
    peak_shear, turned = 0.0, []
    for k in range(3000):
        answer = respond(c, strain[None], memory)
        memory = answer.memory
        s, half = tensors(answer.stress[0]), strain.copy()
        half[3:] *= 0.5
        t = tensors(half)
        assert np.abs(s @ t - t @ s).max() <= 1e-9 * np.abs(s).max() * np.abs(t).max() + 1e-20
        assert np.linalg.eigvalsh(s).max() <= ft * (1 + 1e-9)
        peak_shear = max(peak_shear, s[0, 1])
        turned.append(np.degrees(0.5 * np.arctan2(2 * t[0, 1], t[0, 0] - t[1, 1])))
        if k == 0:
            assert s[0, 0] == pytest.approx(ft, rel=1e-9)
            assert abs(s[1, 1]) < 1e-3
        strain = strain + 1e-5 * np.array([0.5, 0.75, 0.0, 1.0, 0.0, 0.0])
    # axes turn to the end of the increments: tan(2 a) = 1 / (.5 - .75)
    assert turned[-1] == pytest.approx(np.degrees(0.5 * np.arctan2(1.0, -0.25)), abs=0.6)
    assert peak_shear > 0.1 * ft
    assert np.abs(s[:2, :2]).max() < 0.05 * ft  # across, the strain is held


def test_bricks_too_large_for_the_fracture_energy_are_refused_with_the_largest_size():
    with pytest.raises(InputError, match=r"smaller than"):
        curves(1, MASONRY, 3.0)
    largest = 4 / 3 * MASONRY.young_modulus * MASONRY.tensile_energy / MASONRY.tensile_strength**2
    curves(1, MASONRY, 0.999 * largest)
    with pytest.raises(InputError):
        curves(1, MASONRY, 1.001 * largest)
