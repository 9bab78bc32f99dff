"""Public objects as objects: arrays are read-only, pickle and deepcopy give the same, a process pool takes them."""

import copy
import pickle
import re
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from multiprocessing import get_context

import numpy as np
import pytest

import dem
import limitmason as lm
from limitmason.continuum import Box, Continuum, push

JOINT = lm.Joint(33.0, normal_stiffness=1e9, shear_stiffness=5e8)


def column(**options):
    outlines = [[(-w, a), (w, a), (w, b), (-w, b)] for a, b, w in ((-0.2, 0.0, 0.5), (0.0, 0.3, 0.1), (0.3, 0.6, 0.1))]
    return lm.Assembly.from_polygons(
        outlines, thickness=0.3, joint=JOINT, names=["ground", "a", "top"], fixed=["ground"], **options
    )


WORKING = ("generations", "runs", "structure", "discretisation", "elastic", "solid")
"""What engines go on with, and the structure of a prediction, which copies leave out; a ``dem.State`` likewise."""


def curve_of(a):
    return lm.Curve(np.array([0.0, 1.0, 2.0]), np.array([0.0, a, 0.5 * a]), "m", "N")


@cache
def answers():
    """Every kind of public answer, small."""
    wall = column().with_material(lm.Material(young_modulus=1e10, poisson_ratio=0.2))
    tied = wall.with_ties([lm.Tie("top", (0, 0.1, 0.5), "ground", (0, 0.1, -0.1), yield_force=10.0, stiffness=1e6)])
    loads = lm.Loads.horizontal(wall)
    solved = lm.limit_analysis(wall, loads)
    rest = dem.simulate(wall, dem.Settle(tolerance=1e-4), sample=50)
    drive = dem.Drive({"top": {"x": 1.0}})
    pushed = dem.push(wall, drive, to=2e-4, steps=400, rate_check=False, samples=20)
    modes = lm.modes(wall, count=2)
    return {
        "Assembly": wall, "tied Assembly": tied, "Block": wall.blocks[1], "Interface": wall.interfaces[0],
        "Joint": JOINT, "Loads": loads, "Tie": tied.ties[0], "Support": wall.supports[0],
        "contact report": wall.contact_report(),
        "Prediction": solved, "Mechanism": solved.mechanism, "Resultants": solved.resultants,
        "Certificate": solved.certificate, "predicted": lm.predict(wall, loads),
        "compared": lm.compare(wall, loads, ("associative", "mechanisms")),
        "Curve": curve_of(1.0), "CurveTarget": lm.CurveTarget(curve_of(1.0), 0.05),
        "PushoverCurve": lm.pushover(wall, loads, to=1e-4), "ElasticRange": lm.elastic_range(wall, loads),
        "PushCurve": pushed, "History": rest,
        "Modes": modes, "Mac": lm.mac(modes, modes),
        "Fit": lm.calibrate(lambda_free, {"p": (1.0, 0.1)}, [lm.Parameter("a", 0.5, (0.1, 5.0))], leave_out=None),
        "SolidCurve": solid_curve(),
        "experiment": lm.experiments.load(*first_specimen()),
        "fingerprint": wall.fingerprint,
    }


def solid_curve():
    h = 0.1
    brittle = lm.Material(8e8, 0.0, 0.0, tensile_strength=8e4, tensile_energy=12.0)
    cube = Continuum.from_boxes([Box(np.zeros(3), np.full(3, h))], brittle, size=h)
    top = [(0, 0, h), (h, 0, h), (h, h, h), (0, h, h)]
    pulled = cube.with_patch_pressure(top, force=-1.0)
    return push(pulled, control=((h / 2, h / 2, h), (0, 0, 1)), to=3e-5, first=1e-5, largest=1e-5)


def lambda_free(a):
    return {"p": a}


def first_specimen():
    source = lm.experiments.sources()[0]
    return source, lm.experiments.specimens(source)[0]


def arrays_of(thing, path="", seen=None, depth=0):
    """Every array that a reader reaches by attributes, properties, keys and numbers, with its path."""
    seen = {} if seen is None else seen
    if isinstance(thing, np.ndarray):
        yield path, thing
        return
    plain = isinstance(thing, str | bytes | int | float | type(None) | type | dem.State) or callable(thing)
    if plain or id(thing) in seen or depth > 5:
        return
    seen[id(thing)] = thing
    if isinstance(thing, dict):
        inside = [(f"[{k!r}]", v) for k, v in thing.items()]
    elif isinstance(thing, tuple | list):
        names = getattr(thing, "_fields", range(len(thing)))
        inside = [(f".{n}", v) for n, v in list(zip(names, thing, strict=True))[:3000]]
    elif type(thing).__module__.partition(".")[0] in ("limitmason", "dem", "mechanisms"):
        inside = []
        for name in sorted(n for n in dir(thing) if not n.startswith("_")):
            if name in WORKING:
                continue
            try:
                value = getattr(thing, name)
            except (ValueError, TypeError, ArithmeticError, AttributeError, RuntimeError, AssertionError):
                continue
            inside.append((f".{name}", value))
    else:
        return
    for name, value in inside:
        yield from arrays_of(value, path + name, seen, depth + 1)


def writable(thing):
    """Arrays that a reader could write to and then reads again; what is made anew at every reading does no harm."""
    found, again = dict(arrays_of(thing)), dict(arrays_of(thing))
    return [
        path for path, array in found.items()
        if array.flags.writeable and array.size and path in again and np.shares_memory(array, again[path])
    ]


@pytest.mark.parametrize("name", answers())
def test_arrays_that_are_handed_out_are_read_only(name):
    assert not writable(answers()[name])


@pytest.mark.parametrize("name", answers())
@pytest.mark.parametrize("twin", [lambda x: pickle.loads(pickle.dumps(x)), copy.deepcopy], ids=["pickle", "deepcopy"])
def test_a_copy_by_pickle_or_deepcopy_holds_the_same_and_is_read_only_too(name, twin):
    thing = answers()[name]
    other = twin(thing)
    assert type(other) is type(thing)
    mine, others = dict(arrays_of(thing)), dict(arrays_of(other))
    assert not writable(other)
    for path in mine.keys() & others.keys():
        if mine[path].dtype != object:
            np.testing.assert_array_equal(mine[path], others[path], err_msg=path)
    # a prediction leaves its structure and loads behind, as its docstring says
    assert all(re.search(r"(^|\bprediction)\.loads\.", path) for path in mine.keys() - others.keys())


@pytest.mark.exact
def test_an_assembly_does_not_follow_the_arrays_it_was_made_of():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    faces = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    stone = lm.Assembly.from_polyhedra([(corners, faces)], joint=JOINT, fixed=[0])
    corners[3, 2] = 100.0
    assert stone.blocks[0].vertices[3, 2] == 1.0
    assert stone.volumes == pytest.approx(1.0 / 6.0)


def test_curves_go_through_a_pool_of_processes():
    with ProcessPoolExecutor(2, mp_context=get_context("fork")) as pool:
        for a, curve in zip((1.0, 2.0), pool.map(curve_of, (1.0, 2.0)), strict=True):
            assert curve.peak.load == a
            assert not curve.load.flags.writeable
