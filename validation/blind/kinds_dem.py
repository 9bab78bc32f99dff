"""Truth of all three quantities by the DEM: peaks from its store, stiffness and frequency from runs of its own.

Stiffness is that of a small live load after rest under dead load, in joints that open. The frequency is counted on the
record of a free vibration with real masses. Candidates stay those of limit analysis and of blocks on linear springs.
"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np

import dem
import limitmason as lm
from limitmason import causes as catalogue
from limitmason.diagnosis import Study
from limitmason.diagnosis.simulate import SLOW

from . import campaign_store, campaigns, outsiders
from .kinds_designs import CAUSES, SCATTER, OtherCode, build, on_springs, rows, simulate, softer_joints

# declared difference between the codes: of walls in plane, whose head joints open in the DEM and bear tension in the
# candidates' springs, that of the stiffness at the baseline and at the clear causes of the store, as a mean square
METHOD = {"peak": 0.0, "stiffness": 0.005, "frequency 1": 0.005}
IN_PLANE = {**METHOD, "stiffness": 0.075}
SMALL = 0.005  # of the live loads' own weight
PERIODS, REST = 24.0, 6.0  # of the first mode: recorded, and damped before
POINTS = 4096  # of the record, made 16 times finer in frequency


def stiffness(assembly, loads):
    """Squared sum of a small live load over its work, from one state of rest to the next [N/m]."""
    live = np.asarray(loads.live)
    before = dem.simulate(assembly, [dem.Settle()], loads=loads)
    after = dem.simulate(assembly, [dem.Ramp(to=SMALL, steps=4000), dem.Settle()], start=before)
    turned = [after.rotation_of(i)[-1] - before.rotation_of(i)[-1] for i in range(assembly.n_blocks)]
    moved = np.hstack([after.shift[-1] - before.shift[-1], turned])
    return float(SMALL * np.linalg.norm(live[:, :3].sum(axis=0)) ** 2 / (live * moved).sum())


def frequency(assembly, guess):
    """Lowest frequency of a release from a small pull along the diagonal of the ground plan [Hz]."""
    period, brake = 1.0 / guess, dem.Damping(0.8)
    stages = [dem.Hold(duration=REST * period, damping=brake), dem.Ramp(to=SMALL, duration=2 * period, damping=brake),
              dem.Hold(duration=REST * period, damping=brake), dem.Ramp(to=0.0, duration=1e-3 * period),
              dem.Hold(duration=PERIODS * period)]
    found = dem.simulate(assembly, stages, loads=lm.Loads.horizontal(assembly, (1, 1, 0)), mode="dynamic", sample=5,
                         joint_options=dem.JointOptions(dashpot=0.0))
    last = found["stage"] == found["stage"].max()
    time = np.linspace(found["time"][last][0] + 1e-3 * period, found["time"][last][-1], POINTS)
    peaks = []
    for axis in (0, 1):
        x = np.interp(time, found["time"][last], found.shift[last][:, :, axis].sum(axis=1))
        power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(POINTS), 16 * POINTS))
        peaks.append(np.fft.rfftfreq(16 * POINTS, time[1] - time[0])[int(power.argmax())])
    return float(min(peaks))


def declared(specimen):
    """Relative difference of the codes that is declared for each quantity of a specimen."""
    return IN_PLANE if specimen["setup"] == "in plane" else METHOD


class ByDem(OtherCode):
    """Trials whose truth is the DEM's in all three quantities, the difference of the codes declared.

    Parameters
    ----------
    covariates, cache : as of the other designs; runs of the DEM are kept beside the cache
    """

    def __init__(self, covariates, cache):
        super().__init__(covariates, cache)
        observed = [replace(o, scatter=float(np.hypot(o.scatter, declared(self.specimens[o.specimen])[o.quantity])))
                    for o in rows([simulate(s) for s in self.specimens], self.quantities)]
        self.study = Study(
            self.specimens, simulate, observed, nuisance=campaigns.NUISANCE, covariates=covariates, causes=CAUSES,
            cache=cache, version="1", shared=(), **SLOW,
        )
        self.design = self.study.design()
        self.drawn = np.array([SCATTER[q] for q in self.study.rows.quantities])
        self.store = Path(f"{cache}.dem.jsonl") if cache else None
        lines = self.store.read_text().splitlines() if self.store and self.store.exists() else []
        self.known = {tuple(key): value for key, value in map(json.loads, lines)}

    def by_dem(self, what, size, model_of):
        """Stiffness and frequency of every specimen by the DEM, from the store where they are there."""
        out = []
        for s in self.specimens:
            key = (what, float(size), s["name"])
            if key not in self.known:
                model = model_of(s)
                self.known[key] = [stiffness(*model), frequency(model[0], simulate(s)["frequency 1"])]
                if self.store:
                    with self.store.open("a") as lines:
                        lines.write(json.dumps([key, self.known[key]]) + "\n")
            out.append(self.known[key])
        return out

    def values_of(self, peaks, elastic):
        """Values of the study's rows."""
        found = {"peak": peaks, "stiffness": [e[0] for e in elastic], "frequency 1": [e[1] for e in elastic]}
        where = zip(self.study.rows.of, self.study.rows.quantities, strict=True)
        return np.array([found[q][i] for i, q in where])

    def nothing(self, k, rng):
        """Values of the baseline."""
        return self.values_of([self.dem(s) for s in self.specimens], self.by_dem("", 0.0, build)), None

    def off_the_list(self, k, rng):
        """Values with an effect of the outsider's that changes the model, at its middle size."""
        effects = [e for e in outsiders.EFFECTS if e.change is not None]
        effect = effects[k % len(effects)]
        size = effect.sizes[1]
        peaks = [self.dem.effect(effect.name, size, int(s["name"]) - 1, campaigns.FRICTION) for s in self.specimens]
        elastic = self.by_dem(effect.name, size, lambda s: on_springs(*effect.change(s, campaigns.FRICTION, size)))
        return self.values_of(peaks, elastic), effect.name

    def listed(self, k, rng):
        """Values with a cause that is clear, at a stored size."""
        every = (*campaigns.SIMULATED, softer_joints())
        cause = every[k % len(every)]
        size = float(rng.choice(campaign_store.planted_sizes(cause)))
        there = catalogue.Extension(((cause, size),))
        if not self.is_clear(self.design.whiten(self.study.predicted([cause], [size])), cause):
            return None  # by the candidates one kind alone feels it: no run of the DEM is wanted
        if cause.lever == "stiffness":  # which peaks of the store do not feel
            peaks = [self.dem(s) for s in self.specimens]
        else:
            peaks = [self.dem(s, extend=there) for s in self.specimens]
        elastic = self.by_dem(cause.name, size, lambda s: there(*build(s)))
        values = self.values_of(peaks, elastic)
        return (values, cause.name) if self.is_clear(self.design.whiten(values), cause) else None
