"""The assembly: blocks, the interfaces found between them, supports and the recipe it was built from."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from numpy.typing import ArrayLike

from limitmason.checks import finite, positive, several
from limitmason.display.notebook import Displayed
from limitmason.errors import InputError
from limitmason.geometry.contact import KEPT, ContactRules, DoubtfulContact
from limitmason.geometry.polyhedron import longest_sides
from limitmason.model import contact_warnings, detection
from limitmason.model.block import Block
from limitmason.model.blockwork import Blockwork
from limitmason.model.contact_report import ContactReport
from limitmason.model.contact_survey import contact_report
from limitmason.model.input import (
    JointChoice,
    JointTable,
    read_axes,
    read_densities,
    read_fixed,
    read_list,
    read_names,
    read_pieces,
    read_prisms,
    read_recipe,
)
from limitmason.model.interface import Interface, interface_kind, with_edges_inset
from limitmason.model.joint import Joint
from limitmason.model.material import Material
from limitmason.model.moved import renumbered, transformed
from limitmason.model.plausibility import warn_of_blocks, warn_of_tolerance
from limitmason.model.relaid import with_joint_laws, with_materials, with_other_supports
from limitmason.model.ring_beam import fitted
from limitmason.model.support import Support
from limitmason.model.tie import Tie


class ContactError(InputError):
    """Blocks that overlap or float.

    ``assembly`` holds them as far as they go, for ``assembly.contact_report()``.
    """

    def __init__(self, text: str, assembly: Assembly) -> None:
        super().__init__(text)
        self.assembly = assembly


@dataclass(frozen=True, eq=False, repr=False)
class Assembly(Displayed, Blockwork):
    """Rigid blocks in contact.

    Build one with :meth:`from_polygons`, :meth:`from_polyhedra` or the builders in ``limitmason.build``.

    Parameters
    ----------
    blocks, interfaces, supports : see ``Block``, ``Interface``, ``Support``
    recipe : plain data the assembly was built from (wall plan, bond, units); mechanisms read their parameters there
    tolerance : gap or overlap up to which faces count as touching, for a block of median width [m]
    contact_rules : which faces count as touching, as given or by default
    doubts : near misses and contacts kept by a rule, as found with the interfaces; see :meth:`contact_report`
    ties : rods, anchors and ring beams, see :class:`Tie` and :meth:`with_ties`
    """

    # ---- construction -------------------------------------------------------------------------------------------

    @classmethod
    def from_polyhedra(
        cls,
        solids: Sequence[Any],
        *,
        joint: Joint,
        density: float | ArrayLike = 2000.0,
        fixed: Iterable[int | str] = (),
        names: Sequence[str] | None = None,
        joints: JointTable | None = None,
        recipe: Mapping[str, Any] | None = None,
        tolerance: float | None = None,
        angle_tolerance_deg: float = ContactRules.angle_deg,
        wedge_tolerance_deg: float = ContactRules.wedge_deg,
        smallest_contact: float | None = None,
        axes: Sequence[ArrayLike | None] | None = None,
    ) -> Assembly:
        """Assembly of closed solids.

        Contacts are found where plane faces of two blocks meet.

        Parameters
        ----------
        solids : per block (vertices [m], shape (n, 3); faces as vertex index lists, counter-clockwise from outside),
            or a list of such pieces; what is not convex is divided into convex parts, and stays one rigid body
        joint : law of every joint not named in ``joints``
        density : mass density [kg/m3], one or one per block
        fixed : names or numbers of blocks held in all six degrees of freedom
        names : unique block names; "block-0", ... by default
        joints : laws by kind ("bed", "head", "base") or by pair of block names ("a", "b"); a pair goes before a kind
        recipe : plain data to keep with the assembly
        tolerance : gap or overlap up to which faces count as touching [m]; by default 1e-4 of the width of the
            smaller of the two blocks
        angle_tolerance_deg : faces that touch are in contact up to this angle between them, where the gap is within
            the tolerance [deg]
        wedge_tolerance_deg : faces that touch at one end and open by no more than this angle, and by no more than 2 %
            of the smaller block's width (or twice the tolerance), are in contact over all their common area [deg]
        smallest_contact : contacts narrower than this (2 area / perimeter) are left out [m]; the tolerance by default
        axes : length direction of each unit as laid, shape (3,) each; None for one without, or for all

        Raises
        ------
        ValueError
            For open, inverted, flat or overlapping solids, solids with too many hollow edges, repeated names, negative
            density, and blocks without a path of contacts to a support; the message names the block. Overlapping and
            floating blocks raise a ``ContactError``, whose ``assembly`` has a :meth:`contact_report` all the same.

        Warns
        -----
        ContactWarning
            Naming faces that nearly touch and are no contact, and wedges that were made contacts.
        PlausibilityWarning
            For densities and sizes that look like other units, and a tolerance too large for the smallest block.
        """
        solids = read_list("solids", solids)
        if not solids:
            raise InputError("an assembly needs at least one block")
        names = read_names(names, len(solids))
        densities = read_densities(density, names)
        pieces = [read_pieces(solid, name) for solid, name in zip(solids, names, strict=True)]
        every_axis = read_axes(axes, len(pieces))
        blocks = tuple(Block(*row) for row in zip(names, pieces, densities, every_axis, strict=True))
        supports = tuple(Support.fixed(f) for f in read_fixed(fixed))
        rules = ContactRules(
            None if tolerance is None else positive("tolerance", tolerance, "m"),
            finite("angle_tolerance_deg", angle_tolerance_deg),
            finite("wedge_tolerance_deg", wedge_tolerance_deg),
            None if smallest_contact is None else finite("smallest_contact", smallest_contact),
        )
        closed = detection.closed_pieces(blocks)
        # also how far a vertex may lie off the plane of its face
        typical = detection.typical_tolerance(closed) if tolerance is None else float(tolerance)
        blocks, closed = detection.with_convex_parts(blocks, closed, typical)
        assembly = cls(blocks, (), supports, read_recipe(recipe), typical, rules)
        return assembly._with_contacts(closed, joint, joints or {})

    @classmethod
    def from_polygons(
        cls,
        outlines: Sequence[ArrayLike],
        *,
        thickness: float,
        joint: Joint,
        density: float | ArrayLike = 2000.0,
        fixed: Iterable[int | str] = (),
        names: Sequence[str] | None = None,
        joints: JointTable | None = None,
        recipe: Mapping[str, Any] | None = None,
        tolerance: float | None = None,
        angle_tolerance_deg: float = ContactRules.angle_deg,
        wedge_tolerance_deg: float = ContactRules.wedge_deg,
        smallest_contact: float | None = None,
    ) -> Assembly:
        """Assembly of prisms over outlines in the x-z plane.

        They lie between y = 0 and y = thickness.

        Parameters
        ----------
        outlines : simple polygons in either sense, concave ones too [m], shape (n, 2) each, columns x and z
        thickness : extent in y [m], > 0
        joint, density, fixed, names, joints, recipe : as in :meth:`from_polyhedra`
        tolerance, angle_tolerance_deg, wedge_tolerance_deg, smallest_contact : as in :meth:`from_polyhedra`

        Raises
        ------
        ValueError
            As :meth:`from_polyhedra`, and for outlines that cross themselves or enclose no area.
        """
        positive("thickness", thickness, "m")
        outlines = read_list("outlines", outlines)
        names = read_names(names, len(outlines))
        if tolerance is not None:
            finite("tolerance", tolerance)
        solids = read_prisms(outlines, names, thickness, tolerance)
        return cls.from_polyhedra(
            solids, joint=joint, density=density, fixed=fixed, names=names, joints=joints, recipe=recipe,
            tolerance=tolerance, angle_tolerance_deg=angle_tolerance_deg, wedge_tolerance_deg=wedge_tolerance_deg,
            smallest_contact=smallest_contact,
        )

    def _with_contacts(self, pieces: detection.BlockPieces, joint: Joint, table: JointTable) -> Assembly:
        """This assembly with the contacts that its rules find.

        Each has the joint that is chosen for it.

        Parameters
        ----------
        pieces : convex pieces of its blocks
        joint : law of the joints that the table does not name
        table : laws by kind or by pair of block names

        Raises
        ------
        ContactError
            For blocks that overlap, and for blocks that float where something is held.
        """
        rules = self.contact_rules
        # before the errors below: a wrong unit may be their cause
        warn_of_blocks(self.blocks, longest_sides(pieces.solids))
        if rules.distance is not None:
            warn_of_tolerance(rules.distance, [b.name for b in self.blocks], pieces.widths)
        found = detection.detect(self.blocks, pieces, rules, self.tolerance)
        choose = JointChoice(joint, table, [b.name for b in self.blocks])
        fixed = self.fixed
        interfaces = []
        for a, b, polygon, normal in zip(
            found.a.tolist(), found.b.tolist(), found.polygons, found.normals, strict=True
        ):
            kind = interface_kind(normal, fixed[a], fixed[b])
            interfaces.append(Interface(a, b, polygon, normal, choose(a, b, kind) or joint, kind))
        assembly = replace(self, interfaces=tuple(interfaces), doubts=tuple(found.doubts))
        # only now: the error carries the assembly, whose contact report shows what overlaps
        if found.overlaps:
            raise ContactError(contact_warnings.overlap_text(found, self.blocks, pieces.widths, rules), assembly)
        choose.check_all_used()
        if assembly.supports:
            assembly.check_connected()
        contact_warnings.warn_of_doubts(assembly, [d for d in found.doubts if d.kind in KEPT], assembly.near_misses)
        return assembly

    # ---- variants -----------------------------------------------------------------------------------------------

    def with_supports(self, supports: Iterable[Support]) -> Assembly:
        """This assembly with further supports.

        A new one for a block replaces the block's old one. Joints keep kind and law. A block that they leave floating
        is an error. Where a block that was wholly held may move now, the recipe is dropped.
        """
        assembly = with_other_supports(self, several("supports", supports, Support))
        assembly.check_connected()
        return assembly

    def with_joints(
        self, joints: Joint | JointTable | Callable[[Joint], Joint], kinds: Iterable[str] | None = None
    ) -> Assembly:
        """This assembly with other joint laws.

        Parameters
        ----------
        joints : one law, a function of the law a joint has that gives its new one, or a table by kind or by pair of
            block names; joints that share a law still share one after a function has changed it
        kinds : "bed", "head", "base": the joints that one law or a function is for; None is all

        Raises
        ------
        ValueError
            For kinds beside a table, which names its joints itself.
        """
        return with_joint_laws(self, joints, kinds)

    def with_material(
        self, material: Material | Mapping[int | str, Material], *, blocks: Iterable[int | str] | None = None
    ) -> Assembly:
        """This assembly of blocks made of a material.

        A material with a density gives the block that density. The recipe follows, and states none where free units
        differ.

        Parameters
        ----------
        material : of every block, or one by block name or number
        blocks : names or numbers of the blocks that one material is for; None is all

        Raises
        ------
        ValueError
            For blocks beside a table, an unknown block, and a block that would be left without a density.
        """
        return with_materials(self, material, blocks)

    def with_interfaces(self, interfaces: Iterable[Interface]) -> Assembly:
        """This assembly with other interfaces, taken as they are.

        Some joints may be missing, or polygons be changed: contacts are not looked for again.
        """
        return replace(self, interfaces=several("interfaces", interfaces, Interface))

    def with_ties(self, ties: Iterable[Tie]) -> Assembly:
        """This assembly with these ties in place of those it had.

        An empty sequence gives the assembly without ties.

        Raises
        ------
        ValueError
            For unknown blocks, a tie of a block to itself or between held blocks, an end far outside its block, and a
            tie to the ground where no block is wholly held.
        """
        return replace(self, ties=fitted(self, several("ties", ties, Tie)))

    def with_contact_ends_pulled_in(self, inset: float, *, direction: ArrayLike | None = None) -> Assembly:
        """This assembly with interfaces shortened at their ends, as by rounded edges.

        Parameters
        ----------
        inset : distance each end is pulled in [m], >= 0
        direction : edges that face this direction or its opposite stay (for a wall in the x-z plane give the normal of
            the plane, (0, 1, 0), to keep the full thickness); None pulls in all edges

        Raises
        ------
        ValueError
            When an interface is not wider than twice the inset.
        """
        names = [b.name for b in self.blocks]
        return replace(self, interfaces=with_edges_inset(self.interfaces, names, inset, direction))

    def transformed(self, matrix: ArrayLike, translation: ArrayLike = (0.0, 0.0, 0.0)) -> Assembly:
        """This assembly rotated, mirrored or scaled by a matrix and moved.

        A point goes from x to M x + t, and gravity stays along -z. What supports hold turns along.

        Parameters
        ----------
        matrix : shape (3, 3), a multiple of an orthogonal matrix
        translation : [m], shape (3,)

        Notes
        -----
        The recipe is kept only under a pure translation: its directions and lengths would no longer be right. A support
        of single directions that would lie along no global axis is refused.
        """
        return transformed(self, matrix, translation)

    def renumbered(self, order: Sequence[int]) -> Assembly:
        """This assembly with its blocks in another order.

        Parameters
        ----------
        order : every block number once; new block k is old block ``order[k]``
        """
        return renumbered(self, order)

    # ---- contacts -------------------------------------------------------------------------------------------------

    def check_connected(self) -> None:
        """Refuse an assembly of which a block has no path of contacts to a held one.

        One in which nothing is held is refused too.

        Raises
        ------
        ValueError
            When nothing is held; a ``ContactError`` naming the block that floats.
        """
        if not self.held.any():
            raise InputError("nothing is fixed: give fixed=[...] or with_supports([...]) for at least one block")
        loose = contact_warnings.loose_blocks(self)
        if len(loose):
            raise ContactError(contact_warnings.floating_text(self, loose), self)

    @cached_property
    def near_misses(self) -> tuple[DoubtfulContact, ...]:
        """Pairs of faces that nearly touch and are no contact.

        Pairs between which a joint was made by hand are left out.
        """
        if not self.doubts:
            return ()
        present, given = contact_warnings.interfaces_by_pair(self), self.contact_rules.width is not None
        return tuple(contact_warnings.near_misses(self.doubts, present, least_width_given=given))

    @property
    def contact_warnings(self) -> tuple[str, ...]:
        """What an analysis of this assembly says about its contacts."""
        return (contact_warnings.count_text(len(self.near_misses)),) if self.near_misses else ()

    def contact_report(self, *, distance: float | None = None, angle_deg: float | None = None) -> ContactReport:
        """Which faces touch, which nearly do, and what a wider tolerance would add.

        Parameters
        ----------
        distance : near misses are looked for up to this gap [m]; by default ten times the tolerance, or 2 % of the
            width of the smaller block if that is more
        angle_deg : and up to this angle between the faces [deg]; 45 by default

        Returns
        -------
        ContactReport
            ``print`` it for a table; :func:`limitmason.figures.contact_report` draws it.
        """
        return contact_report(self, distance=distance, angle_deg=angle_deg)
