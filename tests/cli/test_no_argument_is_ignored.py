"""No argument is silently ignored: every option of every command changes what happens, or is refused by its name.

The commands are run on tiny models with their computations replaced by recorders: an option is used when anything that
is computed, printed, drawn or written differs from a run without it.
"""

import argparse
import ast
import csv
import hashlib
import json
import re
import sys
import types
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from walls import running_bond

import dem
import limitmason as lm
from limitmason import cli, comparison, diagnosis, experiments, methods
from limitmason.cli import pushover, solve_and_draw
from limitmason.comparison import wall_ladder
from limitmason.study import memo

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("limitmason", "dem", "mechanisms")

# ---- every parameter is read ----

PROTOCOLS = {
    # causes of the measurement are called with (size, prediction, specimen), units are read by the declaration
    ("measurement.py", "gain", "specimen"), ("measurement.py", "angle_offset", "specimen"),
    ("measurement.py", "displacement_gain", "specimen"),
    ("measurement.py", "rig_friction", "unit"),
    # no edit of the model: refuses whatever it is called with
    ("faces.py", "torsion_strength", "size"), ("faces.py", "torsion_strength", "assembly"),
    ("faces.py", "torsion_strength", "loads"),
    ("__init__.py", "loads", "test"),  # recipes: (test, wall, sense)
    # of what is driven: a structure says what it is made of, and what its run says
    ("structure.py", "__init__", "loads"),
    ("zoned_structure.py", "curve_of", "seconds"),
    ("experiment.py", "__setattr__", "value"),  # refuses whatever is set
    # a law without added terms, and a term that changes nothing
    *(("added_terms.py", "_changed", name) for name in ("added", "slip", "damage")),
    *(("added_terms.py", function, name) for function in ("entries_of", "has_added") for name in ("law", "j")),
    *(("joint_term.py", "strength", name) for name in ("slip", "damage", "numbers")),
    # what numba calls, and a call that there is no such of
    ("compiled.py", "on_start", "event"), ("compiled.py", "on_end", "event"), ("threads.py", "_added", "typing"),
    ("threads.py", "sleep", "microseconds"),
}


def is_abstract(function: ast.FunctionDef) -> bool:
    body = [s for s in function.body if not (isinstance(s, ast.Expr) and isinstance(s.value, ast.Constant))]
    return not body or (len(body) == 1 and isinstance(body[0], ast.Raise) and "NotImplemented" in ast.dump(body[0]))


def unread(path: Path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) and not is_abstract(node):
            a = node.args
            names = [x.arg for x in (*a.posonlyargs, *a.args, *a.kwonlyargs, *filter(None, (a.vararg, a.kwarg)))]
            read = {n.id for part in node.body for n in ast.walk(part) if isinstance(n, ast.Name)}
            for name in names:
                if name not in read | {"self", "cls"} and not name.startswith("_"):
                    yield path.name, node.name, name


@pytest.mark.slow
def test_every_parameter_of_every_function_is_read_in_its_body():
    files = [f for p in PACKAGES for f in (ROOT / p).rglob("*.py")]
    assert len(files) > 100
    assert {row for f in files for row in unread(f)} - PROTOCOLS == set()


# ---- every option of every command ----


def leaves(parser: argparse.ArgumentParser, path: tuple[str, ...] = ()):
    """All commands that take no further command, with their parsers."""
    nested = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    if not nested:
        yield path, parser
    for action in nested:
        for name, child in action.choices.items():
            yield from leaves(child, (*path, name))


