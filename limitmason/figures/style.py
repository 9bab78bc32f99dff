"""Print style: page size, fonts, line widths, a palette for every colour vision.

The colour of a method is the ``look`` that its package declares in ``method.py``.
"""

from __future__ import annotations

import functools
import math
import textwrap
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from limitmason.arrays import Array
from limitmason.checks import finite
from limitmason.errors import InputError, NotApplicable

# Okabe and Ito (2008): told apart with every common colour vision, and in grey by their different lightness
BLACK, ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE = (
    "#1a1a1a", "#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#D55E00", "#CC79A7",
)
SERIES = (BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY, BLACK)
MARKERS = ("o", "s", "^", "D", "v", "P", "X")

OPENING, SLIDING = VERMILION, BLUE  # of joints that move
STONE, STILL, FIXED = "#f1e2c6", "#f2f2f2", "#d0d0d0"
OUTLINE, GHOST, HATCH, FAINT = "#4d4d4d", "#8a8a8a", "#8f8f8f", "#666666"

FULL_WIDTH = 6.3
"""Widest figure [in]: the text width of an A4 page."""

HEIGHT = 5.2
"""Tallest drawing, without title, caption and legend [in]."""

_LEFT, _RIGHT, _BOTTOM, _BARE = 0.62, 0.14, 0.42, 0.12
"""Margins of a drawing [in]: room for the numbers and names of its axes, and all around one without a frame."""

_INSET, _TITLE, _LINE, _ROW = 0.12, 0.21, 0.145, 0.19
"""Indent of a heading, and heights of a title, of a line of its caption and of a row of a legend [in]."""

_LETTER = 0.0555  # mean width of a letter of small text [in]: 0.53 of its height
_FONT, _SMALL = 8.5, 7.5  # [pt]
_RC: dict[str, Any] = {
    "font.size": _FONT, "font.family": "sans-serif",
    "axes.titlesize": 9.5, "axes.labelsize": _FONT, "axes.linewidth": 0.6, "axes.edgecolor": FAINT,
    "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True,
    "legend.fontsize": _SMALL, "legend.frameon": False, "legend.handlelength": 1.6, "legend.columnspacing": 1.4,
    "lines.solid_capstyle": "butt", "patch.linewidth": 0.5,
    # TrueType in PDF (42) and text in SVG: letters can be searched and edited
    "savefig.dpi": "figure", "pdf.fonttype": 42, "svg.fonttype": "none",
}

SINGLE_COLUMN = 89.0
"""Width of one column of a journal page [mm]."""

NARROWEST, WIDEST = 60.0, 183.0  # widths that print_style takes [mm]; chosen: 183 is two columns of a journal page
_width: ContextVar[float | None] = ContextVar("width", default=None)


@contextmanager
def print_style(width: float | None = None) -> Iterator[None]:
    """Matplotlib settings of all figures here, for the time of a with-block.

    Figures made here carry their sizes with them. Put ``savefig`` inside the block too when a PDF or SVG must keep its
    text as text (``pdf.fonttype`` is read while saving).

    Parameters
    ----------
    width : of the figures made in the block [mm]: 89 for one column of a journal, 160 (the text of an A4 page) by
        default. Letters keep their size, and figures of several panels are never wider than 160

    Raises
    ------
    InputError
        For widths outside 60 to 183 mm. In the block, panels that need a whole page raise ``NotApplicable``.
    """
    if width is not None and not NARROWEST <= finite("width", width) <= WIDEST:
        raise InputError(f"a figure is {NARROWEST:g} to {WIDEST:g} mm wide, got {width!r}")
    before = _width.set(_width.get() if width is None else float(width))
    try:
        with mpl.rc_context(_RC):  # type: ignore[arg-type]  # keys are known to matplotlib
            yield
    finally:
        _width.reset(before)


def page_width(usual: float = FULL_WIDTH) -> float:
    """Width of the figure made [in]: that of :func:`print_style`, else the usual one."""
    width = _width.get()
    return usual if width is None else width / 25.4


