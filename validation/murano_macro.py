"""The U walls as a continuum: the source's finite element macro-model, which needs no layout of stones."""

from limitmason.continuum import Continuum
from limitmason.errors import InputError
from limitmason.experiments.experiment import Experiment, Quantity
from limitmason.experiments.murano_u_walls import FORCE, NAME, airbag, assembly, roofs
from limitmason.experiments.source_folder import read_table
from limitmason.model.material import FRACTURE, Material

SETS = {"DS": ("step 1", "final"), "REGW": ("final",)}

ASSUMPTIONS = (
    "Side walls of 1.00 m are derived from the axis of the plan, 3.65 m; they are not printed. The ratios of the "
    "frequencies printed of REGW fit no other length (0.85 m is 11 % softer).",
    "The base is held; the source meshed a concrete base too, whose size is not in the text.",
    "The airbag presses evenly on the rear face between the side walls.",
)


def published(specimen: str, properties: str = "final") -> dict[str, Quantity]:
    """What the source prints of a finite element model of a wall, by column of ``macro.csv``.

    Parameters
    ----------
    specimen : "DS" or "REGW"
    properties : "final", "step 1" (DS only), or "micro" for the model of stones and joints
    """
    table = read_table(NAME, "macro.csv")
    row = table.row(f"{specimen} {properties}", "model")
    return table.quantities(row, {c: c for c in table.units if c not in ("model", "source")})


def material(specimen: str, properties: str = "final") -> Material:
    """Masonry of the source's macro-model, Tables 6 and 9."""
    if properties not in SETS.get(specimen, ()):
        known = "; ".join(f"{wall}: {', '.join(map(repr, sets))}" for wall, sets in SETS.items())
        raise InputError(f"no macro-model {properties!r} of {specimen!r}; there are {known}")
    p = {name: float(value) for name, value in published(specimen, properties).items()}
    strength = {name: p[name] for name in ("tensile_strength", *FRACTURE)}
    name = f"{specimen} {properties}"
    return Material(1e6 * p["young_modulus"], p["poisson_ratio"], p["density"], **strength, name=name)


def macro_model(
    test: Experiment,
    properties: str = "final",
    *,
    size: float = 0.10,
    roof_mass: bool = False,
    points: int = 3,
    nodes: int = 20,
    slab: Material | None = None,
) -> Continuum:
    """The wall of an experiment of this source as a solid of bricks.

    Parameters
    ----------
    test : "DS" or "REGW"; its ``return_length`` and ``roof_from`` count, its stones do not
    properties : "final" or, for DS, "step 1"
    size : largest edge of a brick [m]; 0.10 in the source
    roof_mass : let the load on the side walls vibrate as a mass; False: it only weighs, as a spread force does
    points, nodes : integration points along an edge of a brick, and its nodes: 20, as the source's text has it, or 8
    slab : what a base under the wall is made of; its size is that of the blocks' ground, one course thick (assumed);
        None: the ground is rigid

    Returns
    -------
    Continuum
        Weight and roof dead, an airbag of 1 kN live that pushes the facade off its side walls (towards -y).
    """
    solid = Continuum.from_assembly(
        assembly(test), material(test.specimen, properties), size=size, points=points, nodes=nodes, slab=slab,
        planes=[(1, float(test.options["roof_from"]))],
    )
    return loaded(solid, test, roof_mass=roof_mass)


def loaded(solid: Continuum, test: Experiment, *, roof_mass: bool = False) -> Continuum:
    """A solid with the outline of the walls, with the roof dead and the airbag live as in :func:`macro_model`."""
    load = 1e3 * float(test.parameters["roof load on each side wall"])
    for top in roofs(test):
        if roof_mass:
            solid = solid.with_patch_mass(top, load / 9.81)
        else:
            solid = solid.with_patch_pressure(top, force=load, case="dead")
    return solid.with_patch_pressure(airbag(test), force=FORCE)


def control_point(test: Experiment) -> tuple[float, float, float]:
    """Top of the facade's outer face at mid-span [m], where the test measured displacements."""
    return 0.5 * float(test.parameters["span"]), 0.0, float(test.parameters["height"])
