"""A calibrated model as a simulator of diagnosis: the parameters of the fit, and the causes on top of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from limitmason.answers.curve import Curve
from limitmason.calibration.runs import Model, taken
from limitmason.calibration.targets import outputs_of
from limitmason.errors import InputError
from limitmason.study.linked_formulas import LinkedFormulas


@dataclass(frozen=True, eq=False)
class Simulated:
    """The fitted models as the simulator of a diagnosis.

    A cause or a refitted parameter comes as a keyword.

    Parameters
    ----------
    models : of the fit
    readings : what is read of every model
    at : parameters at the fit by name
    ties : formulas of tied parameters
    given : names that models may take
    """

    models: tuple[Model, ...]
    readings: tuple[Any, ...]
    at: Mapping[str, float]
    ties: LinkedFormulas
    given: tuple[str, ...]

    def __call__(self, specimen: Mapping[str, Any], **changed: float) -> float:
        """Prediction of one target by its model, at the fit but for what is changed.

        Parameters
        ----------
        specimen : number of its "model", and the "place" of the target among what is read of it
        changed : parameters, or sizes of causes, by name
        """
        number = int(specimen["model"])
        model = self.models[number]
        values = self.ties({**self.at, **{k: v for k, v in changed.items() if k in self.at}})
        own = {n: float(values[n]) for n in taken(model, self.given)}
        more = {k: v for k, v in changed.items() if k not in self.at and k in taken(model, (k,))}
        # a cause whose parameter no model takes would pass for one without effect
        idle = [k for k in changed if k not in self.at and not any(taken(m, (k,)) for m in self.models)]
        if idle:
            raise InputError(f"no model takes {idle[0]!r}, the parameter of a cause")
        outputs = outputs_of(model(**{**own, **more}))  # a cause may stand in for a tied parameter
        return float(self.readings[number][int(specimen["place"])].of(outputs))


def numbers_of(model: Model, parameters: Mapping[str, float]) -> dict[str, float]:
    """Every number that a model returns, by name: of a curve its peak and stiffness.

    Parameters
    ----------
    model : called with the parameters
    parameters : by name
    """
    out: dict[str, float] = {}
    for name, found in outputs_of(model(**parameters)).items():
        if isinstance(found, Curve):
            out[f"{name}: peak"] = found.peak.load
            out[f"{name}: stiffness"] = found.stiffness()
            continue
        values = np.atleast_1d(np.asarray(found, dtype=object))
        if all(isinstance(v, int | float | np.number) for v in values):
            out |= {name if len(values) == 1 else f"{name} {k + 1}": float(v) for k, v in enumerate(values)}
    return out
