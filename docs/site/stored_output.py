"""What an example prints and draws, held against what the gallery shows of it.

The tests run every example anyway and call :func:`differences`. Words and whole numbers must be the same, other
numbers to a unit of the last digit shown, and pictures look the same. Where processor or compiler are others than those
of the stored output, :data:`ELSEWHERE` is the tolerance; pictures are looked at where the same package draws them.
"""

import re
from pathlib import Path

import llvmlite.binding
import matplotlib
import numba
import numpy as np
from PIL import Image

STORED_WITH = Path(__file__).with_name("stored_with.txt")
"""What all stored output was made with: the drawing package, the compiler and the processor, a line each."""

WIDTH, COLOURS = 900, 64
"""Of pictures in the gallery: at most so many pixels wide, of so many colours."""

ELSEWHERE = 0.02
"""Relative tolerance of all numbers, whole ones too, on another processor or with another compiler: as wide as the
brackets of the DEM, whose sums are then added in another order."""

BRITTLE = ("bnw_zoned_walls", "brick_panel", "minho_cracking_stone")
"""Examples whose joints or units break one after the other: the last bit of a sum decides what breaks next, and peaks
move by several per cent. They are compared only where they were stored."""

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


def same_number(a: str, b: str, tolerance: float = 0.0) -> bool:
    """Whether two numbers as written agree to a unit of the finer last digit, or to a relative tolerance."""
    x, y = float(a), float(b)
    largest = max(abs(x), abs(y))
    if largest < ROUND_OFF:
        return True
    # zeros at the end are not always written: 0.5 may be 0.49999 next time, and 1 may be 0.999
    unit = min((u for u in (last_digit(a), last_digit(b)) if u > 0.0), default=0.0)
    return abs(x - y) <= tolerance * largest + unit * (1.0 + 1e-9)


def differences(printed: str, stored: str, name: str = "") -> list[str]:
    """Lines that differ in more than rounding, each as printed now and as stored; an empty list where none does.

    Parameters
    ----------
    printed, stored : texts
    name : of the example, where it tells what is of the machine
    """
    tolerance = 0.0 if computed_here() else ELSEWHERE
    now, then = (
        [re.sub(MACHINES.get(name, r"\s+$"), "", line) for line in text.rstrip().splitlines()]
        for text in (printed, stored)
    )
    if len(now) != len(then):
        return [f"{len(now)} lines now, {len(then)} stored"]
    found = []
    for a, b in zip(now, then, strict=True):
        (words_a, numbers_a), (words_b, numbers_b) = words_and_numbers(a), words_and_numbers(b)
        alike = words_a == words_b and all(map(same_number, numbers_a, numbers_b, [tolerance] * len(numbers_a)))
        if not alike:
            found.append(f"now:    {a}\nstored: {b}")
    return found


def reduced(path: Path) -> Image.Image:
    """A picture as the gallery keeps it."""
    picture = Image.open(path).convert("RGB")
    if picture.width > WIDTH:
        picture = picture.resize((WIDTH, round(picture.height * WIDTH / picture.width)), Image.Resampling.LANCZOS)
    return picture.quantize(COLOURS)


def unlikeness(drawn: Image.Image, stored: Image.Image, cells: int = 48) -> float:
    """How far a picture is from a stored one: largest mean difference of colour in a cell of a square grid [0, 1]."""
    grids = [
        np.asarray(p.convert("RGB").resize((cells, cells), Image.Resampling.BOX), float) for p in (drawn, stored)
    ]
    return float(abs(grids[0] - grids[1]).mean(axis=2).max() / 255.0)


def made_with() -> list[str]:
    """Drawing package, compiler and processor, as :data:`STORED_WITH` keeps them."""
    processor = llvmlite.binding.get_host_cpu_name()
    return [f"matplotlib {matplotlib.__version__}", f"numba {numba.__version__}", f"processor {processor}"]


def drawn_here() -> bool:
    """Whether the stored pictures were drawn by the version of the drawing package that is installed here."""
    return STORED_WITH.read_text(encoding="utf-8").splitlines()[0] == made_with()[0]


def computed_here() -> bool:
    """Whether the stored numbers are of this compiler and this processor."""
    return STORED_WITH.read_text(encoding="utf-8").splitlines()[1:] == made_with()[1:]
