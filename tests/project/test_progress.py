"""Long runs say how far they are: one bar with the time left, in terminals and notebooks, and nowhere else."""

import ast
import io
import re
import sys
import threading
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import pytest
from walls import running_bond

import dem
import limitmason as lm
from limitmason.display import progress
from limitmason.display.progress import clock, noted, reached, taken_up, task, watched, write
from limitmason.errors import InputError


class Terminal(io.StringIO):
    """Standard error as a terminal, or as a file."""

    def __init__(self, terminal=True):
        super().__init__()
        self.terminal = terminal

    def isatty(self):
        return self.terminal

    @property
    def frames(self):
        return [f.strip() for f in re.split(r"[\r\n]", self.getvalue()) if f.strip()]


@pytest.fixture
def screen(monkeypatch):
    """A terminal on which every report is drawn at once."""
    shown = Terminal()
    monkeypatch.setattr(progress, "_stream", lambda: shown)
    monkeypatch.delenv(progress.VARIABLE, raising=False)
    monkeypatch.setattr(progress, "_mode", [])
    for name in ("AFTER", "_TERMINAL", "_LOG"):
        monkeypatch.setattr(progress, name, 0.0)
    return shown


def half_done():
    with task("run"):
        reached(0.5, "half")


def test_a_bar_tells_what_is_done_and_the_time_left_and_goes_away(screen, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with task("run"):
        now[0] += 30.0
        reached(0.25, "so far so good")
    assert any("run:  25%" in f and "30 s, about 1:30 left; so far so good" in f for f in screen.frames)
    assert not progress._bar
    assert screen.getvalue().endswith("\r")


def test_what_was_done_before_a_run_was_taken_up_took_no_time_of_it(screen, monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with task("run"):
        taken_up(0.5)
        now[0] += 30.0
        reached(0.6)
    # a tenth in 30 s: four tenths are left
    assert any("run:  60%" in f and "30 s, about 2:00 left" in f for f in screen.frames)


def test_a_resume_inside_a_command_counts_what_is_computed_now(screen, monkeypatch):
    """The command line's own task lies around every run: half was in a store, a tenth of the rest takes 10 s."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with task("limitmason"):
        reached(0.0, share=1.0)
        with task("sweep"):
            taken_up(0.5)
            now[0] += 10.0
            reached(0.6, "going on")
    assert any("60%" in f and "10 s, about 40 s left; going on" in f for f in screen.frames)


def test_what_runs_inside_fills_its_share_of_one_bar(screen):
    with task("outer"):
        for k in range(2):
            reached(0.5 * k, f"half {k}", share=0.5)
            with task("inner"):
                reached(0.5, "middle")
    parts = [int(m) for m in re.findall(r"(\d+)%", screen.getvalue())]
    assert set(parts) - {0} == {25, 50, 75}
    assert parts == sorted(parts)
    assert "half 1; middle" in screen.getvalue()
    assert "inner:" not in screen.getvalue()


def test_a_level_that_cannot_tell_hides_the_time_left_and_nothing_else(screen):
    with task("outer"):
        reached(0.5, share=0.5)
        with task("inner"):
            reached(None, "somewhere")
        assert screen.frames[-1].endswith("0 s; somewhere")
        assert "50%" in screen.frames[-1]
        reached(None)
        noted("no end in sight")
    assert "no end in sight" in screen.frames[-1]


def test_nothing_is_drawn_in_the_first_seconds(screen, monkeypatch):
    monkeypatch.setattr(progress, "AFTER", 60.0)
    half_done()
    assert screen.getvalue() == ""


def test_the_clock_moves_on_while_nothing_is_reached(screen, monkeypatch):
    monkeypatch.setattr(progress, "_CLOCK", 0.01)
    with task("stuck"):
        drawn = threading.Event()
        for _ in range(500):
            if screen.frames:
                break
            drawn.wait(0.01)
    assert screen.frames
    assert screen.frames[0].startswith("stuck: 0 s")


def test_a_file_is_left_alone_unless_asked_for(screen, monkeypatch):
    screen.terminal = False
    half_done()
    assert screen.getvalue() == ""
    with lm.show_progress(True):
        half_done()
    assert len(screen.frames) == 1
    monkeypatch.setenv(progress.VARIABLE, "always")
    half_done()
    assert len(screen.frames) == 2


def test_a_terminal_is_left_alone_when_asked_to(screen, monkeypatch):
    with lm.show_progress(False):
        half_done()
    monkeypatch.setenv(progress.VARIABLE, "never")
    half_done()
    assert screen.getvalue() == ""
    with pytest.raises(InputError, match="always, never, auto"):
        lm.show_progress("sometimes")


def test_a_notebook_counts_as_looked_at(screen, monkeypatch):
    screen.terminal = False
    monkeypatch.setitem(sys.modules, "ipykernel", object())
    half_done()
    assert "50%" in screen.getvalue()


def test_threads_stay_silent(screen):
    thread = threading.Thread(target=half_done)
    thread.start()
    thread.join()
    assert screen.getvalue() == ""


def test_worker_processes_stay_silent():
    with ProcessPoolExecutor(1) as pool:
        assert not pool.submit(would_draw).result()


def would_draw():
    lm.show_progress(True)
    return progress.bars_are_drawn()


def test_a_progress_function_of_ones_own_is_followed_instead(screen):
    told = []

    @watched("own")
    def run(*, progress=None):
        reached(0.5)
        if progress is not None:
            progress("half")

    run(progress=told.append)
    assert told == ["half"]
    assert screen.getvalue() == ""
    with task("outer"):
        reached(0.25)
        run(progress=told.append)
    assert "50%" not in screen.getvalue(), "what is followed by other means moves no bar around it"


def test_an_error_takes_the_bar_away(screen):
    with pytest.raises(ZeroDivisionError), task("run"):
        reached(0.5 / 0)
    assert not progress._bar


def test_lines_are_written_above_the_bar(screen):
    with task("run"):
        reached(0.5)
        write("a line")
    assert re.search(r"\ra line\n", screen.getvalue())


@pytest.mark.parametrize("seconds, words", [(6.6, "7 s"), (185.0, "3:05"), (7385.0, "2:03:05"), (float("nan"), "")])
def test_times_are_short(seconds, words):
    assert clock(seconds) == words


WALL = running_bond(2, 3, joint=lm.Joint(33.0, normal_stiffness=1e9, shear_stiffness=1e9))
LOADS = lm.Loads.horizontal(WALL)
TOP = dem.Drive({WALL.blocks[-1].name: {"x": 1.0}})


def double(x):
    return 2.0 * x


def line(x):
    return {"y": x}


LONG = {
    "DEM, collapse": lambda: dem.collapse(WALL, LOADS, contact_points=(2, 2), error_budget=("rate",)),
    "limit analysis": lambda: lm.limit_analysis(WALL, LOADS, "non-associative", prove=False, search="quick"),
    "pushover": lambda: lm.pushover(WALL, LOADS, to=1e-4),
    "compare": lambda: lm.compare(WALL, LOADS, ("associative", "mechanisms")),
    "study": lambda: lm.study.sweep(double, {"x": range(4)}),
    "calibration": lambda: lm.calibrate(line, {"y": (2.0, 0.1)}, [lm.Parameter("x", 1.0, (0.1, 10.0))]),
    "push": lambda: dem.push(WALL, TOP, to=1e-4, steps=2000, rate_check=False, samples=10, contact_points=(2, 2)),
    "time stepping": lambda: dem.simulate(WALL, dem.Hold(steps=400), sample=100, contact_points=(2, 2)),
}


@pytest.mark.parametrize("title", LONG)
def test_long_runs_say_how_far_they_are(title, screen):
    LONG[title]()
    titles = {f.split(":")[0] for f in screen.frames}
    assert titles == {title}, "one bar, of what was called"
    parts = [int(m) for m in re.findall(r"(\d+)%\|", screen.getvalue())]
    assert max(parts) >= 50
    assert any(" left" in f for f in screen.frames)
    assert not progress._bar


def test_a_bar_changes_no_answer(screen):
    shown = dem.collapse(WALL, LOADS, contact_points=(2, 2), error_budget=())
    with lm.show_progress(False):
        plain = dem.collapse(WALL, LOADS, contact_points=(2, 2), error_budget=())
    assert shown.collapse_multiplier == plain.collapse_multiplier
    assert shown.details["steps"] == plain.details["steps"]


HANDED_ON = {
    "limitmason/diagnosis/report.py:report",
    "limitmason/diagnosis/result.py:judged_again",
    "limitmason/limit/nonassociative/analysis.py:solve_nonassociative",
    "limitmason/limit/nonassociative/search.py:search_smallest",
}
"""Functions that hand their progress function on, not by its name, to one that shows a bar without it."""


def test_every_function_that_takes_a_progress_function_shows_a_bar_without_one():
    """Whoever writes a long run gives it a task: found in the text of every module."""
    missing = set()
    for package in (lm, dem):
        root = Path(package.__file__).parent
        for file in sorted(root.rglob("*.py")):
            text = file.read_text(encoding="utf-8")
            if "progress:" not in text:
                continue
            for node in ast.walk(ast.parse(text)):
                if not isinstance(node, ast.FunctionDef) or node.name.startswith("_"):
                    continue
                if "progress" not in [a.arg for a in node.args.kwonlyargs + node.args.args]:
                    continue
                lines = text.splitlines()[min(d.lineno for d in [node, *node.decorator_list]) - 1 : node.end_lineno]
                if not any(w in "\n".join(lines) for w in ("@watched(", "with task(", "progress=progress")):
                    missing.add(f"{file.relative_to(root.parent)}:{node.name}")
    assert sorted(missing) == sorted(HANDED_ON)
