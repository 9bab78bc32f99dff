"""Safety drawn: loads safe at once, axles on a bridge, the verdict of a code."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from scipy.spatial import ConvexHull, QhullError

from limitmason.arrays import Array
from limitmason.checks import instance
from limitmason.codes import Assessment, RecordSpectrum
from limitmason.codes.mechanism_capacity import DAMPING, peak_of, zero_of
from limitmason.constants import GRAVITY
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.load_curves import finished_diagram
from limitmason.limit.axles import AxleEnvelope
from limitmason.limit.load_set import LoadRegion

_WIDTH = 3.4  # of a single diagram [in]
_CARRIED, _CERTAIN = "#d8d8d8", "#a0a0a0"  # fill of a region, and of the part that is certain for psi < phi


@style.in_print_style
def load_region(region: LoadRegion, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Multipliers of two loads that a structure carries together, as a region.

    Filled where forces carry them, a line per half-plane of a mechanism, dashed where no more was asked.

    Parameters
    ----------
    region : of two loads, from ``limitmason.load_region``; a region that is certain for psi < phi is filled darker,
        and is a thick line where it is flat
    title : heading
    ax : axes to draw in; its own by default

    Raises
    ------
    InputError
        For an empty region, and one of one or three loads.
    """
    instance("region", region, LoadRegion, "by lm.load_region")
    if len(region.names) != 2 or not len(region.corners):
        raise InputError(f"a region is drawn of two loads that can be carried, not: {region}")
    own = ax is None
    _, ax = style.paper(style.page_width(_WIDTH), height=3.0, ax=ax)
    for drawn, shade in ((region, _CARRIED), (region.certain, _CERTAIN)):
        if drawn is not None and len(drawn.corners):
            outline = _outline(drawn.corners)
            ax.fill(*outline.T, color=shade, lw=0 if len(outline) > 2 else 3.0)  # a flat one is a line
            ax.plot(*np.vstack([outline, outline[:1]]).T, color="black", lw=0.8, marker="o", ms=2.5)
    low, high = region.corners.min(axis=0), region.corners.max(axis=0)
    # a margin in which the lines of half-planes show, also along a side without length
    room = 0.12 * np.maximum(high - low, 1e-3 * np.abs(region.corners).max())
    ax.set_xlim(low[0] - room[0], high[0] + room[0])
    ax.set_ylim(low[1] - room[1], high[1] + room[1])
    for plane in region.outside:  # half-planes normal . x <= offset, each with the twists of its mechanism
        foot, (x, y) = plane.offset * plane.normal, plane.normal  # its line runs through the foot, across the normal
        line = ax.axline((foot[0], foot[1]), (foot[0] - y, foot[1] + x), color=style.ORANGE, lw=0.5)
        if plane.twists is None:  # white over the outline, which it makes dashed
            line.set(color="white", lw=1.2, ls=(0, (4, 4)))
    ax.set_xlabel(f"multiplier of {region.names[0]} [-]")
    ax.set_ylabel(f"multiplier of {region.names[1]} [-]")
    handles: list[Any] = [Patch(facecolor=_CARRIED, edgecolor="black", linewidth=0.8, label="carried")]
    if region.certain is not None and len(region.certain.corners):
        handles.append(Patch(facecolor=_CERTAIN, edgecolor="black", linewidth=0.8, label="certain for ψ < φ"))
    if any(plane.twists is not None for plane in region.outside):
        handles.append(Line2D([], [], color=style.ORANGE, linewidth=1.0, label="a mechanism"))
    style.frame(ax, title=None)
    return finished_diagram(ax, own, title, str(region), handles)


def _outline(corners: Array) -> Array:
    """Those of ``corners`` [-], shape (n, 2), on the outline of them all, in order.

    Of a set without area they are the two points that are farthest apart.
    """
    try:
        return np.asarray(corners[ConvexHull(corners).vertices])
    except (QhullError, ValueError):
        apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
        return np.asarray(corners[list(np.unravel_index(int(apart.argmax()), apart.shape))])


