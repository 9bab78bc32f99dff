"""Which figure belongs to which object: what ``plot()`` and a notebook show."""

from __future__ import annotations

from functools import singledispatch
from io import BytesIO
from typing import Any

from matplotlib.figure import Figure

from limitmason.answers.curve import Curve
from limitmason.answers.results import Prediction
from limitmason.comparison import SideBySide
from limitmason.diagnosis import Confusable, Diagnosis
from limitmason.errors import InputError, NotApplicable
from limitmason.figures.collapse_mechanism import assembly, mechanism
from limitmason.figures.confusion import confusable
from limitmason.figures.diagnosis_panels import diagnosis
from limitmason.figures.load_curves import history_curves, load_displacement
from limitmason.figures.modes import mac_matrix, mode_shape
from limitmason.figures.safety import axle_envelope, load_region
from limitmason.figures.studies import side_by_side, study_lines, varied
from limitmason.figures.tilt import tilt_test
from limitmason.limit import AxleEnvelope, LoadRegion
from limitmason.model import Assembly
from limitmason.study import Table
from limitmason.vibration import Mac, Modes

MANY = 400
"""Blocks beyond which a notebook is shown the words alone: the picture takes seconds."""


@singledispatch
def plot(shown: Any, *which: Any, **options: Any) -> Figure:
    """Figure of ``shown``, an object of this package.

    Parameters
    ----------
    which : what of it is drawn, such as the number of a mode; records and tests leave no choice
    options : of the figure

    Raises
    ------
    InputError
        Where there is no figure of such an object.
    """
    # known by what they have, not by their class: records and tilting tests stand in packages above this one
    if hasattr(shown, "diagram") and not which:
        return history_curves(**shown.diagram(), **options)
    if hasattr(shown, "tilt_deg") and not which:
        return tilt_test(shown, **options)
    given = [*map(repr, which), *options]
    with_them = f" with {', '.join(given)}" if given else ""
    raise InputError(f"there is no figure of a {type(shown).__name__}{with_them}")


@plot.register
def _(shown: Prediction, structure: Assembly | None = None, **options: Any) -> Figure:
    """Collapse mechanism of a prediction, of ``structure`` where it has lost its own."""
    model = shown.structure if structure is None else structure
    if model is None:
        raise InputError("this prediction was read or copied without its assembly: give it, plot(structure=wall)")
    return mechanism(model, shown, **options)


@plot.register
def _(shown: Modes, number: int = 1, **options: Any) -> Figure:
    """Shape of mode ``number``, from 1."""
    return mode_shape(shown, number, **options)


@plot.register
def _(shown: Table, x: str | None = None, **options: Any) -> Figure:
    """Lines of a study over the column ``x``, by default the first that varies."""
    return study_lines(shown, varied(shown, options.get("y", "multiplier")) if x is None else x, **options)


for kind, draw in {
    Assembly: assembly, Curve: load_displacement, SideBySide: side_by_side, Diagnosis: diagnosis, Mac: mac_matrix,
    LoadRegion: load_region, AxleEnvelope: axle_envelope, Confusable: confusable,
}.items():
    plot.register(kind, draw)


def html(shown: Any) -> str:
    """Picture of ``shown`` as SVG, or empty where there is none or it takes long."""
    model = shown.structure if isinstance(shown, Prediction) else shown
    model = shown.system.carrier if isinstance(shown, Modes) else model  # what carries a mode may be no assembly
    if isinstance(model, Assembly) and model.n_blocks > MANY:
        return f"<p>{model.n_blocks} blocks are drawn on demand: .plot(), or lm.view for a scene to turn.</p>"
    if isinstance(shown, Prediction) and (model is None or shown.mechanism is None):
        return ""
    out = BytesIO()
    try:
        plot(shown).savefig(out, format="svg")
    except (InputError, NotApplicable):  # no picture, as of a region of one load, or one too wide for print_style
        return ""
    text = out.getvalue().decode("utf-8")
    return f'<div style="max-width: 48rem">{text[text.index("<svg") :]}</div>'
