"""Modes from measured or simulated motion under unknown white noise: frequency-domain decomposition and SSI.

Sources: Brincker, Zhang and Andersen (2001) for the decomposition of spectra; Peeters and De Roeck (1999) for
covariance-driven stochastic subspace identification.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import eig, svd

from limitmason.arrays import Array, Flags
from limitmason.checks import choice, numbers, positive
from limitmason.checks import count as whole
from limitmason.display.text_table import aligned
from limitmason.errors import InputError, NotConverged
from limitmason.storage.frozen import ReadOnly

Complex = NDArray[np.complex128]

METHODS = ("fdd", "ssi")

# chosen, not derived
_NYQUIST = 0.45  # of the sampling frequency: top of the band by default, a tenth below what samples can tell
_SEGMENTS = 2  # segments of a spectrum at least: the mean of one is the noise itself
_FEWEST = 8  # samples of a segment at least: a peak is told from what lies beside it
_PER_LAG = 8  # samples for each block row at least
_PROMINENCE = 0.7  # natural logarithm by which a peak rises above what is beside it: a factor of two
_FLOOR = 1e-12  # of the largest singular value: lines below are below any noise
_DAMPED = 0.2  # damping ratio that no structure has: poles of more are the noise's
_SAME_FREQUENCY, _SAME_DAMPING = 0.01, 0.1  # parts within which a pole comes back at the next order
_SAME_SHAPE = 0.95  # criterion (MAC) above which it has the shape it had
_RETURNS = 3  # poles that a mode is made of, at least


@dataclass(frozen=True, eq=False)
class Identified(ReadOnly):
    """Modes found in signals, lowest first.

    Parameters
    ----------
    frequency : [Hz], shape (k,)
    damping : ratio to critical [-], shape (k,); NaN where the method gives none
    shape : complex, one component per channel, the largest 1, shape (k, channels)
    spectrum : frequencies [Hz] and first singular value of the spectral matrix there, shape (2, lines)
    method : "fdd" or "ssi"
    warnings : what a user should know
    """

    frequency: Array
    damping: Array
    shape: Complex
    spectrum: Array
    method: str
    warnings: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Table of frequencies and damping ratios, and the warnings."""
        rows = [
            [str(k + 1), f"{f:.4g}", "-" if np.isnan(d) else f"{d:.2%}"]
            for k, (f, d) in enumerate(zip(self.frequency, self.damping, strict=True))
        ]
        return "\n".join([aligned([["mode", "frequency [Hz]", "damping"], *rows], "<>>"), *self.warnings])

    __repr__ = __str__


def identify_modes(
    signals: ArrayLike,
    step: float,
    *,
    method: str = "fdd",
    count: int = 3,
    band: tuple[float, float] | None = None,
    lines: int = 1024,
    order: int = 20,
    lags: int = 30,
) -> Identified:
    """Modes of a linear structure from its motion under white noise that nobody measured.

    Parameters
    ----------
    signals : one column per channel, accelerations or displacements, shape (samples, channels)
    step : time between samples [s]
    method : "fdd" (peaks of the first singular value of the spectra: frequencies and shapes, a first look) or "ssi"
        (covariance-driven subspace identification: damping too)
    count : most modes wanted, those of the most prominent peaks (fdd) or found at most orders (ssi)
    band : lowest and highest frequency [Hz]; up to 90 % of Nyquist's by default
    lines : samples per segment of the spectra; their distance 1 / (lines step) is the resolution of fdd
    order, lags : largest order of the state and number of block rows, of ssi

    Raises
    ------
    InputError
        For signals that are too short, constant or not finite, and options out of range.
    NotConverged
        When no mode is found in the band.

    Notes
    -----
    Closely spaced modes need more channels than modes and long records. Noise that is not white shows as modes of its
    own. Damping of a record of n periods scatters by about sqrt(1 / (2 pi zeta n)).
    """
    y = numbers("signals", signals)
    if y.ndim != 2 or not np.isfinite(y).all():
        raise InputError(f"signals must be finite, one column per channel, got shape {y.shape}")
    positive("step between samples", step, "s")
    count, lines = whole("count", count), whole("lines", lines, _FEWEST)
    order, lags = whole("order", order, least=2), whole("lags", lags, least=2)
    if len(y) < max(_SEGMENTS * lines, _PER_LAG * lags):
        raise InputError(
            f"{len(y)} samples are too few: {_SEGMENTS} segments of {lines} and {_PER_LAG} x {lags} lags are needed"
        )
    choice("method", method, METHODS)
    if lags * y.shape[1] <= order:
        raise InputError(f"order must lie below lags times channels, {lags * y.shape[1]}, got {order!r}")
    y = y - y.mean(axis=0)
    if not (y.std(axis=0) > 0.0).all():
        raise InputError(f"channel {int(np.argmin(y.std(axis=0)))} does not move")
    if band is not None and numbers("band", band).shape != (2,):
        raise InputError(f"band must be a lowest and a highest frequency [Hz], got {band!r}")
    low, high = (0.0, _NYQUIST / step) if band is None else numbers("band", band).tolist()
    if not 0.0 <= low < high <= 0.5 / step:
        raise InputError(f"band must lie between 0 and {0.5 / step:g} Hz, got {band!r}")
    # one unit for all channels: their sizes against each other are the shape
    y = y / y.std()
    spectrum, first, vectors = _spectra(y, step, lines)
    inside = (spectrum >= low) & (spectrum <= high)
    shown = np.array([spectrum, first])
    if method == "fdd":
        return _peaks(spectrum, first, vectors, inside, count, shown)
    return _stable(_subspace(y, step, order, lags), (low, high), count, shown, method)


