"""What models of the measured walls get wrong, as a study of causes; and what planted campaigns it would find.

    python -m validation.wall_diagnosis --out docs --store FOLDER

makes ``measured-walls-diagnosis.md`` and its figure. Answers are kept in the folder of ``--store``.
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from limitmason import causes
from limitmason.causes import Cause
from limitmason.comparison.wall_ladder import predict_walls
from limitmason.diagnosis import Diagnosis, Observation, Rehearsal, Study
from limitmason.display.progress import reached
from limitmason.display.text_table import markdown as markdown_lines
from limitmason.experiments.modern_walls import NAME
from limitmason.experiments.modern_walls.inputs import complete, has_shear_span
from limitmason.experiments.source_folder import read_table
from limitmason.study.memo import Memo
from validation.wall_causes import (
    COVARIATES,
    CRACK,
    FORCE,
    MODE,
    REPLICATES,
    STIFFNESS,
    UNITS,
    WallModel,
    as_specimens,
    replicate_scatter,
    responses,
    wall_causes,
)
from validation.wall_diagnosis_text import TEXT
from validation.wall_stiffness import (
    fitted_exponent,
    printed,
    stiff_walls,
    stiffness_figure,
    stiffness_lines,
    within,
)

Array = NDArray[np.float64]
DRAWS = 400  # of the bootstrap, of planted data

KINDS: Mapping[str, tuple[str, ...]] = {
    "first": ("bond_lost", "cohesion_lost", "heads_lost", "units_weaker", "units_diagonal", "webs_weaker", "toe_weaker",
              "rig_turns", "load_rises", "stiffness_lost", "section_opens", "joints_soft",
              "moduli_of_code"),
    "laws": ("cohesion_lost", "heads_carry", "units_weaker", "webs_weaker", "toe_weaker", "rig_turns", "load_rises",
             "overlap_short", "stiffness_lost", "section_opens", "joints_soft",
              "moduli_of_code"),
}
"""Causes that are offered, by the model they are nested in."""

LEVELS = 4  # most sizes of a cause at which a model is solved


def observations(
    walls: Sequence[str], quantities: Sequence[str], scatter: Mapping[str, Mapping[str, float]] | None
) -> list[Observation]:
    """What was measured on some walls.

    Parameters
    ----------
    walls : numbers
    quantities : of :data:`REPLICATES`
    scatter : by quantity and wall; None where the scatter about the fit is the only measure of noise
    """
    kinds = {FORCE: "force", MODE: "pattern"}
    return [
        Observation(
            wall, quantity, responses()[wall][quantity], None if scatter is None else scatter[quantity][wall],
            UNITS[quantity], kinds.get(quantity, "deformation"), "identity" if quantity == MODE else "log",
        )
        for wall in walls
        for quantity in quantities
    ]


def scatter_of(
    walls: Sequence[str], spreads: Mapping[str, float], model: float = 0.0
) -> dict[str, dict[str, float]]:
    """Scatter by quantity and wall: repeated walls, of forces also the inputs and what a model leaves beside them."""
    return {
        quantity: {w: math.hypot(replicates, *((spreads[w], model) if quantity == FORCE else ())) for w in walls}
        for quantity, replicates in REPLICATES.items()
    }


def study_of(
    base: str, walls: Sequence[str], store: Path, quantities: Sequence[str],
    scatter: Mapping[str, Mapping[str, float]] | None = None,
) -> Study:
    """A study of measured walls by one block model; campaigns may share a part of the noise."""
    specimens = as_specimens(walls)
    kinds = [k for k in KINDS[base] if any(q in ACTS.get(k, (FORCE, MODE, STIFFNESS, CRACK)) for q in quantities)]
    offered: list[Cause] = [*wall_causes(kinds), causes.ALL["gain"]()]
    if CRACK in quantities:
        offered.append(SEEN_LATE)
    elastic = tuple(quantities) == (STIFFNESS,)
    return Study(
        specimens, WallModel(base, store / f"causes_{base}.jsonl", elastic=elastic),
        observations(walls, quantities, scatter), covariates=COVARIATES, groups=[s["campaign"] for s in specimens],
        shared=("campaign",), levels=LEVELS, causes=tuple(offered),
        pair_tables="verified" if elastic else "additive",
    )


def _late(size: float, prediction: float, specimen: Mapping) -> float:
    return size * prediction


SEEN_LATE = Cause(
    "first crack seen late", "seen_late", 1.0, (1.0, 8.0), "drift at which a crack is wide enough to be seen over that "
    "at which tension is exceeded", acts_on="measurement", apply=_late, reads=(CRACK,), source="width that an eye sees",
)

ACTS: Mapping[str, tuple[str, ...]] = {
    **{k: (STIFFNESS, CRACK) for k in ("stiffness_lost", "moduli_of_code", "section_opens", "joints_soft")},
    "rig_turns": (FORCE, MODE, STIFFNESS),
    **{k: (FORCE, MODE) for k in ("cohesion_lost", "heads_carry", "heads_lost", "units_weaker", "units_diagonal",
                                  "webs_weaker", "toe_weaker", "load_rises", "overlap_short")},
}
"""Quantities that a cause acts on; the others act on all."""


# ---- planted campaigns -------------------------------------------------------------------------------------------

PLANTED: Mapping[str, float] = {
    "shift": 0.85, "filled_lost": 1.0, "fv0_high": 1.0, "overlap_short": 0.25, "webs_weaker": 0.5, "rig_turns": 0.4,
}
"""What is hidden in a campaign, and its size: load read 15 % low, heads that are not filled, fv0 twice the truth, a
quarter overlap, webs at half strength, a rig that lets the zero moment rise."""

PLANTED_IN = ("extended", "first")
SCATTER = 0.10
CLEAR = 25.0  # d2 from nothing that a planted size has at least
SEEN = 9.0  # d2 at its bound below which a cause is not offered: it is not visible
FEWEST = 5  # walls of a campaign


class Planting(NamedTuple):
    """A cause hidden in a campaign: the cause, its campaign, size, d2 from nothing, and what would be measured."""

    cause: Cause
    campaign: str
    size: float
    seen: float
    forces: Array


def _walls(study: Study) -> WallModel:
    """The simulator of a study of this page."""
    assert isinstance(study.simulate, WallModel)
    return study.simulate


class Trial(NamedTuple):
    """Verdict on one computed data set: what was hidden ("" for nothing), in which campaign, and what was said."""

    hidden: str
    campaign: str
    kind: str
    said: tuple[str, ...]
    named: bool


def campaign_study(base: str, walls: Sequence[str], store: Path) -> Study:
    """A study of forces in which any one campaign may have any one of the planted causes."""
    specimens = as_specimens(walls)
    count = Counter(s["campaign"] for s in specimens)
    campaigns = tuple(name for name, n in count.items() if n >= FEWEST)
    model = WallModel(base, store / f"causes_{base}.jsonl", campaigns)
    offered = [*wall_causes([k for k in PLANTED if k != "shift"], campaigns)]
    offered += [causes.ALL["batch shift"](covariate="campaign", label=name) for name in campaigns]
    nothing = [model(s)[FORCE] for s in specimens]
    seen = [c for c in offered if c.transforms or _felt(model, specimens, c, nothing) >= SEEN]
    rows = [Observation(w, FORCE, v, SCATTER) for w, v in zip(walls, nothing, strict=True)]
    return Study(
        specimens, model, rows, covariates=COVARIATES, groups=[s["campaign"] for s in specimens], shared=(),
        levels=LEVELS, pair_tables="additive", causes=tuple(seen),
    )


def _felt(model: WallModel, specimens: Sequence[Mapping], cause: Cause, nothing: Sequence[float]) -> float:
    """Squared distance d2 from nothing of a cause at its bound."""
    moved = [model(s, **{cause.parameter: cause.bounds[1]})[FORCE] for s in specimens]
    return float((np.log(np.array(moved) / nothing) ** 2).sum()) / SCATTER**2


def plantings(study: Study) -> list[Planting]:
    """Every cause of the list at its size, or at the smallest beyond it that has d2 of 25; others are left out."""
    found = []
    nothing = np.array([study.simulate(s)[FORCE] for s in study.specimens])
    for cause in study.causes:
        kind, _, number = cause.parameter.partition("_at_")
        if cause.transforms:
            campaign = cause.name.removeprefix("shift of campaign ")
            own, size, end = np.array([s["campaign"] == campaign for s in study.specimens]), PLANTED["shift"], 0.7
        else:
            own, size, end = None, PLANTED[kind], cause.bounds[1]
            campaign = _walls(study).campaigns[int(number)]
        for step in np.linspace(0.0, 1.0, 6):
            tried = float(size + step * (end - size))
            if own is not None:
                forces = np.where(own, tried, 1.0) * nothing
            else:
                forces = np.array([study.simulate(s, **{cause.parameter: tried})[FORCE] for s in study.specimens])
            seen = float((np.log(forces / nothing) ** 2).sum()) / SCATTER**2
            if seen >= CLEAR:
                found.append(Planting(cause, campaign, tried, seen, forces))
                break
    return found


def trials(
    study: Study, planted: Sequence[Planting], number: int, store: Path, *, nothing: int = 0
) -> list[Trial]:
    """Hide the plantings in turn, draw the scatter and diagnose; the last data sets have nothing hidden.

    Verdicts are kept in a file of the store as they come.
    """
    memo, found = Memo(store / "planted.jsonl", kind=dict), []
    bare = np.array([study.simulate(s)[FORCE] for s in study.specimens])

    def verdict(hidden: Planting | None, k: int) -> dict[str, Any]:
        rng = np.random.default_rng(k)
        forces = (bare if hidden is None else hidden.forces) * np.exp(SCATTER * rng.standard_normal(len(bare)))
        answer = study.replace(measured=forces).diagnose(seed=k, pairs=False, draws=DRAWS)
        return {"kind": str(answer.kind), "said": list(answer.causes), "named": bool(answer.verdict.distinct)}

    for k in range(number + nothing):
        hidden = planted[k % len(planted)] if k < number else None
        name, campaign = (hidden.cause.name, hidden.campaign) if hidden else ("", "")
        row = memo.once([_walls(study).base, name, hidden.size if hidden else 0.0, k], partial(verdict, hidden, k))
        found.append(Trial(name, campaign, row["kind"], tuple(row["said"]), row["named"]))
        reached((k + 1) / (number + nothing), f"data set {k + 1}")
    return found


# ---- the page ----------------------------------------------------------------------------------------------------


class Asked(NamedTuple):
    """A question to the data: words, model, whether of all walls, quantities, whether scatter is stated, model's."""

    words: str
    base: str
    every: bool
    quantities: tuple[str, ...]
    stated: bool
    model: float = 0.0