PARSER = cli.parser.command_parser()
COMMANDS = dict(leaves(PARSER))
BASES = {
    "experiments list": ["experiments", "list"],
    "experiments show": ["experiments", "show", "ferris-tin-loi-2001/wall-1"],
    "experiments run": ["experiments", "run", "ferris-tin-loi-2001", "wall-1"],
    "predict": ["predict", "modern-walls", "189", "--method", "formulas"],
    "solve": ["solve", "wall.json"],
    "figure assembly": ["figure", "assembly", "wall.json"],
    "figure mechanism": ["figure", "mechanism", "wall.json"],
    "figure forces": ["figure", "forces", "wall.json"],
    "stability": ["stability", "arch.json"],
    "app": ["app"],
    "axles": ["axles", "arch.json", "--axle", "0", "1e4", "--level", "0.9"],
    "region": ["region", "wall.json", "--live", "--push", "block-4", "0", "0", "-1e3"],
    "assess": ["assess", "wall.json", "--site", "0.15", "2.45", "0.28"],
    "template": ["template", "new.json"],
    "view": ["view", "wall.json"],
    "view, alone": ["view", "wall.json", "--alone"],
    "check": ["check", "wall.json"],
    "compare": ["compare", "wall.json"],
    "report": ["report", "wall.json"],
    "compare, associative": ["compare", "wall.json", "--methods", "associative"],
    "pushover": ["pushover", "wall.json", "--to", "1mm", "--block", "beam", "--direction", "1", "0", "0"],
    "pushover, packaged": ["pushover", "brick-panels-opening/S1", "--to", "1mm"],
    "diagnose, column": ["diagnose", "data.csv"],
    "diagnose, column and list": ["diagnose", "data.csv", "--causes", "own_model.py:OUTSIDE"],
    "diagnose, own": ["diagnose", "data.csv", "--model", "own_model.py:simulate", "--causes", "own_model.py:CAUSES"],
    "diagnose, series": ["diagnose", "--model", "murano-u-walls"],
    "diagnose, template": ["diagnose", "--template", "out.csv"],
}
METHODS = ("limit", "dem", "mechanisms")
VALUES = {
    "--all": [], "--arch": [],
    "--csv": ["t.csv"], "--figure": ["f.png"], "--method": ["dem"], "--flow-rule": ["non-associative"],
    "--contact-model": ["grid"], "--grid": ["3", "3"], "--torsion-limit": [],
    "--methods": ["non-associative", "dem"], "--store": ["kept"],
    "--workers": ["2"], "--markdown": ["page.md"], "--output": ["o.json"], "--vtu": ["v.vtu"], "-o": ["drawn.png"],
    "--view": ["3d"], "--dpi": ["50"], "--measured": ["0.4", "0.5"], "--points": ["2", "2"], "--no-budget": [],
    "--proven": ["1"], "--model": ["own_model.py:simulate"], "--predicted": ["other"], "--template": ["out.csv"],
    "--out": ["elsewhere"], "--title": ["A title"], "--group": ["batch"], "--covariates": ["height"],
    "--batches": ["group"], "--noise": ["0.05"], "--dof": ["8"], "--input": ["mu=0.6,0.03"],
    "--friction": ["33"], "--density": ["1800"], "--tilt": ["left"], "--held": ["b1"], "--gap": ["0.01"],
    "--open": [], "--alone": [],
    "--mortar": ["0.01"], "--layers": ["stones"],
    "--causes": ["gain"], "--towards": ["other"], "--tilting": [], "--spatial": [], "--seed": ["3"],
    "--levels": ["11"], "--jobs": ["2"], "--fresh": [], "--pool": ["pool.csv"], "--next": ["2"], "--rehearse": ["2"],
    "--shared": ["batch"], "--missing": ["2"],
    "--no-checks": [], "--distance": ["0.5"], "--angle": ["60"], "--tolerance": ["0.001"], "--thickness": ["0.2"],
    "--scale": ["0.001"], "--to": ["2mm"], "--block": ["beam"], "--direction": ["0", "0", "-1"], "--blocks": ["lumped"],
    "--spacing": ["20mm"], "--steps": ["500"], "--once": [], "--option": ["outline=675/8/5"],
    "--checkpoint": ["kept.npz"], "--cracks": ["c.png"], "--zone-size": ["20mm"], "--search": ["quick"],
    "--stress": ["solid"], "--time-limit": ["0.5"], "--no-interval": [],
    "--support": ["base-left"], "--forces": ["forces.csv"], "--axle": ["0.5", "2e4"], "--level": ["1.0"],
    "--push": ["block-3", "500", "0", "0"], "--live": [], "--within": ["0.01"], "--sld": ["0.05", "2.5", "0.25"],
    "--site": [], "--slc": ["0.2", "2.5", "0.3"], "--soil": ["D"], "--topography": ["1.2"], "--mode": ["0.3", "1.2"],
    "--confidence": ["1.2"], "--along": ["0", "0", "1"],
    "--fill": ["1800"], "--spread": ["10"], "--port": ["8765"], "--folder": ["walls"], "--no-browser": [],
}
OTHER = {("view", "-o"): ["other.html"], ("view, alone", "-o"): ["other.html"],
         ("predict", "--method"): ["first"], ("report", "-o"): ["other.html"], ("assess", "-o"): ["other.html"],
         ("region", "--tolerance"): ["0.3"],
         ("compare", "--markdown"): [], ("compare, associative", "--markdown"): [], ("compare", "--methods"): ["dem"],
         ("compare, associative", "--methods"): ["mechanisms"],
         ("pushover", "--method"): ["limit"], ("pushover, packaged", "--method"): ["limit"],
         ("pushover", "--block"): ["stone-1"], ("pushover", "--direction"): ["0", "0", "1"]}
