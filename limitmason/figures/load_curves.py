"""Curves of a simulation: load against displacement, and any recorded quantity."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from limitmason.answers.curve import Curve
from limitmason.arrays import Array
from limitmason.checks import finite
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.storage.csv_table import Tabular

_WIDTH, _HEIGHT = 4.6, 3.0  # of the diagram [in]
FORCE = "force [kN]"
_FORCES = ("N", "kN", "MN")
_TO_SI = {"m": 1.0, "mm": 1e-3, "N": 1.0, "kN": 1e3, "MN": 1e6}  # size of units in m and N
# dash patterns of matplotlib: start and lengths of line and gap [line widths]; levels differ from curves
_LEVELS = ((0, (5, 2)), (0, (1.2, 1.6)), (0, (8, 2, 1.2, 2)), (0, (3, 1.2, 1.2, 1.2, 1.2, 1.2)))
_LINES = ("-", (0, (5, 1.5)), (0, (1.2, 1.2)), (0, (6, 1.5, 1.2, 1.5)))


@style.in_print_style
def load_displacement(
    curves: Any,
    *,
    measured: Any = None,
    block: int | str | None = None,
    direction: tuple[float, float, float] = (1.0, 0.0, 0.0),
    points: Iterable[tuple[str, float, float]] = (),
    levels: Mapping[str, float] | None = None,
    title: str | None = None,
    caption: str | None = None,
    xlabel: str = "displacement [mm]",
    ylabel: str = FORCE,
    ax: Axes | None = None,
) -> Figure:
    """Load-displacement curves with measured key points and predicted levels.

    Parameters
    ----------
    curves : a ``limitmason.Curve`` of forces, or of multipliers, which are drawn as forces where forces stand beside
        them; a history with ``curve(block, direction)`` (such as ``dem.History``), a pair of arrays (displacement [m],
        force [N]), a mapping of labels to any of these, or a sequence of ``Curve``, each with its own label; one that
        begins with "_" stays out of the legend, as in matplotlib
    measured : a measured or published ``Curve``, drawn in black with its points; or an experiment (also its method
        ``curve``), whose measured loads are levels where it has no curve
    block : the driven block of a history; the only driven block that is not wholly fixed when not given
    direction : along which a history's displacement and force are taken
    points : measured key points (label, displacement [m], force [N])
    levels : forces to mark by horizontal lines, by label [N]; a multiplier times the resultant of the live loads
    title, caption : heading and the small text under it
    xlabel, ylabel : of the axes; the curves are drawn in mm and kN
    ax : axes to draw on; a new figure when not given

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        When a curve has not one force per displacement, none is given, its units are of something else than length and
        force, or the driven block is not clear.
    """
    named, points = _by_label(curves), [_point(p) for p in points]
    if not named:
        raise InputError("no curve to draw")
    if block is not None and not any(hasattr(c, "curve") for _, c in named):
        raise InputError(f"block={block!r} is that of a history, and none is given")
    if measured is None and not points and not levels and all(_is_multiplier(c) for _, c in named):
        # named kN so that they are drawn with their own numbers: the axis is given its name here
        named = [(label, Curve(c.displacement, c.load, c.displacement_unit, "kN")) for label, c in named]
        ylabel = "multiplier λ [-]" if ylabel == FORCE else ylabel
    own = ax is None
    _, ax = style.paper(style.page_width(_WIDTH), _HEIGHT, ax)
    ax.axhline(0.0, color=style.FAINT, linewidth=0.5, zorder=0.5)
    for (label, curve), look in zip(named, _looks(), strict=False):
        u, f = _curve(curve, block, direction, label)
        ax.plot(1e3 * u, 1e-3 * f, linewidth=1.0, label=label or None, gid=f"curve {label}".strip(), **look)
    for label, curve in _measured_curves(measured):
        u, f = _curve(curve, block=None, direction=direction, label=label)
        marker = "o" if len(u) < 12 else None  # chosen: the points of a longer record run into each other
        ax.plot(1e3 * u, 1e-3 * f, color=style.BLACK, linewidth=0.8, marker=marker, markersize=3.5, label=label,
                markerfacecolor="white", gid="measured", zorder=2.5)
    for (label, force_kn), dashes in zip(_measured_levels(measured), cycle(_LEVELS), strict=False):
        ax.axhline(force_kn, color=style.BLACK, linewidth=0.8, linestyle=dashes, label=label, gid=f"measured {label}")
    for (label, force), colour in zip((levels or {}).items(), cycle(reversed(style.SERIES)), strict=False):
        ax.axhline(1e-3 * force, color=colour, linewidth=0.8, linestyle=(0, (2, 2)), label=label, gid=f"level {label}")
    groups: dict[str, list[tuple[float, float]]] = {}
    for label, displacement, force in points:
        groups.setdefault(label, []).append((1e3 * displacement, 1e-3 * force))
    for (label, rows), marker in zip(groups.items(), cycle(style.MARKERS), strict=False):
        x, y = np.array(rows).T
        ax.plot(x, y, marker, color=style.BLACK, markersize=4.5, markerfacecolor="none", linestyle="none", label=label,
                gid=f"point {label}", zorder=4)
    return _finish(ax, own, xlabel, ylabel, title, caption)


@style.in_print_style
def history_curves(
    history: Any,
    names: Sequence[str],
    *,
    against: str = "step",
    units: Mapping[str, str] | None = None,
    log: bool = False,
    title: str | None = None,
    caption: str | None = None,
    ylabel: str | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Recorded quantities of a simulation in one diagram.

    Parameters
    ----------
    history : anything that gives an array for ``history[name]``: ``dem.History``, a mapping
    names : what to draw, for example ("kinetic", "elastic", "friction")
    against : name of the quantity along the horizontal axis
    units : by name, written on the axes; the common unit of ``names`` goes to the vertical axis, units that differ to
        the names. Those of a ``dem.History`` are known
    log : logarithmic vertical axis; values that are not positive are left out of it
    title : heading
    caption : the small text under it
    ylabel : label instead of the names
    ax : axes to draw on; a new figure when not given

    Raises
    ------
    InputError
        When no name is given, or arrays differ in length.
    KeyError
        For a name that the history does not have.
    """
    names = names if isinstance(names, str) else list(names)
    if not names or isinstance(names, str):
        raise InputError(f"name at least one quantity to draw, in a list, got {names!r}")
    known = history.tabulated()[0] if isinstance(history, Tabular) else {}
    units = {name: "" if unit == "-" else unit for name, unit in (dict(known) | dict(units or {})).items()}
    kinds = {units.get(n, "") for n in names}
    x = np.asarray(history[against], dtype=float)
    own = ax is None
    _, ax = style.paper(style.page_width(_WIDTH), _HEIGHT, ax)
    for name, look in zip(names, _looks(), strict=False):
        y = np.asarray(history[name], dtype=float)
        if y.shape != x.shape:
            raise InputError(f"{name!r} has shape {y.shape}, {against!r} has {x.shape}")
        if log:
            y = np.where(y > 0.0, y, np.nan)
        label = name if len(names) > 1 else None
        if len(kinds) > 1 and units.get(name):
            label = f"{name} [{units[name]}]"
        ax.plot(x, y, linewidth=1.0, label=label, gid=f"curve {name}", **look)
    if log:
        ax.set_yscale("log")
    if ylabel is None:
        unit = kinds.pop() if len(kinds) == 1 else ""
        ylabel = (names[0] if len(names) == 1 else "") + (f" [{unit}]" if unit else "")
    along = f"{against} [{units[against]}]" if units.get(against) else against
    return _finish(ax, own, along, ylabel.strip(), title, caption)


