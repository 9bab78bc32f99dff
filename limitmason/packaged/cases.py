"""The cases of the table: packaged specimens, one row for all repeats of one model, and what they are held to."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from limitmason.experiments.record import Experiment, Target
from limitmason.experiments.registry import all_cases, load, sources, specimens
from limitmason.model.assembly import Assembly
from limitmason.study.store import fingerprint

VARIANTS: Mapping[str, tuple[tuple[str, Mapping[str, Any]], ...]] = {
    "ferris-tin-loi-2001": (("", {}), ("rounded corners", {"rounding": 0.02})),
    "rondelet-wallette": (("", {}), ("psi = phi", {"dilatancy_deg": 35.0})),
    "bnw-walls": (
        ("friction 0.4, cohesion 0.2 MPa", {"friction": 0.4, "cohesion": 0.2e6}),
        ("friction 0.6, no cohesion", {"friction": 0.6}),
    ),
}
"""Options in which a source is shown, with a name; sources that are not named here are shown as packaged."""

ASSUMED: Mapping[str, str] = {
    "ferris-tin-loi-2001": "Rounded corners are contacts pulled in by 20 mm. The published values for those are of two "
    "programs that step in time; HybriDFEM, rigid blocks on the same contacts, gives 0.586, 0.525, 0.337, 0.247 and "
    "0.194 for walls 1 to 5 and no convergence for wall 6.",
    "rondelet-wallette": "The bond is not published: the four plausible ones are listed. The closed forms do not see "
    "the column that holds the wallette: they are those of a free wall, far too low, and no bound. The references are "
    "3DEC's, with soft contacts as in the DEM here; 0.40 is printed, 0.32 follows from a difference of about 25 %.",
    "minho-dry-stone-2005-2009": "Constant vertical load, horizontal force at the loading beam, which is free to turn; "
    "rigid blocks, so that the DEM keeps its default stiffness (examples/minho_pushover.py has the measured one).",
    "bnw-walls": "Friction of the joints is not in the sources at hand; the database has an initial shear strength of "
    "0.25 MPa. Assumed here: 0.4 and 0.2 MPa, the characteristic values of EN 1996-1-1:2005 (3.6.2 and Table 3.4, clay "
    "units, general purpose mortar M2.5 to M9), and, to show what they do, 0.6 without cohesion; no tension. Joints "
    "crush at the masonry strength of the database. Units are rigid: cracks through them, seen in the tests of BNW2 "
    "and BNW3, cannot appear. The UDEC run was calibrated on these walls.",
    "murano-u-walls": "Stone layout, headers and span of the roof load are assumed; joints as calibrated in 3DEC on "
    "these tests by the source, so no prediction is independent of them. Limit analysis lets the mortar of REGW "
    "hold tension and cohesion for ever; the DEM drops both where a joint breaks.",
    "mcmaster-bending": "Spans are assumed, measured strengths are only in a figure of the source: nothing to compare "
    "with. Limit analysis lets tension and cohesion go on for ever; the DEM drops both where a joint breaks, as the "
    "case states.",
}
"""What a reader must know of a source's rows beyond its data sheet."""

_COPIES = ("HybriDFEM",)
"""Published values of another program's copy of the same: not a reference of their own."""


@dataclass(frozen=True)
class Reference:
    """A value to hold predictions against.

    Parameters
    ----------
    label : what it is, for example "measured Vmax+" or "3DEC dilatant"
    kind : "measured" or "published"
    flow_rule : "associative" or "non-associative" of a published value, None of a measured one
    value : in the unit of the case
    """

    label: str
    kind: str
    flow_rule: str | None
    value: float


@dataclass(frozen=True, eq=False)
class Case:
    """One row of the table: one model, and all specimens that it stands for.

    Parameters
    ----------
    specimens : names of the source's specimens with this model and these loads
    variant : name of the options it is shown in, empty as packaged
    test : the first of the specimens, with its options
    direction : sense of the live load
    references : values of all its specimens
    """

    specimens: tuple[str, ...]
    variant: str
    test: Experiment
    direction: str
    references: tuple[Reference, ...]

    @property
    def source(self) -> str:
        """Name of the source."""
        return self.test.source.name

    @property
    def unit(self) -> str:
        """Unit of all values of the row; "-" for multipliers."""
        return self.test.multiplier_to_measured.unit

    @property
    def name(self) -> str:
        """Specimens, variant and sense of the load in words."""
        first, last, n = self.specimens[0], self.specimens[-1], len(self.specimens)
        words = [first if n == 1 else f"{first} ... {last} ({n})"]
        words += [self.variant] if self.variant else []
        words += ["load to -"] if self.direction == "-" else []
        return ", ".join(words)


