"""The command line: packaged experiments, models from files, figures.

Answers go to standard output, progress and errors to standard error; a mistake in the input ends with exit status 2
and one line that names it, an analysis without a finite multiplier with exit status 3.
"""

import argparse
import csv
import json
import sys
from collections.abc import Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path

from limitmason import __version__
from limitmason.methods import available_methods, predict
from limitmason.model.assembly import Assembly
from limitmason.model.load import Loads
from limitmason.results import ALMOST_SOLVED, SOLVED, Prediction

_DESCRIPTION = """\
Collapse multiplier of rigid-block masonry: at what load a block structure collapses, how, and how far to trust it.

A TARGET is either a model file (.json; `limitmason template` writes one to start from) or a packaged experiment
written SOURCE/SPECIMEN, for example ferris-tin-loi-2001/wall-3.
"""

_EPILOG = """\
examples:
  limitmason experiments list                          what is packaged
  limitmason experiments show minho-dry-stone-2005-2009 SW.100.1
  limitmason experiments run ferris-tin-loi-2001       all six walls against the published values
  limitmason experiments run --all --csv table.csv     everything, as a table file
  limitmason solve ferris-tin-loi-2001/wall-3 --figure wall-3.png
  limitmason template wall.json                        a small wall to edit
  limitmason solve wall.json --flow-rule non-associative --output answer.json
  limitmason figure mechanism wall.json -o wall.pdf    also: assembly, forces; .png, .pdf or .svg

units: SI (m, kg, N, Pa), angles in degrees where a name ends in _deg; z is up, compression positive.
The multiplier scales the live loads; for horizontal loads equal to the weight it is the tangent of the tilt angle
(dry joints). exit status: 0 solved, 2 wrong input, 3 no finite multiplier, 130 interrupted.
"""


_TEMPLATE = """\
{
 "schema": "limitmason-model",
 "version": 1,
 "thickness": 0.3,
 "density": 2000.0,
 "joint": {"friction_angle_deg": 33.0, "dilatancy_angle_deg": 0.0},
 "fixed": ["ground"],
 "loads": {"horizontal": [1, 0, 0]},
 "names": [
NAMES
 ],
 "outlines": [
OUTLINES
 ]
}
"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status.

    Parameters
    ----------
    arguments : as typed after ``limitmason``; those of the process by default
    """
    options = _parser().parse_args(arguments)
    if not hasattr(options, "run"):
        _parser().print_help()
        return 0
    try:
        return options.run(options)
    except KeyboardInterrupt:
        _say("interrupted")
        return 130
    except BrokenPipeError:
        return 0
    except (ValueError, TypeError, KeyError, OSError, ImportError) as error:
        if options.debug:
            raise
        if isinstance(error, FileNotFoundError):
            error = ValueError(f"{error.filename}: no such file")
        _say(f"error: {error.args[0] if isinstance(error, KeyError) and error.args else error}")
        return 2


def _parser() -> argparse.ArgumentParser:
    style = argparse.RawDescriptionHelpFormatter
    top = argparse.ArgumentParser("limitmason", description=_DESCRIPTION, epilog=_EPILOG, formatter_class=style)
    top.add_argument("--version", action="version", version=f"limitmason {__version__}")
    top.add_argument("--debug", action="store_true", help="show the whole traceback of an error")
    commands = top.add_subparsers(title="commands", metavar="COMMAND")

    packaged = commands.add_parser("experiments", help="list, show and run the packaged experiments")
    packaged.set_defaults(run=lambda o: (packaged.print_help(), 0)[1])
    actions = packaged.add_subparsers(metavar="ACTION")
    listing = actions.add_parser("list", help="sources and specimens")
    listing.add_argument("source", nargs="?", help="only this source")
    listing.set_defaults(run=_list)
    show = actions.add_parser("show", help="data sheet of one specimen: parameters, values, source, assumptions")
    show.add_argument("source")
    show.add_argument("specimen", nargs="?")
    show.set_defaults(run=_show)
    run = actions.add_parser("run", help="predict and print beside measured and published values")
    run.add_argument("source", nargs="?", help="a source, or SOURCE/SPECIMEN")
    run.add_argument("specimens", nargs="*", help="only these specimens")
    run.add_argument("--all", action="store_true", help="every packaged experiment that has a model")
    run.add_argument("--csv", type=Path, metavar="FILE", help="also write the table to a file")
    run.add_argument("--figure", type=Path, metavar="FILE", help="also draw predicted against measured or published")
    _analysis_options(run, flow_default=None)
    run.set_defaults(run=_run)

    summary = actions.add_parser("summary", help="all packaged cases as one Markdown table (a minute)")
    summary.set_defaults(run=_summary)

    solve = commands.add_parser("solve", help="collapse multiplier of a model with its certificate")
    solve.add_argument("target", metavar="TARGET")
    solve.add_argument("--output", type=Path, metavar="FILE", help="write the whole prediction as JSON")
    solve.add_argument("--figure", type=Path, metavar="FILE", help="draw the mechanism (.png, .pdf, .svg)")
    solve.add_argument("--vtu", type=Path, metavar="FILE", help="write blocks and mechanism for ParaView")
    _analysis_options(solve)
    solve.set_defaults(run=_solve)

    figure = commands.add_parser("figure", help="draw an assembly, its mechanism or its contact forces")
    figure.add_argument("kind", choices=("assembly", "mechanism", "forces"))
    figure.add_argument("target", metavar="TARGET")
    figure.add_argument("-o", "--output", type=Path, metavar="FILE", help="default: KIND.png")
    figure.add_argument("--view", choices=("auto", "elevation", "3d"), default="auto")
    figure.add_argument("--dpi", type=int, default=200)
    _analysis_options(figure)
    figure.set_defaults(run=_figure)

    template = commands.add_parser("template", help="write a small model file to edit")
    template.add_argument("file", type=Path)
    template.set_defaults(run=_template)
    return top


