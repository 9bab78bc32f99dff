"""A structure before and after strengthening: both mechanisms with their multipliers, and both capacity curves."""

from __future__ import annotations

import textwrap
from typing import Any

from matplotlib.figure import Figure

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.errors import InputError
from limitmason.figures import style
from limitmason.figures.moving_blocks import mechanism
from limitmason.model import Assembly


@style.in_print_style
def before_and_after(
    before: tuple[Assembly, Prediction],
    after: tuple[Assembly, Prediction],
    *,
    curves: tuple[Curve, Curve] | None = None,
    title: str | None = None,
    names: tuple[str, str] = ("before", "after"),
    **options: Any,
) -> Figure:
    """Mechanisms without and with the ties of a structure side by side.

    It shows what the multiplier gains.

    Parameters
    ----------
    before, after : assembly and prediction, each with a mechanism
    curves : capacity curves of both (:func:`limitmason.pushover`), drawn below in multipliers, with those of the
        predictions as levels; none by default
    title : heading
    names : over the two drawings
    options : of :func:`mechanism` for both, as ``view``, ``scale`` and the direction of view

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        When a prediction has no mechanism, or one of another assembly, for curves that are not in multipliers over
        metres, and for ``ax``, ``caption`` or ``legend`` here.
    """
    for name in ("ax", "caption", "legend"):
        if name in options:
            raise InputError(f"{name} is not an option of before_and_after, which lays out two drawings of its own")
    for curve in curves or ():
        if (curve.load_unit, curve.displacement_unit) != ("-", "m"):
            raise InputError(
                f"curves must be multipliers over metres, got {curve.load_unit!r} over {curve.displacement_unit!r}: "
                "give curves of lm.pushover with live loads"
            )
    below = 2.2 if curves is not None else 0.0  # inches
    height = 3.6 + below
    style.needs_a_page("before_and_after")
    figure = style.blank(style.FULL_WIDTH, height)

    def up(share: float) -> float:
        """Height of something in the upper part, whose place is a share of its 3.6 inches."""
        return (below + 3.6 * share) / height

    handles: dict[str, Any] = {}
    for k, ((model, prediction), name) in enumerate(zip((before, after), names, strict=True)):
        ax = figure.add_axes((0.09 + 0.5 * k, up(0.2), 0.39, 0.6 * 3.6 / height))
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
    figure.text(0.02, up(0.97), title or "", fontsize=9.5, fontweight="bold", va="top", gid="title")
    caption = textwrap.fill(" · ".join(t for t in (gain, bounds) if t), 110)
    figure.text(0.02, up(0.915), caption, fontsize=7.5, color=style.FAINT, va="top", gid="caption")
    if handles:
        figure.legend(
            handles.values(), handles.keys(), loc="lower center", bbox_to_anchor=(0.5, up(0.0)),
            ncols=min(len(handles), 4), fontsize=7.5,
        )  # fmt: skip
    if curves is not None:
        ax = figure.add_axes((0.09, 0.45 / height, 0.89, (below - 0.55) / height))
        rows = zip(curves, (before, after), names, style.SERIES, strict=False)
        for curve, (_, prediction), name, colour in rows:
            ax.plot(1e3 * curve.displacement, curve.load, color=colour, label=name, gid="capacity curve")
            ax.axhline(prediction.collapse_multiplier, color=colour, linewidth=0.6, linestyle="--")
        ax.axhline(0.0, color=style.FAINT, linewidth=0.5, zorder=0.5)
        ax.set_xlabel("control displacement [mm]", fontsize=7.5)
        ax.set_ylabel("multiplier λ [-]", fontsize=7.5)
        ax.tick_params(labelsize=7.0)
        ax.legend(loc="best", fontsize=7.0, title="capacity curves; dashed: limit analysis", title_fontsize=7.0)
    return figure
