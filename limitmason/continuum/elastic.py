"""Linear answers: displacements and stresses under dead and live loads, without cracks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from limitmason.arrays import Array
from limitmason.checks import finite, instance
from limitmason.continuum.rotating_crack import tensor
from limitmason.continuum.solid import Continuum, Reactions
from limitmason.storage.frozen import ReadOnly


@dataclass(frozen=True, eq=False)
class ElasticState(ReadOnly):
    """Displacements of a solid that stays elastic.

    Parameters
    ----------
    model : the solid
    displacement : of the nodes [m], shape (n_nodes, 3)
    forces : on the nodes [N], shape (n_nodes, 3)
    residual : largest unbalanced over the largest nodal force [-]
    """

    model: Continuum
    displacement: Array
    forces: Array
    residual: float

    @cached_property
    def stress(self) -> Array:
        """Stresses (xx, yy, zz, xy, yz, zx) at the integration points [Pa], tension positive, shape (m, q, 6)."""
        d = self.model.moduli[self.model.mesh.material]
        strain = self.model.discretisation.strains(self.displacement.ravel())
        return np.asarray(np.einsum("mij,mqj->mqi", d, strain))

    @property
    def principal(self) -> Array:
        """Principal stresses at the integration points [Pa], shape (m, q, 3).

        They are in ascending order, and tension is positive.
        """
        return np.asarray(np.linalg.eigvalsh(tensor(self.stress)), dtype=np.float64)

    @property
    def reactions(self) -> Reactions:
        """Force and moment of the supports on the solid."""
        return self.model.reactions(self.stress, self.forces.ravel())

    def at(self, points: ArrayLike) -> Array:
        """Displacement of points [m], shape (k, 3)."""
        return self.model.value_at(self.displacement.ravel(), points)


def solve_elastic(model: Continuum, multiplier: float = 0.0) -> ElasticState:
    """Displacements under dead + multiplier x live loads, all materials elastic.

    Parameters
    ----------
    model : the solid
    multiplier : of the live loads [-]

    Notes
    -----
    Signs: stresses are positive in tension, as in mechanics of continua; joint forces elsewhere count compression so.
    """
    instance("model", model, Continuum)
    finite("multiplier", multiplier)
    d = model.discretisation
    forces = model.all_dead + multiplier * model.live.ravel()
    wanted = forces[d.order]
    u = model.elastic.solve(wanted)
    largest = float(np.abs(wanted).max()) or 1.0  # without any load the residual is not divided
    residual = float(np.abs(wanted - model.elastic.product(u[:, None])[:, 0]).max()) / largest
    return ElasticState(model, d.spread(u).reshape(-1, 3), forces.reshape(-1, 3), residual)
