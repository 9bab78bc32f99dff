"""The table of docs/predicted.md: every packaged case with a model, predicted beside published or measured."""

from collections.abc import Callable, Iterable
from itertools import groupby

from limitmason.comparison.rows import Row
from limitmason.comparison.specimen import run
from limitmason.display.progress import reached, watched
from limitmason.display.text_table import markdown, markdown_line
from limitmason.experiments.experiment import Experiment
from limitmason.experiments.registry import all_cases

from .page import names_of, span

_HEADER = ("case", "value", "reference", "limit analysis", "flow rule", "predicted / reference")


def summary_table(progress: Callable[[str], None] | None = None) -> str:
    """Markdown table of all packaged cases that need no further choice, by limit analysis.

    Cases of equal prediction (repeats of one configuration) share a row.

    Parameters
    ----------
    progress : called with the name of each case before it is solved
    """
    cases = all_cases(with_model=True)
    return "\n".join([*markdown([_HEADER]), *table_rows(cases, progress=progress)])


@watched("experiments")
def table_rows(
    cases: Iterable[Experiment],
    *,
    flow_rule: str | None = None,
    progress: Callable[[str], None] | None = None,
) -> list[str]:
    """Rows of :func:`summary_table` for the given cases.

    Parameters
    ----------
    cases : experiments with a model
    flow_rule : only comparisons under this rule
    progress : called with the name of each case before it is solved
    """
    rows: list[Row] = []
    cases = tuple(cases)
    for number, case in enumerate(cases):
        reached(number / len(cases), case.name, share=1.0 / len(cases))
        if progress is not None:
            progress(f"{case.source.name}/{case.specimen}")
        # not those of another program's copy of the same model, nor of another model than the case's own
        own = {t.quantity for t in case.targets if not t.copy and not t.options}
        rows += [r for r in run(case, flow_rule=flow_rule, quantities=own) if not r.options]
    rows.sort(key=lambda r: (r.source, r.kind, r.flow_rule, r.specimen.rstrip("0123456789").split(".")[0][:2]))
    groups = groupby(rows, key=lambda r: (r.source, r.kind, r.flow_rule, r.unit, f"{r.predicted:.5g}"))
    return [markdown_line(_cells(list(group))) for _, group in groups]


def _cells(rows: list[Row]) -> list[str]:
    first = rows[0]
    names = list(dict.fromkeys(r.specimen for r in rows))
    unit = "" if first.unit == "-" else f" {first.unit}"
    references = [float(r.reference) for r in rows if r.reference is not None]
    known = first.solved
    ratios = [r.ratio for r in rows]
    value = f"{first.kind}" + (f", {len(rows)} values" if len(rows) > 1 else "")
    return [
        f"{first.source} {names_of(names)}", value, span(min(references), max(references)) + unit,
        f"{first.predicted:.4g}{unit}" if known else first.status, first.flow_rule,
        span(min(ratios), max(ratios), ".2f") if known else "-",
    ]
