"""21 dry-joint shear walls of Minho: 31 measured peaks against the plain rigid-block model.

Nothing is tuned. What the sources leave open is shown as a range: the friction of the WS walls (0.5 to 0.75), the
height of the force on the SW walls (0.95 or 1.0 m).
"""

import numpy as np

from limitmason import experiments, figures, limit_analysis

SOURCE = "minho-dry-stone-2005-2009"


def collapse_load(test, direction, **options):
    """Collapse load [kN] with the given options in place of the defaults."""
    case = test.with_options(**options)
    prediction = limit_analysis(case.assembly(), case.loads(direction))
    assert prediction.status == "solved"
    return prediction.collapse_multiplier * test.multiplier_to_measured


rows, ratios = [], {"WS": [], "SW": []}
print("test      peak     measured kN   predicted kN   range kN           ratio")
for name in experiments.specimens(SOURCE):
    test = experiments.load(SOURCE, name)
    series = name[:2]
    variants = (
        [{"friction": f} for f in (0.5, 0.65, 0.75)] if series == "WS" else [{"force_height": h} for h in (0.95, 1.0)]
    )
    for quantity, direction in (("Vmax+", "+"), ("Vmax-", "-")):
        if quantity not in test.measured:
            continue
        measured = float(test.measured[quantity])
        value = collapse_load(test, direction)
        values = [collapse_load(test, direction, **v) for v in variants]
        low, high = min(values), max(values)
        rows.append((f"{name} {quantity[-1]}", measured, (low, value, high), f"{series} walls"))
        ratios[series].append(value / measured)
        print(
            f"{name:<10}{quantity:<9}{measured:11.1f}{value:15.1f}   {low:6.1f} to {high:6.1f}{value / measured:12.3f}"
        )

print(f"{len(rows)} peaks")
for series, values in ratios.items():
    print(f"{series}: predicted / measured {np.mean(values):.3f} on average, {min(values):.3f} to {max(values):.3f}")
figures.predicted_against_published(
    rows,
    quantity="peak horizontal force [kN]",
    published="measured",
    title="Dry-joint shear walls, University of Minho",
).savefig("minho_shear_walls.png", dpi=200)