def _point(point: Any) -> tuple[str, float, float]:
    """A measured point, (label, displacement [m], force [N]), or what is wrong."""
    try:
        label, displacement, force = point
    except (TypeError, ValueError):
        raise InputError(f"a point is (label, displacement, force), got {point!r}") from None
    name = f"of point {label!r}"
    return str(label), finite(f"displacement {name}", displacement), finite(f"force {name}", force)


def _looks() -> Iterator[dict[str, Any]]:
    """Colour and line style of one curve after the other, without end.

    No style repeats soon, so that grey will do too.
    """
    return ({"color": c, "linestyle": _LINES[k % len(_LINES)]} for k, c in enumerate(cycle(style.SERIES)))


def _is_multiplier(curve: Any) -> bool:
    """Whether ``curve`` is a ``Curve`` of multipliers, not of forces."""
    return isinstance(curve, Curve) and curve.load_unit == "-"


def _by_label(curves: Any) -> list[tuple[str, Any]]:
    """Pairs of label and curve to draw, with an empty label where there is none.

    Parameters
    ----------
    curves : a ``Curve``, a sequence of them, a mapping of labels to curves, or one history or pair of arrays
    """
    if isinstance(curves, Curve):
        return [(curves.label, curves)]
    # a mapping with a method ``curve`` is a history: its keys are recorded quantities, not labels of curves
    if isinstance(curves, Mapping) and not hasattr(curves, "curve"):
        return list(curves.items())
    if isinstance(curves, Iterator):
        curves = list(curves)
    # a pair of arrays is a sequence too, but one curve
    if isinstance(curves, Sequence) and all(isinstance(c, Curve) for c in curves):
        return [(c.label, c) for c in curves]
    return [("", curves)]


