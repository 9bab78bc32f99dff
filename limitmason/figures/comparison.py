"""Predicted against published values, with the line of agreement and a band.

``ax`` are the axes that are drawn on.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from limitmason.checks import choice
from limitmason.checks import finite as finite_number
from limitmason.comparison.rows import Row as Compared
from limitmason.errors import InputError
from limitmason.figures import style

LABELS = ("auto", "all", "outside", "none")
_MANY = 12  # points up to which each has its name beside it
_SIDE = 4.0  # of the square [in]

_ROW, _REACH = 0.034, 0.16
"""Height of a name beside a point, and how far it reaches along the axis, over a square of ``_SIDE`` [-]."""

_ON_LINE = 0.02
"""Relative difference up to which a point lies on the 1:1 line, as far as can be seen [-]."""


class ComparedValue(NamedTuple):
    """One comparison: ``published`` and ``predicted`` are (low, value, high).

    All three are equal where there is no range.
    """

    label: str
    published: tuple[float, float, float]
    predicted: tuple[float, float, float]
    group: str


def comparison_rows(rows: Iterable[Sequence[Any]]) -> list[ComparedValue]:
    """Rows (label, published, predicted[, group]) checked and with ranges.

    A value in ``rows`` is a number, a range (low, high) shown by its mean, or (low, value, high).

    Raises
    ------
    InputError
        Naming the row that is malformed.
    """
    out = []
    for number, row in enumerate(rows):
        items = list(row) if isinstance(row, Iterable) else []
        if not 3 <= len(items) <= 4:
            raise InputError(f"row {number}: expected (label, published, predicted[, group]), got {row!r}")
        label = str(items[0])
        values = [_with_range(v, f"row {number} ({label})") for v in items[1:3]]
        out.append(ComparedValue(label, values[0], values[1], str(items[3]) if len(items) == 4 else ""))
    return out


def _with_range(value: Any, where: str) -> tuple[float, float, float]:
    """Low, value and high of a number, two ends of a range, or (low, value, high).

    Two may stand in either order, and the value is their mean; three must rise.

    ``where`` the value stands is said of one that is refused.
    """
    try:
        numbers = [float(v) for v in (value if np.ndim(value) else [value])]
    except (TypeError, ValueError):
        raise InputError(f"{where}: {value!r} is not a number or a range of numbers") from None
    if len(numbers) in (1, 2):
        low, high = float(np.min(numbers)), float(np.max(numbers))  # NaN where one is: that row is counted, not drawn
        return low, 0.5 * (low + high), high
    if len(numbers) == 3 and numbers[0] <= numbers[1] <= numbers[2]:
        return numbers[0], numbers[1], numbers[2]
    raise InputError(f"{where}: a range is (low, high) or (low, value, high), got {value!r}")


def predicted_beside_references(rows: Iterable[Compared], **options: Any) -> Figure:
    """Scatter of rows of a table against their measured or published values.

    The rows are those of ``limitmason.comparison.table``.

    Parameters
    ----------
    rows : all of one unit; those without a prediction or a reference value are left out
    options : of :func:`predicted_against_published`

    Raises
    ------
    InputError
        Where no row has a prediction, and where the values have different units.
    """
    known = [r for r in rows if r.reference is not None and np.isfinite(r.predicted)]  # below, no reference is None
    units = {r.unit for r in known}
    if len(units) != 1:
        raise InputError(
            "no row has a prediction: there is nothing to draw" if not known
            else f"the values have different units ({', '.join(sorted(units))}): draw one source at a time"
        )
    # a specimen of which several quantities were measured is named with each of them
    several = len({(r.source, r.specimen) for r in known}) < len(known)
    stated = {
        "quantity": "collapse multiplier λ [-]" if units == {"-"} else f"collapse load [{units.pop()}]",
        "published": " or ".join(sorted({r.kind for r in known})),
        "title": ", ".join(sorted({r.source for r in known})),
    }
    points = [
        (f"{r.specimen} {r.quantity}" if several else r.specimen, float(r.reference or 0.0), r.predicted,
         f"{r.kind}, {r.flow_rule or r.method}") for r in known
    ]
    return predicted_against_published(points, **{**stated, **options})


@style.in_print_style
def predicted_against_published(
    rows: Iterable[Sequence[Any]],
    *,
    band: float = 0.10,
    labels: str = "auto",
    quantity: str = "collapse multiplier λ [-]",
    published: str = "published",
    predicted: str = "predicted",
    log: bool = False,
    title: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Scatter of predictions against published or measured values.

    The 1:1 line and a band about it are drawn too.

    Parameters
    ----------
    rows : (label, published or measured, predicted[, group]) each; a value may be a range (low, high) or
        (low, value, high), drawn as a bar; all in one unit
    band : half width of the band as a fraction [-]; 0 for none
    labels : which points are named: "all", "none", those "outside" the band, or "auto": all up to 12 points, then
        those outside
    quantity : what is compared, with its unit
    published, predicted : words before it on the two axes, for example "measured"
    log : logarithmic axes
    title : heading
    ax : axes to draw on; a new figure when not given

    Returns
    -------
    Figure
        The caption counts the points, those inside the band and the mean ratio; rows that are not finite are counted
        there too, never dropped silently.

    Raises
    ------
    InputError
        When a row is malformed, none is finite, or a logarithmic axis meets a value that is not positive.
    """
    choice("labels", labels, LABELS)
    if not 0.0 <= finite_number("band", band) < 1.0:
        raise InputError(f"band must be a fraction from 0 to 1, got {band!r}")
    table = comparison_rows(rows)
    finite = [r for r in table if np.isfinite(r.published).all() and np.isfinite(r.predicted).all()]
    if not finite:
        raise InputError(f"none of the {len(table)} rows has finite values to compare")
    if log and (bad := next((r for r in finite if min(r.published[0], r.predicted[0]) <= 0.0), None)):
        raise InputError(f"row {bad.label!r} is not positive and cannot stand on a logarithmic axis")
    page = style.Page((1.0, 1.0), ax)  # a unit square, whose side is _SIDE on a page of its own
    if page.own:
        page.inch = _SIDE
    ax = page.ax
    low, high = _limits(finite, log)
    ends = np.array([low, high])
    if band > 0.0:
        ax.fill_between(ends, (1.0 - band) * ends, (1.0 + band) * ends, color="#e4e4e4", linewidth=0.0, zorder=0.5,
                        gid="band")
    ax.plot(ends, ends, color=style.FAINT, linewidth=0.8, zorder=1.0, gid="1:1")
    groups = list(dict.fromkeys(r.group for r in finite))
    handles = [_draw_group(ax, [r for r in finite if r.group == g], g, k) for k, g in enumerate(groups)]
    x = np.array([r.published[1] for r in finite])
    y = np.array([r.predicted[1] for r in finite])
    with np.errstate(divide="ignore", invalid="ignore"):
        # a point on the edge is inside, whatever its last digits are
        inside = np.abs(y - x) <= band * np.abs(x) + 1e-12 * np.maximum(np.abs(x), np.abs(y))
        ratio = np.where(x != 0.0, y / x, np.nan)
    # all are named, or else those outside the band
    named = labels == "all" or (labels == "auto" and len(finite) <= _MANY)
    chosen = [] if labels == "none" else [i for i in range(len(finite)) if named or not inside[i]]
    if log:
        ax.set_xscale("log")
        ax.set_yscale("log")
    ax.set_xlim(low, high)
    ax.set_ylim(low, high)
    sides = {g: k % 2 == 1 for k, g in enumerate(groups)}  # names on the 1:1 line stand left for every second group
    points = [(finite[i].label, x[i], y[i], sides[finite[i].group]) for i in chosen]
    _label_points(ax, points, (low, high), log, page.inch)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel(f"{published} {quantity}".strip())
    ax.set_ylabel(f"{predicted} {quantity}".strip())
    ax.tick_params(labelsize=7.5, width=0.5, length=2.5, which="both")
    shown = [h for h, g in zip(handles, groups, strict=True) if g]
    return page.finish(title, _summary(len(table), finite, inside, ratio, band), shown)


