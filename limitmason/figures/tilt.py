"""Tilting tests: path of the reactions at the table, and their ratio on the way."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from limitmason.errors import InputError
from limitmason.figures import style

_WIDTH, _PANEL, _FOOT = style.FULL_WIDTH, 2.35, 0.46  # of the page, of a diagram, and of its axis below it [in]
_IMPOSED: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (4, 2))}
_AT_FALL: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (1, 1.5))}
# what is read of a test; the first five are arrays, a value for every sample
_FIELDS = ("vertical", "horizontal", "ratio", "steps", "tilt_deg", "collapse", "collapse_multiplier")


@style.in_print_style
def tilt_test(
    tests: Any,
    *,
    measured: float | tuple[float, float] | None = None,
    title: str | None = None,
    caption: str | None = None,
) -> Figure:
    """Path of the reactions of tilting tests, Rh / Rv0 over Rv / Rv0.

    Rv is the reaction normal to the table, Rh that along it, and Rv0 the weight of the wall. The diagram on the right
    is Rh / Rv against steps.

    The dashed lines are what the table imposes, a circle on the left and tan(alpha) on the right; the dotted lines are
    the multiplier lambda, a ray on the left; the point is the collapse. Left of it the wall follows the table.

    Parameters
    ----------
    tests : a tilting test (such as ``dem.TiltTest``) or a mapping of labels to several; what is read are the arrays
        ``vertical`` = Rv / Rv0, ``horizontal`` = Rh / Rv0, ``ratio`` = Rh / Rv, ``steps`` and ``tilt_deg`` [deg], and
        ``collapse`` (sample) and ``collapse_multiplier``
    measured : angle of the table at which a test fell [deg], or the (lowest, highest) of several; drawn as its tangent
    title, caption : heading and the small text under it

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        When nothing is given, a test lacks one of the arrays, or they differ in length.

    Notes
    -----
    Form of the diagrams: Godio, Stefanou and Sab 2017, Figs 5 and 6.
    """
    named = dict(tests) if isinstance(tests, Mapping) else {"wall": tests}
    if not named:
        raise InputError("no tilting test to draw")
    for label, test in named.items():
        _check(label, test)
    style.needs_a_page("tilt_test")
    figure, (left, right) = style.panels(_WIDTH, _PANEL + _FOOT, columns=2)
    top = max(float(np.nanmax(t.horizontal)) for t in named.values())
    steepest = max(float(np.nanmax(t.tilt_deg)) for t in named.values())
    low, high = _bounds(measured)
    if measured is not None:
        steepest = max(steepest, high)
        _band(left, right, low, high)
    angle = np.deg2rad(np.linspace(0.0, 1.05 * steepest, 200))
    left.plot(np.cos(angle), np.sin(angle), color=style.FAINT, gid="imposed path", **_IMPOSED)
    entries: list[Any] = []
    for (label, test), colour, marker in zip(named.items(), cycle(style.SERIES), cycle(style.MARKERS), strict=False):
        k, lam = int(test.collapse), float(test.collapse_multiplier)  # sample, and tan of the angle, at the fall
        left.plot(test.vertical, test.horizontal, color=colour, linewidth=1.1, gid=f"path {label}")
        fell = getattr(test, "status", "") != "did not fall"
        steps = np.asarray(test.steps) / 1e3
        imposed = np.tan(np.deg2rad(test.tilt_deg))
        right.plot(steps, imposed, color=style.FAINT, gid=f"imposed {label}", **_IMPOSED)
        right.plot(steps, test.ratio, color=colour, linewidth=1.1, gid=f"ratio {label}")
        if fell:
            place = test.vertical[k], test.horizontal[k]
            ray = np.array([0.0, 1.0]) / math.hypot(1.0, lam)  # from the origin to the circle that the table imposes
            left.plot(ray, lam * ray, color=colour, gid=f"ray {label}", **_AT_FALL)
            left.plot(*place, marker, color=colour, markersize=4.5, gid=f"collapse {label}")
            right.axhline(lam, color=colour, gid=f"lambda {label}", **_AT_FALL)
            right.plot(steps[k], test.ratio[k], marker, color=colour, markersize=4.5, zorder=4)
        degrees = math.degrees(math.atan(lam))
        text = f"{label}: λ = {lam:.3f} ({degrees:.1f}°)" if fell else f"{label}: did not fall, λ > {lam:.3f}"
        shown = marker if fell else None
        entries.append(Line2D([], [], color=colour, linewidth=1.1, marker=shown, markersize=4.5, label=text))
    for dash, label in ((_IMPOSED, "imposed by the table, tan α"), (_AT_FALL, "λ at the fall")):
        entries.append(Line2D([], [], color=style.FAINT, label=label, **dash))
    if measured is not None:
        values = f"{low:.1f}°" if low == high else f"{low:.1f}° to {high:.1f}°"
        band: dict[str, Any] = {"color": style.BLACK, "label": f"measured, {values}"}
        entries.append(Line2D([], [], linewidth=0.9, **band) if low == high else Patch(alpha=0.15, **band))
    # ratios at the end of a fall are as large as they please: the axis follows the multipliers
    largest = max(float(t.collapse_multiplier) for t in named.values())
    largest = max(largest, math.tan(math.radians(high)) if measured is not None else 0.0)
    left.set(xlim=(0.0, 1.05), ylim=(min(0.0, *(float(np.nanmin(t.horizontal)) for t in named.values())), 1.15 * top),
             xlabel="Rv / Rv0 [-]", ylabel="Rh / Rv0 [-]")
    right.set(ylim=(0.0, 1.3 * largest), xlabel="time steps [thousand]", ylabel="Rh / Rv [-]")
    right.set_xlim(left=0.0)
    for axes, letter in ((left, "a"), (right, "b")):
        axes.tick_params(labelsize=7.5, width=0.5, length=2.5)
        axes.set_title(letter, loc="left", fontsize=8.5, fontweight="bold", pad=3.0)
    return style.finished(figure, title, caption, entries)


def _check(label: str, test: Any) -> None:
    """Refuse ``test``, named ``label``, without the readings of a tilting test."""
    missing = [name for name in _FIELDS if not hasattr(test, name)]
    if missing:
        raise InputError(f"tilting test {label!r} has no {missing[0]!r}; it must carry {', '.join(_FIELDS)}")
    shapes = {name: np.shape(getattr(test, name)) for name in _FIELDS[:5]}
    if len(set(shapes.values())) != 1 or len(shapes["ratio"]) != 1 or not shapes["ratio"][0]:
        raise InputError(f"tilting test {label!r}: arrays of different or no length: {shapes}")


def _bounds(measured: float | tuple[float, float] | None) -> tuple[float, float]:
    """Least and largest angle [deg] of one measured angle or several, NaN without any."""
    if measured is None:
        return math.nan, math.nan
    try:
        values = np.atleast_1d(np.asarray(measured, dtype=float))
    except (TypeError, ValueError):
        values = np.zeros(0)
    if not (len(values) and np.isfinite(values).all() and (values > 0.0).all() and (values < 90.0).all()):
        raise InputError(f"measured must be angles between 0 and 90 degrees, got {measured!r}")
    return float(values.min()), float(values.max())


def _band(left: Axes, right: Axes, low: float, high: float) -> None:
    """Draw the measured angle, ``low`` to ``high`` [deg], as rays and as a level.

    The ratio of the reactions of a wall at rest on a table is the tangent of the table's angle.
    """
    for angle in {low, high}:
        a = math.radians(angle)
        left.plot([0.0, math.cos(a)], [0.0, math.sin(a)], color=style.BLACK, linewidth=0.6, alpha=0.6, gid="measured")
    a, b = math.tan(math.radians(low)), math.tan(math.radians(high))
    if low == high:
        right.axhline(a, color=style.BLACK, linewidth=0.9, gid="measured level")
    else:
        right.axhspan(a, b, color=style.BLACK, alpha=0.15, linewidth=0.0, gid="measured level")