def needs_a_page(name: str) -> None:
    """Refuse a width in which the panels of a figure do not fit.

    Raises
    ------
    NotApplicable
        Where :func:`print_style` asks for less than the text width of an A4 page.
    """
    if 25.4 * page_width() < math.floor(25.4 * FULL_WIDTH):  # in whole mm, as it is asked for
        raise NotApplicable(f"{name} has several panels and needs {25.4 * FULL_WIDTH:.0f} mm: leave out the width")


def enlarged(low: float, high: float) -> str:
    """What to say of an axis that spans less than a tenth of its values, else empty.

    It goes from ``low`` to ``high``.
    """
    top = max(abs(low), abs(high))  # an axis that shows zero enlarges nothing
    if not top > 0.0 or low * high <= 0.0 or abs(high - low) >= 0.1 * top:
        return ""
    return f"axis enlarged: it spans {100.0 * abs(high - low) / top:.2g} % of the value"


def in_print_style(function: Callable[..., Figure]) -> Callable[..., Figure]:
    """Run a figure function under :func:`print_style`; settings outside stay."""

    @functools.wraps(function)
    def wrapped(*args: Any, **options: Any) -> Figure:
        with print_style():
            return function(*args, **options)

    return wrapped


def lines_of(text: str | None, width: float, most: int | None = None) -> list[str]:
    """Small text broken into lines.

    Parameters
    ----------
    width : of the page that they fit [in]
    most : lines that may stand there; the last of them ends in dots where more would follow
    """
    lines = textwrap.wrap(text, int((width - 2.0 * _INSET) / _LETTER)) if text else []
    return lines if most is None or len(lines) <= most else [*lines[: most - 1], lines[most - 1][:-4] + " ..."]


class Heading:
    """Title and small caption at the top of a page.

    ``depth`` is the height they take [in].

    Parameters
    ----------
    title : heading
    text : caption under it, which is broken into lines here unless it is given as lines
    width : of the page [in]
    """

    def __init__(self, title: str | None, text: str | list[str] | None, width: float) -> None:
        self.title, self.width = title, width
        self.lines = text if isinstance(text, list) else lines_of(text, width)
        self.depth = 0.1 + (_TITLE if title else 0.0) + _LINE * len(self.lines) + 0.06  # with space above and below

    def put(self, figure: Figure) -> None:
        """Write them on a figure that has its final size."""
        total = figure.get_size_inches()[1]
        top = 1.0 - 0.09 / total
        if self.title:
            figure.text(_INSET / self.width, top, self.title, fontsize=9.5, fontweight="bold", va="top", gid="title")
            top -= _TITLE / total
        if self.lines:
            figure.text(_INSET / self.width, top, "\n".join(self.lines), fontsize=_SMALL, color=FAINT, va="top",
                        linespacing=1.3, gid="caption")


def figure_of(ax: Axes) -> Figure:
    """The whole figure that axes lie on, also those of a part of it."""
    figure = ax.figure
    while not isinstance(figure, Figure):
        figure = figure.figure
    return figure


def blank(width: float, height: float, **options: Any) -> Figure:
    """A figure ``width`` by ``height`` [in] of no window; ``options`` of ``Figure``."""
    figure = Figure(figsize=(width, height), dpi=200, **options)
    FigureCanvasAgg(figure)
    return figure


