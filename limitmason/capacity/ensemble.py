"""What joints that do not quite fit do to a capacity curve: paths from random gaps, and how far their loads spread.

Below psi = phi the load at which a structure first loses equilibrium depends on the self-stress it starts from, and
gaps of a ten-thousandth of a block reach any. The load that its mechanism still carries after a displacement of a tenth
of the thickness depends on them far less.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.arrays import Array
from limitmason.capacity.analysis import finds_contacts_anew, followed_in, whole_pushover
from limitmason.capacity.contacts import points_of_path
from limitmason.capacity.controls import as_one_assembly, control_row, with_moving_support
from limitmason.capacity.refusals import refuse
from limitmason.capacity.result import PushoverCurve
from limitmason.checks import count, listener, positive
from limitmason.deformable.levels import RIGID
from limitmason.display.progress import reached, watched
from limitmason.display.text_table import aligned
from limitmason.errors import InputError
from limitmason.mechanics.contact_points import ContactPoints
from limitmason.model.assembly import Assembly
from limitmason.model.block import Block
from limitmason.model.load import Loads
from limitmason.model.model_call import of_model
from limitmason.storage.frozen import ReadOnly

GOES_ON = 0.1
"""Displacement of the control after which a load counts as sustained, over the smallest block dimension [-]."""

_ROUNDING = 1e-9  # relative: widths of a block that differ by less are equal

SETTLES = 10.0
"""Displacement over the gap within which a load that fell is carried again, so that nothing was lost [-]."""


def thickness(assembly: Assembly) -> float:
    """The smallest dimension of a free block, however it is turned [m]."""
    return min(_least_width(b) for b, fixed in zip(assembly.blocks, assembly.fixed, strict=True) if not fixed)


def _least_width(block: Block) -> float:
    """Least extent of a block along the axes of space and the normals of its faces [m]."""
    least = float(np.ptp(block.vertices, axis=0).min())
    for part in block.parts:
        for face in part.faces:
            corners = part.vertices[list(face)] - part.vertices[face[0]]
            normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
            width = float(np.ptp(block.vertices @ normal)) / float(np.linalg.norm(normal))
            # of a block along the axes nothing but rounding is less
            least = width if width < (1.0 - _ROUNDING) * least else least
    return least


class Spread(NamedTuple):
    """Median and 5 and 95 % quantiles of a sample, and how many paths had a value."""

    median: float
    low: float
    high: float
    paths: int


@dataclass(frozen=True)
class Ensemble(ReadOnly):
    """First loss and sustained load of paths from random gaps.

    A path with a step that its certificate refuses has neither.

    Parameters
    ----------
    first_loss : load at which every path first loses equilibrium, shape (paths,); NaN where it has none. A load is the
        multiplier [-], or the force of a support that moves [N]
    sustained : load after a tenth of the smallest block dimension, shape (paths,); NaN where it has none
    status : how every path ended
    curves : load against displacement of the control [m], a curve per path
    """

    first_loss: Array
    sustained: Array
    status: tuple[str, ...]
    curves: tuple[Curve, ...] = ()

    def __str__(self) -> str:
        """Median and 5 and 95 % quantiles of both loads."""
        rows = [["", "median", "5 %", "95 %", "spread", "paths"]]
        for name, s in (("first loss", self.spread_of_first_loss), ("sustained", self.spread_of_sustained)):
            wide = f"{100.0 * (s.high - s.low) / abs(s.median):.1f} %" if s.paths and s.median else "-"
            rows.append(
                [name, f"{s.median:.4f}", f"{s.low:.4f}", f"{s.high:.4f}", wide, f"{s.paths} of {len(self.status)}"]
            )
        return aligned(rows, "<>>>>>")

    @property
    def spread_of_first_loss(self) -> Spread:
        """Of the load at which equilibrium is first lost."""
        return _spread(self.first_loss)

    @property
    def spread_of_sustained(self) -> Spread:
        """Of the load after a tenth of the smallest block dimension."""
        return _spread(self.sustained)


@of_model
@watched("random gaps")
def imperfection_ensemble(
    assembly: Assembly,
    loads: Loads,
    *,
    gap: float = 1e-4,
    samples: int = 20,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
    **settings: Any,
) -> Ensemble:
    """Capacity curves of a structure whose joints have random gaps.

    Every joint is open by a plane over its face, g (max(u0, 0) + u1 x + u2 y) plus g times the largest |u1 x + u2 y|,
    so that no point overlaps. Each u is uniform in -1 .. 1, and x, y are over half the extent of the face: faces are
    flat and do not quite fit. Blocks settle under the dead load.
    The first loss of equilibrium is the first load that, once it falls, is not carried again within ten gaps: blocks
    that come down through their gaps let it fall and recover on the way. With points at the corners alone a block that
    rests on one of them turns about it at next to no load: take contact_model="grid".

    Parameters
    ----------
    assembly, loads : the problem; the live loads are followed in their own sense, whatever the control
    gap : g over the median block size [-]
    samples : number of paths
    seed : of the gaps; the same seed gives the same paths, and the first of 40 are those of 20
    progress : called with a line per path
    settings : of :func:`pushover`, without ``to``, ``gaps`` and ``start``

    Raises
    ------
    InputError
        For gaps or numbers of samples that are not positive, and settings that are chosen here.
    """
    gap, samples, seed = positive("gap", gap), count("samples", samples), count("seed", seed, least=0)
    for name in ("to", "gaps", "start"):
        if name in settings:
            raise InputError(f"{name} is chosen by the ensemble: leave it out")
    listener("progress", progress, "a line of text")
    refuse(assembly)
    size = float(np.median(np.cbrt(assembly.arrays.volume[~assembly.fixed])))
    reach = GOES_ON * thickness(assembly)
    # the model as the paths will have it, and its contact points, for whose places gaps are drawn
    model, its_loads, control = as_one_assembly(assembly, loads, settings.get("control", "live"))
    model, its_loads, _ = with_moving_support(model, its_loads, control, reach)
    placed = {k: settings[k] for k in ("contact_model", "grid") if k in settings}
    blocks = settings.get("blocks", RIGID)
    anew = finds_contacts_anew(model, blocks, settings.get("contacts"))
    plane, _ = followed_in(model, its_loads, blocks, settings.get("stress"), anew=anew)
    points, _ = points_of_path(model, plane, **placed)
    # the load is followed: where it pushes the controlled block against the axis, that goes the other way
    free = ~model.held
    _, ratio = control_row(model, control, np.eye(6), free, np.where(free, its_loads.live, 0.0))
    to = float(np.copysign(reach, ratio))
    first, sustained, status, curves = [], [], [], []
    for k in range(samples):
        reached(k / samples, f"path {k + 1} of {samples}", share=1.0 / samples)
        gaps = gap * size * _planes(model, points, np.random.default_rng([seed, k]))
        curve = whole_pushover(assembly, loads, gaps=gaps, to=to, **settings)
        sound = all(c.accepted for c in curve.certificates)
        goes_on = sound and abs(curve.displacement[-1]) >= (1.0 - 1e-6) * reach  # but for rounding
        first.append(_lost(curve, SETTLES * gap * size) if sound else np.nan)
        sustained.append(float(curve.load[-1]) if goes_on else np.nan)  # paths end at the displacement asked for
        status.append(str(curve.status))
        u, load, unit = curve.displacement, curve.load, curve.load_unit
        curves.append(Curve(u, load, load_unit=unit, label=f"path {k + 1}", status=curve.status))
        if progress is not None:
            progress(f"path {k + 1} of {samples}: first loss {first[-1]:.5f}, sustained {sustained[-1]:.5f}")
    return Ensemble(np.array(first), np.array(sustained), tuple(status), tuple(curves))


def _lost(curve: PushoverCurve, within: float) -> float:
    """The first loss of a path [-], NaN without one.

    Where nothing falls it is the load of the plateau on which the path ends.

    Parameters
    ----------
    curve : the path
    within : displacement in which a load that fell may be carried again [m]
    """
    value, point = first_loss(curve.displacement, curve.load, within), curve.first_limit_point
    ends_on_plateau = point is not None and curve.load[-1] >= point.load
    return point.load if np.isnan(value) and point is not None and ends_on_plateau else value


def first_loss(displacement: Array, load: Array, within: float) -> float:
    """The first load that falls and is not carried again within a displacement, or NaN where there is none.

    Parameters
    ----------
    displacement, load : of a path, in its order [m], [-], shape (n,)
    within : [m]
    """
    for k in np.flatnonzero(np.diff(load) < 0.0):
        again = np.flatnonzero(load[k + 1 :] >= load[k])
        if not len(again) or abs(displacement[k + 1 + again[0]] - displacement[k]) > within:
            return float(load[k])
    return float("nan")


def _planes(assembly: Assembly, points: ContactPoints, rng: np.random.Generator) -> Array:
    """Openings of the points by a random plane per joint, none negative, over the gap g [-], shape (m,).

    A plane is a uniform opening, cut at 0 so that about half of the joints have none, and two tilts, each drawn from
    -1 to 1 over half the joint.

    Parameters
    ----------
    points : contact points, those of one joint one after another
    rng : random numbers, three for every joint of the assembly
    """
    x = assembly.arrays
    out = np.zeros(points.count)
    draws = rng.uniform(-1.0, 1.0, (len(x.area), 3))
    first = np.flatnonzero(np.diff(points.interface, prepend=-1))
    for rows in np.split(np.arange(points.count), first[1:]):
        k = int(points.interface[rows[0]])
        from_centre = points.position[rows] - x.centre[k]
        along = np.stack([from_centre @ x.tangent_1[k], from_centre @ x.tangent_2[k]], axis=1)
        # over half the joint's extent; along a side on which all points lie at the centre there is no tilt
        along = along / np.maximum(np.abs(along).max(axis=0), 1e-12 + 1e-9 * np.abs(along).max())
        out[rows] = np.maximum(draws[k, 0], 0.0) + along @ draws[k, 1:] + np.abs(along @ draws[k, 1:]).max()
    return out


def _spread(values: Array) -> Spread:
    """Median, 5 and 95 % quantiles of the values that are finite, and how many these are."""
    known = values[np.isfinite(values)]
    if not len(known):
        return Spread(median=np.nan, low=np.nan, high=np.nan, paths=0)
    low, median, high = np.quantile(known, (0.05, 0.5, 0.95))
    return Spread(float(median), float(low), float(high), len(known))