def _limits(rows: list[ComparedValue], log: bool) -> tuple[float, float]:
    """Ends of both axes; linear ones begin at zero unless a third would be empty.

    Parameters
    ----------
    rows, log : values that are drawn, and whether on logarithmic axes
    """
    values = np.array([r.published + r.predicted for r in rows])
    low, high = float(values.min()), float(values.max())
    if log:  # a margin of a tenth of a decade
        return low / 1.25, high * 1.25
    low = min(low, 0.0) if low < 0.35 * high else low
    pad = 0.06 * max(high - low, 0.02 * abs(high), 1e-12)  # equal values, and zeros, have axes of some length too
    return (0.0 if low == 0.0 else low - pad), high + pad


def _draw_group(ax: Axes, rows: list[ComparedValue], group: str, k: int) -> Any:
    """Draw the values of a group with their ranges, and return their legend entry.

    Parameters
    ----------
    rows : of the group, all finite
    group : its name, empty for none
    k : its number, which chooses colour and marker
    """
    # columns of both: low, value, high
    colour, marker = style.SERIES[k % len(style.SERIES)], style.MARKERS[k % len(style.MARKERS)]
    x, y = np.array([r.published for r in rows]), np.array([r.predicted for r in rows])
    for values, other, horizontal in ((x, y, True), (y, x, False)):
        ranged = values[:, 2] > values[:, 0]  # a bar along the axis of these values
        if ranged.any():
            draw = ax.hlines if horizontal else ax.vlines
            low, high = values[ranged, 0], values[ranged, 2]
            draw(other[ranged, 1], low, high, colors=colour, linewidth=0.9, alpha=0.6, zorder=2, gid="range")
    (points,) = ax.plot(
        x[:, 1], y[:, 1], marker, color=colour, markersize=4.6, markeredgecolor="white", markeredgewidth=0.5, zorder=3,
        linestyle="none", label=group or None, gid="points",
    )
    return points