REHEARSED = {FORCE: 0.16, STIFFNESS: 0.54}  # scatter that the best explanation leaves
LEFT = 0.13  # scatter of ln V that the extended model leaves beside repeated walls and inputs
QUESTIONS = (
    Asked("forces", "first", False, (FORCE,), False),
    Asked("forces and modes", "first", False, (FORCE, MODE), True, LEFT),
    Asked("forces", "laws", False, (FORCE,), False),
    Asked("forces, scatter of repeats and inputs", "laws", False, (FORCE,), True),
    Asked("forces and modes", "laws", False, (FORCE, MODE), True, LEFT),
    Asked("forces, modes, stiffness, first crack", "laws", False, tuple(REPLICATES), True, LEFT),
    Asked("stiffness", "laws", False, (STIFFNESS,), False),
    Asked("stiffness, all walls", "laws", True, (STIFFNESS,), False),
)


def verdict_line(asked: Asked, answer: Diagnosis) -> list[str]:
    """A row of the table of verdicts."""
    found, names = answer.verdict.identification, answer.kept[0] if answer.kept else ()
    gain = answer.gains[names] if names else None
    by_group = "" if gain is None or gain.leave_group_out is None else str(gain.leave_group_out)
    return [
        asked.base, asked.words, str(answer.n), KIND_WORDS.get(str(answer.kind), str(answer.kind)),
        " or ".join(" and ".join(answer.sized(n)) for n in answer.kept)
        or (f"varies with {answer.covariate}" if answer.covariate else "-"),
        "" if found is None else f"{found.excess:.1f} of {found.margin:.0f}, {found.along}",
        "" if found is None else f"{100 * found.chance:.0f}",
        "" if gain is None else f"{100 * gain.error_before:.0f} to {100 * gain.error_left_out:.0f} %",
        by_group, "" if gain is None else str(gain.selected),
    ]


