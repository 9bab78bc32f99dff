"""Ready simulators for a study: collapse multipliers, extended by causes."""

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from limitmason import experiments
from limitmason.answers.method import Method
from limitmason.answers.results import Status
from limitmason.errors import InputError, NotConverged
from limitmason.methods import MODES, Answer, answer, get_method, predict
from limitmason.model import Assembly, Loads
from limitmason.study.run_fingerprint import fingerprint

Build = Callable[..., tuple[Assembly, Loads]]
FLOOR = 1e-3  # multiplier of what cannot stand [-]: far below those of walls, and its logarithm exists
MODAL_TEST = "modal test"  # entry of a specimen whose modes were measured
SLOW: Mapping[str, Any] = MappingProxyType(
    {"levels": 5, "nuisance_levels": 3, "crossed": "corners", "pair_tables": "additive"}
)
"""Options of ``Study`` for a slow simulator: 5 sizes per cause, 3 values per input, no calls for pairs.

For one measured input and n specimens 7 n calls per cause with one side, 9 n with two, 3 n for the baseline, none for
causes of the measurement: some 1,700 for 24 specimens and 12 causes.
"""


@dataclass(frozen=True, eq=False)
class Collapse:
    """A simulator ``simulate(specimen, extend=None, **parameters)``.

    Make one with :func:`collapse`, whose arguments these are.

    Parameters
    ----------
    build : ``build(specimen, **parameters)``, which returns assembly and loads
    method : name of the method that finds the multiplier
    measured_as : factor from the multiplier to what was measured, or a function of specimen and multiplier
    floor : multiplier of a structure that cannot stand [-]
    accept : statuses of a prediction that count
    options : of the method, by name
    same : text that is the same for specimens with the same predictions; None where this is not known
    """

    build: Build
    method: str = "limit"
    measured_as: float | Callable[[Any, float], float] | None = None
    floor: float = FLOOR
    accept: tuple[str, ...] = (Status.SOLVED, Status.ALMOST_SOLVED)
    options: Mapping[str, Any] = field(default_factory=dict)
    same: Callable[[Any], str] | None = field(default=None, repr=False)

    def identity(self, specimen: Any) -> str | None:
        """Text that is the same for specimens with the same predictions.

        They are so whatever the parameters. It is None where this is not known.
        """
        return None if self.same is None else self.same(specimen)

    def __post_init__(self) -> None:
        get_method(self.method, self.options.get("flow_rule"))  # refuses an unknown one
        if not self.floor > 0:
            raise InputError(f"floor must be positive, got {self.floor!r}: a prediction needs a logarithm")

    @property
    def _method(self) -> Method:
        return get_method(self.method, self.options.get("flow_rule"))

    @property
    def __signature__(self) -> inspect.Signature:
        """What it takes: specimen, ``extend``, parameters of ``build``, method's options."""
        return _signature(self.build, [n for n in self._method.takes if n not in self.options])

    def model(
        self, specimen: Any, *, extend: Callable | None = None, **parameters: Any
    ) -> tuple[Assembly, Loads, dict[str, Any]]:
        """Assembly, loads and options of the method, extended.

        Parameters
        ----------
        specimen : what is built
        parameters : inputs of ``build`` or of the method by name
        extend : edit of assembly and loads by the causes

        Raises
        ------
        TypeError
            For a parameter that neither ``build`` nor the method takes.
        """
        takes, any_name = _keywords(self.build)
        method_takes = self._method.takes
        # a diagnosis asks thousands of times: nothing that costs more than the answer
        to_build, options = {}, self._method.one_of_many(self.options)
        for name, value in parameters.items():
            if name in takes:
                to_build[name] = value
            elif name in method_takes:
                options[name] = value
            elif any_name:
                to_build[name] = value
            else:
                known = ", ".join([*takes, *method_takes])
                raise TypeError(f"neither build nor method {self.method!r} takes {name!r}; they take: {known}")
        assembly, loads = self.build(specimen, **to_build)
        if extend is not None:
            assembly, loads = extend(assembly, loads)
        return assembly, loads, options

    def __call__(self, specimen: Any, *, extend: Callable | None = None, **parameters: Any) -> float:
        """Prediction of one specimen in the unit that ``measured_as`` makes of it.

        A structure that cannot stand under its dead load has the floor as its multiplier, so that a fit can still climb
        from there.

        Parameters
        ----------
        extend : edit of assembly and loads by the causes
        """
        assembly, loads, options = self.model(specimen, extend=extend, **parameters)
        prediction = predict(assembly, loads, self.method, **options)
        value = prediction.collapse_multiplier
        if prediction.status == Status.CANNOT_STAND or (prediction.status in self.accept and value <= self.floor):
            value = self.floor
        elif prediction.status not in self.accept or not np.isfinite(value):
            raise NotConverged(
                f"method {self.method!r} ended '{prediction.status}' (multiplier {value:.4g}) for specimen {specimen!r}"
                "; narrow the bounds of the cause, change the method's options, or list the status in accept="
            )
        if self.measured_as is None:
            return float(value)
        if callable(self.measured_as):
            return float(self.measured_as(specimen, float(value)))
        return float(self.measured_as) * float(value)


