"""The cases of the table: packaged specimens, one row for all repeats of one model, and what they are held to."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from limitmason.experiments.experiment import Experiment, TargetValue
from limitmason.experiments.registry import all_cases, load, recipe_of, specimens, tabled
from limitmason.experiments.shown import Settings
from limitmason.model.assembly import Assembly
from limitmason.study.run_fingerprint import fingerprint


@dataclass(frozen=True)
class ReferenceValue:
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
    references: tuple[ReferenceValue, ...]

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


def settings_of(case: Case, *, thorough: bool = False) -> Settings:
    """Settings of one case: in plane two points across the thickness, more along joints that crush.

    Parameters
    ----------
    thorough : the standard search everywhere, and the range proven where that can be
    """
    return case.test.recipe.shown.settings_of(case.specimens[0], case.variant, thorough=thorough)


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
    found = [c for name in (tabled() if source is None else (source,)) for c in _of_source(name)]
    return tuple(c for c in found if specimen is None or specimen in c.specimens)


@functools.cache
def _of_source(name: str) -> tuple[Case, ...]:
    found: dict[str, Case] = {}
    for variant, options in recipe_of(name).shown.variants:
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


def _by_direction(test: Experiment) -> list[tuple[str, list[ReferenceValue]]]:
    """The senses of the load that need a prediction of their own, with the values of each."""
    own = {d: _references(test, (d,)) for d in test.directions}
    if len(own) == 1:
        return list(own.items())
    if symmetric(test.assembly()):
        return [("+", _references(test, tuple(own)))]
    return list(own.items())


def _references(test: Experiment, directions: Iterable[str]) -> list[ReferenceValue]:
    # a value with options of its own, as for rounded corners, belongs to that variant alone
    named = {k for t in test.targets for k in t.options}
    return [
        ReferenceValue(_words(test, t), t.kind, t.flow_rule, float(test.value(t)))
        for t in test.targets
        if t.kind in ("measured", "published")
        and t.direction in directions
        and not t.copy
        and all(test.options[k] == t.options.get(k, test.option_table[k].default) for k in named)
        and _fits(test, t.flow_rule)
    ]


def _words(test: Experiment, target: TargetValue) -> str:
    standing = test.standing(target)
    return f"{target.kind} {target.quantity}" + ("" if standing == target.kind else f" ({standing})")


def _fits(test: Experiment, flow_rule: str | None) -> bool:
    """Whether a published value belongs to the dilatancy of this variant where the variants differ in it."""
    dilatant = bool(test.options.get("dilatancy_deg"))
    both = any(options.get("dilatancy_deg") for _, options in test.recipe.shown.variants)
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
