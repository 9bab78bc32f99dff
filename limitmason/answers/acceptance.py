"""What makes an answer accepted, "solved": the figures of its certificate, and their limits."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

OWN_RESIDUAL = 1e-6
"""Largest residual of an accepted answer [-]; chosen.

Unbalance of a block over its own load, excess of a joint over its law over its own force, and of a non-associative
answer the violation of its flow rule.
"""

TOTAL_RESIDUAL = 1e-7
"""Largest unbalance of a block, and excess of a joint, over the total load in an accepted answer [-]; chosen."""

GAP = 1e-6
"""Largest gap between the bounds of an accepted answer [-]; chosen."""

CELL_GAP = 5e-3
"""Gap that the cells of cohesive faces may leave in an accepted answer [-]; chosen."""


LABEL_WIDTH = 33
"""Characters before the figures of a certificate as text."""


@dataclass(frozen=True)
class Certificate:
    """How well a prediction satisfies its own theory.

    It is computed with numpy from the assembly and the prediction alone.

    Forces are relative to the total weight (or the total load, where blocks are weightless), rates to the mechanism's
    largest rate. NaN where it does not apply.

    Parameters
    ----------
    equilibrium_residual : largest unbalanced force, or moment over the block's size [-]
    yield_violation : largest excess over the joint law at a contact point [-]
    flow_residual : largest violation of the flow rule, opening < tan(psi) times sliding [-]
    complementarity : largest power that a joint force does against its flow rule [-]
    static_multiplier : lower bound, from the forces [-]
    kinematic_multiplier : upper bound, from the repaired mechanism [-]
    gap : (kinematic - static) over |static|, or over the multiplier at which live equals dead load if that is more [-]
    confinement : largest joint force over the total weight [-]; far above 1 the answer rests on self-stress
    force_cap : joint force over the total weight up to which the kinematic bound holds [-]; infinite (no limit) unless
        blocks are wedged so that no motion opens every joint
    block_residual : largest unbalance of a block over its *own* dead and live load [-]; of a weightless block over the
        largest joint force on it
    worst_block : name of that block
    joint_excess : largest excess over the joint law over the force in that joint, or over the load of its lighter block
        where that is more [-]
    worst_joint : names of the blocks of that joint
    discretisation : part of the gap that comes from dividing cohesive faces into cells [-]; below zero when the forces
        let cohesion gather where it is not
    """

    equilibrium_residual: float
    yield_violation: float
    flow_residual: float = float("nan")
    complementarity: float = float("nan")
    static_multiplier: float = float("nan")
    kinematic_multiplier: float = float("nan")
    gap: float = float("nan")
    confinement: float = float("nan")
    force_cap: float = float("inf")
    block_residual: float = float("nan")
    worst_block: str = ""
    joint_excess: float = float("nan")
    worst_joint: str = ""
    discretisation: float = 0.0

    @property
    def refusal(self) -> str:
        """Why the answer is not accepted as solved, or empty when it is.

        Every block must be in equilibrium and every joint within its law: to :data:`OWN_RESIDUAL` of its own load or
        force, and to :data:`TOTAL_RESIDUAL` of the total load.
        The two bounds must meet to :data:`GAP`. What the cells of cohesive faces leave between them does not count, if
        it is at most :data:`CELL_GAP`.
        A non-associative answer has no second bound: it must keep its flow rule, and joints do no power against it.
        Cohesion at points must not do more than it does when spread over the faces that the mechanism twists. A grid of
        too few points does.
        """
        if np.isnan(self.equilibrium_residual):
            return "there are no joint forces to certify"
        reasons = []
        # not (a <= b) rather than a > b: a figure that is NaN proves nothing
        if not (self.block_residual <= OWN_RESIDUAL and self.equilibrium_residual <= TOTAL_RESIDUAL):
            reasons.append(
                f"block {self.worst_block!r} is out of equilibrium by {self.block_residual:.1e} of its own load"
            )
        if not (self.joint_excess <= OWN_RESIDUAL and self.yield_violation <= TOTAL_RESIDUAL):
            reasons.append(f"the joint {self.worst_joint} exceeds its law by {self.joint_excess:.1e} of its own force")
        # cells leave the forces below what whole faces carry; forces above that are no stresses of these faces
        if self.discretisation < -GAP:
            most = self.kinematic_multiplier
            much = f"{-self.discretisation:.1e} too much" if np.isnan(most) else f"whole faces carry at most {most:.6g}"
            reasons.append(
                "cohesion gathers at points where there is none to that amount: the forces are no admissible stresses, "
                + much
            )
        elif not np.isnan(self.kinematic_multiplier):
            if not (self.discretisation <= CELL_GAP and abs(self.gap - self.discretisation) <= GAP):
                reasons.append(f"the bounds from forces and from the mechanism differ by {self.gap:.1e}")
        elif np.isnan(self.complementarity):  # neither a second bound nor the power of a non-associative mechanism
            reasons.append("no mechanism proves that no more can be carried")
        elif not (self.flow_residual <= OWN_RESIDUAL and self.complementarity <= OWN_RESIDUAL):
            worst = max(self.flow_residual, self.complementarity)
            reasons.append(f"the mechanism breaks its flow rule, or joints work against it, by {worst:.1e}")
        return "; ".join(reasons)

    @property
    def accepted(self) -> bool:
        """Whether equilibrium, joint law and the comparison with the mechanism all hold.

        See ``refusal``.
        """
        return not self.refusal

    def __repr__(self) -> str:
        return f"<Certificate: {self.refusal or 'accepted'}>"

    def __str__(self) -> str:
        """One line a figure."""
        rows = [
            ("equilibrium residual", self.equilibrium_residual),
            ("yield violation", self.yield_violation),
            ("flow rule residual", self.flow_residual),
            ("complementarity", self.complementarity),
            ("static multiplier", self.static_multiplier),
            ("kinematic multiplier", self.kinematic_multiplier),
            ("gap", self.gap),
            ("largest joint force / weight", self.confinement),
            (f"unbalance / own load ({self.worst_block})", self.block_residual),
            (f"yield excess / own force ({self.worst_joint})", self.joint_excess),
        ]
        if self.discretisation:
            rows.append(("part of the gap from cells of faces", self.discretisation))
        if np.isfinite(self.force_cap):
            rows.append(("bound holds up to force / weight", self.force_cap))
        known = [(label, value) for label, value in rows if not np.isnan(value)]
        return "\n".join(
            f"{label + ' ':<{LABEL_WIDTH}}{format(value, '.8f' if 'multiplier' in label else '.2e')}"
            for label, value in known
        )