def _spectra(y: Array, step: float, lines: int) -> tuple[Array, Array, Complex]:
    """First singular value and vector of the spectral matrix, line by line.

    Where one mode governs, the cross spectra of all channels are of rank one: the vector is its shape.

    Parameters
    ----------
    y : signals, over their common standard deviation [-], shape (samples, channels)
    step : between samples [s]
    lines : samples of a segment, over which periodograms are averaged; lines of the spectrum lie 1 / (lines step) apart

    Returns
    -------
    tuple
        Frequencies [Hz], (f,); first singular values [s], (f,); first vectors, complex, (f, channels).
    """
    from scipy.signal import csd  # takes as long to load as the rest of the DEM, which loads this file

    f, matrix = csd(y.T[:, None], y.T[None], fs=1.0 / step, nperseg=lines)
    u, s, _ = np.linalg.svd(np.moveaxis(matrix, 2, 0))
    # scipy's cross spectrum conjugates the first channel, so entry ij is conj(shape_i) shape_j
    return np.asarray(f), s[:, 0], np.conj(u[:, :, 0])


def _peaks(
    f: Array, first: Array, vectors: Complex, inside: Flags, count: int, shown: Array
) -> Identified:
    """Modes at the most prominent peaks of the first singular value.

    At most ``count`` peaks are taken, each at least twice as high as what is beside it. The frequency [Hz] is that of a
    parabola through three lines.

    Parameters
    ----------
    f : lines of the spectrum [Hz], shape (m,)
    first : first singular value at each, shape (m,)
    vectors : its singular vector, shape (m, channels)
    inside : which lines lie within the band, shape (m,)
    count : how many modes at most
    shown : frequencies and first singular value, kept with the answer, shape (2, m)
    """
    from scipy.signal import find_peaks

    # lines without power stay finite
    level = np.log(np.maximum(first, first.max() * _FLOOR))
    # outside the band as low as its lowest line, so that no peak there hides one of the band
    within = np.where(inside, level, level[inside].min() if inside.any() else 0.0)
    at, found = find_peaks(within, prominence=_PROMINENCE)
    # so flattened, the slope of a mode beyond an end of the band looks like a peak: the true level must have one too
    true = (level[at] >= level[at - 1]) & (level[at] >= level[at + 1])
    at, prominence = at[true], found["prominences"][true]
    if not len(at):
        raise NotConverged("no peak of the spectra in the band: is the record long enough and excited there?")
    at = np.sort(at[np.argsort(prominence)[::-1][:count]])
    # vertex of a parabola through the logarithms of three lines, from the middle one in lines; flat ones have none
    a, b, c = level[at - 1], level[at], level[at + 1]
    curvature = a - 2 * b + c
    shift = 0.5 * (a - c) / np.where(curvature == 0.0, -1.0, curvature)
    frequency = f[at] + np.clip(shift, -0.5, 0.5) * (f[1] - f[0])
    warnings = () if len(at) >= count else (f"{len(at)} of {count} modes found in the band",)
    return Identified(
        frequency=frequency, damping=np.full(len(at), np.nan), shape=_scaled(vectors[at]), spectrum=shown, method="fdd",
        warnings=warnings,
    )


class _Poles(NamedTuple):
    """Poles of one order, k of them.

    Frequencies [Hz], (k,), damping ratios [-], (k,), and shapes as rows, (k, channels).
    """

    frequency: Array
    damping: Array
    shape: Complex


class _Returning(NamedTuple):
    """A pole that came back at the next order: frequency [Hz], damping ratio [-] and shape, (channels,)."""

    frequency: float
    damping: float
    shape: Complex