def collapse(
    build: Build,
    method: str = "limit",
    *,
    measured_as: float | Callable[[Any, float], float] | None = None,
    floor: float = FLOOR,
    accept: tuple[str, ...] = (Status.SOLVED, Status.ALMOST_SOLVED),
    **options: Any,
) -> Collapse:
    """A simulator for ``Study``: build a specimen, extend it, find its multiplier.

    Parameters
    ----------
    build : ``build(specimen, **parameters)`` returns (assembly, loads); it takes the measured inputs, such as
        ``friction_coefficient``, and the parameters of causes without ``apply``
    method : "limit", "dem", "mechanisms", or another of ``limitmason.methods``
    measured_as : factor from the multiplier to what was measured, or ``measured_as(specimen, multiplier)``
    floor : multiplier of a structure that cannot stand, and the least one returned [-]
    accept : statuses of a prediction that count; "not converged" of the DEM is left out unless it is listed
    options : passed to the method, for example ``flow_rule="non-associative"``; a parameter of a study with the name of
        an option goes to the method as well (the cause "torsion strength" does)

    Returns
    -------
    Collapse
        ``simulate(specimen, extend=None, **parameters)``; ``.model(...)`` returns the extended model itself.
    """
    return Collapse(
        build=build, method=method, measured_as=measured_as, floor=floor, accept=tuple(accept), options=options
    )


class Several:
    """A simulator for ``Study`` of several quantities of one model.

    A cause moves them all.

    Parameters
    ----------
    build : ``build(specimen, **parameters)`` returns (assembly, loads); of a specimen with a "modal test", a
        :class:`~limitmason.vibration.ModalTest`, frequencies and shapes at its sensors are answered as well
    answers : quantity to the method that finds it, or to a function of assembly and loads
    options : of a method, by its name; see :func:`limitmason.methods.answer`
    """

    def __init__(
        self, build: Build, answers: Mapping[str, str | Callable[[Assembly, Loads], float]],
        **options: Mapping[str, Any],
    ) -> None:
        """Keep the builder, the method of each quantity, and the options of the methods.

        Parameters
        ----------
        answers : method, or function, of each quantity
        options : by method
        """
        if not callable(build):
            raise InputError(f"build must be a function build(specimen) of assembly and loads, got {build!r}")
        if not isinstance(answers, Mapping):
            raise InputError(f"answers must read {{'peak': 'limit'}}, a method for each quantity, got {answers!r}")
        self.build, self.answers, self.options = build, dict(answers), options

    @property
    def __signature__(self) -> inspect.Signature:
        """What it takes: the specimen, ``extend`` and the parameters of ``build``."""
        return _signature(self.build)

    def __call__(self, specimen: Any, *, extend: Callable | None = None, **parameters: Any) -> Answer:
        """Answers of all quantities for one specimen, all of the same extended model.

        Parameters
        ----------
        extend : edit of assembly and loads by the causes
        """
        assembly, loads = self.build(specimen, **parameters)
        if extend is not None:
            assembly, loads = extend(assembly, loads)
        wanted, options = dict(self.answers), dict(self.options)
        test = specimen.get(MODAL_TEST) if isinstance(specimen, Mapping) else None
        if not wanted and test is None:
            raise InputError("several(build, {}) answers nothing of it: name a method, {'peak': 'limit'}, or give the "
                             f"specimen its {MODAL_TEST!r}")
        if test is not None:
            wanted |= dict.fromkeys(test.quantities, MODES)
            options[MODES] = {**options.get(MODES, {}), "test": test}
        return answer(assembly, loads, wanted, **options)