KIND_WORDS = {"two": "behaves like two together", "cause": "**named**"}
VERDICTS = ["model", "data", "numbers", "verdict", "cause and size [95 %]", "ahead of the nearest nameless effect",
            "named were it true, of 100", "error, values left out", "campaigns left out", "with the choice repeated"]


def rehearsal_lines(found: Rehearsal) -> list[list[str]]:
    """A row per hidden cause."""
    shown = ("none", "named", "behaves like it", "set with it", "wrong name", "behaves like another", "set without it")
    rows = [["hidden", "trials", *shown]]
    return rows + [[r["hidden"], str(r["trials"]), *(str(r[o]) for o in shown)] for r in found.table()]


def trial_lines(found: Sequence[Trial]) -> list[list[str]]:
    """Shares over the planted data sets, all and by kind of cause, and false alarms."""
    groups: dict[str, list[Trial]] = {"all": [t for t in found if t.hidden]}
    for t in found:
        if t.hidden:
            kind = "load read low" if t.hidden.startswith("shift") else t.hidden.partition(":")[0]
            groups.setdefault(kind, []).append(t)
    rows = [["hidden", "data sets", "alarm", "campaign found", "cause in the set", "wrong name"]]
    for kind, some in groups.items():
        n = len(some)
        alarm = sum(t.kind != "none" for t in some)
        where = sum(bool(t.said) and all(_campaign(name) == t.campaign for name in t.said) for t in some)
        inside = sum(t.hidden in t.said for t in some)
        wrong = sum(t.named and t.said[:1] != (t.hidden,) for t in some)
        rows.append([kind, str(n), *(f"{k} ({k / n:.0%})" for k in (alarm, where, inside, wrong))])
    nothing = [t for t in found if not t.hidden]
    if nothing:
        alarm = sum(t.kind != "none" for t in nothing)
        rows.append(["nothing", str(len(nothing)), f"{alarm} ({alarm / len(nothing):.0%})", "", "", ""])
    return rows