WITH = {"--block": ["--direction", "1", "0", "0"], "--direction": ["--block", "spreader"],
        "--dof": ["--noise", "0.05"], "--along": ["--support", "base-left"], "--workers": ["--store", "kept"]}
OWN_MODEL = """
from limitmason import causes
from limitmason.diagnosis import Cause
def simulate(specimen, bend=0.0, mu=0.6):
    return 1.0 + bend * mu
CAUSES = [Cause("bend", "bend", 0.0, (0.0, 1.0))]
OUTSIDE = [causes.gain()]
"""


def command_of(base: str) -> argparse.ArgumentParser:
    words = BASES[base]
    return COMMANDS[tuple(words[:2])] if words[0] == "experiments" else COMMANDS[(words[0],)]


def test_every_command_and_every_option_is_tried_here():
    tried = {tuple(w[:2]) if w[0] == "experiments" else (w[0],) for w in BASES.values()}
    assert tried == set(COMMANDS)
    for path, parser in COMMANDS.items():
        for action in parser._actions:
            if action.option_strings and action.dest != "help":
                assert action.option_strings[0] in VALUES, (path, action.option_strings)


@pytest.fixture(scope="module")
def canned():
    wall = running_bond(2, 2)
    loads = lm.Loads.horizontal(wall)
    found = {m: lm.predict(wall, loads, m, **({"error_budget": ()} if m == "dem" else {})) for m in METHODS}
    return wall, loads, found, lm.compare(wall, loads, ("associative", "mechanisms"))


@pytest.fixture(scope="module")
def inputs(canned, tmp_path_factory):
    """What lies in the folder of every command, by name: written once, as to write a model takes as long as a run."""
    folder, (wall, loads, *_) = tmp_path_factory.mktemp("inputs"), canned
    arch = lm.build.arch(radius=1.0, thickness=0.15, width=0.5, voussoirs=5, joint=lm.Joint(45.0), angle_deg=150.0)
    lm.formats.write_json(folder / "wall.json", wall, loads)
    lm.formats.write_json(folder / "arch.json", arch, lm.Loads.weight(arch))
    (folder / "own_model.py").write_text(OWN_MODEL)
    write_data(folder / "data.csv")
    write_data(folder / "pool.csv", specimens=4)
    return {p.name: p.read_bytes() for p in folder.iterdir()}


class Stopped(Exception):
    """Where a diagnosis would begin to compute."""


