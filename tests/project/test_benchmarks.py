"""Benchmarks end with words, not with a traceback or a wait without end."""

import importlib.util
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[2] / "benchmarks"


def benchmark(name, monkeypatch):
    """A benchmark as a module that no other process can import by its name."""
    spec = importlib.util.spec_from_file_location(f"own_{name}", FOLDER / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("peak", [0.1, 2.0])
def test_few_histories_that_all_stand_or_all_fall_have_no_fragility(peak, monkeypatch, capsys):
    histories = benchmark("histories", monkeypatch)
    monkeypatch.setattr(histories, "rocking", lambda seed, pga: {"peak": peak, "overturned": peak > 1.0, "steps": 10.0})
    monkeypatch.setattr(sys, "argv", ["histories.py", "--histories", "4", "--workers", "1"])
    histories.main()
    said = capsys.readouterr().out
    assert f"{4 * (peak > 1.0)} of 4 histories overturned" in said
    assert "give more --histories" in said
    assert "nan" not in said


def test_a_process_that_cannot_import_ends_the_benchmark(monkeypatch):
    speed = benchmark("dem_speed", monkeypatch)
    monkeypatch.setattr(speed, "LOOKED_AFTER", 0.1)
    with pytest.raises(SystemExit, match="a process of the benchmark ended with 1"):
        speed.side_by_side(2, 10)