def _label_points(
    ax: Axes, points: list[tuple[str, float, float, bool]], limits: tuple[float, float], log: bool, side: float
) -> None:
    """Write names beside points: above the 1:1 line to the left, below to the right.

    Names are kept apart vertically. Those of points on the line go to the side of their group, so that two groups that
    agree do not write over each other.

    Parameters
    ----------
    points : text, x and y of every point, and whether its name stands left where it lies on the line
    limits : ends of both axes
    log : whether both axes are logarithmic
    side : of the square [in]
    """
    low, high = (np.log(limits[0]), np.log(limits[1])) if log else limits
    row, reach = (share * _SIDE / side * (high - low) for share in (_ROW, _REACH))
    for left in (True, False):
        own = [
            (text, x, y) for text, x, y, left_on_line in points
            if left == (left_on_line if abs(y - x) <= _ON_LINE * abs(x) else y > x)
        ]
        placed: list[tuple[float, float]] = []  # places of points along x, and of their names along y
        for text, x, y in sorted(own, key=lambda p: (p[2], p[1])):
            u, v = (np.log(x), np.log(y)) if log else (x, y)  # place of the point along both axes
            at = v  # place of its name along y
            near = [q for p, q in placed if abs(p - u) < reach]
            while any(abs(at - q) < row for q in near):
                # up to the lowest place clear of a name in the way, a little more so that rounding ends the search
                at = min(q + 1.001 * row for q in near if abs(at - q) < row)
            placed.append((u, at))
            shift = (at - v) / (high - low) * 72.0 * side  # [pt]; a name moved far has a line to its point
            ax.annotate(
                text, (x, y), (-6.0 if left else 6.0, shift), textcoords="offset points", fontsize=6.5,
                color=style.FAINT, ha="right" if left else "left", va="center", gid="label", zorder=4,
                arrowprops={"arrowstyle": "-", "linewidth": 0.4, "color": style.GHOST, "shrinkA": 0.0, "shrinkB": 2.0}
                if abs(shift) > 5.0 else None,
            )


def _summary(total: int, finite: list[ComparedValue], inside: np.ndarray, ratio: np.ndarray, band: float) -> str:
    """Caption: how many values, how many within the band, mean and variation.

    Parameters
    ----------
    total, finite : how many values there are, and those that can be drawn
    inside : whether each value lies in the band, shape (n,)
    ratio : predicted over published [-], shape (n,), NaN where published is zero
    band : half the band's width [-]
    """
    parts = [f"{len(finite)} values"]
    if band > 0.0:
        parts.append(f"{int(inside.sum())} within ±{100 * band:g} %")
    good = ratio[np.isfinite(ratio)]
    if len(good):
        text = f"ratio of the two: mean {good.mean():.3f}"
        if len(good) > 1 and good.mean() != 0.0:
            text += f", variation {100 * good.std(ddof=1) / abs(good.mean()):.1f} %"
        parts.append(text)
    if total > len(finite):
        parts.append(f"{total - len(finite)} without a finite value not shown")
    return " · ".join(parts)
