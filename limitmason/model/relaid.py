"""An assembly with other joint laws, materials or supports: its blocks stay where they are."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from limitmason.arrays import Flags
from limitmason.checks import choice, instance
from limitmason.errors import InputError
from limitmason.model.block import Block
from limitmason.model.input import JointChoice, JointTable, read_fixed
from limitmason.model.interface import Interface
from limitmason.model.joint import Joint
from limitmason.model.material import Material
from limitmason.model.moved import Laid
from limitmason.model.support import Support

_ORIGIN = ("source", "specimen", "options")  # of a recipe: which experiment it is, whatever it stands on
_KINDS = {"base", "bed", "crack", "head"}  # of joints that builders make, whether or not the assembly has them


def _known(interfaces: Iterable[Interface]) -> list[str]:
    """Kinds of joints that builders make or the ``interfaces`` have, by name."""
    return sorted(_KINDS | {i.kind for i in interfaces})


def of_kind(interfaces: Sequence[Interface], kind: str | None) -> Flags:
    """Which interfaces are joints of a kind, all where it is None, shape (k,); an unknown kind is refused."""
    if kind is not None:
        choice("kind", kind, _known(interfaces))
    return np.array([kind is None or i.kind == kind for i in interfaces], dtype=bool)


def with_joint_laws(
    assembly: Laid, joints: Joint | JointTable | Callable[[Joint], Joint], kinds: Iterable[str] | None
) -> Laid:
    """The assembly with other joint laws, see ``Assembly.with_joints``.

    Parameters
    ----------
    joints : one law, a function of a joint's old law, or a table by kind or by pair of block names
    kinds : of the joints that one law or a function is for; None is all
    """
    if isinstance(kinds, str) or not isinstance(kinds, Iterable | None):
        single = "the single word " if isinstance(kinds, str) else ""
        raise InputError(f"kinds must be several names such as ('bed', 'base'), got {single}{kinds!r}")
    given = None if kinds is None else list(kinds)
    for kind in given or ():
        choice("kinds", kind, _known(assembly.interfaces))
    chosen = None if given is None else set(given)
    if isinstance(joints, Joint) or callable(joints):
        changed = _by_law(assembly.interfaces, joints, chosen)
    elif not isinstance(joints, Mapping):
        raise InputError(f"joints must be a limitmason.Joint, a function of one, or a table; got {joints!r}")
    elif chosen is not None:
        raise InputError("kinds goes with one law or a function; a table names its joints itself")
    else:
        choose = JointChoice(default=None, table=joints, names=[b.name for b in assembly.blocks], required=False)
        changed = tuple(replace(i, joint=choose(i.block_a, i.block_b, i.kind) or i.joint) for i in assembly.interfaces)
        choose.check_all_used()
    return replace(assembly, interfaces=changed)


def _by_law(
    interfaces: Iterable[Interface], law: Joint | Callable[[Joint], Joint], kinds: set[str] | None
) -> tuple[Interface, ...]:
    """Interfaces, those of some kinds with a new law.

    ``law`` is the new one, or a function that makes it of the old one; ``kinds`` None is all. Interfaces that shared a
    law share the new one: readers of laws go by identity, and look at each once.
    """
    new: dict[int, Joint] = {}
    changed = []
    for i in interfaces:
        if kinds is None or i.kind in kinds:
            if id(i.joint) not in new:
                new[id(i.joint)] = instance("joints(joint)", law if isinstance(law, Joint) else law(i.joint), Joint)
            i = replace(i, joint=new[id(i.joint)])
        changed.append(i)
    return tuple(changed)


def with_materials(
    assembly: Laid, material: Material | Mapping[int | str, Material], blocks: Iterable[int | str] | None
) -> Laid:
    """The assembly of blocks made of other materials, see ``Assembly.with_material``.

    Parameters
    ----------
    material : of every block chosen, or one by block name or number
    blocks : names or numbers of the blocks that one material is for; None is all
    """
    if isinstance(material, Material):
        chosen = range(assembly.n_blocks) if blocks is None else [
            assembly.block_index(b) for b in read_fixed(blocks, "blocks")
        ]
        table = dict.fromkeys(chosen, material)
    elif blocks is not None:
        raise InputError("blocks goes with one material; a table names its blocks itself")
    elif not isinstance(material, Mapping):
        raise InputError(f"material must be a limitmason.Material, or a table of them, got {material!r}")
    else:
        table = {assembly.block_index(b): m for b, m in material.items()}
    changed = list(assembly.blocks)
    for k, made_of in table.items():
        if not isinstance(made_of, Material):
            raise InputError(f"block {changed[k].name!r}: material must be a limitmason.Material, got {made_of!r}")
        density = changed[k].density if made_of.density is None else float(made_of.density)
        if not density > 0.0:
            raise InputError(
                f"block {changed[k].name!r} has no density and neither has its material: give Material(density=...)"
            )
        changed[k] = replace(changed[k], material=made_of, density=density)
    return replace(assembly, blocks=tuple(changed), recipe=_with_density(assembly, changed))


def _with_density(assembly: Laid, changed: Sequence[Block]) -> dict[str, Any]:
    """The recipe of an assembly whose blocks have changed: its density is that of the free blocks that had it.

    Where these differ now, it states none.
    """
    recipe = dict(assembly.recipe)
    pairs = zip(assembly.blocks, changed, assembly.fixed, strict=True)
    new = {b.density for a, b, fixed in pairs if not fixed and a.density == recipe.get("density")}
    if len(new) > 1:
        del recipe["density"]
    elif new:
        recipe["density"] = new.pop()
    return recipe


def with_other_supports(assembly: Laid, supports: Sequence[Support]) -> Laid:
    """The assembly with further supports, see ``Assembly.with_supports``."""
    new = {assembly.block_index(s.block): all(s.held) for s in supports}
    kept = tuple(s for s in assembly.supports if assembly.block_index(s.block) not in new)
    recipe = assembly.recipe
    if any(assembly.fixed[k] and not held for k, held in new.items()):
        # what the builder stood on moves now: its lengths are of a wall on firm ground
        recipe = {k: v for k, v in recipe.items() if k in _ORIGIN}
    return replace(assembly, supports=kept + tuple(supports), recipe=recipe)
