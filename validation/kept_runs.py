"""Studies whose runs are kept in a table: the loop over those that are missing, and the names on a command line."""

import argparse
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Protocol


class Study(Protocol):
    """A module with cases that have names, and how to make and keep what is found of each."""

    CASES: Sequence[Any]

    def run(self, case: Any, progress: Callable[[str], None] | None) -> Any:
        """Make a run."""

    def read(self) -> dict[str, Any]:
        """What is kept, by name."""

    def write(self, kept: Mapping[str, Any]) -> None:
        """Keep it."""


def make(study: Study, names: Sequence[str], progress: Callable[[str], None]) -> None:
    """Make runs by name, all that are missing without names, and keep each as soon as it is there."""
    order = [c.name for c in study.CASES]
    for case in study.CASES:
        if case.name in names or (not names and case.name not in study.read()):
            found = study.run(case, progress)
            kept = {**study.read(), case.name: found}
            study.write({n: kept[n] for n in sorted(kept, key=order.index)})


def command(doc: str | None, what: Sequence[str] = ()) -> argparse.ArgumentParser:
    """Parser of one of ``what``, where there is a choice, and of names of runs to make again."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    if what:
        parser.add_argument("what", choices=what)
    parser.add_argument("names", nargs="*", help="of runs to make again; what is missing by default")
    return parser


def refuse_unknown(parser: argparse.ArgumentParser, names: Iterable[str], cases: Sequence[Any]) -> None:
    """End the command where a run is named that there is none of."""
    known = [c.name for c in cases]
    if unknown := sorted(set(names) - set(known)):
        parser.error(f"no run called {', '.join(unknown)}; known: {', '.join(known)}")


def with_section(text: str, lines: Sequence[str]) -> str:
    """A page with one of its sections in the place of the one of the same heading, or before its last."""
    parts = ("\n" + text).split("\n## ")
    new = "\n".join(lines).removeprefix("## ").rstrip("\n") + "\n"
    heading = new.partition("\n")[0]
    at = next((k for k, p in enumerate(parts) if p.partition("\n")[0] == heading), None)
    if at is None:
        parts.insert(len(parts) - 1, new)
    else:
        parts[at] = new
    return "\n## ".join(parts)[1:]