def cases(source: str | None = None, *, specimen: str | None = None) -> tuple[Case, ...]:
    """Every packaged case that has a model, repeats of one model as one case.

    Parameters
    ----------
    source : only this one
    specimen : only cases of this specimen

    Notes
    -----
    Both senses of the load are one case where the wall is symmetric; otherwise each is a case of its own.
    """
    found = [c for name in (sources() if source is None else (source,)) for c in _of_source(name)]
    return tuple(c for c in found if specimen is None or specimen in c.specimens)


@functools.cache
def _of_source(name: str) -> tuple[Case, ...]:
    found: dict[str, Case] = {}
    for variant, options in VARIANTS.get(name, (("", {}),)):
        for own in specimens(name):
            test = load(name, own, **options)
            if not test.has_model:
                continue
            for direction, references in _by_direction(test):
                key = fingerprint(variant, replace(test.assembly(), recipe={}), test.loads(direction))
                if key in found:
                    old = found[key]
                    found[key] = replace(
                        old, specimens=(*old.specimens, own), references=(*old.references, *references)
                    )
                else:
                    found[key] = Case((own,), variant, test, direction, tuple(references))
    return tuple(found.values())


def not_covered() -> tuple[tuple[str, tuple[str, ...], str], ...]:
    """Source, specimens and reason of every packaged case that has no model in any of the options shown."""
    shown = {(c.source, s) for c in cases() for s in c.specimens}
    missing: dict[tuple[str, str], list[str]] = {}
    for test in all_cases(with_model=False):
        if (test.source.name, test.specimen) not in shown:
            missing.setdefault((test.source.name, test.no_model), []).append(test.specimen)
    return tuple((source, tuple(names), reason) for (source, reason), names in missing.items())


def _by_direction(test: Experiment) -> list[tuple[str, list[Reference]]]:
    """The senses of the load that need a prediction of their own, with the values of each."""
    own = {d: _references(test, (d,)) for d in test.directions}
    if len(own) == 1:
        return list(own.items())
    if symmetric(test.assembly()):
        return [("+", _references(test, tuple(own)))]
    return list(own.items())


def _references(test: Experiment, directions: Iterable[str]) -> list[Reference]:
    # a value with options of its own, as for rounded corners, belongs to that variant alone
    named = {k for t in test.targets for k in t.options}
    return [
        Reference(_words(test, t), t.kind, t.flow_rule, float(test.value(t)))
        for t in test.targets
        if t.kind in ("measured", "published")
        and t.direction in directions
        and not any(word in t.quantity for word in _COPIES)
        and all(test.options[k] == t.options.get(k, test.option_table[k].default) for k in named)
        and _fits(test, t.flow_rule)
    ]


def _words(test: Experiment, target: Target) -> str:
    standing = test.standing(target)
    return f"{target.kind} {target.quantity}" + ("" if standing == target.kind else f" ({standing})")


def _fits(test: Experiment, flow_rule: str | None) -> bool:
    """Whether a published value belongs to the dilatancy of this variant where the variants differ in it."""
    dilatant = bool(test.options.get("dilatancy_deg"))
    both = any(options.get("dilatancy_deg") for _, options in VARIANTS.get(test.source.name, ()))
    return not both or flow_rule != "non-associative" or not dilatant


def symmetric(assembly: Assembly) -> bool:
    """Whether the blocks are mirror images of each other about a plane across x."""
    x = assembly.arrays
    moves = ~assembly.held.all(axis=1)
    middle = 0.5 * (x.corners[:, 0].max() + x.corners[:, 0].min())
    size = float(np.ptp(x.corners, axis=0).max())
    table = np.column_stack([x.centroid, np.cbrt(x.volume)])[moves]
    image = table.copy()
    image[:, 0] = 2.0 * middle - image[:, 0]
    grid = [np.round(t / (1e-6 * size)).astype(np.int64) for t in (table, image)]
    ordered = [g[np.lexsort(g.T)] for g in grid]
    return bool(np.abs(ordered[0] - ordered[1]).max(initial=0) <= 2)