class Page:
    """A drawing with equal axes on a page that fits: title above, legend below.

    ``width`` and ``height`` are those of what is shown [m], ``room`` is the widest page [in], and ``inch`` the scale of
    the drawing [in/m]. ``own`` tells whether the page was made here.

    Parameters
    ----------
    extent : width and height to show [m]
    ax : axes of the caller, which keep their size, or None for a new figure
    framed : leave room for tick and axis labels
    beside : width that is added on the right afterwards, as for a colour bar [in]
    """

    def __init__(self, extent: Iterable[float], ax: Axes | None, *, framed: bool = True, beside: float = 0.0) -> None:
        """Take a page of its own, or the caller's axes, and the scale that fits."""
        width, height = extent
        self.room = page_width() - beside
        self.own = ax is None
        self.framed = framed
        self.width, self.height = max(width, 1e-12), max(height, 1e-12)  # nothing is divided by zero
        if ax is None:
            side = (_LEFT if framed else _BARE) + (_RIGHT if framed else _BARE)
            self.inch = min((self.room - side) / self.width, HEIGHT / self.height)
            figure = blank(page_width(), HEIGHT)
            self.ax = figure.add_axes((0.0, 0.0, 1.0, 1.0))
        else:
            self.ax = ax
            across, along = self.figure.get_size_inches()
            box = ax.get_position()
            self.inch = min(across * box.width / self.width, along * box.height / self.height)

    @property
    def figure(self) -> Figure:
        """The figure drawn on."""
        return figure_of(self.ax)

    def finish(self, title: str | None, text: str | None, handles: list[Any]) -> Figure:
        """Set the size of the page, then title, caption and legend, and return the figure.

        Parameters
        ----------
        title : heading
        text : small caption under it
        handles : legend entries; none, no legend
        """
        if not self.own:
            self._finish_axes(title, text, handles)
            return self.figure
        left, right, bottom = (_LEFT, _RIGHT, _BOTTOM) if self.framed else (_BARE, _BARE, _BARE)
        wide, high = self.width * self.inch, self.height * self.inch
        # a narrow drawing stands in the middle of a page that its title and caption can be read on
        page = max(wide + left + right, min(3.3, self.room))
        left += 0.5 * (page - wide - left - right)
        heading = Heading(title, text, page)
        columns, rows = legend_shape(handles, page)
        foot = bottom + (_ROW * rows + 0.06 if rows else 0.0)
        total = foot + high + heading.depth
        figure = self.figure
        figure.set_size_inches(page, total)
        self.ax.set_position((left / page, foot / total, wide / page, high / total))
        heading.put(figure)
        legend_below(figure, handles, columns)
        return figure

    def _finish_axes(self, title: str | None, text: str | None, handles: list[Any]) -> None:
        """Title and caption above, and a legend of ``handles`` below the caller's axes."""
        ax = self.ax
        across = self.figure.get_size_inches()[0] * ax.get_position().width
        lines = textwrap.wrap(text, max(int(across / _LETTER), 24)) if text else []
        _above(ax, title, lines)
        if handles:
            columns, _ = legend_shape(handles, across)
            below = -0.18 if self.framed else -0.02  # under the numbers of the axis, where it has them
            ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, below), ncols=columns,
                      fontsize=_SMALL, frameon=False)


def outline_width(inch: float, size: float, widest: float = 0.7) -> float:
    """Width of outlines [pt]: 3 % of a ``size`` [m] at ``inch`` in/m, to ``widest``."""
    return float(min(max(0.03 * 72.0 * inch * size, 0.12), widest))


def legend_shape(handles: list[Any], width: float) -> tuple[int, int]:
    """Columns and rows of a legend of ``handles`` that fits a width [in]."""
    if not handles:
        return 0, 0
    entries = [0.45 + 0.06 * len(str(h.get_label())) for h in handles]  # width of mark and gap, and of a letter [in]
    columns = len(handles) if sum(entries) <= width - 0.2 else min(max(int(width / max(entries)), 1), len(handles))
    return columns, -(-len(handles) // columns)  # rows rounded up


def legend_below(figure: Figure, handles: list[Any], columns: int) -> None:
    """Legend of ``handles`` in columns at the foot of a figure of final size, or none."""
    if handles:
        figure.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 0.03 / figure.get_size_inches()[1]),
                      ncols=columns, fontsize=_SMALL, frameon=False, borderpad=0.0, borderaxespad=0.0)


def paper(width: float, height: float, ax: Axes | None) -> tuple[Figure, Axes]:
    """A figure of one diagram [in] and its axes, or those of the caller."""
    if ax is not None:
        return figure_of(ax), ax
    figure, axes = panels(width, height)
    return figure, axes[0]


def panels(width: float, height: float, rows: int = 1, columns: int = 1) -> tuple[Figure, list[Axes]]:
    """A figure of diagrams, ``width`` by ``height`` [in], and their axes row by row."""
    figure = blank(width, height, layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False).flat)


def finished(figure: Figure, title: str | None, text: str | None, handles: list[Any]) -> Figure:
    """A figure of :func:`panels`, higher by title, caption ``text`` and a legend."""
    width, height = figure.get_size_inches()
    heading, (columns, rows) = Heading(title, text, width), legend_shape(handles, width)
    foot = _ROW * rows + 0.06 if rows else 0.0
    total = heading.depth + height + foot
    figure.set_size_inches(width, total)
    figure.set_layout_engine("constrained", rect=(0.08 / width, foot / total, 1.0 - 0.16 / width, height / total))
    heading.put(figure)
    legend_below(figure, handles, columns)
    return figure


