"""What searches for contacts cost on a shaken tower: stretches with and without them, side by side.

    python benchmarks/tower_search.py [--ring 10] [--courses 36] [--factor 0.4] [--before 0.4] [--stretches 8] [--full]

The tower, its settling and its record are those of ``tower.py``. The ground begins with the strong part of the record,
times ``--before``, and 0.5 s of it are run with searches. The rest is times ``--factor``, which ``--before`` also is by
default. Every stretch of 0.1 s is then run twice from the same state: with the default searches, and on the contacts
that are there. The next one goes on from the first.
A joint slides where its slip changes by more than 0.1 mm in the stretch. Processor seconds.

``--full`` also runs every stretch with searches of all pairs, and prints by how much energies differ, over the work of
ground and weight since the beginning.
"""

import argparse
import os
import time

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from tower import RECORD_STEP, SETTLE, record, tower

import dem
from dem import kernels
from dem.contact import detection
from dem.contact.near import Neighbours
from dem.stages.simulate import prepared

BEGIN, BEFORE, STRETCH, SLIDES = 2.0, 0.5, 0.1, 1e-4


class EveryPair(Neighbours):
    """Neighbours that are all looked at."""

    def due(self):
        """All of them."""
        return np.ones(len(self.moved), dtype=bool)


def stretched(model, state, shaking, every=50, neighbours=Neighbours):
    """State after a stretch, and processor seconds of its steps and searches."""
    detection.Neighbours = neighbours
    run = prepared(model, shaking, start=state, detect_every=every, sample=10**6)
    begun = time.process_time()
    run.begin()
    while not run.over:
        run.advance()
    run.finish()
    detection.Neighbours = Neighbours
    return run.rec.state, time.process_time() - begun


def slips(model, state):
    """Largest slip of the joints that are as they were made from interfaces, by interface [m]."""
    slip = np.linalg.norm(state.measured(model).slip, axis=1)
    largest = np.maximum.reduceat(slip, state.joints.start[:-1])
    first = state.interface >= 0
    return dict(zip(state.interface[first].tolist(), largest[first].tolist(), strict=True))


def energies(model, state):
    """Sums of energy, and the stored one [J]."""
    return np.array([*(state.total[getattr(kernels, f"E_{c}")] for c in ("KINETIC", "FRICTION", "VISCOUS", "SUPPORT")),
                     state.measured(model).elastic_energy])


def main():
    """Print a row for every stretch, and the median."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ring", type=int, default=10)
    parser.add_argument("--courses", type=int, default=36)
    parser.add_argument("--factor", type=float, default=0.4)
    parser.add_argument("--before", type=float)
    parser.add_argument("--stretches", type=int, default=8)
    parser.add_argument("--full", action="store_true")
    args = parser.parse_args()
    model, whole = tower(args.ring, args.courses), np.array(record().acceleration)

    def part(begin, end, factor=args.factor):
        rows = factor * whole[round(begin / RECORD_STEP) : round(end / RECORD_STEP) + 1]
        return dem.BaseMotion(tuple(map(tuple, rows.tolist())), RECORD_STEP, after="coast")

    state = dem.simulate(
        model, dem.Hold(duration=SETTLE, damping=dem.Damping(local=0.8)), mode="dynamic", contact_points=(2, 4),
        sample=SETTLE,
    ).state
    state.stop()
    state, _ = stretched(model, state, part(BEGIN, BEGIN + BEFORE, args.before or args.factor))
    print(f"{model.n_blocks} blocks, {len(model.interfaces)} joints, step {state.dt:.3g} s\n")
    print("| from [s] | joints that slide | cut anew or found | largest slip [mm] | without [s] | with / without |"
          + (" energies, all pairs |" if args.full else ""))
    print("|---" * (7 if args.full else 6) + "|", flush=True)
    ratios, begin = [], BEGIN + BEFORE
    for _ in range(args.stretches):
        shaking = part(begin, begin + STRETCH)
        new, searched = stretched(model, state, shaking)
        _, kept = stretched(model, state, shaking, every=None)
        before, after = slips(model, state), slips(model, new)
        slide = np.mean([abs(after[k] - before[k]) > SLIDES for k in before.keys() & after.keys()])
        ratios.append(searched / kept)
        print(f"| {begin:.1f} | {slide:.1%} | {np.mean(new.interface < 0):.1%} | {1e3 * max(after.values()):.1f} | "
              f"{kept:.2f} | {ratios[-1]:.2f} |", end="" if args.full else "\n", flush=True)
        if args.full:
            every, _ = stretched(model, state, shaking, neighbours=EveryPair)
            work = np.abs(new.total[[kernels.E_SUPPORT, kernels.E_APPLIED]]).sum()
            print(f" {np.abs(energies(model, new) - energies(model, every)).max() / work:.1e} |", flush=True)
        state, begin = new, begin + STRETCH
    print(f"\nwith / without: median {np.median(ratios):.2f}, {min(ratios):.2f} to {max(ratios):.2f}")


if __name__ == "__main__":
    main()