@pytest.fixture
def run(canned, inputs, tmp_path, monkeypatch, capsys):
    """Run a command in a folder of its own: exit status, messages, and everything that it did."""
    *_, found, table = canned
    done: list[str] = []

    def note(*what) -> None:
        done.append(re.sub(r"0x[0-9a-f]+", "", repr(what)))

    def predict(_assembly, _loads, method, **settings):
        note("predict", method, settings)
        return found[method]

    def investigate(study, **settings):
        known = {k: v for k, v in settings.items() if k != "progress"}
        read = (study.covariates, study.groups, study.nuisance, str(study.noise), list(study.measured), study.levels,
                study.shared)
        note("study", vars(study.about), study.specimens, read, study.n_jobs, [(c.name, c.unit) for c in study.causes])
        note("by", getattr(study.simulate, "method", None), getattr(study.simulate, "options", None))
        note("investigate", known)
        said = types.SimpleNamespace(record=lambda: {"headline": "none", "in words": []})
        return types.SimpleNamespace(answer=said, n=study.n)

    def written(study, folder, *, checks):
        note("written", study.n, str(folder), checks)
        folder.mkdir(exist_ok=True)
        (folder / "report.txt").write_text("a report\n")
        return [folder / "report.txt"]

    def recorder(name, answer):
        def recorded(*arguments, **options):
            known = {k: v for k, v in options.items() if k != "progress"}
            note(name, [getattr(a, "name", a) for a in arguments if not isinstance(a, lm.Assembly | lm.Loads)], known)
            return answer

        return recorded

    def drive(assembly, driven_by, **settings):
        known = {k: v for k, v in settings.items() if k not in ("progress", "loads")}
        note("drive", assembly.n_blocks, driven_by.displacement, known)
        return lm.Curve(np.array([0.0, 1e-3]), np.array([0.0, 5.0]), status="finished")

    pushed = methods.Method("dem", None, drive=drive)
    monkeypatch.setattr(solve_and_draw, "predict", predict)
    # of a table only the runs are replaced: it is the table that hands every option on to them
    row = recorder("run", comparison.run(experiments.load("pavia-tilting", "S1")))
    monkeypatch.setattr(sys.modules["limitmason.comparison.specimen"], "run", row)
    monkeypatch.setattr(experiments, "all_cases", lambda **_: [experiments.load("pavia-tilting", "S1")])
    monkeypatch.setattr(wall_ladder, "predict_walls", recorder("walls", wall_ladder.predict_walls("formulas", ["189"])))
    monkeypatch.setattr(comparison, "compare", recorder("compare", table))
    monkeypatch.setattr(pushover, "get_method", lambda name: methods.get_method(name) if name == "limit" else pushed)
    monkeypatch.setattr(pushover, "_draw", lambda o, *_: note("draw", o.figure, o.cracks))
    monkeypatch.setattr(diagnosis, "investigate", investigate)
    monkeypatch.setattr(lm.figures, "diagnosis_folder", written)
    # what a figure shows is tested elsewhere: here it counts that it is drawn, of what, and how
    monkeypatch.setattr(solve_and_draw, "draw", lambda *a, **o: note("draw", a[:2], a[3] and a[3].method, a[4:], o))
    monkeypatch.setattr(solve_and_draw.webbrowser, "open", lambda address: note("open", Path(address).name))
    drawn = SimpleNamespace(savefig=lambda path, **_: note("draw", path))
    monkeypatch.setattr(lm.figures, "predicted_beside_references", lambda _: drawn)
    monkeypatch.setattr(
        lm.figures, "structure_report",
        lambda model, loads, table, path, **o: note("report", model.n_blocks, loads.name, str(path), o),
    )
    monkeypatch.setattr(lm.figures, "assessment_report", lambda v, path, **o: note("page", str(v), str(path), o))

    def served(folder, port):
        note("serve", folder, port)
        place = SimpleNamespace(path=folder)
        return nullcontext(SimpleNamespace(url="http://127.0.0.1/", folder=place, serve_forever=lambda: None))

    monkeypatch.setattr("limitmason.app.server.Server", served)
    monkeypatch.setattr("webbrowser.open", lambda address: note("browser", address))
    monkeypatch.setattr(cli, "command_parser", lambda: PARSER)  # one serves all runs
    count = iter(range(10_000))

    def go(arguments):
        folder = tmp_path / f"run-{next(count)}"
        folder.mkdir()
        monkeypatch.chdir(folder)
        for name, content in inputs.items():
            (folder / name).write_bytes(content)
        (folder / "diagnosis").mkdir()
        header = {"schema": memo.SCHEMA, "limitmason": lm.__version__, "of": ""}
        (folder / "diagnosis" / "simulations.jsonl").write_text(json.dumps(header) + "\n")
        before = set(folder.rglob("*"))
        done.clear()
        status = cli.main(arguments)
        out, err = capsys.readouterr()
        files = {
            str(p.relative_to(folder)): hashlib.sha256(p.read_bytes()).hexdigest()
            for p in folder.rglob("*") if p.is_file() and p not in before
        }
        gone = sorted(str(p.relative_to(folder)) for p in before if not p.exists())
        return status, err, (status, out, err, files, gone, tuple(done))

    return go