def _measured_curves(measured: Any) -> list[tuple[str, Any]]:
    """Pairs of name in the legend and measured curve.

    Parameters
    ----------
    measured : one curve, several, an experiment, its method ``curve``, or None
    """
    test = getattr(measured, "__self__", measured)  # of a method, the experiment that it belongs to
    if hasattr(test, "recipe"):  # only experiments have one
        try:
            curve = test.curve()
        except InputError:  # this one was published without a curve: its forces are drawn as levels
            return []
        return [(curve.label or "measured", curve)]
    return [] if measured is None else [(label or "measured", curve) for label, curve in _by_label(measured)]


def _measured_levels(measured: Any) -> list[tuple[str, float]]:
    """Names and measured forces [kN] of an experiment without a curve, else none.

    Parameters
    ----------
    measured : an experiment or its method ``curve``; also a curve, several or None, which have no levels

    Raises
    ------
    InputError
        For an experiment with neither a measured curve nor a measured force.
    """
    test = getattr(measured, "__self__", measured)
    if not hasattr(test, "recipe") or _measured_curves(test):
        return []
    loads = [(f"measured {n}", float(v) * _TO_SI[v.unit] / 1e3) for n, v in test.measured.items() if v.unit in _FORCES]
    if not loads:
        raise InputError(f"{test.name} has neither a measured curve nor a measured force to draw")
    return loads


def _curve(curve: Any, block: int | str | None, direction: Any, label: str) -> tuple[Array, Array]:
    """Displacements [m] and forces [N], shape (k,) each, in the order of the path.

    Multipliers become forces where the curve knows its loads.

    Parameters
    ----------
    curve : a ``Curve``, a history, or a pair of arrays (displacement [m], force [N])
    block : of a history, whose displacement and reaction are taken; None for the driven block
    direction : along which these are taken of a history, shape (3,)
    label : by which a curve is named where it is refused
    """
    if hasattr(curve, "curve"):
        curve = curve.curve(_driven(curve) if block is None else block, direction)
    if _is_multiplier(curve) and hasattr(curve, "as_force"):
        curve = curve.as_force()
    if isinstance(curve, Curve):
        length, force = curve.displacement_unit, curve.load_unit
        if length not in ("m", "mm") or force not in _FORCES:
            raise InputError(
                f"curve {label!r} is in {length} and {force}; drawn are lengths (m, mm) and forces (N, kN, MN): "
                "convert it with Curve.in_units"
            )
        return curve.displacement * _TO_SI[length], curve.load * _TO_SI[force]
    try:
        displacement, force = curve
    except (TypeError, ValueError):
        raise InputError(f"curve {label!r} is neither a history nor a pair (displacement, force)") from None
    u, f = np.asarray(displacement, dtype=float), np.asarray(force, dtype=float)
    if u.ndim != 1 or u.shape != f.shape or not len(u):
        raise InputError(f"curve {label!r} has displacements of shape {u.shape} and forces of shape {f.shape}")
    return u, f


def _driven(history: Any) -> int:
    """Number of the one recorded block of ``history`` that is not wholly fixed.

    Recorded is its reaction.

    Supports have a recorded reaction too, but are not driven.
    """
    blocks = [int(i) for i in history.reaction_blocks if not history.assembly.fixed[int(i)]]
    if len(blocks) != 1:
        names = ", ".join(history.assembly.blocks[i].name for i in blocks) or "none"
        raise InputError(f"name the driven block with block=...; reactions are recorded on: {names}")
    return blocks[0]


def _finish(ax: Axes, own: bool, xlabel: str, ylabel: str, title: str | None, caption: str | None) -> Figure:
    """Write labels, legend, title and caption of a diagram, and return its figure.

    Parameters
    ----------
    ax, xlabel, ylabel : the diagram, and the names of its axes with their units
    own : whether the page was made here; in axes of the caller the page is not made larger
    """
    ax.set_xlabel(xlabel)
    ax.set_ylabel(ylabel)
    ax.tick_params(labelsize=7.5, width=0.5, length=2.5, which="both")
    handles, _ = ax.get_legend_handles_labels()
    return finished_diagram(ax, own, title, caption, handles)


def finished_diagram(ax: Axes, own: bool, title: str | None, text: str | None, handles: list[Any]) -> Figure:
    """The figure of a diagram, with title, caption ``text`` and a legend of ``handles``.

    ``own`` tells whether its page was made here, which grows by them; axes of the caller keep the size of their page.
    """
    figure = style.figure_of(ax)
    if own:
        return style.finished(figure, title, text, handles)
    wide = float(figure.get_size_inches()[0]) * ax.get_position().width
    style._above(ax, title, style.wrapped(text, wide).splitlines() if text else [])
    if handles:
        ax.legend(handles=handles)
    return figure
