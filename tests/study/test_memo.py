"""The file of the memory of runs: shared, cut off and damaged, old ones refused, kept where all is read only."""

import json
import math
import os
import resource
import signal

import numpy as np
import pytest
from processes import ended, ready, said, together

import dem
import limitmason as lm
from limitmason.errors import InputError
from limitmason.study import Memo, sweep

JOINT = lm.Joint(33.0, normal_stiffness=1e10, shear_stiffness=5e9)


def begin(pipe, paths, who):
    for path in paths:
        ready(pipe)
        try:
            memo = Memo(path, "k")
            for k in range(5):
                memo.keep(10 * who + k, {"y": k})
            pipe.send("kept")
        except Exception as error:
            pipe.send(repr(error))


@pytest.mark.slow
def test_two_processes_begin_one_new_file_and_no_row_is_lost(tmp_path):
    paths = [tmp_path / "new" / f"{trial}" for trial in range(200)]
    children, pipes = together(begin, [(paths, 0), (paths, 1)])
    for path in paths:
        if path != paths[0]:
            assert [said(pipe) for pipe in pipes] == ["ready", "ready"]
            for pipe in pipes:
                pipe.send("go")
        assert [said(pipe) for pipe in pipes] == ["kept", "kept"]
        memo = Memo(path, "k")
        assert sorted(json.loads(key) for key in memo.rows) == [0, 1, 2, 3, 4, 10, 11, 12, 13, 14]
    assert [ended(child) for child in children] == [0, 0]


def filled(path, rows=6):
    memo = Memo(path, "k", kind=dict)
    for k in range(rows):
        memo.keep(k, {"y": k / 3, "t": "é" * 20, "none": math.nan})
    return path.read_bytes()


def test_a_file_cut_off_anywhere_goes_on_with_the_rows_before_the_cut(tmp_path):
    path = tmp_path / "rows"
    whole = filled(path)
    ends = [k + 1 for k, byte in enumerate(whole) if byte == ord("\n")]
    for n in range(0, len(whole), 7):
        path.write_bytes(whole[:n])
        memo = Memo(path, "k", kind=dict)
        assert len(memo) == max(sum(end <= n for end in ends) - 1, 0)
        for k in range(6):
            memo.once(k, lambda k=k: {"y": k / 3, "t": "é" * 20, "none": math.nan})
        assert path.read_bytes() == whole


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda b: b[:300] + b"\0" * 50 + b"\n" + b[300:], "line 3 is damaged"),
        (lambda b: b[:300] + b"\xff\xfe\n" + b[300:], "line 3 is damaged"),
        (lambda b: b + b'{"key": 3, "row": [1]}\n', "line 8 is damaged"),
        (lambda b: b + b'{"key": 3, "row": null}\n', "line 8 is damaged"),
        (lambda b: b + b'{"row": {}}\n', "line 8 is damaged"),
        (lambda b: b + b"[1]\n", "line 8 is damaged"),
        (lambda b: b + b'{"key": 3, "row": ' + b"[" * 900 + b"]" * 900 + b"}\n", "line 8 is damaged"),
        (lambda b: b + b'{"key": 3, "row": {"y": 1' + b"0" * 400 + b"}}\n", "line 8 is damaged"),
        (lambda b: b'{"a": 1}\n' + b, "not a store of runs"),
        (lambda b: b"a table\n", "not a store of runs"),
        (lambda b: b"a table", "not a store of runs"),
        (lambda b: b.replace(b'"of": "k"', b'"of": "l"'), "another study"),
        (lambda b: b.replace(lm.__version__.encode(), b"0.1.0"), "written by limitmason 0.1.0"),
        (lambda b: b'{"schema": "limitmason-rows", "version": 1, "key": "k"}\n', "before limitmason 0.2"),
    ],
)
def test_what_is_no_row_is_refused_by_file_and_line(tmp_path, change, words):
    path = tmp_path / "rows"
    path.write_bytes(change(filled(path)))
    before = path.read_bytes()
    with pytest.raises(InputError, match=rf"rows.*{words}"):
        Memo(path, "k", kind=dict)
    assert path.read_bytes() == before
    with pytest.raises(InputError, match="is a folder"):
        Memo(tmp_path)


def on_a_full_disk(pipe, path):
    ready(pipe)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
    memo = Memo(path, "k", kind=dict)
    try:
        for k in range(100):
            memo.keep(k, {"y": k / 3, "t": "é" * 20, "none": math.nan})
    except OSError as error:
        pipe.send((len(memo), str(error)))


