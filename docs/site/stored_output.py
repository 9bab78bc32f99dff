"""What an example prints and draws, held against what the gallery shows of it.

The tests run every example anyway and call :func:`differences`. Words and whole numbers must be the same, other
numbers to a unit of the last digit shown, and pictures look the same. With another processor, compiler or solver than
those of the stored output sums are added in another order, and counts, places of flat peaks and brittle sequences move:
there nothing is compared.
"""

import os
import re
from importlib.metadata import version
from pathlib import Path

import llvmlite.binding
import numpy as np
from PIL import Image

STORED_WITH = Path(__file__).with_name("stored_with.txt")
"""What all stored output was made with: packages that draw, compile and solve, and the processor, a line each."""

PACKAGES = ("matplotlib", "numba", "numpy", "scipy", "clarabel", "highspy", "scikit-fem")

WIDTH, COLOURS = 900, 64
"""Of pictures in the gallery: at most so many pixels wide, of so many colours."""

MACHINES: dict[str, str] = {"three_theories_one_wall": r"(?<= solved) +[\d.]+"}
"""What in an example's lines is of the machine that ran it and not compared: the seconds that each theory took."""

ROUND_OFF = 1e-6
"""Two numbers that are both smaller say nothing but that something is met: residuals, gaps, unbalances."""

ALIKE = 0.004
"""Largest :func:`unlikeness` of two drawings of one figure by the same package: about one grey level in a cell."""

_NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?(?!\w)")
_FILL = re.compile(r"\s+|-{2,}")


def words_and_numbers(line: str) -> tuple[list[str], list[str]]:
    """The words of a line between its numbers, without what only aligns columns, and the numbers as written."""
    return [_FILL.sub(" ", part).strip() for part in _NUMBER.split(line)], _NUMBER.findall(line)


def last_digit(number: str) -> float:
    """A unit of the last digit of a number as written; 0 for a whole number, which counts something."""
    mantissa, _, power = number.partition("e")
    if not power and "." not in mantissa:
        return 0.0
    return float(10.0 ** (int(power or 0) - len(mantissa.partition(".")[2])))


def same_number(a: str, b: str) -> bool:
    """Whether two numbers as written agree to a unit of the finer last digit."""
    x, y = float(a), float(b)
    if max(abs(x), abs(y)) < ROUND_OFF:
        return True
    # zeros at the end are not always written: 0.5 may be 0.49999 next time, and 1 may be 0.999
    unit = min((u for u in (last_digit(a), last_digit(b)) if u > 0.0), default=0.0)
    return abs(x - y) <= unit * (1.0 + 1e-9)


def differences(printed: str, stored: str, name: str = "") -> list[str]:
    """Lines that differ in more than rounding, each as printed now and as stored; an empty list where none does.

    Parameters
    ----------
    printed, stored : texts
    name : of the example, where it tells what is of the machine
    """
    now, then = (
        [re.sub(MACHINES.get(name, r"\s+$"), "", line) for line in text.rstrip().splitlines()]
        for text in (printed, stored)
    )
    if len(now) != len(then):
        return [f"{len(now)} lines now, {len(then)} stored"]
    found = []
    for a, b in zip(now, then, strict=True):
        (words_a, numbers_a), (words_b, numbers_b) = words_and_numbers(a), words_and_numbers(b)
        alike = words_a == words_b and all(map(same_number, numbers_a, numbers_b))
        if not alike:
            found.append(f"now:    {a}\nstored: {b}")
    return found


def reduced(path: Path) -> Image.Image:
    """A picture as the gallery keeps it."""
    picture = Image.open(path).convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    # an octree keeps the few dots of a thin coloured line, which the default, a median cut, turns brown
    return picture.quantize(COLOURS, method=Image.Quantize.FASTOCTREE)


def unlikeness(drawn: Image.Image, stored: Image.Image, cells: int = 48) -> float:
    """How far a picture is from a stored one: largest mean difference of colour in a cell of a square grid [0, 1]."""
    grids = [
        np.asarray(p.convert("RGB").resize((cells, cells), Image.Resampling.BOX), float) for p in (drawn, stored)
    ]
    return float(abs(grids[0] - grids[1]).mean(axis=2).max() / 255.0)


def made_with() -> list[str]:
    """Packages and processor, as :data:`STORED_WITH` keeps them."""
    return [*(f"{name} {version(name)}" for name in PACKAGES), f"processor {llvmlite.binding.get_host_cpu_name()}"]


def made_here() -> bool:
    """Whether the stored output is of the packages and the processor that are here, and of blocks that are not moved.

    The lane ``--jitter`` moves them by 1e-12 m: residuals, which are printed, are then of that size.
    """
    if os.environ.get("LIMITMASON_JITTER"):
        return False
    return STORED_WITH.read_text(encoding="utf-8").splitlines() == made_with()