def _campaign(name: str) -> str:
    """Campaign of a cause by its name."""
    return name.removeprefix("shift of campaign ") if name.startswith("shift of") else name.partition(": ")[2]


def not_planted(study_campaigns: Sequence[str], planted: Sequence[Planting]) -> str:
    """Causes by the campaigns in which they could not be planted."""
    done = {(p.cause.name.partition(":")[0].partition(" of campaign")[0], p.campaign) for p in planted}
    names = [c.name for c in wall_causes([k for k in PLANTED if k != "shift"])] + ["shift"]
    lines = []
    for name in names:
        left = [c for c in study_campaigns if (name, c) not in done]
        if left:
            lines.append(f"- {'load read low' if name == 'shift' else name}: "
                         f"{'every campaign' if len(left) == len(study_campaigns) else ', '.join(left)}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> None:
    """Make what is missing, then the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--store", type=Path, required=True)
    parser.add_argument("--trials", type=int, default=200, help="planted data sets; half as many blind trials")
    o = parser.parse_args(arguments)
    o.store.mkdir(parents=True, exist_ok=True)
    rows = {r["specimen"]: r for r in read_table(NAME, "walls.csv").rows}
    every = [w for w, r in rows.items() if w in responses() and has_shear_span(r)]
    whole = [w for w in every if complete(rows[w])]
    moved = predict_walls("extended", every, store=o.store / "ladder.jsonl")
    spreads = {p.wall: float(np.nan_to_num(p.spread)) for p in moved}
    answers, lines, studies = {}, [VERDICTS], {}
    for asked in QUESTIONS:
        scatter = scatter_of(every, spreads, asked.model) if asked.stated else None
        walls = every if asked.every else whole
        study = study_of(asked.base, walls, o.store, asked.quantities, scatter)
        answers[asked] = study.diagnose()
        studies[asked.base, asked.words] = study
        lines.append(verdict_line(asked, answers[asked]))
        print(answers[asked].report(checks=False), flush=True)
    parts = {"[verdicts]": markdown(lines), "[left]": f"{LEFT:g}", "[sd_force]": f"{REHEARSED[FORCE]:.0%}",
             "[sd_stiffness]": f"{REHEARSED[STIFFNESS]:.0%}"}
    for mark, quantity in (("force", FORCE), ("stiffness", STIFFNESS), ("crack", CRACK)):
        found, freedom = replicate_scatter(quantity)
        parts[f"[repeats_{mark}]"] = f"{found:.3f} ({freedom})"
    for mark, words, quantity in (("force", "forces", FORCE), ("stiffness", "stiffness, all walls", STIFFNESS)):
        rehearsal = studies["laws", words].rehearse(n=o.trials // 2, sd=REHEARSED[quantity], pairs=False)
        parts[f"[rehearsed_{mark}]"] = markdown(rehearsal_lines(rehearsal))
    alone = study_of("first", whole, o.store, (MODE,), scatter_of(every, spreads)).diagnose(pairs=False)
    by_mode = sorted(((t.gain, t.names[0]) for t in alone.verdict.tested.values()), reverse=True)
    parts["[by_mode]"] = "\n".join(f"  - {name} {gain:+.1f}" for gain, name in by_mode)
    stiff = stiff_walls()
    exponent, low, high = within(stiff)
    own = within(printed(stiff))
    table = stiffness_lines(stiff)
    parts |= {"[stiff_walls]": str(len(stiff.walls)), "[stiffness]": markdown(table), "[half]": table[2][1],
              "[within]": f"{exponent:.2f} (90 % of draws of campaigns {low:.2f} to {high:.2f})",
              "[within_printed]": f"{own[0]:.2f} ({own[1]:.2f} to {own[2]:.2f})",
              "[n_printed]": str(len(printed(stiff).walls))}
    stiffness_figure(stiff, fitted_exponent(stiff), o.out / "measured-walls-stiffness.png")
    for base in PLANTED_IN:
        study = campaign_study(base, whole, o.store)
        planted = plantings(study)
        found = trials(study, planted, o.trials, o.store, nothing=o.trials)
        near = [["cause", "d2 from nothing", "nearest rival", "d2"]]
        told = study.confusable()
        near += [[r["cause"], f"{r['d2_baseline']:.0f}", r["rival"], f"{r['d2']:.1f}"] for r in told.table()]
        twins = "; ".join(" and ".join(pair) for pair in told.twins) or "none"
        parts |= {f"[planted_{base}]": markdown(trial_lines(found)), f"[n_{base}]": str(len(planted)),
                  f"[confusable_{base}]": markdown(near), f"[twins_{base}]": twins,
                  f"[not_{base}]": not_planted(_walls(study).campaigns, planted)}
    text = TEXT
    for mark, part in parts.items():
        text = text.replace(mark, part)
    (o.out / "measured-walls-diagnosis.md").write_text(text, encoding="utf-8")


def markdown(lines: Sequence[Sequence[str]]) -> str:
    """A table of Markdown."""
    return "\n".join(markdown_lines(lines))


if __name__ == "__main__":
    main()