several = Several


@dataclass(frozen=True)
class _Packaged:
    """Builds packaged experiments from {"specimen": name, "direction": "+"}."""

    source: str

    def __call__(self, specimen: Mapping[str, Any], **parameters: Any) -> tuple[Assembly, Loads]:
        test = experiments.load(self.source, specimen["specimen"], **parameters)
        return test.assembly(), test.loads(specimen.get("direction", "+"))

    def measured(self, specimen: Mapping[str, Any], multiplier: float) -> float:
        """A multiplier in the unit of the measured value."""
        return multiplier * float(experiments.load(self.source, specimen["specimen"]).multiplier_to_measured)

    def identity(self, specimen: Mapping[str, Any]) -> str:
        """Text of all that a prediction depends on: repeats of one test share it."""
        assembly, loads = self(specimen)
        bare = replace(assembly, recipe={})  # which names the specimen
        return fingerprint(self.source, bare, loads, self.measured(specimen, 1.0))


def packaged(source: str, method: str = "limit", *, floor: float = FLOOR, **options: Any) -> Collapse:
    """A simulator of packaged experiments, in the unit of their measured values.

    Parameters
    ----------
    source : name in ``limitmason.experiments.sources()``; a specimen of the study is a mapping with "specimen", its
        name there, "direction" ("+" or "-", "+" when left out), and covariates. The study's parameters are options of
        the source's assemblies (``friction``, ``force_height``, ...)
    method, floor, options : as in :func:`collapse`
    """
    if source not in experiments.sources():
        raise InputError(f"unknown experiment source {source!r}; known: {', '.join(experiments.sources())}")
    packed = _Packaged(source)
    return Collapse(
        build=packed, method=method, measured_as=packed.measured, floor=floor, options=options, same=packed.identity
    )


def _keywords(build: Build) -> tuple[list[str], bool]:
    """Names of the parameters behind the specimen, and whether there is a ``**``."""
    parameters = list(inspect.signature(build).parameters.values())
    any_name = any(p.kind is p.VAR_KEYWORD for p in parameters)
    return [p.name for p in parameters[1:] if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)], any_name


def _signature(build: Build, more: Sequence[str] = ()) -> inspect.Signature:
    """Specimen, ``extend``, the parameters of ``build``, and ``more`` names that a simulator takes."""
    kind = inspect.Parameter
    names, any_name = _keywords(build)
    out = [kind("specimen", kind.POSITIONAL_OR_KEYWORD), kind("extend", kind.KEYWORD_ONLY, default=None)]
    keywords = [n for n in dict.fromkeys((*names, *more)) if n not in ("specimen", "extend")]
    out += [kind(n, kind.KEYWORD_ONLY, default=None) for n in keywords]
    if any_name:
        out.append(kind("parameters", kind.VAR_KEYWORD))
    return inspect.Signature(out)
