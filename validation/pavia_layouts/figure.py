"""A layout search drawn: published pairs, the catalogue as a cloud, and the layouts that fit."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from limitmason.figures import style

from .search import INFERRED, LayoutSearch

_MARKERS = ("o", "s", "^", "D", "v", "P", "<", ">", "h")


@style.in_print_style
def layout_search(search: LayoutSearch, *, title: str | None = None, ax: Axes | None = None) -> Figure:
    """Computed pairs of a catalogue of layouts about the published pairs, compatible ones in colour.

    Parameters
    ----------
    search : from ``search_layouts``
    title : heading
    ax : axes to draw on; a new figure when not given

    Returns
    -------
    Figure
        First value along, second up; crosses are published pairs with a box of the tolerance about each. The verdict
        of the permuted control stands under the title.
    """
    figure, ax = style.paper(style.page_width(), 5.0, ax)
    first, second = (search.catalogue[c].astype(float) for c in search.columns)
    published = np.array(list(search.pairs.values()), dtype=float)
    ax.plot(first, second, "o", color="#b9b9b9", markersize=2.6, markeredgewidth=0, zorder=1, gid="catalogue",
            label=f"catalogue, {len(search.catalogue)} layouts")
    ratio = published[:, 0] / published[:, 1]
    for k, (name, (x, y)) in enumerate(search.pairs.items()):
        colour, marker = style.SERIES[k % len(style.SERIES)], _MARKERS[k % len(_MARKERS)]
        numbers = list(search.compatible[name])
        half = search.tolerance * np.array([x, y])
        ax.add_patch(
            Rectangle((x - half[0], y - half[1]), *(2.0 * half), fill=False, edgecolor=colour, linewidth=0.7, zorder=2,
                      gid="tolerance")
        )
        label = f"{name}: {len(numbers)} layout{'s' if len(numbers) != 1 else ''}"
        ax.plot(first[numbers], second[numbers], marker, color=colour, markersize=4.6, linestyle="none",
                markeredgecolor="white", markeredgewidth=0.3, zorder=3, gid="compatible", label=label)
        ax.plot([x], [y], "x", color=style.BLACK, markersize=5.5, markeredgewidth=1.1, zorder=4, gid="published")
        # outside the band of the pairs: above it for a small ratio, below it for a large one
        left = ratio[k] <= np.median(ratio)
        ax.annotate(name, (x, y) + half * ((-1, 1) if left else (1, -1)), (-2, 0) if left else (2, 0),
                    textcoords="offset points", ha="right" if left else "left", va="center", fontsize=style._SMALL,
                    color=colour, zorder=5)
    ax.plot([], [], "x", color=style.BLACK, markersize=5.5, markeredgewidth=1.1, linestyle="none",
            label=f"published, box ± {100 * search.tolerance:g} %")
    low, high = published.min(axis=0), published.max(axis=0)
    margin = 0.12 * (high - low) + 1.5 * search.tolerance * high
    ax.set_xlim(low[0] - margin[0], high[0] + margin[0])
    ax.set_ylim(low[1] - margin[1], high[1] + margin[1])
    ax.set_xlabel(f"collapse multiplier λ [-], {search.columns[0]}")
    ax.set_ylabel(f"collapse multiplier λ [-], {search.columns[1]}")
    ax.grid(linewidth=0.3, color="#dddddd")
    ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), fontsize=style._SMALL, frameon=False)
    short = search.verdict.split(":")[0]
    style.frame(ax, title, f"layouts {INFERRED}\n{short} (permuted control)")
    return figure