def test_a_full_disk_keeps_what_was_written_and_says_so(tmp_path):
    path = tmp_path / "rows"
    [child], [pipe] = together(on_a_full_disk, [(path,)])
    rows, words = said(pipe)
    ended(child)
    assert "rows" in words
    assert "make room" in words
    assert 0 < rows == len(Memo(path, "k", kind=dict)) < 100
    whole = filled(tmp_path / "whole", 100)
    memo = Memo(path, "k", kind=dict)
    for k in range(100):
        memo.once(k, lambda k=k: {"y": k / 3, "t": "é" * 20, "none": math.nan})
    assert path.read_bytes() == whole


def test_a_whole_file_is_read_where_nothing_may_be_written(tmp_path):
    path = tmp_path / "rows"
    filled(path)
    path.chmod(0o444)
    tmp_path.chmod(0o555)
    try:
        assert len(Memo(path, "k", kind=dict)) == 6
    finally:
        tmp_path.chmod(0o755)


def test_numbers_come_back_bit_by_bit(tmp_path):
    random = np.random.default_rng(1)
    values = [*random.standard_normal(200).tolist(), math.inf, -math.inf, 5e-324, -0.0]
    Memo(tmp_path / "rows").keep(["a", (1, 2.5)], values)
    again = Memo(tmp_path / "rows")[["a", [1, 2.5]]]
    assert [v.hex() for v in again] == [v.hex() for v in values]


@pytest.fixture
def interruptible():
    """Ctrl-C reaches Python too where the tests run in the background of a shell, which ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("keeps", ["sweep", "once", "compare"])
def test_what_an_interrupt_cut_short_is_not_kept(keeps, tmp_path, interruptible):
    """A simulation that Ctrl-C ends returns what it has: that is no answer for a store, and the study ends too."""
    block = lm.build.column(width=0.4, depth=0.4, unit_height=0.2, courses=1, joint=JOINT)
    loads, stages = lm.Loads.horizontal(block), [dem.Settle(gently=200), dem.Ramp(0.1, steps=2000)]
    pressed: list[int] = []

    def press(_):
        if not pressed:
            pressed.append(1)
            os.kill(os.getpid(), signal.SIGINT)

    def last(k):
        return dem.simulate(block, stages, loads=loads, sample=100, progress=press)["multiplier"][-1]

    def study():
        if keeps == "sweep":
            return [row["value"] for row in sweep(last, {"k": [1, 2]}, store=tmp_path / "runs", key="cut").rows]
        if keeps == "once":
            return [Memo(tmp_path / "runs", "cut").once(1, lambda: last(1))]
        options = {"error_budget": (), "progress": lambda *_: press(0)}
        return [lm.compare(block, loads, ("dem",), store=tmp_path, dem=options).rows[0].multiplier]

    with pytest.raises(KeyboardInterrupt):
        study()
    assert pressed
    slides = math.tan(math.radians(33.0))
    whole = {"sweep": [0.1, 0.1], "once": [0.1], "compare": [slides]}[keeps]
    assert study() == pytest.approx(whole, rel=0.01)


@pytest.mark.parametrize("keeps", ["sweep", "once", "compare"])
def test_nothing_is_computed_for_a_file_that_cannot_be_written(keeps, tmp_path, monkeypatch):
    """The first run, of an hour perhaps, was lost: only when it was to be kept was the file tried."""
    (tmp_path / "file").write_text("mine")
    begun: list[int] = []
    path = tmp_path / "file" / "rows"

    def run(k=1):
        begun.append(k)

    def study():
        if keeps == "compare":
            block = lm.build.column(width=0.4, depth=0.4, unit_height=0.2, courses=1, joint=JOINT)
            return lm.compare(block, lm.Loads.horizontal(block), ("associative",), store=path.parent, associative={})
        return sweep(run, {"k": [1]}, store=path, key="k") if keeps == "sweep" else Memo(path).once(1, run)

    monkeypatch.setattr("limitmason.comparison.comparing._solve", lambda *_: run())
    with pytest.raises(OSError, match="file"):
        study()
    assert not begun
    assert (tmp_path / "file").read_text() == "mine"


def test_a_run_that_goes_to_another_folder_takes_no_row_with_it(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "elsewhere").mkdir()

    def run(k):
        os.chdir(tmp_path / "elsewhere")
        return k

    sweep(run, {"k": [1, 2]}, store="rows", key="k")
    assert not (tmp_path / "elsewhere" / "rows").exists()
    assert len(Memo(tmp_path / "rows", "k")) == 2