def _subspace(y: Array, step: float, order: int, lags: int) -> list[_Poles]:
    """Poles of every even order, from covariances of a record at several lags.

    It is the covariance-driven stochastic subspace identification.

    Parameters
    ----------
    y : record, shape (n, channels), at time steps ``step`` [s]
    order : largest order
    lags : number of block rows of the Toeplitz matrix
    """
    n, channels = y.shape
    # covariances of the record with itself k steps earlier, without bias
    r = [y[k:].T @ y[: n - k] / (n - k) for k in range(1, 2 * lags)]
    toeplitz = np.block([[r[lags + i - j - 1] for j in range(lags)] for i in range(lags)])
    u, s, _ = svd(toeplitz)
    poles = []
    for size in range(2, order + 1, 2):
        # observability matrix, (lags channels, size): block row i is C A^i, A one time step of a state and C what
        # channels see of it, so that a shift by one block is A
        observed = u[:, :size] * np.sqrt(s[:size])
        a = np.linalg.lstsq(observed[:-channels], observed[channels:], rcond=None)[0]
        value, vector = eig(a)
        poles.append(_continuous(value, observed[:channels] @ vector, step))
    return poles


def _continuous(value: Complex, shape: Complex, step: float) -> _Poles:
    """Poles that oscillate, from the eigenvalues of a system in time steps.

    With mu an eigenvalue of a step, s = ln(mu) / step, f = |s| / (2 pi), zeta = -Re(s) / |s|. Of a conjugate pair the
    pole of positive imaginary part is kept.

    Parameters
    ----------
    value : eigenvalues mu of a step, shape (k,)
    shape : shapes as columns, (channels, k)
    step : time between samples [s]
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.log(np.where(np.abs(value) > 0.0, value, 1e-300)) / step
    keep = rate.imag > 1e-9  # [1/s]: below it is the rounding of a real pole
    rate, shape = rate[keep], shape[:, keep].T
    return _Poles(np.abs(rate) / (2.0 * np.pi), -rate.real / np.abs(rate), shape)


def _stable(poles: Sequence[_Poles], band: tuple[float, float], count: int, shown: Array, method: str) -> Identified:
    """Modes of poles that come back at the next order, gathered by frequency.

    A pole comes back with nearly its frequency, damping and shape. A mode has the medians of its poles; the modes that
    come back most often are taken.

    Parameters
    ----------
    poles : of every order, ascending
    band : lowest and highest frequency [Hz]
    count : how many modes at most
    shown : frequencies and first singular value, kept with the answer, shape (2, lines)
    method : its name, kept with the answer
    """
    kept: list[_Returning] = []
    for before, after in pairwise(poles):
        for f, damping, shape in zip(*after, strict=True):
            if not (band[0] <= f <= band[1] and 0.0 < damping < _DAMPED) or not len(before.frequency):
                continue
            i = int(np.argmin(np.abs(before.frequency - f)))
            was = before.shape[i]
            alike = abs(np.vdot(was, shape)) ** 2 / (np.vdot(was, was).real * np.vdot(shape, shape).real)
            near = abs(before.frequency[i] - f) < _SAME_FREQUENCY * f
            if near and abs(before.damping[i] - damping) < _SAME_DAMPING * damping and alike > _SAME_SHAPE:
                kept.append(_Returning(float(f), float(damping), shape))
    kept.sort(key=lambda pole: pole.frequency)
    # a new group begins where frequencies are farther apart than those of one mode
    ascending = np.array([pole.frequency for pole in kept])
    cuts = [0, *(np.flatnonzero(np.diff(ascending) >= _SAME_FREQUENCY * ascending[1:]) + 1).tolist(), len(kept)]
    groups = [kept[a:b] for a, b in pairwise(cuts) if b - a >= _RETURNS]
    if not groups:
        raise NotConverged("no pole comes back from order to order: is the record long enough and excited in the band?")
    best = sorted(sorted(groups, key=len, reverse=True)[:count], key=lambda group: group[0].frequency)
    frequency = np.array([np.median([pole.frequency for pole in group]) for group in best])
    ratios = np.array([np.median([pole.damping for pole in group]) for group in best])
    # of every group the pole whose frequency is nearest to the median gives the shape
    nearest = [min(group, key=lambda pole: abs(pole.frequency - f)) for group, f in zip(best, frequency, strict=True)]
    shapes = _scaled(np.array([pole.shape for pole in nearest]))
    warnings = () if len(best) >= count else (f"{len(best)} of {count} modes found in the band",)
    return Identified(frequency, ratios, shapes, shown, method, warnings)


def _scaled(shape: Complex) -> Complex:
    """Shapes, (k, channels), over their component of largest size, which becomes 1."""
    largest = np.take_along_axis(shape, np.abs(shape).argmax(axis=1)[:, None], axis=1)
    return np.asarray(shape / largest)
