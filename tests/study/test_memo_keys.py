"""Keys of the memory of runs: what functions, models and values they see, and what they refuse."""

import enum
import functools
import importlib
import math
import shutil
import sys
from dataclasses import dataclass, replace

import numpy as np
import pytest

import limitmason as lm
from limitmason.errors import InputError
from limitmason.study import fingerprint, sweep
from limitmason.study.run_fingerprint import fingerprint_of_code

JOINT = lm.Joint(33.0, normal_stiffness=1e10, shear_stiffness=5e9)


def wall(**options):
    return lm.build.wall(length=1.2, courses=3, unit=(0.4, 0.2, 0.2), joint=JOINT, **options)


def made(text, **names):
    """A function by its text, as a file of one's own holds it."""
    space = {"__name__": "own", "np": np, "functools": functools, "enum": enum, "dataclass": dataclass, **names}
    exec("def part(x):\n    return x\n" + text, space)
    return space["f"]


PAIRS = {
    "names": ("def f(x): return np.sin(x)", "def f(x): return np.cos(x)"),
    "attributes": ("def f(x): return x.n_blocks", "def f(x): return x.tolerance"),
    "defaults": ("def f(x, k=1.0): return k * x", "def f(x, k=2.0): return k * x"),
    "keyword defaults": ("def f(x, *, k=1.0): return k * x", "def f(x, *, k=2.0): return k * x"),
    "constants in tuples": ("def f(x): return x in (1, 2)", "def f(x): return x in (3, 4)"),
    "constants in sets": ("def f(x): return x in {1, 2}", "def f(x): return x in {3, 4}"),
    "bytes": ("def f(x): return b'a'", "def f(x): return b'b'"),
    "signs of zero": ("def f(x): return 0.0", "def f(x): return -0.0"),
    "inner functions": ("def f(x): return sum(2 * v for v in x)", "def f(x): return sum(3 * v for v in x)"),
    "lambdas": ("f = lambda x: [(lambda v: v + 1)(v) for v in x]", "f = lambda x: [(lambda v: v + 2)(v) for v in x]"),
    "closures": (
        "def g(k):\n    def f(x): return k * x\n    return f\nf = g(1.0)",
        "def g(k):\n    def f(x): return k * x\n    return f\nf = g(2.0)",
    ),
    "lists closed over": (
        "def g(k):\n    def f(x): return k[0] * x\n    return f\nf = g([1.0])",
        "def g(k):\n    def f(x): return k[0] * x\n    return f\nf = g([2.0])",
    ),
    "arrays closed over": (
        "def g(k):\n    def f(x): return k @ x\n    return f\nf = g(np.array([1.0]))",
        "def g(k):\n    def f(x): return k @ x\n    return f\nf = g(np.array([2.0]))",
    ),
    "values of the module": ("K = 1.0\ndef f(x): return K * x", "K = 2.0\ndef f(x): return K * x"),
    "functions called": ("def h(x): return x\ndef f(x): return h(x)", "def h(x): return -x\ndef f(x): return h(x)"),
    "functions called deep down": (
        "def a(x): return np.sin(x)\ndef h(x): return a(x)\ndef f(x): return h(x)",
        "def a(x): return np.cos(x)\ndef h(x): return a(x)\ndef f(x): return h(x)",
    ),
    "decorated functions": (
        "@functools.wraps(part)\ndef f(x): return x + 1\nf = functools.lru_cache(f)",
        "@functools.wraps(part)\ndef f(x): return x + 2\nf = functools.lru_cache(f)",
    ),
    "partials": ("f = functools.partial(part, 1)", "f = functools.partial(part, 2)"),
    "objects of bound methods": (
        "class M:\n    def __init__(self, k): self.k = k\n    def run(self, x): return self.k * x\nf = M(1).run",
        "class M:\n    def __init__(self, k): self.k = k\n    def run(self, x): return self.k * x\nf = M(2).run",
    ),
    "code of other methods": (
        "class M:\n    def h(self, x): return x\n    def run(self, x): return self.h(x)\nf = M().run",
        "class M:\n    def h(self, x): return -x\n    def run(self, x): return self.h(x)\nf = M().run",
    ),
    "properties": (
        "class M:\n    @property\n    def k(self): return 1\n    def run(self, x): return self.k\nf = M().run",
        "class M:\n    @property\n    def k(self): return 2\n    def run(self, x): return self.k\nf = M().run",
    ),
    "base classes": (
        "class A:\n    def h(self): return 1\nclass M(A):\n    def __call__(self, x): return self.h()\nf = M()",
        "class A:\n    def h(self): return 2\nclass M(A):\n    def __call__(self, x): return self.h()\nf = M()",
    ),
    "classes used": (
        "class A:\n    def h(self): return 1\ndef f(x): return A().h()",
        "class A:\n    def h(self): return 2\ndef f(x): return A().h()",
    ),
    "operators": ("def f(x): return x + 1", "def f(x): return x - 1"),
    "order of arguments": ("def f(x, a=1, b=2): return a", "def f(x, b=2, a=1): return a"),
    "recursion": ("def f(x): return f(x - 1) if x else 1", "def f(x): return f(x - 1) if x else 2"),
}
# what a class holds beside its methods: the same text with one number or another
PAIRS |= {text: (text.replace("@", "1.0"), text.replace("@", "2.0")) for text in (
    "class A:\n    K = [@]\ndef f(x): return A.K[0] * x",
    "class A:\n    K = np.array([@])\n    def run(self, x): return self.K * x\nf = A().run",
    "class A:\n    K = functools.partial(pow, @)\ndef f(x): return A.K(x)",
    "class A:\n    k = functools.cached_property(lambda self: @)\ndef f(x): return A().k",
    "class A:\n    k = functools.cache(lambda self: @)\ndef f(x): return A().k()",
    "class A(enum.Enum):\n    K = @\ndef f(x): return A.K.value * x",
)}


