"""Verdict on a local mechanism after the Italian Circular of 2019, C8.7.1.2.1.

Acceleration and displacement of a mechanism are computed in :mod:`limitmason.codes.mechanism_capacity`, spectra in
:mod:`limitmason.codes.spectra`. Shear strength of piers is in ``limitmason.mechanics.pier_strength``. The tables of
materials are not in the package.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.arrays import Array
from limitmason.capacity.result import PushoverCurve
from limitmason.checks import choice, finite, instance
from limitmason.codes.mechanism_capacity import Capacity, Spectrum, ag_of, bodies_of, capacity_of
from limitmason.codes.spectra import LARGEST_AG
from limitmason.errors import InputError
from limitmason.limit import limit_analysis
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model

STATES = ("SLD", "SLV", "SLC")
"""Limit states: damage, life safety, collapse."""

_WEIGHED = 1e-3  # relative: live loads are the weight if their sum is, up to the digits of a drawing; chosen
_SAME = 1e-6  # relative: displacements of one control in one mechanism, up to rounding
_AT_REST = 1e-9  # of the largest displacement: a control that moves less does not move
_OTHER_SHARE = 0.01  # relative difference of e* by bodies and by stones from which a warning tells it; chosen
_TURNING = 1e-6  # of the largest velocity: blocks that turn by less over their size do not turn; chosen
_PARALLEL = 0.05  # of the turns along their main axis: turns across it from which axes are not parallel; chosen


@dataclass(frozen=True, eq=False)
class Assessment:
    """What the Circular says of a mechanism.

    Parameters
    ----------
    multiplier : alpha0 [-]
    bodies : the reading of the text: blocks that move without relative motion are one body of the chain
    stones : every block of the model counted by itself; its e* hangs on how the model is cut
    confidence_factor : FC
    structure, loads : of which it is the verdict
    prediction : collapse load, with the mechanism
    spectra : by limit state
    curve : alpha [-] over the displacement of the control [m]; None for a verdict by q = 2 alone
    warnings : what the Circular may not cover
    """

    multiplier: float
    bodies: Capacity
    stones: Capacity
    confidence_factor: float
    structure: Assembly
    loads: Loads
    prediction: Prediction
    spectra: Mapping[str, Spectrum]
    curve: Curve | None = None
    warnings: tuple[str, ...] = ()

    @property
    def demand(self) -> dict[str, float]:
        """Acceleration of the ground over g that is asked, by limit state."""
        return {state: ag_of(spectrum) for state, spectrum in self.spectra.items()}

    @property
    def reached(self) -> dict[str, float]:
        """Acceleration of the ground over g that is reached, by limit state; "SLV" is by q = 2 without a curve."""
        return {**self.bodies.ag, "SLV": self.bodies.ag.get("SLV", self.bodies.ag_simplified)}

    @property
    def safety(self) -> dict[str, float]:
        """Acceleration that is reached over the demand, by limit state [-]."""
        return {state: self.reached[state] / self.demand[state] for state in STATES if state in self.reached}

    def share_text(self, state: str) -> str:
        """Share of the demand that is reached at a limit state, or what it exceeds.

        The reached acceleration is infinite beyond all that were tried.
        """
        share = self.safety[state]
        return f"{share:.0%}" if math.isfinite(share) else f"more than {LARGEST_AG / self.demand[state]:.0%}"

    def __str__(self) -> str:
        """Both readings as a table, the share of the demand by limit state, and warnings."""
        head = f"Circular 2019, C8.7.1: alpha0 {self.multiplier:.4f}, FC {self.confidence_factor:.2f}, "
        names = (
            "bodies", "e*", "a0* m/s2", "d0 m", "dSLV m", "a(dSLV)", "T_SLV s", "T_SLC s", "ag,SLV g", "q = 2",
            "ag,SLD g",
        )
        asked = dict.fromkeys(f"{ag:.3f}" for ag in self.demand.values())
        lines = [f"{head}ag {', '.join(asked)} g", "  ".join(f"{n:>9}" for n in ("", *names))]
        for label, c in (("the text", self.bodies), ("by stones", self.stones)):
            cells = (
                c.bodies, c.mass_share, c.a0, c.d0, c.d.get("SLV", math.nan), c.a.get("SLV", math.nan),
                c.period.get("SLV", math.nan), c.period.get("SLC", math.nan), c.ag.get("SLV", math.nan),
                c.ag_simplified, c.ag["SLD"],
            )
            told = (f"{v:.4f}" if isinstance(v, float) else str(v) for v in (label, *cells))
            lines.append("  ".join(f"{'-' if v == 'nan' else v:>9}" for v in told))
        lines += [f"  {state}: {self.share_text(state)} of the demand" for state in self.safety]
        return "\n".join([*lines, *(f"  warning: {w}" for w in self.warnings)])


@of_model
def assess(
    assembly: Assembly,
    loads: Loads,
    spectrum: Spectrum | Mapping[str, Spectrum],
    *,
    prediction: Prediction | None = None,
    curve: Curve | None = None,
    control: str | tuple[int | str, str] = "live",
    confidence_factor: float = 1.35,
) -> Assessment:
    r"""Verdict on a local mechanism after the Italian Circular of 2019.

    It is the acceleration of the ground that is reached, by limit state.

    .. math:: e^* = \frac{(\sum P \delta)^2}{\sum P \sum P \delta^2}, \qquad a = \frac{\alpha g}{e^* F_C}, \qquad
        d = d_C \frac{\sum P \delta^2}{\delta_C \sum P \delta}

    d_SLV is 40 % of d0 (or where more than half of the capacity is lost at once), d_SLC 60 %; T = 1.68 and
    1.56 pi sqrt(d / a); the a_g is that at which the displacement spectrum at T is d. Without a curve SLV follows from
    q = 2 alone, which the text allows where a(d) is not worked out.

    Parameters
    ----------
    assembly, loads : the mechanism's structure; the live load is what the multiplier scales, P its size on each block:
        the weight of all free blocks turned along the push, or that with what they bear
    spectrum : of the ground, of a floor, or of a record; or one for each of "SLD", "SLV" and "SLC", by name
    prediction : with the mechanism; associative limit analysis by default
    curve : capacity curve, alpha over displacement [m], to where alpha is zero
    control : whose displacement the curve has, as for ``lm.pushover``: "live", or (block, "x")
    confidence_factor : FC, 1.35, 1.20 or 1.00 by the level of knowledge

    Returns
    -------
    Assessment
        Both for bodies and for stones: the text means the blocks of the kinematic chain, which are the bodies. Write it
        as a page with ``lm.figures.assessment_report``.

    Raises
    ------
    InputError
        For a structure without a mechanism, a live load that is not the weight in one direction, a curve that does not
        come back to zero, has other units or was followed with another control, and an unknown control.

    Notes
    -----
    Every limit state has its own a_g, F0 and Tc*; one spectrum is taken for all three.
    Circolare 21 gennaio 2019 n. 7, C8.7.1.3 to C8.7.1.12. Calibrated for mechanisms that move parallel to a plane.
    """
    if not finite("confidence_factor", confidence_factor) >= 1.0:
        raise InputError(f"confidence_factor must be 1 or more, got {confidence_factor!r}")
    spectra = _spectra(spectrum)
    if not isinstance(curve, Curve | None):
        raise InputError(f"curve must be a Curve, of lm.pushover for example, got {type(curve).__name__}")
    _check_weights(assembly, loads)
    if curve is not None:
        _check_units(curve)
    found = limit_analysis(assembly, loads) if prediction is None else instance("prediction", prediction, Prediction)
    if found.mechanism is None or not found.collapse_multiplier > 0.0:
        raise InputError(f"there is no mechanism to assess: {found.method!r} ended '{found.status}'")
    twists = found.mechanism.twists
    if len(twists) != assembly.n_blocks:
        raise InputError(f"prediction: it is of {len(twists)} blocks, the assembly has {assembly.n_blocks}")
    weight = np.linalg.norm(loads.live[:, :3], axis=1)
    power = (loads.live * twists).sum(axis=1)  # moments too: a load off the centroid moves as its own point does
    moved = np.divide(power, weight, out=np.zeros_like(power), where=weight > 0.0)
    if isinstance(control, str) and control == "live":
        # as in a capacity curve of that control: of centroids along the live forces, without what supports take
        force = np.where(assembly.held[:, :3], 0.0, loads.live[:, :3])
        at_control = float((force * twists[:, :3]).sum() / np.linalg.norm(force, axis=1).sum())
    else:
        if not isinstance(control, tuple | list) or len(control) != 2:
            raise InputError(f"control must be 'live' or (block, 'x'), got {control!r}")
        choice("control: the axis", control[1], ("x", "y", "z"))
        at_control = float(abs(twists[assembly.block_index(control[0]), "xyz".index(control[1])]))
    if not abs(at_control) > _AT_REST * np.abs(moved).max():
        raise InputError(f"control {control!r} does not move in the mechanism")
    if isinstance(curve, PushoverCurve):
        _check_control(curve, control, at_control, twists)
    chain = bodies_of(assembly, twists)
    # a capacity curve of this package has forces, of ``unit`` at a multiplier of one
    alpha = None if curve is None else curve.load / float(getattr(curve, "unit", 1.0))
    # a control that moves against its axis has a curve below zero, which may come back to where it began
    path = None
    if curve is not None:
        furthest = curve.displacement[np.abs(curve.displacement).argmax()]
        path = np.sign(furthest) * curve.displacement, np.asarray(alpha)
    # the blocks of every body of the chain, then every block as a body of its own
    readings = []
    for groups in (chain, [[i] for body in chain for i in body]):
        pushed = np.array([weight[g].sum() for g in groups])
        # of the live load's resultant on each; a body without any counts with no displacement
        delta = np.array([weight[g] @ moved[g] for g in groups]) / np.where(pushed > 0.0, pushed, 1.0)
        readings.append(capacity_of(
            pushed, delta, at_control, found.collapse_multiplier, path, spectra, confidence_factor
        ))
    notes = _warnings(twists, np.cbrt(assembly.volumes), readings)
    return Assessment(
        multiplier=float(found.collapse_multiplier), bodies=readings[0], stones=readings[1],
        confidence_factor=confidence_factor, structure=assembly, loads=loads, prediction=found, spectra=spectra,
        curve=None if path is None else Curve(*path, load_unit="-"), warnings=notes,
    )


def _check_weights(assembly: Assembly, loads: Loads) -> None:
    """Refuse live loads of which the multiplier is no acceleration over g.

    They must be the weight of the free blocks of the assembly turned one way, or that with the loads that these bear.
    """
    free = ~assembly.fixed
    live, own = np.linalg.norm(loads.live[free, :3], axis=1).sum(), assembly.weights[free].sum()
    borne = np.maximum(-loads.dead[free, 2], assembly.weights[free]).sum()
    if not (1.0 - _WEIGHED) * own <= live <= (1.0 + _WEIGHED) * borne:
        raise InputError(
            f"loads: the multiplier is an acceleration over g only where the live load is the weight of the blocks, "
            f"or that with what they bear; it is {live / own:.4g} of their weight. Make it by Loads.horizontal"
        )
    if np.linalg.norm(loads.live[free, :3].sum(axis=0)) < (1.0 - _WEIGHED) * live:
        raise InputError(
            "loads: the live loads of the blocks point in different directions, and the ground accelerates all of them "
            "in one. Make them by Loads.horizontal"
        )


def _check_control(curve: PushoverCurve, control: object, at_control: float, twists: Array) -> None:
    """Refuse a capacity curve whose displacement is not that of the control.

    Parameters
    ----------
    curve, control : as of :func:`assess`
    at_control : displacement of the control in the mechanism
    twists : of every block in the mechanism, shape (n, 6)
    """
    count = curve.structure.assembly.n_blocks
    if count != len(twists):
        raise InputError(f"curve: it is of {count} blocks, the assembly has {len(twists)}")
    if not math.isclose(abs(curve.controlled(twists[:, :3])), abs(at_control), rel_tol=_SAME):
        raise InputError(
            f"curve: its displacement is not that of control {control!r}; give the control and the live loads that it "
            "was followed with"
        )


def _check_units(curve: Curve) -> None:
    """Refuse a curve that is not over metres, or is of forces in an unknown unit.

    A curve of forces must have ``unit``, its force at alpha = 1.
    """
    if curve.displacement_unit != "m" or (curve.load_unit != "-" and not hasattr(curve, "unit")):
        raise InputError(
            f"curve: it is in {curve.load_unit} over {curve.displacement_unit}; alpha has load_unit='-', over m: "
            "curve.in_units('m', metres per unit, '-', 1 / the weight that is pushed)"
        )


def _spectra(spectrum: Spectrum | Mapping[str, Spectrum]) -> dict[str, Spectrum]:
    """One spectrum for each limit state, from one for all or a mapping."""
    given = dict(spectrum) if isinstance(spectrum, Mapping) else dict.fromkeys(STATES, spectrum)
    if set(given) != set(STATES):
        raise InputError(
            f"spectrum: give one, or one for each of {', '.join(STATES)}; got {', '.join(given) or 'none'}"
        )
    for state, one in given.items():
        if not isinstance(one, Spectrum):
            raise InputError(f"spectrum of {state}: a GroundSpectrum, FloorSpectrum or RecordSpectrum, got {one!r}")
    return given


def _warnings(twists: Array, size: Array, readings: Sequence[Capacity]) -> tuple[str, ...]:
    """Warnings where e* by bodies and by stones differ, and where axes of turn do.

    Parameters
    ----------
    twists : of every block [m/s, rad/s], shape (n, 6)
    size : of every block [m], by which its turn is a velocity, shape (n,)
    readings : by bodies, and by stones
    """
    out = []
    bodies, stones = readings
    if abs(stones.mass_share / bodies.mass_share - 1.0) > _OTHER_SHARE:
        count = "one body" if bodies.bodies == 1 else f"{bodies.bodies} bodies"
        out.append(
            f"e* is {bodies.mass_share:.3f} of {count} and {stones.mass_share:.3f} of {stones.bodies} "
            "stones; the text asks for the bodies"
        )
    turning = np.linalg.norm(twists[:, 3:], axis=1) * size
    turns = twists[turning > _TURNING * max(np.abs(twists[:, :3]).max(), turning.max()), 3:]
    # singular values: turns of all blocks along their main axis, and across it
    along, *across = np.linalg.svd(turns)[1] if len(turns) else (0.0,)
    if max(across, default=0.0) > _PARALLEL * along:
        out.append("blocks turn about axes that are not parallel: the Circular is calibrated for motion along a plane")
    return tuple(out)
