"""Adapters of limit analysis, settlement, elastic range and modes, judged by own programs and own elasticity."""

from collections.abc import Callable

import numpy as np

from .engine import REFUSED, number
from .laws import SLOW, Answer
from .model import Model, Quantity
from .statics import Statics

# ---- limit analysis, settlement -------------------------------------------------------------------------------------


def limit(model: Model) -> Answer:
    """Collapse multiplier."""
    import limitmason as lm

    got = lm.limit_analysis(*model.build())
    if got.status == "almost solved":
        return {SLOW: True}
    # cells of cohesive faces follow their axes; each lower bound is as near to the one exact value as it says
    said = 0.0 if got.certificate is None else got.certificate.discretisation
    return {"status": str(got.status), "multiplier": number(got.collapse_multiplier, slack=1.0 + said / 1e-6, live=-1)}


def exact(model: Model) -> bool:
    """Whether own statics know the strength exactly: no crushing, and cohesion in plane only."""
    laws = [model.law, *model.laws.values()]
    sticks = any(w.cohesion or w.tension for w in laws)
    return all(np.isinf(w.crushing) for w in laws) and (model.plane or not sticks)


def judge_limit(model: Model, answer: Answer) -> list[str]:
    """The static theorem by own programs; for cohesive faces in space an upper bound of it."""
    own, found = Statics(model), answer["multiplier"].value
    if exact(model):
        return _sharply(lambda sharp: _beside(own.limit(sharp=sharp), found, answer["status"]))
    if any(np.isfinite(w.crushing) for w in (model.law, *model.laws.values())) or np.isnan(found):
        return []
    return _sharply(lambda sharp: _at_most(own.limit(sharp=sharp), found))


def _sharply(complaints: Callable[[bool], list[str]]) -> list[str]:
    """Complaints that own statics keep where their interior point gives way to linear programs of full precision."""
    return complaints(False) and complaints(True)


def _at_most(most: float, found: float) -> list[str]:
    # both meet equilibrium to 1e-6 of a block's own load, which may be worth some times that in the multiplier
    return [f"{found!r}, own statics at most {most!r}"] if found > most + 1e-5 * abs(most) else []


def _beside(own: float, theirs: float, status: str, size: float = 0.0) -> list[str]:
    if np.isnan(own):
        return []
    ends = {np.inf: "unbounded", -np.inf: "cannot stand under dead load"}
    if own in ends:
        return [] if status == ends[own] else [f"{theirs!r} ({status}), own statics: {ends[own]}"]
    if abs(theirs - own) <= 1e-6 * max(abs(own), size):
        return []
    return [f"{theirs!r} ({status}), own statics {own!r}"]


def settlement(model: Model) -> Answer:
    """Reaction of a support, or a group of them, that settles."""
    import limitmason as lm

    if not model.group:
        return {REFUSED: "no support to spare"}
    axis = int(np.argmax(np.abs(model.down)))
    direction = f"{'-' if model.down[axis] < 0 else '+'}{'xyz'[axis]}"
    assembly, loads = model.build()
    support = model.group[0] if len(model.group) == 1 else list(model.group)
    got = lm.settlement_analysis(assembly, support, direction=direction, loads=lm.Loads(loads.dead, 0 * loads.live))
    reaction = got.reaction.least
    return {"status": str(got.status), "reaction": number(reaction, model.weight, length=1, mass=1, time=-2)}


def judge_settlement(model: Model, answer: Answer) -> list[str]:
    """The same program by own statics: R is least where -t is largest."""
    if not exact(model):
        return []
    dead, push = model.dead.copy(), np.zeros_like(model.dead)
    dead[list(model.group)] = 0.0
    push[model.group[0], :3] = model.down * model.weight
    own, found = Statics(model), -answer["reaction"].value / model.weight
    return _sharply(
        lambda sharp: _beside(
            own.largest(dead, push, model.group, model.down, sharp=sharp), found, answer["status"], 1.0
        )
    )


# ---- elastic range, modes -------------------------------------------------------------------------------------------


def elastic_range(model: Model, blocks: str = "rigid") -> Answer:
    """Ends of the range by each criterion, and displacements."""
    import limitmason as lm

    got = lm.elastic_range(*model.build(), blocks=blocks)
    out: Answer = {}
    for criterion in ("opening", "slip", "crushing"):
        ends = [(sense, got.end(sense, criterion)) for sense in (-1, 1)]
        values = [sense * np.inf if e is None else e.multiplier for sense, e in ends]
        out[criterion] = Quantity(np.array(values), live=-1, kind="ends")
    free = model.free
    for name, shift, power in (("dead", got.shift_dead, 0), ("live", got.shift_live, 1)):
        size = float(np.abs(shift[free]).max())
        out[f"shift by {name} load"] = Quantity(shift, length=1, live=power, stiff=-1, kind="vectors", size=size)
    return out


def judge_elastic(model: Model, answer: Answer) -> list[str]:
    """Own elasticity and strengths at the corners of faces."""
    own, out = Statics(model), []
    u = own.displaced().reshape(-1, 6, 2)
    for k, name in enumerate(("dead", "live")):
        q = answer[f"shift by {name} load"]
        off = np.abs(q.value - u[:, :3, k]).max() / max(q.size, 1e-300)
        if off > 1e-6:
            out.append(f"shift by {name} load: off by {off:.1e} of the largest")
    if all(w.tension <= w.cohesion / w.mu for w in (model.law, *model.laws.values())):
        found = own.elastic_ends()
        for criterion, ends in found.items():
            for own_end, end, opens in zip(ends, answer[criterion].value, found["opening"], strict=True):
                # where a load makes no shear, slip comes with opening or not at all
                bare = criterion == "slip" and np.isclose(own_end, opens, rtol=1e-6, atol=0.0)
                if own_end != end and not bare and not abs(own_end - end) <= 1e-6 * abs(own_end):
                    out.append(f"{criterion}: {end!r}, own elasticity {own_end!r}")
    return out


def modes(model: Model, blocks: str = "rigid") -> Answer:
    """Lowest frequencies, up to twelve."""
    import limitmason as lm

    assembly, _ = model.build()
    got = lm.modes(assembly, min(12, 6 * len(model.free) - 1), blocks=blocks)
    out: Answer = {"frequency": Quantity(got.frequency, time=-1, stiff=0.5)}
    # what a repeated frequency shares among its modes is theirs together
    ends = np.flatnonzero(np.diff(got.frequency) > 1e-4 * got.frequency[:-1])
    if len(ends):
        taking = got.participating[: ends[-1] + 1].sum(axis=0)
        out["participating"] = Quantity(float(taking.sum()), mass=1, size=3 * float(model.density.max()), slack=10.0)
    return out


def judge_modes(model: Model, answer: Answer) -> list[str]:
    """Dense eigenvalues of own K and M."""
    theirs = answer["frequency"].value
    own = Statics(model).frequencies()[: len(theirs)]
    off = np.abs(theirs - own) / own[-1]
    return [f"frequencies {theirs}, own {own}"] if off.max() > 1e-5 else []