@pytest.mark.parametrize("what", PAIRS)
def test_functions_that_differ_have_other_keys_and_equal_ones_the_same(what):
    one, two = PAIRS[what]
    assert fingerprint(made(one)) != fingerprint(made(two))
    assert fingerprint(made(one)) == fingerprint(made(one))
    assert fingerprint(made("\n\n# elsewhere\n" + two)) == fingerprint(made(two))


TIE = {"yield_force": 1e4, "area": 1e-4, "modulus": 2e11}


def tied(length=1.0, **options):
    last = wall().blocks[-1]
    tie = lm.Tie(last.name, last.centroid, None, last.centroid - [0, 0, length], **(TIE | options))
    return wall().with_ties([tie])


def stone(**options):
    return wall().with_material(lm.Material(**({"young_modulus": 1e9, "poisson_ratio": 0.2} | options)))


MODELS = {
    "a wall": wall(), "stone": stone(), "stiffer stone": stone(young_modulus=9e9), "denser": stone(density=2500.0),
    "named stone": stone(name="granite"), "tie": tied(), "softer tie": tied(modulus=1e9),
    "weak tie": tied(yield_force=5.0), "longer tie": tied(0.9),
    "partly held": wall().with_supports([lm.Support(2, dofs=["y"])]),
    "another law": wall().with_joints(replace(JOINT, cohesion=1e4)),
    "moved": wall().transformed(np.eye(3), (1.0, 0, 0)), "a half": wall(start="half"),
    "sharper edges": wall().with_contact_ends_pulled_in(0.01),
}


@pytest.mark.parametrize("call", [
    "import apart\ndef f(x): return apart.h(x)", "def f(x):\n    import apart as a\n    return a.h(x)",
    "def f(x):\n    from apart import h\n    return h(x)", "from apart import h\ndef f(x): return h(x)",
    "import apart\ndef f(x): return getattr(apart, 'h')(x)",
])
def test_functions_of_a_module_of_ones_own_count_with_what_these_read(call, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)

    def key(text):
        """Key of a function that calls another, in a module of this text read anew."""
        (tmp_path / "apart.py").write_text(text)
        sys.modules.pop("apart", None)
        shutil.rmtree(tmp_path / "__pycache__", ignore_errors=True)
        importlib.invalidate_caches()
        return fingerprint(made(call))

    plain = "K = 1.0\ndef g(x): return K * x\ndef h(x): return g(x)\n"
    assert key(plain) == key(plain)
    assert len({key(plain), key(plain.replace("1.0", "2.0")), key(plain.replace("K *", "K +"))}) == 3


def test_models_that_differ_in_one_thing_have_other_keys_and_equal_ones_the_same(tmp_path):
    keys = {name: fingerprint(model) for name, model in MODELS.items()}
    assert len(set(keys.values())) == len(keys)
    assert fingerprint(wall()) == keys["a wall"]
    assert fingerprint(tied()) == keys["tie"]
    read = lm.formats.read_json
    for name, model in MODELS.items():
        lm.formats.write_json(tmp_path / "m.json", model)
        assert read(tmp_path / "m.json")[0].fingerprint.digest == model.fingerprint.digest, name