@style.in_print_style
def axle_envelope(envelope: AxleEnvelope, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Multiplier over the place of the first axle, with a point at the smallest.

    Parameters
    ----------
    envelope : from ``limitmason.axle_envelope``
    title : heading
    ax : axes to draw in; its own by default

    Raises
    ------
    InputError
        Where no place of the axles has a finite multiplier.
    """
    instance("envelope", envelope, AxleEnvelope, "by lm.axle_envelope")
    own = ax is None
    _, ax = style.paper(style.page_width(_WIDTH), height=2.2, ax=ax)
    shown = np.where(np.isfinite(envelope.multipliers), envelope.multipliers, np.nan)
    if not np.isfinite(shown).any():
        raise InputError("no place of the axles has a finite multiplier: there is nothing to draw")
    least = float(np.nanmin(envelope.multipliers))
    ax.plot(envelope.positions, shown, color="black", lw=0.9)
    ax.plot([envelope.governing], [least], "o", color=style.ORANGE, ms=4)
    # axles over a support are carried at any multiplier: beyond six times the least the curve is cut off
    ax.set_ylim(0.0, min(float(np.nanmax(shown)), 6.0 * least) * 1.05)
    ax.set_xlabel("first axle at x [m]")
    ax.set_ylabel("multiplier of the axles [-]")
    style.frame(ax, title=None)
    return finished_diagram(ax, own, title, str(envelope), [])


@style.in_print_style
def assessment(verdict: Assessment, *, title: str | None = None) -> Figure:
    """Capacity of a mechanism over the displacement spectra of its demand.

    The points of SLV and SLC are marked. Without a curve: the elastic spectrum, its peak, and what is set against it.

    Parameters
    ----------
    verdict : from ``limitmason.assess``
    title : heading

    Raises
    ------
    InputError
        For a verdict without a curve on the spectrum of a record.
    """
    capacity = instance("verdict", verdict, Assessment, "by lm.assess").bodies
    share = ", ".join(f"{state} {verdict.share_text(state)}" for state in verdict.safety)
    count = "1 body" if capacity.bodies == 1 else f"{capacity.bodies} bodies"
    text = f"{count}, e* {capacity.mass_share:.3f}, FC {verdict.confidence_factor:.2f}; of the demand: {share}"
    if verdict.curve is None:
        return _by_peaks(verdict, title, text)
    style.needs_a_page("assessment")
    figure, (left, right) = style.panels(style.FULL_WIDTH, height=2.4, columns=2)
    alpha, moved = verdict.curve.load, verdict.curve.displacement
    # from the control point to the oscillator of the code, whose curve comes down to zero at d0; a = alpha g / (e* FC)
    along = moved * (capacity.d0 / zero_of(moved, alpha))
    left.plot(along, alpha * GRAVITY / (capacity.mass_share * verdict.confidence_factor), color="black", lw=0.9)
    periods = np.linspace(0.02, 1.6 * max(capacity.period.values()), 200)  # [s], beyond both points of the verdict
    for state, colour in (("SLV", style.ORANGE), ("SLC", style.BLUE)):
        demand = [verdict.spectra[state].displacement(float(t), DAMPING[state]) for t in periods]
        right.plot(periods, demand, color=colour, lw=0.9, label=f"{state}, damping {DAMPING[state]:.0%}")
        right.plot([capacity.period[state]], [capacity.d[state]], "o", color=colour, ms=4)
        left.plot([capacity.d[state]], [capacity.a[state]], "o", color=colour, ms=4, label=state)
    left.set(xlabel="displacement d [m]", ylabel="capacity a [m/s$^2$]", ylim=(0.0, None))
    left.set_xlim(0.0, 1.05 * capacity.d0)
    right.set(xlabel="period [s]", ylabel="displacement [m]", xlim=(0.0, None), ylim=(0.0, None))
    left.legend(frameon=False)
    right.legend(frameon=False)
    return style.finished(figure, title, text, [])


def _by_peaks(verdict: Assessment, title: str | None, text: str) -> Figure:
    """Elastic spectra of SLD and SLV with peaks, beside a0* and, by q = 2, twice it.

    ``text`` is the caption.
    """
    figure, (ax,) = style.panels(style.page_width(_WIDTH), height=2.4)
    for state, colour, factor in (("SLV", style.ORANGE, 2.0), ("SLD", style.BLUE, 1.0)):
        spectrum = verdict.spectra[state]
        if isinstance(spectrum, RecordSpectrum):
            raise InputError("a verdict by q = 2 alone on a record has no curve and no spectrum to draw")
        periods = np.linspace(0.0, 1.5, 301)  # [s]; chosen: the plateau, and where the spectrum has come down from it
        ax.plot(periods, [spectrum.acceleration(float(t)) for t in periods], color=colour, lw=0.9, label=f"{state}, 5%")
        ax.plot([0.0], [peak_of(spectrum)], "o", color=colour, ms=4, clip_on=False)
        a = factor * verdict.bodies.a0
        ax.axhline(a, color=colour, lw=0.7, ls="--", label=f"{state}: {'2 ' * (factor > 1.0)}a0* = {a:.2f} m/s$^2$")
    ax.set(xlabel="period [s]", ylabel="acceleration [m/s$^2$]", xlim=(0.0, 1.5), ylim=(0.0, None))
    ax.legend(frameon=False)
    return style.finished(figure, title, text, [])