def _analysis_options(parser: argparse.ArgumentParser, flow_default: str | None = "associative") -> None:
    group = parser.add_argument_group("analysis")
    group.add_argument("--method", default="limit", choices=sorted(available_methods()), help="default: limit")
    flow_help = "associative ignores the dilatancy angle" + ("" if flow_default else "; default: as published")
    rules = ("associative", "non-associative")
    group.add_argument("--flow-rule", choices=rules, default=flow_default, help=flow_help)
    group.add_argument("--contact-model", choices=("vertices", "grid"), default="vertices")
    group.add_argument(
        "--grid", type=int, nargs=2, metavar=("ALONG", "ACROSS"), help="points per interface; needs grid"
    )
    group.add_argument(
        "--torsion-limit", action="store_true", help="limit torsion to that of uniform pressure (estimate)"
    )


def _settings(options: argparse.Namespace) -> dict:
    if options.method != "limit":
        return {}
    out: dict = {"contact_model": options.contact_model}
    if options.grid:
        if options.contact_model != "grid":
            raise ValueError("--grid needs --contact-model grid")
        out["grid"] = tuple(options.grid)
    if options.torsion_limit:
        out["torsion_limit"] = True
    if options.flow_rule:
        out["flow_rule"] = options.flow_rule
    return out


def _say(text: str) -> None:
    sys.stderr.write(text + "\n")
    sys.stderr.flush()


