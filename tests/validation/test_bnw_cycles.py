"""What is read of cycles: stiffness from end to end and lost work of loops in closed form; the page has the section."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from validation import bnw_cycles as cycles

ENDS = [sense * a for a in cycles.AMPLITUDES for _ in range(cycles.TIMES) for sense in (1.0, -1.0)]


def curve_of(load):
    """A curve along the path of the cycles at a height of 1 m, with one crack plane that moves at once."""
    path = np.concatenate([[0.0], *(np.linspace(a, b, 41)[1:] for a, b in zip([0.0, *ENDS], ENDS, strict=False))])
    u = 1e-2 * path
    seen = np.where(np.arange(len(u)) >= 4, 2.0 * cycles.CRACK, 0.0)[:, None]
    return SimpleNamespace(
        displacement=u, load=load(u), opening=seen, slip=0.0 * seen,
        assembly=SimpleNamespace(interfaces=[SimpleNamespace(kind="crack")]),
        first_unit_crack=lambda width: None, first_crushing=lambda strain: None,
    )


def rigid_plastic(u, limit=2e5):
    """Coulomb friction: the load has the sign of the movement."""
    return limit * np.sign(np.diff(u, prepend=-1e-9))


def test_elastic_cycles_lose_nothing():
    rows = cycles.rows_of("any", curve_of(lambda u: 1.5e8 * u), 1.0)
    assert len(rows) == len(cycles.AMPLITUDES) * cycles.TIMES
    assert [float(r[5]) for r in rows] == pytest.approx([150.0] * len(rows))
    # from the turn of one cycle to that of the next the work comes back; the first begins at rest
    assert all(abs(float(r[6])) < 0.1 for r in rows if r[2] > 1)
    assert [r[7] for r in rows] == ["0.010"] + [""] * (len(rows) - 1)
    assert all(r[8] == "" for r in rows)


def test_friction_loses_four_times_load_and_amplitude_a_cycle():
    rows = cycles.rows_of("any", curve_of(rigid_plastic), 1.0)
    for r in rows:
        if r[2] > 1:
            # the trapezoid over a turn leaves out two of eighty steps
            assert float(r[6]) == pytest.approx(4.0 * 2e5 * 1e-2 * r[1], rel=0.03)
        assert float(r[5]) == pytest.approx(2e5 / (1e-2 * r[1]) * 1e-6, rel=1e-6)


def test_the_page_has_the_section():
    shown = (Path(cycles.__file__).parents[1] / "docs" / "papers" / "bnw.md").read_text(encoding="utf-8")
    assert "\n".join(cycles.section()).strip() in shown