def write_data(path: Path, specimens: int = 6) -> None:
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["specimen", "measured", "predicted", "other", "group", "height", "batch"])
        writer.writerow(["-", "-", "-", "-", "-", "m", "-"])
        for k in range(specimens):
            batch = "ab"[k % 2]
            writer.writerow([f"B{k}", 0.4 + 0.01 * k, 0.42 + 0.01 * k, 0.5, f"g{k // 2}", 0.5 + 0.1 * (k // 2), batch])


def options_of(base: str):
    return [a.option_strings[0] for a in command_of(base)._actions if a.option_strings and a.dest != "help"]


def value_of(base: str, option: str) -> list[str]:
    if base.startswith("diagnose") and option == "--measured":
        return ["other"]
    return OTHER.get((base, option), VALUES[option])


def has_method(base: str) -> bool:
    return "--method" in options_of(base)


CASES = [
    (base, method)
    for base in BASES
    for method in (METHODS if has_method(base) and base in ("solve", "figure mechanism", "figure forces",
                                                            "experiments run", "diagnose, series") else (None,))
]


@pytest.mark.parametrize(("base", "method"), CASES)
def test_every_option_is_used_or_refused_by_name(base, method, run):
    start = BASES[base] + ([] if method is None else ["--method", method])
    status, err, plain = run(start)
    if base == "figure forces" and method == "mechanisms":
        assert plain[-1][-1].startswith("('draw'")  # what it says there is tested below
    assert status == 0, err
    ignored = []
    for option in options_of(base):
        if option in start:
            continue
        typed = [option, *value_of(base, option)]
        with_it = run([*start, *typed])
        refused = with_it[0] == 2 and option in with_it[1]
        if not refused and with_it[2] == plain:
            ignored.append(option)
        if option in WITH and not any(w in start for w in WITH[option][:1]):
            # where another option is needed with it, both together must do more than that one alone, or be refused
            alone, both = run([*start, *WITH[option]]), run([*start, *WITH[option], *typed])
            if alone[0] == 0 and both[2] == alone[2]:
                ignored.append(f"{option} with {WITH[option][0]}")
        assert "Traceback" not in with_it[1], (option, with_it[1])
        # of `check`, 1 says that there is something to decide
        assert with_it[0] in ((0, 1, 2) if base == "check" else (0, 2)), (option, with_it)
        if with_it[0] == 2:
            known = option in with_it[1] or option.lstrip("-").replace("-", "_") in with_it[1]
            assert known, (option, with_it[1])
    assert not ignored


def test_grid_reaches_the_analysis(run):
    assert "'grid': (3, 3)" in str(run(["solve", "wall.json", "--contact-model", "grid", "--grid", "3", "3"])[2])


def test_forces_are_not_drawn_where_there_are_none_and_a_mechanism_is_where_there_is_one(canned, tmp_path, capsys):
    wall, loads, *_ = canned
    model, picture = str(tmp_path / "w.json"), str(tmp_path / "p.png")
    lm.formats.write_json(model, wall, loads)
    assert cli.main(["figure", "forces", model, "--method", "mechanisms", "-o", picture]) == 2
    assert "there are no joint forces to draw" in capsys.readouterr().err
    assert not Path(picture).exists()
    assert cli.main(["figure", "mechanism", model, "--method", "mechanisms", "-o", picture]) == 0
    assert Path(picture).exists()


# ---- keywords of functions that apply in one mode only ----


@pytest.mark.parametrize(("call", "name"), [
    (lambda w, p: lm.limit_analysis(w, p, grid=(3, 3)), "grid"),
    (lambda w, p: lm.proven_range(w, p, grid=(3, 3)), "grid"),
    (lambda w, p: lm.limit_analysis(w, p, search="quick"), "search"),
    (lambda w, p: lm.limit_analysis(w, p, "non-associative", torsion_limit=True), "torsion_limit"),
    (lambda w, p: lm.predict(w, p, "limit", contact_points=(2, 2)), "contact_points"),
    (lambda w, p: lm.predict(w, p, "dem", flow_rule="associative"), "flow_rule"),
    (lambda w, p: lm.predict(w, p, "mechanisms", flow_rule="associative"), "flow_rule"),
    (lambda w, p: lm.predict(w, p, "mechanisms", include=["toppling"]), "include"),
    (lambda w, p: lm.compare(w, p, "associative", proven=1.0), "proven"),
    (lambda w, p: lm.compare(w, p, "associative", dem={"tolerance": 0.1}), "dem"),
    (lambda w, p: lm.compare(w, p, "associative", associative={"search": "quick"}), "search"),
    (lambda w, p: lm.settlement_analysis(w, 0, loads=p), "loads"),
    (lambda w, p: comparison.run(experiments.load("ferris-tin-loi-2001", "wall-1"), "dem", flow_rule="associative"),
     "flow_rule"),
    (lambda w, p: comparison.run(experiments.load("ferris-tin-loi-2001", "wall-1"), kinds="guessed"), "kinds"),
    (lambda w, p: experiments.load("mcmaster-bending", "theta-90").loads("-"), "direction '-'"),
])
def test_keyword_of_another_mode_is_refused_by_name(call, name, canned):
    wall, loads, *_ = canned
    two = [lm.Support(k, translations=True, rotations=True) for k in (0, 1)]
    wall = wall.with_supports(two) if name == "loads" else wall
    with pytest.raises((ValueError, TypeError), match=re.escape(name)):
        call(wall, loads)


SETTLED = {
    "contact_points": "contact_points is part of the state", "contact_model": "contact_model is part of the state",
    "dt": "dt is part of the state", "mode": "the state to start from is quasi-static, not dynamic",
    "joint_options": "joint_options differ from those of the run",
}


@pytest.mark.parametrize("setting", [
    {"contact_points": (2, 2)}, {"contact_model": "vertices"}, {"mode": "dynamic"}, {"dt": 0.5},
    {"joint_options": "soft"},
])
def test_run_that_starts_from_a_state_refuses_what_the_state_has_settled(setting, canned):
    wall, *_ = canned
    start = dem.simulate(wall, dem.Hold(steps=2), contact_points=(2, 2))
    if "joint_options" in setting:
        setting = {"joint_options": dem.JointOptions(stiffness_factor=0.1)}
    with pytest.raises(ValueError, match=SETTLED[next(iter(setting))]):
        dem.simulate(wall, dem.Hold(steps=2), start=start, **setting)
    again = dem.simulate(wall, dem.Hold(steps=2), start=start, mode="quasi-static")
    assert again.status == "finished"


def test_tensile_strength_above_the_apex_is_named_in_every_answer():
    # c / tan(phi) = 2.22e3 / tan 34 = 3.29e3 Pa, where the paper's 3DEC ran with 0.403 MPa (Murano et al., Table 4)
    joint = lm.Joint(34.0, cohesion=2.22e3, tensile_strength=0.403e6, name="first guess")
    wall = lm.build.column(width=0.4, depth=0.3, unit_height=0.2, courses=2, joint=joint)
    loads = lm.Loads.horizontal(wall)
    for method, options in (("limit", {}), ("mechanisms", {})):
        said = [w for w in lm.predict(wall, loads, method, **options).warnings if "cut at the apex" in w]
        assert len(said) == 1, method
        assert "4.03e+05 Pa (first guess) counts as c / tan(phi) = 3291 Pa" in said[0]
    # the DEM cuts nothing
    uncut = lm.predict(wall, loads, "dem", error_budget=(), contact_points=(2, 2))
    assert not any("cut at the apex" in w for w in uncut.warnings)
    below = wall.with_joints(lm.Joint(34.0, cohesion=2.22e3, tensile_strength=3e3))
    assert not any("cut at the apex" in w for w in lm.predict(below, loads, "limit").warnings)
