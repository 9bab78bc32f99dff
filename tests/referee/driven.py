"""Adapters of the DEM: collapse, push and simulate, judged by the static theorem, equilibrium and own elasticity."""

from dataclasses import replace

import numpy as np

from .assemblies import Law
from .engine import number
from .laws import Answer
from .model import Frame, Model, Quantity
from .statics import Statics

ERROR = 0.02
"""What the DEM may be off by beyond what it says of itself [-]."""

GENTLY = 8000
"""Steps over which weight comes on where joints slide at once."""

PART = 0.4
"""Of the limit load, up to which structures are loaded in ``simulate``."""


BONDED = 1e4
"""Strength of the joints of tied structures in ``simulate``, over their weight by the square of their length [-]."""

STIFFER = 30.0
"""Factor on the stiffness in ``simulate``: displacements are then in inverse proportion to it."""


def _associated(model: Model):
    """Assembly and loads at psi = phi, for which the static theorem holds."""
    assembly, loads = model.build()
    return assembly.with_joints(lambda j: replace(j, dilatancy_angle_deg=j.friction_angle_deg)), loads


def collapse(model: Model) -> Answer:
    """Multiplier at psi = phi, known to within its interval."""

    import dem

    assembly, loads = _associated(model)
    got = dem.collapse(assembly, loads)
    if got.interval is None:
        return {"status": str(got.status)}
    low, high = got.interval
    value = got.collapse_multiplier
    wide = 2 * (high - low) / abs(value) + ERROR
    return {"multiplier": number(value, slack=wide, live=-1), "_interval": (low, high)}


def judge_collapse(model: Model, answer: Answer) -> list[str]:
    """The static theorem's value lies in the interval.

    Ties turn as their blocks slide and then bear more, up to what they would bear whichever way they pull.
    """
    statics = Statics(model)
    own = statics.limit()
    most = statics.limit(turning=True) if model.ties else own
    if "multiplier" not in answer:
        return [f"{answer['status']}, own statics {own!r}"]
    low, high = answer["_interval"]
    if low * (1 - ERROR) <= most and own <= high * (1 + ERROR):
        return []
    return [f"interval {low:.5g} to {high:.5g}, own statics {own:.5g}, ties turning {most:.5g}"]


def push(model: Model) -> Answer:
    """Largest load of a push of one block, over a thousandth of the structure."""
    import dem
    import limitmason as lm

    assembly, loads = model.build()
    block, axis = model.driven, int(np.argmax(np.abs(model.along)))
    sense = float(np.sign(model.along[axis]))
    drive = dem.Drive({block: {"xyz"[axis]: sense}})
    got = dem.push(assembly, drive, to=1e-3 * model.length, loads=lm.Loads(loads.dead, 0 * loads.live))
    top = got.peak.load
    wide = got.rate_error + ERROR
    return {
        "peak": number(top, max(abs(top), 1e-3 * model.weight), wide, length=1, mass=1, time=-2),
        "_rate": got.rate_error, "_block": block,
    }


def judge_push(model: Model, answer: Answer) -> list[str]:
    """Not above the static theorem for a force along the drive through the block's centroid."""
    live = np.zeros_like(model.dead)
    live[answer["_block"], :3] = model.along * model.weight
    own = Statics(model).largest(model.dead, live) * model.weight
    found = answer["peak"].value
    if found > own * (1 + ERROR + answer["_rate"]) + 1e-3 * model.weight:
        return [f"peak {found:.5g} N (rate error {answer['_rate']:.1%}) above the static theorem's {own:.5g} N"]
    return []


def bonded(model: Model) -> Model:
    """A model with ties, its joints so strong that they stay elastic: of dry ones hardly any do.

    Own elasticity then judges its displacements, with the ties that are taut at rest.
    """
    strength = BONDED * model.weight / model.length**2

    def law(w: Law) -> Law:
        return replace(w, cohesion=(1.0 + w.mu) * strength, tension=strength)

    if not model.ties:
        return model
    return replace(model, law=law(model.law), laws={pair: law(w) for pair, w in model.laws.items()})


def simulate(model: Model) -> Answer:
    """Displacements and reaction after own weight and a part of the limit load have come to rest."""
    import dem

    factor, model = PART * Statics(model).limit(), bonded(model)
    assembly, loads = _associated(model.seen(Frame(stiff=STIFFER)))
    stages = [dem.Settle(), dem.Ramp(to=factor, steps=4000), dem.Settle()]
    got = dem.simulate(assembly, stages, loads=loads)
    if any("joints slid" in note for note in got.warnings):
        # as the note says
        stages[0] = dem.Settle(gently=GENTLY)
        got = dem.simulate(assembly, stages, loads=loads)
    shift = STIFFER * got.shift[-1]
    total = sum(got.reaction_of(i)[-1, :3] for i in model.fixed)
    size = float(np.abs(shift).max())
    return {
        "status": str(got.status),
        "shift": Quantity(shift, length=1, stiff=-1, kind="vectors", size=size),
        "_reaction": total, "_factor": factor,
    }


def judge_simulate(model: Model, answer: Answer) -> list[str]:
    """Reactions carry the loads; where no joint has reached its strength, own elasticity gives the displacements."""
    if answer["status"] != "finished":
        return [f"ends {answer['status']} at {PART} of the limit load"]
    own, factor, out = Statics(bonded(model)), answer["_factor"], []
    loads = (model.dead + factor * model.live)[model.free, :3].sum(axis=0)
    off = np.linalg.norm(answer["_reaction"] + loads) / model.weight
    if off > 1e-3:
        out.append(f"reactions off by {off:.1e} of the weight")
    elastic = own.pulled(factor)
    ends = elastic.elastic_ends().values() if elastic else ()
    if elastic and ends and all(low < 0 and 1.05 * factor < high for low, high in ends):
        u = (elastic.displaced() @ [1.0, factor]).reshape(-1, 6)[:, :3]
        off = np.abs(answer["shift"].value - u).max() / np.abs(u).max()
        if off > ERROR:
            out.append(f"displacements off by {off:.1e} from own elasticity")
    return out
