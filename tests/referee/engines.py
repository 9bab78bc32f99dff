"""All engines by name: adapter, judge, the laws that hold for it, tolerance, and the structures it is asked for."""

from functools import partial

from .driven import collapse, judge_collapse, judge_push, judge_simulate, push, simulate
from .engine import Engine
from .laws import LAWS, Answer
from .model import Model
from .paths import judge_path, limited, path
from .static_engines import (
    elastic_range,
    exact,
    judge_elastic,
    judge_limit,
    judge_modes,
    judge_settlement,
    limit,
    modes,
    settlement,
)

_STATIC = ("turned", "mirrored", "renumbered", "in mm, N", "in other units")
_LOADED = (*_STATIC, "live load doubled")
_SPRUNG = (*_STATIC, "stiffness halved")
_COMPILED = 900.0  # the first run after an edit of a kernel waits for the compiler
_FEW = ("turned", "renumbered", "in mm, N")


def _mixed(number: int) -> dict:
    return {"wild": number % 4 == 0}


def _split(number: int) -> dict:
    return {"split": True, "together": number % 2 == 0}


def _without_ties(number: int) -> dict:
    return {"plain": 1.0 if number % 2 else 0.3, "ties": False}


def _limited(number: int) -> dict:
    return {"most": 7, "fit": limited}


def _bonded(number: int) -> dict:
    """In plane and in space every third has each kind of bond; few blocks, where joints have many points."""
    bonds = ("brittle", "softening", "held")[number // 3 % 3]
    most = 5 if number % 3 == 2 else 8 if bonds == "held" else 6
    return {"most": most, "bonds": bonds, "crushing": False, "fit": limited}


def _small(number: int) -> dict:
    return {"most": 6, "ties": False, "fit": limited}


def _driven(number: int) -> dict:
    options = {"most": 5, "crushing": False, "apex": False, "plain": 0.7}
    return options | {"fit": lambda model: exact(model) and limited(model)}


def _nothing(model: Model, answer: Answer) -> list[str]:
    """No own statics for it; the laws are left."""
    return []


def _deforming(blocks: str) -> tuple[Engine, ...]:
    """Engines that let blocks deform."""
    along, judged = partial(path, blocks=blocks), partial(judge_path, blocks=blocks)
    return (
        Engine(f"elastic {blocks}", partial(elastic_range, blocks=blocks), _nothing, (*LAWS,), drawn=_without_ties),
        Engine(f"modes {blocks}", partial(modes, blocks=blocks), _nothing, _SPRUNG, drawn=_without_ties),
        Engine(f"pushover {blocks}", along, judged, _FEW, 1e-3, drawn=_small),
    )


_ALL = (
    Engine("limit", limit, judge_limit, _LOADED, drawn=_mixed),
    Engine("settlement", settlement, judge_settlement, _STATIC, axes=True, drawn=_split),
    Engine("elastic", elastic_range, judge_elastic, (*LAWS,), drawn=_without_ties),
    Engine("modes", modes, judge_modes, _SPRUNG, drawn=_without_ties),
    Engine("pushover", path, judge_path, _LOADED, 1e-3, drawn=_limited),
    Engine("pushover bonds", path, judge_path, _FEW, 1e-3, drawn=_bonded, longest=25.0),
    *_deforming("simply deformable"),
    *_deforming("ritz"),
    Engine("dem collapse", collapse, judge_collapse, _LOADED, 1.0, drawn=_driven, longest=_COMPILED),
    Engine("dem push", push, judge_push, _STATIC, 1.0, axes=True, drawn=_driven, longest=_COMPILED),
    Engine("dem simulate", simulate, judge_simulate, _SPRUNG, 0.02, drawn=_driven, longest=_COMPILED),
)

ENGINES = {engine.name: engine for engine in _ALL}
