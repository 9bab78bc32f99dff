"""Ambient vibration test: white noise at the base, modes from the record."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from dem.contact.near import on_ground
from dem.stages.history import History
from limitmason.checks import count, instance, not_negative, positive
from limitmason.errors import InputError
from limitmason.model.base_motion import BaseMotion
from limitmason.vibration.identification import Identified, identify_modes

_AXES = {"x": 0, "y": 1, "z": 2}
_EVEN = 1e-6  # of a step: samples as far apart as that differ in rounding alone [-]
_SHORTEST = 0.1  # of the shortest period of a noise: time between its samples by default [-]; chosen


def white_noise(
    duration: float,
    *,
    rms: float,
    highest: float = 30.0,
    lowest: float = 0.1,
    direction: tuple[float, float, float] = (1.0, 1.0, 0.0),
    sample_step: float | None = None,
    seed: int = 0,
) -> BaseMotion:
    """Base motion of equal power between two frequencies, which ends at rest.

    Parameters
    ----------
    duration : [s]
    rms : root mean square of the acceleration [m/s2]; small enough that no joint opens
    highest, lowest : limits of the band [Hz]
    direction : of the motion, of any length, shape (3,)
    sample_step : [s]; a tenth of the shortest period by default
    seed : of the random phases

    Raises
    ------
    InputError
        For numbers that are not positive, a band without a whole wave in the record, and samples too far apart for it.
    """
    given = {"duration": duration, "rms": rms, "highest": highest, "lowest": lowest}
    for name, value in given.items():
        positive(f"white noise: {name}", value)
    if not lowest < highest:
        raise InputError(f"white noise: lowest must be below highest, got {lowest!r} and {highest!r} Hz")
    count("white noise: seed", seed, least=0)
    step = _SHORTEST / highest if sample_step is None else positive("white noise: sample_step", sample_step, "s")
    n = max(round(duration / step), 1)  # less than a sample is too short for any wave
    if not 0.5 / step > highest:  # Nyquist's frequency
        raise InputError(f"sample_step {step:g} s is too long for {highest:g} Hz")
    frequency = np.fft.rfftfreq(n, step)
    phase = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(frequency))
    inside = (frequency >= lowest) & (frequency <= highest)
    if not inside.any():
        raise InputError(f"{duration:g} s are too short: no wave from {lowest:g} to {highest:g} Hz comes whole in them")
    # whole periods of every wave in the record: velocity ends where it began
    record = np.fft.irfft(np.where(inside, np.exp(1j * phase), 0.0), n)
    # it comes and goes within half a period of the lowest wave, and keeps no velocity by that
    fade = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) * step * lowest * 2.0)
    record = record * fade
    record -= fade * (record.sum() / fade.sum())
    record[[0, -1]] = 0.0
    record *= rms / record.std()
    return BaseMotion(acceleration=tuple(record), sample_step=step, direction=direction, after="hold")


def identify(
    history: History,
    channels: Sequence[tuple[int | str, str]],
    *,
    skip: float = 0.0,
    **options: Any,
) -> Identified:
    """Modes of a simulated structure from its motion against its base.

    Parameters
    ----------
    history : of a dynamic run with a :class:`BaseMotion`, see :func:`white_noise`. Only its longest stretch of samples
        at equal steps in time is read
    channels : blocks and directions, ("stone 3", "y"), whose centroids' displacements are the signals
    skip : time that is left out at the beginning of this stretch [s], not of the whole history
    options : method, count, band and others of :func:`limitmason.vibration.identification.identify_modes`

    Returns
    -------
    Identified

    Raises
    ------
    InputError
        For a history that is not dynamic, too short or not evenly sampled, a negative ``skip`` and unknown channels.

    Notes
    -----
    Relative displacements carry the low modes best. The amplitude decides what is identified: joints that open or
    slide on the way make a softer structure.
    """
    if instance("history", history, History).state.mode != "dynamic":
        raise InputError("identification needs a dynamic run: simulate(..., mode='dynamic')")
    not_negative("skip", skip)
    if any(isinstance(channel, str) or np.shape(channel) != (2,) for channel in channels):
        raise InputError(f"channels: give pairs of a block and a direction, ('stone 3', 'y'), got {channels!r}")
    if not channels:
        raise InputError("give at least one channel, such as ('stone 3', 'y')")
    assembly = history.assembly
    time = np.asarray(history.scalars["time"])
    gaps = np.diff(time)
    if len(gaps) < 2:
        raise InputError("the history has too few samples")
    step = float(np.median(gaps))
    even = np.abs(gaps - step) < _EVEN * step
    # the longest stretch of equal gaps, as the ends of stages are sampled too: stretches begin and end at ``edges``
    edges = np.flatnonzero(np.diff(np.concatenate([[False], even, [False]]).astype(int)))
    first, last = max(zip(edges[::2], edges[1::2], strict=True), key=lambda e: e[1] - e[0], default=(0, 0))
    # sampled by time a run has few equal gaps in a row: they must be most of their stage
    stage = history.scalars["stage"]
    if 2 * (last - first) < np.count_nonzero(stage == stage[last]):
        raise InputError(
            f"samples {gaps.min():.3g} to {gaps.max():.3g} s apart are not evenly spaced: simulate with sample= a "
            "whole number of steps"
        )
    rows = slice(first + int(np.ceil(skip / step)), last + 1)
    # all held blocks move with the ground: the first stands for it
    held = np.flatnonzero(on_ground(assembly))
    base = history.displacement_of(int(held[0]))[rows] if len(held) else 0.0
    signals = []
    for block, axis in channels:
        if str(axis) not in _AXES:
            raise InputError(f"channel ({block!r}, {axis!r}): the direction must be 'x', 'y' or 'z'")
        moved = history.displacement_of(block)[rows] - base
        signals.append(moved[:, _AXES[axis]])
    return identify_modes(np.column_stack(signals), step, **options)
