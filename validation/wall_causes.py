"""Causes of what block models of measured walls get wrong, and their effect on force, stiffness, cracking and mode.

A :class:`WallModel` is what ``limitmason.diagnosis.Study`` calls: a wall of ``modern-walls`` in, its quantities out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from limitmason.answers.results import FlowRule
from limitmason.causes.cause import Cause
from limitmason.comparison.wall_ladder import formulas_force
from limitmason.comparison.wall_modes import rocking_force
from limitmason.errors import InputError
from limitmason.experiments import registry
from limitmason.experiments.experiment import Experiment
from limitmason.experiments.modern_walls import (
    FILLED,
    HELD,
    MODELS,
    NAME,
    axial_force,
    moduli,
    shear_span,
    units_per_course,
    value,
)
from limitmason.experiments.modern_walls.inputs import CODE, inputs_of
from limitmason.experiments.source_folder import read_table
from limitmason.limit.analysis import limit_analysis
from limitmason.study.memo import Memo

FORCE, MODE, STIFFNESS, CRACK = "peak", "failure mode: rocks", "stiffness", "drift at first crack"
HOLLOW = ("HC",)
ROCKING = 0.9, 0.1
"""Force over rocking force at which a wall rocks as likely as not, and the spread of that; assumed, not fitted."""

BLOCKS = 180
"""Most units of the walls on which the effect of a cause is computed: larger units of the same shape stand for the
printed ones."""

SHEAR_FACTOR = 1.2  # of a rectangle
SECANT = 0.7
"""Share of the largest force at which the secant of the bilinear curves is taken; EN 1998-1 and common practice."""

MODULUS_AT = 1.0 / 3.0  # of fc, stress at which E is read: EN 1052-1

STATIONS = 400  # along the height


@cache
def first_alike(wall: str) -> str:
    """The first wall of the table with the same campaign and inputs: both have one prediction."""
    rows = read_table(NAME, "walls.csv").rows
    known = {r["specimen"]: {k: v for k, v in r.items() if k not in ("specimen", "test_unit", "responses", "source")}
             for r in rows}
    return next(name for name, row in known.items() if row == known[wall])


def stiffness(test: Experiment, moduli_share: float = 1.0, opens: float = 0.0) -> float:
    """Elastic force over drift of a wall between rigid ends, gross section, on the way to one that opens [kN/%].

    From the moment V (a H - z) with a = H0 / H, uncracked: delta / V = H^3 / (E I) (a / 2 - 1 / 6) + 1.2 H / (G A).
    Sections without tension: curvature 2 N / (E t x^2), x = 3 (L / 2 - M / N), where M > N L / 6; the secant at
    ``SECANT`` of the smallest of the four formulas.

    Parameters
    ----------
    moduli_share : of E and G
    opens : share of the way, in ln K, to sections without tension
    """
    row = test.row
    length, height, thickness = (float(row[k]) for k in ("L", "H", "t"))
    modulus, shear = moduli(test)
    span, axial = shear_span(test), axial_force(test)
    bending = height**3 / (modulus * thickness * length**3 / 12.0) * (span / 2.0 - 1.0 / 6.0)
    sliding = SHEAR_FACTOR * height / (shear * thickness * length)
    force = min(SECANT * 1e3 * formulas_force(test), 0.95 * axial * length / (2.0 * span * height))
    z = (np.arange(STATIONS) + 0.5) / STATIONS * height
    moment = force * (span * height - z)
    pressed = 3.0 * (0.5 * length - np.abs(moment) / axial)
    open_ = np.abs(moment) > axial * length / 6.0
    whole = moment / (modulus * thickness * length**3 / 12.0)
    curvature = np.where(open_, np.sign(moment) * 2.0 * axial / (modulus * thickness * pressed**2), whole)
    more = float((curvature - whole) @ (height - z)) * height / STATIONS / force
    gross, opened = bending + sliding, bending + sliding + more
    return moduli_share * 1e-3 * height / 100.0 / gross * (gross / opened) ** opens


def cracking_force(test: Experiment) -> float:
    """Force at the first crack [kN]: at the edge, (s0 + bond) t L^2 / (6 H0), or diagonal (Turnsek and Cacovic)."""
    row, o = test.row, test.options
    length, height, thickness = (float(row[k]) for k in ("L", "H", "t"))
    stress, ft = value(test, "sigma0"), o["crack_share"] * value(test, "ft")
    bond = o["tension_share"] * value(test, "fv0")
    edge = (stress + bond) * thickness * length**2 / (6.0 * shear_span(test) * height)
    slender = min(max(height / length, 1.0), 1.5)
    diagonal = length * thickness * ft / slender * math.sqrt(1.0 + stress / max(ft, 1e-9))
    return 1e3 * min(edge, diagonal)


def rocks(force: float, rocking: float) -> float:
    """Probability that a wall is said to rock (F), by its force over that at which it rocks in one piece."""
    middle, spread = ROCKING
    return 0.5 * (1.0 + math.erf(math.log(force / rocking / middle) / spread / math.sqrt(2.0)))


@dataclass(frozen=True)
class WallModel:
    """A block model of the measured walls that takes the size of every cause, see :func:`wall_causes`.

    Parameters
    ----------
    base : "first" or "extended"
    store : file that keeps every answer of limit analysis, across studies; None for none
    elastic : the stiffness alone, which needs no limit analysis
    campaigns : names that a parameter that ends in "_at_k" speaks of; it then acts on the walls of the k-th alone
    """

    base: str
    store: str | Path | None = None
    campaigns: tuple[str, ...] = ()
    elastic: bool = False
    memo: Memo = field(init=False, repr=False)
    _known: dict[Any, dict[str, float]] = field(init=False, repr=False, default_factory=dict)

    def __post_init__(self) -> None:
        if self.base not in MODELS:
            raise InputError(f"base must be one of {', '.join(MODELS)}, got {self.base!r}")
        object.__setattr__(self, "memo", Memo(self.store, kind=(float, int)))

    def __call__(self, specimen: Mapping[str, Any], **sizes: float) -> dict[str, float]:
        """Force [kN], probability of rocking, stiffness [kN/%] and drift at the first crack [%]."""
        wall = str(specimen["specimen"])
        acting: dict[str, float] = {}
        for name, size in sizes.items():
            kind, _, number = name.partition("_at_")
            if not number or self.campaigns[int(number)] == specimen["campaign"]:
                acting[kind] = acting.get(kind, 0.0) + size
        key = first_alike(wall), tuple(sorted(acting.items()))
        if key not in self._known:
            self._known[key] = self._quantities(wall, acting)
        return self._known[key]

    def _quantities(self, wall: str, acting: Mapping[str, float]) -> dict[str, float]:
        options = self._options(wall, acting)
        test = registry.load(NAME, wall, **options)
        share = 1.0 - acting.get("stiffness_lost", 0.0)
        if not test.row["E"]:
            share *= 1.0 + acting.get("moduli_of_code", 0.0)
        pressed = value(test, "sigma0") / (inputs_of(test.row)["fc"].value * MODULUS_AT)
        share *= pressed ** acting.get("joints_soft", 0.0)
        stiff = stiffness(test, share, acting.get("section_opens", 0.0))
        if self.elastic:
            return {STIFFNESS: stiff}
        force = self._force(wall, options)
        for kind, (law, flow) in _OTHER_LAWS.items():
            if share := acting.get(kind, 0.0):
                force *= (self._force(wall, {**options, **law}, flow) / self._force(wall, options)) ** share
        return {FORCE: force, MODE: rocks(force, rocking_force(test)), STIFFNESS: stiff,
                CRACK: min(cracking_force(test), force) / stiff}

    def _force(self, wall: str, options: Mapping[str, Any], flow: str = "associative") -> float:
        """Force of the printed units, times the effect of the options on a wall of at most ``BLOCKS`` units."""
        whole = self._solved(wall, MODELS[self.base], "associative")
        return whole * self._coarse(wall, options, flow) / self._coarse(wall, MODELS[self.base], "associative")

    def _coarse(self, wall: str, options: Mapping[str, Any], flow: str) -> float:
        row = registry.load(NAME, wall).row
        coarse = math.ceil(math.sqrt(units_per_course(row)[0] * int(row["courses"]) / BLOCKS))
        return self._solved(wall, options if coarse == 1 else {**options, "coarse": coarse}, flow)

    def _solved(self, wall: str, options: Mapping[str, Any], flow: str) -> float:
        def solve() -> float:
            test = registry.load(NAME, wall, **options)
            more: Any = {"contact_model": "grid", "search": "quick"} if flow == FlowRule.NON_ASSOCIATIVE else {}
            found = limit_analysis(test.assembly(), test.loads(), flow, check_dead_load=False, **more)
            return float(found.collapse_multiplier)

        return float(self.memo.once([first_alike(wall), flow, sorted(options.items())], solve))

    def _options(self, wall: str, sizes: Mapping[str, float]) -> dict[str, Any]:
        """Options of the wall with the causes at their sizes."""
        test = registry.load(NAME, wall, **MODELS[self.base])
        row, was = test.row, test.options
        hollow, held = row["unit_type"] in HOLLOW, float(row["H0_over_H"]) == HELD
        left = {kind: 1.0 - size for kind, size in sizes.items()}
        options: dict[str, Any] = dict(MODELS[self.base])

        def times(name: str, factor: float) -> None:
            options[name] = factor * float(was[name])

        if "bond_lost" in sizes:
            times("tension_share", left["bond_lost"])
        if "cohesion_lost" in sizes:
            times("cohesion_share", left["cohesion_lost"])
        heads = left.get("heads_lost", 1.0) * (left.get("filled_lost", 1.0) if row["head_joints"] in FILLED else 1.0)
        if "heads_carry" in sizes:
            options["head_friction"] = sizes["heads_carry"]
        elif heads != 1.0:
            for name in ("head_share", "head_friction", "unfilled_friction"):
                times(name, heads)
        units = left.get("units_weaker", 1.0) * (left.get("webs_weaker", 1.0) if hollow else 1.0)
        if units != 1.0:
            times("crack_share", units)
        if hollow and "toe_weaker" in sizes:
            options["fc"] = max(left["toe_weaker"] * value(test, "fc"), 1.02 * value(test, "sigma0"))
        if held and "rig_turns" in sizes:
            options["shear_span"] = HELD * (1.0 + sizes["rig_turns"])
        if held and "load_rises" in sizes:
            options["sigma0"] = min((1.0 + sizes["load_rises"]) * value(test, "sigma0"), 0.98 * value(test, "fc"))
        if "fv0_high" in sizes:
            options["fv0"] = value(test, "fv0") / (1.0 + sizes["fv0_high"])
        if "fv0_of_code" in sizes and inputs_of(row)["fv0"].kind == CODE:
            options["fv0"] = (1.0 + sizes["fv0_of_code"]) * value(test, "fv0")
        if "overlap_short" in sizes:
            options["overlap"] = 0.5 - sizes["overlap_short"]
        return options


_OTHER_LAWS: Mapping[str, tuple[Mapping[str, Any], str]] = {
    "units_diagonal": ({"cracks": "diagonal strength", "crack_factor": 2.0}, "associative"),
    "dilation_ends": ({}, "non-associative"),
}
"""Causes that are a share of the way, in ln V, to another model: its options and flow rule."""

_KINDS: Mapping[str, tuple[str, tuple[float, float], str, str]] = {
    "bond_lost": ("bond lost once a joint opens", (0.0, 1.0), "share of the tensile strength of joints that is gone",
                  "fracture energy of bond of 5 to 20 N/m: van der Pluijm (1999)"),
    "cohesion_lost": ("cohesion lost before the peak", (0.0, 0.9), "share of fv0 that a bed joint does not carry at "
                      "once", "softening of cohesion over slip: Lourenco and Rots (1997)"),
    "heads_lost": ("head joints carry less shear", (0.0, 1.0), "share of strength and friction of head joints that is "
                   "not there", "Mann and Mueller (1982) leave out head joints"),
    "filled_lost": ("heads declared filled that are not", (0.0, 1.0), "the same, of filled head joints alone",
                    "workmanship"),
    "units_weaker": ("units crack at less", (0.0, 0.9), "share of the strength of cracks in units that is missing",
                     "tension of units beside shear: Mann and Mueller (1982)"),
    "units_diagonal": ("units crack by the diagonal strength", (0.0, 1.0), "share of the way, in ln V, to cracks by "
                       "c = 2 ft / b sqrt(1 + s0 / ft)", "Turnsek and Cacovic (1971)"),
    "dilation_ends": ("dilation that ends", (0.0, 1.0), "share of the way, in ln V, to joints without dilatancy",
                      "non-associative limit analysis"),
    "heads_carry": ("filled head joints carry friction", (0.0, 1.0), "their friction over mu",
                    "mortar that fills them"),
    "webs_weaker": ("webs of hollow units crack at less", (0.0, 0.9), "share of the strength of cracks in hollow units "
                    "that is missing; the void ratio for a law on the net area", "net area of webs and shells"),
    "toe_weaker": ("toe crushes on the shells of hollow units", (0.0, 0.5), "share of fc that is missing under a "
                   "hollow unit's toe", "bedding on shells"),
    "rig_turns": ("rig that turns", (0.0, 0.8), "rise of the zero moment over half of the height, of walls held at "
                  "both ends", "beam on jacks of finite stiffness"),
    "load_rises": ("axial load that rises", (0.0, 0.6), "rise of N over its start, of walls held at both ends",
                   "platens that hold a wall that rocks"),
    "fv0_of_code": ("fv0 of a code taken for tested", (-0.6, 1.5), "fv0 over the code's, less one",
                    "EN 1996-1-1, 3.6.2"),
    "fv0_high": ("fv0 stated too high", (0.0, 2.0), "stated fv0 over the true one, less one",
                 "triplets of other walls"),
    "overlap_short": ("units with a short overlap", (0.0, 0.25), "half less overlap over length of a unit", "bond"),
    "stiffness_lost": ("section cracked from the start", (0.0, 0.8), "share of E and G that is not there",
                       "EN 1998-1, 4.3.1(7): half"),
    "section_opens": ("sections open under load", (0.0, 1.0), "share of the way, in ln K, to sections without "
                      "tension", "no-tension beam: Navier on what is pressed"),
    "joints_soft": ("joints that close under load", (0.0, 1.2), "exponent m of E = E (3 s0 / fc)^m, E read at fc / 3",
                    "EN 1052-1; joints that close: Bandis, Lumsden and Barton (1983)"),
    "moduli_of_code": ("E of a code taken for tested", (-0.8, 1.5), "E over 1000 fc, less one, where none is printed",
                       "EN 1996-1-1, 3.7.2"),
}
"""By parameter: name, bounds, meaning of the size, source. The baseline is 0."""


_OWN: Mapping[str, tuple[str, ...]] = {
    "section_opens": ("load",),
    "joints_soft": ("load",),
    "moduli_of_code": ("moduli",),
}
"""Columns along which a cause acts by its own law."""


def wall_causes(kinds: Sequence[str], campaigns: Sequence[str] = ()) -> tuple[Cause, ...]:
    """Causes for a study of a :class:`WallModel`.

    Parameters
    ----------
    kinds : parameters of causes
    campaigns : of the model; each cause is then offered once for every campaign, acting on its walls alone

    Raises
    ------
    InputError
        For an unknown parameter.
    """
    if unknown := [k for k in kinds if k not in _KINDS]:
        raise InputError(f"there is no cause {unknown[0]!r}; known: {', '.join(_KINDS)}")
    found = []
    for kind in kinds:
        name, bounds, physics, source = _KINDS[kind]
        for k, where in enumerate(campaigns) if campaigns else ((None, ""),):
            found.append(Cause(
                f"{name}: {where}" if where else name, kind if k is None else f"{kind}_at_{k}", 0.0, bounds, physics,
                source=source, own=("campaign",) if where else _OWN.get(kind, ()),
            ))
    return tuple(found)


@cache
def responses() -> dict[str, dict[str, float]]:
    """Measured quantities by wall, means of both senses: force [kN], rocking (1 or 0), stiffness, first crack."""
    found: dict[str, dict[str, float]] = {}
    for row in read_table(NAME, "responses.csv").rows:
        force, first, plateau, yielded = (
            float(
                np.mean([float(row[f"{name}_{sense}"]) for sense in ("pos", "neg") if row[f"{name}_{sense}"]] or np.nan)
            )
            for name in ("V_max", "d_cr", "V_bl", "d_e")
        )
        mode = row["failure_mode"].removeprefix("H-")[:1]
        rocked = {"F": 1.0, "S": 0.0, "G": 0.0}.get(mode, np.nan)
        found[row["specimen"]] = {FORCE: force, MODE: rocked, STIFFNESS: plateau / yielded, CRACK: first}
    return found


REPLICATES: Mapping[str, float] = {FORCE: 0.075, MODE: 0.35, STIFFNESS: 0.32, CRACK: 0.53}
"""Standard deviation of the logarithm of repeated walls of this table: 12, 11 and 6 degrees of freedom; that of the
mode, a probability, is assumed."""


def replicate_scatter(quantity: str) -> tuple[float, int]:
    """Standard deviation of the logarithm among walls with equal inputs in one campaign, and degrees of freedom."""
    groups: dict[str, list[float]] = {}
    for wall, response in responses().items():
        if np.isfinite(response[quantity]) and response[quantity] > 0.0:
            groups.setdefault(first_alike(wall), []).append(math.log(response[quantity]))
    squares = sum(float(np.var(v)) * len(v) for v in groups.values())
    freedom = sum(len(v) - 1 for v in groups.values())
    return math.sqrt(squares / freedom), freedom


def as_specimens(walls: Sequence[str]) -> list[dict[str, Any]]:
    """Walls as specimens of a study: number, campaign, and what effects may go with."""
    known = {r["specimen"]: r for r in read_table(NAME, "walls.csv").rows}
    return [
        {"specimen": w, "campaign": r["campaign"], "units": r["unit_type"], "shear span": float(r["H0_over_H"]),
         "filled": "filled" if r["head_joints"] in FILLED else "not filled",
         "moduli": "printed" if r["E"] else "of a code", "slenderness": float(r["H"]) / float(r["L"]),
         "load": inputs_of(r)["sigma0"].value / inputs_of(r)["fc"].value}
        for w, r in ((w, known[w]) for w in walls)
    ]


COVARIATES = ("campaign", "units", "filled", "moduli", "shear span", "slenderness", "load")
UNITS: Mapping[str, str] = {FORCE: "kN", MODE: "-", STIFFNESS: "kN/%", CRACK: "%"}
