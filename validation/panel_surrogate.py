"""The brick panel in closed form, after the published UDEC runs, and three small tests of the same joints.

A stand-in for hours of simulation, to try a calibration or a study on; no model of the panel. SI units.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from limitmason.experiments.source_folder import read_table

SOURCE = "brick-panels-opening"

PUBLISHED_STIFFNESS = (83e9, 36e9)
"""kn and ks of the runs of Table 2 [Pa/m]."""

BRICK_COMPLIANCE = 3.6e-9
JOINT_COMPLIANCE = 2.09e-8
"""Mid-span displacement per load of bricks and of joints at ``PUBLISHED_STIFFNESS`` [m/N].

From (d - d0) / P of the panel at 8.3 and 83 GPa/m, 0.2125 and 0.0245 mm/kN: a / kn + b.
"""

NORMAL_SHARE = 0.5
"""Share of the joints' compliance that goes with kn, the rest with ks; assumed: the source varies both together [-]."""

DILATANCY = 1.0
"""Peak grows with (1 + tan psi) to this power; assumed: the source says that it grows, not how much [-]."""


@cache
def log_slopes() -> tuple[float, float, float, float]:
    """Slopes of log failure load over log tan(phi), log c, log ft in Table 2, and the constant (in N and Pa).

    Run 13 is left out: the source has it out of line with its neighbours.
    """
    rows = [r for r in read_table(SOURCE, "udec_runs.csv").rows if r["suspect"] == "0"]
    a = np.array([[np.log(np.tan(np.radians(float(r["friction"])))), np.log(1e6 * float(r["cohesion"])),
                   np.log(1e6 * float(r["tension"])), 1.0] for r in rows])
    b = np.log([1e3 * float(r["V_failure"]) for r in rows])
    found = np.linalg.lstsq(a, b, rcond=None)[0]
    return float(found[0]), float(found[1]), float(found[2]), float(found[3])


@cache
def first_crack_line() -> tuple[float, float]:
    """Slope [N/Pa] and constant [N] of the first-crack load over ft in Table 2."""
    rows = read_table(SOURCE, "udec_runs.csv").rows
    tension, load = ([float(r[name]) for r in rows] for name in ("tension", "V_first_crack"))
    slope, constant = np.polyfit(1e6 * np.array(tension), 1e3 * np.array(load), 1)
    return float(slope), float(constant)


def panel_response(
    normal_stiffness: float,
    shear_stiffness: float,
    friction_angle_deg: float,
    cohesion: float,
    tensile_strength: float,
    dilatancy_angle_deg: float = 0.0,
) -> dict[str, float]:
    """Stiffness [N/m], first crack [N] and peak [N] of the panel with the 2.025 m opening.

    Parameters
    ----------
    normal_stiffness, shear_stiffness : [Pa/m]
    friction_angle_deg, dilatancy_angle_deg : [deg]
    cohesion, tensile_strength : [Pa]

    Notes
    -----
    Slopes of strength from Table 2 by least squares, stiffness from Table 3; see the constants for what is assumed.
    First crack is the onset at the first joint, which the source's runs find somewhat late.
    """
    kn, ks = PUBLISHED_STIFFNESS
    compliance = BRICK_COMPLIANCE + JOINT_COMPLIANCE * (
        NORMAL_SHARE * kn / normal_stiffness + (1.0 - NORMAL_SHARE) * ks / shear_stiffness
    )
    a, b, c, constant = log_slopes()
    tan_phi, tan_psi = np.tan(np.radians([friction_angle_deg, dilatancy_angle_deg]))
    peak = np.exp(constant + a * np.log(tan_phi) + b * np.log(cohesion) + c * np.log(tensile_strength))
    slope, onset = first_crack_line()
    return {
        "stiffness": 1.0 / compliance,
        "first crack": float(slope * tensile_strength + onset),
        "peak": float(peak * (1.0 + tan_psi) ** DILATANCY),
    }


def triplet(
    friction_angle_deg: float,
    cohesion: float,
    shear_stiffness: float,
    dilatancy_angle_deg: float,
    *,
    pressures: tuple[float, ...] = (0.1e6, 0.3e6, 0.6e6),
) -> dict[str, float | list[float]]:
    """Shear test of one joint under pressure: c + p tan(phi) [Pa], ks [Pa/m], opening per slip tan(psi) [-].

    Parameters
    ----------
    friction_angle_deg, dilatancy_angle_deg : [deg]
    cohesion : [Pa]
    shear_stiffness : [Pa/m]
    pressures : normal to the joint [Pa]; assumed
    """
    tan_phi, tan_psi = np.tan(np.radians([friction_angle_deg, dilatancy_angle_deg]))
    return {
        "shear strength": [float(cohesion + p * tan_phi) for p in pressures],
        "slope": float(shear_stiffness),
        "dilatancy": float(tan_psi),
    }


def pull_off(tensile_strength: float) -> dict[str, float]:
    """Direct pull on one joint: ft [Pa]."""
    return {"strength": float(tensile_strength)}


def joint_column(normal_stiffness: float) -> dict[str, float]:
    """Two bricks pressed together, shortening between gauges on both sides of the joint: kn [Pa/m]."""
    return {"slope": float(normal_stiffness)}