def _print(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def _load(target: str) -> tuple[Assembly, Loads, str]:
    """Assembly, loads and title of a model file or a packaged experiment."""
    path = Path(target)
    if path.exists() or path.suffix.lower() in (".json", ".obj", ".dxf"):
        from limitmason import formats

        if path.suffix.lower() in (".obj", ".dxf"):
            raise ValueError(
                f"{path} holds geometry alone: read it with limitmason.formats in a script, give thickness, joints and "
                "loads, and write the model as .json (see examples/traced_drawing.py)"
            )
        model = formats.read_json(path)
        if not model.loads.live.any():
            raise ValueError(f"{path}: the file holds no live load; add a 'loads' entry, see `limitmason template`")
        return model.assembly, model.loads, path.stem
    from limitmason import experiments

    source, slash, specimen = target.partition("/")
    if not slash:
        raise ValueError(f"{target!r} is neither a file nor SOURCE/SPECIMEN; see `limitmason experiments list`")
    test = experiments.load(source, specimen)
    return test.assembly(), test.loads(), f"{source} {specimen}"


def _report(prediction: Prediction) -> int:
    _print(str(prediction))
    return 0 if prediction.status in (SOLVED, ALMOST_SOLVED) else 3


def _list(options: argparse.Namespace) -> int:
    from limitmason import experiments

    for source in [options.source] if options.source else experiments.sources():
        names = experiments.specimens(source)
        case = experiments.load(source, names[0])
        _print(f"{source}: {case.source.title}\n  {' '.join(names)}")
    return 0


def _show(options: argparse.Namespace) -> int:
    from limitmason import experiments

    source, _, specimen = options.source.partition("/")
    specimen = options.specimen or specimen
    for name in [specimen] if specimen else experiments.specimens(source):
        _print(str(experiments.load(source, name)) + "\n")
    return 0


def _run(options: argparse.Namespace) -> int:
    from limitmason import experiments

    if options.all == bool(options.source):
        raise ValueError("name a source, or give --all; see `limitmason experiments list`")
    settings = _settings(options)
    flow_rule = settings.pop("flow_rule", None)
    if options.all:
        cases = list(experiments.all_cases(with_model=True))
    else:
        source, _, one = options.source.partition("/")
        names = ([one] if one else []) + options.specimens
        cases = [experiments.load(source, n) for n in names or experiments.specimens(source)]
    rows = []
    for k, case in enumerate(cases, 1):
        _say(f"[{k}/{len(cases)}] {case.source.name}/{case.specimen}")
        rows += experiments.run(case, options.method, flow_rule=flow_rule, **settings)
    _print(experiments.as_text(rows))
    if options.csv:
        _write_table(options.csv, rows)
        _say(f"wrote {options.csv}")
    if options.figure:
        from limitmason import figures

        _draw_comparison(options.figure, rows, figures)
    return 0


def _draw_comparison(path: Path, rows: Sequence, figures) -> None:
    known = [r for r in rows if isfinite(r.predicted)]
    units = {r.unit for r in known}
    if len(units) != 1:
        raise ValueError(
            "no row has a prediction: there is nothing to draw" if not known
            else f"the values have different units ({', '.join(sorted(units))}): draw one source at a time"
        )  # fmt: skip
    kinds = {r.kind for r in known}
    names = {(r.source, r.specimen) for r in known}
    figure = figures.predicted_against_published(
        [(f"{r.specimen} {r.quantity}" if len(names) < len(known) else r.specimen, float(r.reference), r.predicted,
          f"{r.kind}, {r.flow_rule or r.method}") for r in known],
        quantity="collapse multiplier λ [-]" if units == {"-"} else f"collapse load [{units.pop()}]",
        published=" or ".join(sorted(kinds)),
        title=", ".join(sorted({r.source for r in known})),
    )  # fmt: skip
    figure.savefig(path, dpi=200)
    _say(f"wrote {path}")


def _summary(options: argparse.Namespace) -> int:
    del options
    from limitmason import experiments

    _print(experiments.summary_table(progress=_say))
    return 0


def _write_table(path: Path, rows: Sequence) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = ("source", "specimen", "quantity", "kind", "unit", "reference", "predicted", "ratio", "method")
        writer.writerow([*names, "flow_rule", "status", "seconds"])
        writer.writerow(["-"] * 4 + ["unit of reference and predicted", "unit", "unit", "-", "-", "-", "-", "s"])
        for r in rows:
            values = [r.source, r.specimen, r.quantity, r.kind, r.unit, float(r.reference), r.predicted, r.ratio]
            writer.writerow([*values, r.method, r.flow_rule, r.status, f"{r.seconds:.3f}"])


def _solve(options: argparse.Namespace) -> int:
    assembly, loads, title = _load(options.target)
    _say(f"{title}: {int((~assembly.fixed).sum())} free blocks, {len(assembly.interfaces)} interfaces, {loads.name}")
    prediction = predict(assembly, loads, options.method, **_settings(options))
    status = _report(prediction)
    from limitmason import formats

    if options.output:
        formats.write_prediction(options.output, prediction, assembly=assembly)
        _say(f"wrote {options.output}")
    if options.vtu:
        formats.write_vtu(options.vtu, assembly, prediction)
        _say(f"wrote {options.vtu}")
    if options.figure:
        _draw(options.figure, "mechanism", assembly, prediction, title)
    return status


def _figure(options: argparse.Namespace) -> int:
    assembly, loads, title = _load(options.target)
    output = options.output or Path(f"{options.kind}.png")
    if options.kind == "assembly":
        _draw(output, "assembly", assembly, None, title, view=options.view, dpi=options.dpi)
        return 0
    prediction = predict(assembly, loads, options.method, **_settings(options))
    status = _report(prediction)
    if status == 0:
        _draw(output, options.kind, assembly, prediction, title, view=options.view, dpi=options.dpi)
    return status


def _draw(path: Path, kind: str, assembly: Assembly, prediction: Prediction | None, title: str, *, view: str = "auto",
          dpi: int = 200) -> None:  # fmt: skip
    from limitmason import figures

    if kind == "assembly":
        figure = figures.assembly(assembly, title=title, view=view)
    elif prediction is None or prediction.resultants is None:
        _say(f"no figure: {'without an answer' if prediction is None else prediction.status}")
        return
    elif kind == "mechanism":
        figure = figures.mechanism(assembly, prediction, title=title, view=view)
    else:
        figure = figures.contact_forces(assembly, prediction, title=title, view=view)
    figure.savefig(path, dpi=dpi)
    _say(f"wrote {path}")


def _template(options: argparse.Namespace) -> int:
    if options.file.exists():
        raise ValueError(f"{options.file} exists already; choose another name")
    stones = {"ground": [[-0.2, -0.2], [1.4, -0.2], [1.4, 0.0], [-0.2, 0.0]]}
    for course, ends in enumerate([[0, 0.4, 0.8, 1.2], [0, 0.2, 0.6, 1.0, 1.2]] * 3):
        low, high = round(0.2 * course, 3), round(0.2 * (course + 1), 3)
        for k, (left, right) in enumerate(pairwise(ends), 1):
            stones[f"stone-{course + 1}-{k}"] = [[left, low], [right, low], [right, high], [left, high]]
    rows = [[f"  {json.dumps(outline)}" for outline in stones.values()], [f'  "{name}"' for name in stones]]
    outlines, names = (",\n".join(r) for r in rows)
    options.file.write_text(_TEMPLATE.replace("OUTLINES", outlines).replace("NAMES", names), encoding="utf-8")
    _say(f"wrote {options.file}: a small wall; edit its outlines, joint and loads, then `limitmason solve`")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
