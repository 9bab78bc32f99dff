"""A structure before and after strengthening, both mechanisms in one figure with their multipliers."""

from __future__ import annotations

import textwrap
from typing import Any

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.mechanism import mechanism
from limitmason.model import Assembly
from limitmason.results import Prediction


@style.in_print_style
def before_and_after(
    before: tuple[Assembly, Prediction],
    after: tuple[Assembly, Prediction],
    *,
    title: str | None = None,
    names: tuple[str, str] = ("before", "after"),
    **options: Any,
) -> Figure:
    """Mechanisms of a structure without and with its ties side by side, and what the multiplier gains.

    Parameters
    ----------
    before, after : assembly and prediction, each with a mechanism
    title : heading
    names : over the two drawings
    options : of :func:`mechanism` for both, as ``view``, ``scale`` and the direction of view

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        When a prediction has no mechanism, or one of another assembly, and for ``ax``, ``title`` or ``caption`` here.
    """
    for name in ("ax", "caption", "legend"):
        if name in options:
            raise InputError(f"{name} is not an option of before_and_after, which lays out two drawings of its own")
    figure = Figure(figsize=(style.FULL_WIDTH, 3.6), dpi=200)
    FigureCanvasAgg(figure)
    handles: dict[str, Any] = {}
    for k, ((model, prediction), name) in enumerate(zip((before, after), names, strict=True)):
        ax = figure.add_axes((0.09 + 0.5 * k, 0.2, 0.39, 0.6))
        heading = f"{name}: λ = {prediction.collapse_multiplier:.4g}"
        mechanism(model, prediction, ax=ax, title=heading, caption=False, **options)
        legend = ax.get_legend()
        if legend is not None:
            for handle, label in zip(legend.legend_handles, legend.get_texts(), strict=True):
                handles.setdefault(label.get_text(), handle)
            legend.remove()
        ax.locator_params(axis="x", nbins=4)
    first, second = (p.collapse_multiplier for _, p in (before, after))
    gain = f"× {second / first:.3g}" if first > 0.0 else ""
    bounds = " · ".join(dict.fromkeys(str(p.bound) for _, p in (before, after)))
    figure.text(0.02, 0.97, title or "", fontsize=9.5, fontweight="bold", va="top", gid="title")
    caption = textwrap.fill(" · ".join(t for t in (gain, bounds) if t), 110)
    figure.text(0.02, 0.915, caption, fontsize=7.5, color=style.FAINT, va="top", gid="caption")
    if handles:
        figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=min(len(handles), 4), fontsize=7.5)
    return figure