def test_kinds_of_values_are_told_apart_and_equal_values_shared_or_not_are_the_same():
    values = [1, 1.0, "1", True, None, b"1", [1], (1, 2), {1: 2}, {"1": 2}, {1}, math.nan, math.inf, np.array([1]),
              np.array([1.0]), np.array([[1.0]]), "None", {}, [], "\ud800", 1j]
    assert len({fingerprint(v) for v in values}) == len(values)
    assert fingerprint(np.float64(0.1)) == fingerprint(0.1)
    row = [1.0, 2.0]
    assert fingerprint([row, row]) == fingerprint([[1.0, 2.0], [1.0, 2.0]])
    assert fingerprint({"a": 1, "b": 2}) == fingerprint({"b": 2, "a": 1})


def test_what_has_no_content_is_refused_by_the_name_of_what_uses_it(tmp_path):
    with (tmp_path / "open").open("w") as file:
        with pytest.raises(TypeError, match="no content"):
            fingerprint(file)
        with pytest.raises(TypeError, match=r"f uses 'LOG': .* no content .* give a key"):
            fingerprint(made("def f(x): LOG.write(x)", LOG=file))
    loop = []
    loop.append(loop)
    with pytest.raises(TypeError, match="holds itself"):
        fingerprint(loop)



def test_a_set_that_leads_back_to_what_holds_it_ends_and_counts_state_as_all_else_does():
    def registered(text):
        """A function that reads the set of functions in which it stands itself."""
        own = made(text, H=set())
        own.__globals__["H"].add(own)
        return own

    one, two = "def f(x): return len(H) * x", "def f(x): return len(H) + x"
    assert fingerprint(registered(one)) == fingerprint(registered(one)) != fingerprint(registered(two))

    def held(count):
        """Fingerprints of a set whose only function holds a counter: of all that it holds, and of the code."""
        members = frozenset({made("def f(x): return N.append(x)", N=[count])})
        return fingerprint(members), fingerprint_of_code(members)

    (all_1, code_1), (all_2, code_2) = held(1), held(2)
    assert all_1 != all_2
    assert code_1 == code_2


def test_every_public_call_of_the_package_can_be_used_by_what_is_stored():
    calls = {name: getattr(lm, name) for name in lm.__all__ if callable(getattr(lm, name))}
    refused = {}
    for name, call in calls.items():
        try:
            fingerprint(made("def f(x): return call(x)", call=call))
        except TypeError as error:
            refused[name] = str(error)
    assert not refused
    assert calls.keys() >= {"limit_analysis", "pushover", "stability", "compare"}


def test_an_edited_model_is_computed_anew_or_refused_and_the_same_one_is_found(tmp_path):
    one, two = (made(f"def f(a): return {{'p': float(np.{g}(a))}}") for g in ("sin", "cos"))
    sweep(one, {"a": [0.1, 0.2]}, store=tmp_path / "rows")
    assert [r["p"] for r in sweep(one, {"a": [0.1, 0.2]}, store=tmp_path / "rows")] == [math.sin(0.1), math.sin(0.2)]
    with pytest.raises(InputError, match=r"rows holds the runs of another study"):
        sweep(two, {"a": [0.1, 0.2]}, store=tmp_path / "rows")
    parameters, target = [lm.Parameter("a", 0.5, (0.05, 0.75))], {"p": (math.cos(0.6), 0.01)}
    lm.calibrate(one, target, parameters, store=tmp_path / "fit", leave_out=None)
    with pytest.raises(InputError, match=r"fit holds the runs of another study"):
        lm.calibrate(two, target, parameters, store=tmp_path / "fit", leave_out=None)
    uniform = lm.study.Random(lm.study.uniform(0, 1e4))

    def run(assembly, loads):
        return {"E": assembly.blocks[-1].material.young_modulus}

    def drawn(model):
        return lm.study.monte_carlo(
            (model, lm.Loads.weight(model)), 3, run=run, joints={"cohesion": uniform}, store=tmp_path / "drawn"
        )

    assert [r["E"] for r in drawn(stone())] == [1e9] * 3
    with pytest.raises(InputError, match=r"drawn holds the runs of another study"):
        drawn(stone(young_modulus=9e9))


def test_compare_keeps_answers_of_every_material_apart(tmp_path):
    for model in (stone(), stone(young_modulus=9e9), stone()):
        lm.compare(model, lm.Loads.horizontal(model), "mechanisms", store=tmp_path)
    assert len((tmp_path / "answers.jsonl").read_text().splitlines()) == 1 + 2
