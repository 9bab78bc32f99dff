"""Stored collapse multipliers of the campaigns: candidates by limit analysis, truths by limit analysis and by the DEM.

``python -m validation.blind.campaign_store`` computes what is missing (a quarter of an hour on one core) and writes
``campaigns.csv``: one line per code, effect, size and friction, one column per specimen.
"""

import sys
import time
from dataclasses import dataclass, field
from pathlib import Path

from limitmason import dem, limit_analysis
from limitmason.diagnosis import Extension, Noise, Study
from limitmason.storage.csv_table import parsed, write_table

from . import campaigns
from .campaigns import CAUSES, FRICTION, FRICTION_ERROR, NEVER_LISTED, NOISE, NUISANCE, SIMULATED, SPECIMENS
from .outsiders import BY_NAME, EFFECTS

STORE = Path(__file__).with_name("campaigns.csv")
LIMIT, DEM = "limit", "dem"
TABLES = {"levels": 5, "nuisance_levels": 5, "crossed": "corners", "pair_tables": "additive"}
FRICTIONS = (-1.0, 1.0)  # in standard deviations, drawn alike: mean 0, variance 1, between the levels
SMALL, EVERY = campaigns.CHOSEN["12"], tuple(range(len(SPECIMENS)))
SHARES = {1: (0.3, 0.55, 0.85), 2: (0.4, 0.8)}  # of the way to a bound, by the number of sides: planted sizes
TWO = (("weak base joint", 0.75, "cohesion", 0.2), ("edge rounding", 5.0, "overload magnitude", 1.3),
       ("lost overlap", 30.0, "out-of-plumb", 1.5), ("effective thickness", 0.85, "weak base joint", 0.8))
SAVED = 60.0  # seconds between two savings


def planted_sizes(cause):
    """Sizes of a catalogue cause that are planted, none of them a level of its table."""
    shares = SHARES[len(cause.sides)]
    return [cause.baseline + share * (side - cause.baseline) for side in cause.sides for share in shares]


def friction(z):
    """Friction coefficient at a number of standard deviations."""
    return FRICTION + FRICTION_ERROR * z


def read(store=STORE):
    """Stored values by (code, effect, friction, number of the specimen)."""
    out = {}
    if store.exists():
        for row in parsed(store.read_text(encoding="utf-8"), store.name).rows:
            for number, value in enumerate(row[3:]):
                if value:
                    out[row[0], row[1], row[2], number] = float(value)
    return out


def write(values, store=STORE):
    """Write all values, one line per code, effect and friction."""
    rows = {}
    for (code, effect, mu, number), value in values.items():
        rows.setdefault((code, effect, mu), {})[number] = f"{value:.8g}"
    names = ["code", "effect and size", "friction coefficient", *(f"specimen {s['name']}" for s in SPECIMENS)]
    note = (
        "Collapse multipliers of campaigns.SPECIMENS, by python -m validation.blind.campaign_store\n"
        "limit: limit_analysis(flow_rule='associative'); "
        "dem: dem.collapse(error_budget=(), tolerance=0.003, contact_points=(3, 2))"
    )
    lines = [[*key, *(rows[key].get(i, "") for i in EVERY)] for key in sorted(rows)]
    write_table(store, dict.fromkeys(names, "-"), lines, note)


@dataclass
class Simulator:
    """``simulate(specimen, friction_coefficient=, extend=)`` of one code, from the store.

    Parameters
    ----------
    code : "limit" or "dem"
    values : stored values, shared
    save : called after a value was computed; None refuses what is not stored
    """

    code: str
    values: dict = field(repr=False)
    save: object = field(default=None, repr=False)

    def __call__(self, specimen, *, friction_coefficient=FRICTION, extend=None):
        """Collapse multiplier; causes at their baseline are no causes."""
        steps = [(c, size) for c, size in (extend.steps if extend else ()) if size != c.baseline]
        label = " + ".join(f"{c.name} {size:.10g}" for c, size in steps)

        def model():
            made = campaigns.build(specimen, friction_coefficient)
            return Extension(tuple(steps), specimen)(*made) if steps else made

        return self._value(label, friction_coefficient, int(specimen["name"]) - 1, model)

    def effect(self, name, size, number, mu):
        """The same with an effect of the outsider's."""
        effect = BY_NAME[name]
        return self._value(
            f"{name} {size:.10g}", mu, number, lambda: effect.change(SPECIMENS[number], mu, size)
        )

    def _value(self, label, mu, number, model):
        key = (self.code, label, f"{mu:.10g}", number)
        if key not in self.values:
            if self.save is None:
                raise LookupError(f"no stored value for {key}: run python -m validation.blind.campaign_store")
            self.values[key] = solved(self.code, *model())
            self.save()
        return self.values[key]


def solved(code, model, loads):
    """Collapse multiplier of a model by one code, at least 0.001 for what cannot stand."""
    if code == LIMIT:
        found = limit_analysis(model, loads, "associative", check_dead_load=False)
    else:
        found = dem.collapse(model, loads, error_budget=(), tolerance=3e-3, contact_points=(3, 2))
    if found.status not in ("solved", "almost solved"):
        return 1e-3
    return max(float(found.collapse_multiplier), 1e-3)


def blank(name, simulator, **options):
    """A campaign with one code as the candidates, without measured values."""
    chosen = {"covariates": campaigns.COVARIATES, **options}
    return Study(campaigns.specimens(name), simulator, None, Noise(NOISE), NUISANCE, **chosen, **TABLES)


def make(codes=(LIMIT, DEM)):
    """Compute what is not stored yet."""
    values, last = read(), [time.monotonic()]

    def save():
        if time.monotonic() - last[0] > SAVED:
            write(values)
            last[0] = time.monotonic()
            sys.stderr.write(f"\r{len(values)} values        ")

    by_name = {c.name: c for c in CAUSES}
    planted = [((c, x),) for c in (*SIMULATED, *NEVER_LISTED) if not c.transforms for x in planted_sizes(c)]
    if LIMIT in codes:
        limit = Simulator(LIMIT, values, save)
        blank("24", limit).design(CAUSES)
        write(values)
        planted += [((by_name[a], x), (by_name[b], y)) for a, x, b, y in TWO]
        for z in FRICTIONS:
            for number in EVERY:
                limit(SPECIMENS[number], friction_coefficient=friction(z))
                for steps in planted:
                    limit(SPECIMENS[number], friction_coefficient=friction(z), extend=Extension(steps))
                for effect in EFFECTS:
                    for size in effect.sizes if effect.change else ():
                        limit.effect(effect.name, size, number, friction(z))
        write(values)
    if DEM in codes:
        slow = Simulator(DEM, values, save)
        for steps in ((), *(p for p in planted if p[0][0] in SIMULATED)):
            for number in SMALL:
                slow(SPECIMENS[number], extend=Extension(steps))
        for effect in EFFECTS:
            for number in SMALL if effect.change else ():
                slow.effect(effect.name, effect.sizes[1], number, FRICTION)
        write(values)
    sys.stderr.write("\n")


if __name__ == "__main__":
    make(sys.argv[1:] or (LIMIT, DEM))