def frame(ax: Axes, title: str | None, caption: str = "") -> None:
    """Ticks of a diagram, and title and caption above it, at offsets in points."""
    ax.tick_params(labelsize=_SMALL, width=0.5, length=2.5, colors=FAINT)
    ax.spines[:].set_linewidth(0.5)
    wide = float(figure_of(ax).get_size_inches()[0])
    caption = "\n".join(wrapped(line, wide - 0.9) for line in caption.split("\n"))  # 0.9 in: margins of the diagram
    _above(ax, title, caption.splitlines())


def _above(ax: Axes, title: str | None, lines: list[str]) -> None:
    """A title and the lines of a caption above a diagram, at offsets in points."""
    if lines:
        ax.annotate("\n".join(lines), (0.0, 1.0), (0.0, 5.0), xycoords="axes fraction", textcoords="offset points",
                    fontsize=_SMALL, color=FAINT, va="bottom", linespacing=1.3, gid="caption")
    if title:
        ax.set_title(title, loc="left", fontweight="bold", pad=8.0 + 11.0 * len(lines))


def metre_axes(ax: Axes, names: tuple[str, str]) -> None:
    """Equal axes in metres by two ``names``; late ticks get the sizes of the style."""
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlabel(f"{names[0]} [m]", color=FAINT)
    ax.set_ylabel(f"{names[1]} [m]", color=FAINT)
    ax.locator_params(axis="both", nbins=6, steps=[1, 2, 5, 10])
    frame(ax, title=None)


def pale(colour: str, share: float = 0.42) -> tuple[float, float, float]:
    """Red, green and blue of a colour mixed with white, of which ``share`` stays [-].

    It is opaque, so that what lies below does not shine through.
    """
    red, green, blue = (1.0 - share * (1.0 - c) for c in to_rgb(colour))
    return red, green, blue


def round_length(length: float) -> float:
    """Largest of 1, 2, 5 times a power of ten up to a length; 1 for none."""
    if not length > 0.0 or not math.isfinite(length):
        return 1.0
    decade = 10.0 ** math.floor(math.log10(length))  # below: rounding takes no step away that is just reached
    return max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= length * (1.0 + 1e-9))


def seen_at(shift: Array, length: float) -> float:
    """Round factor from 1 on that draws all of ``shift`` within a length [m]."""
    return max(round_length(length / max(float(np.abs(shift).max()), 1e-300)), 1.0)


def force_unit(force: float) -> tuple[str, float]:
    """The unit that fits a force [N], and the size of that unit [N]."""
    # from 999.5 on three digits show 1000
    return next(((unit, size) for unit, size in (("MN", 1e6), ("kN", 1e3)) if abs(force) >= 0.9995 * size), ("N", 1.0))


def force_text(force: float) -> str:
    """A force [N] in words, with a fitting unit."""
    unit, size = force_unit(force)
    return f"{force / size:.3g} {unit}"


def prediction_text(prediction: Any) -> str:
    """Caption of a prediction: multiplier, bound, method, and status if not solved."""
    # a support that gives way is answered by its reaction; with no number at all the status says what there is to say
    settles = prediction.reaction is not None
    silent = math.isnan(prediction.collapse_multiplier) and not settles
    answer = str(prediction.answer) if settles else f"λ = {prediction.collapse_multiplier:.4g}"
    parts = [*([] if silent else [answer, str(prediction.bound)]), str(prediction.method).replace("$", r"\$")]
    rule = prediction.flow_rule  # left out where the name of the method says it already
    if rule and rule.lower() not in prediction.method.lower().replace("_", "-").replace(",", " ").split():
        parts.append(f"{rule} flow rule")
    if prediction.status != "solved":
        parts.append(f"status: {prediction.status}")
    return " · ".join(p for p in parts if p)


def wrapped(text: str, width: float) -> str:
    """Small text broken into lines that fit a width [in]."""
    return textwrap.fill(text, max(int(width / _LETTER), 20)) if text else text
