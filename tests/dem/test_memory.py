"""A model that does not fit into memory is refused before it is made, by a number that models that fit confirm."""

import tracemalloc

import pytest
from walls import running_bond

import dem
import limitmason as lm
from dem.model import joints
from limitmason.errors import InputError


def test_a_model_larger_than_the_machine_is_refused_with_the_numbers(monkeypatch):
    wall = running_bond(3, 4)
    loads = lm.Loads.weight(wall)
    monkeypatch.setattr(joints, "memory_of_machine", lambda: 1e6)
    count = len(wall.interfaces)
    with pytest.raises(InputError, match=rf"{count * 1000} contact points on {count} joints take .* GB"):
        dem.initial_state(wall, loads, contact_points=(40, 25))
    assert dem.initial_state(wall, loads, contact_points=(2, 2)).dt > 0.0


def test_the_bytes_of_a_point_are_those_that_are_taken():
    wall = running_bond(8, 10)
    loads = lm.Loads.weight(wall)
    dem.initial_state(wall, loads, contact_points=(2, 2))  # what is loaded and kept once
    tracemalloc.start()
    points = len(dem.initial_state(wall, loads, contact_points=(16, 16)).points.s)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert 0.5 * joints.PER_POINT * points < peak < joints.PER_POINT * points
