"""The distinct element method as a method: ``limitmason.predict(..., "dem")``."""

from dem.multiplier.collapse import collapse
from dem.papers import COLLAPSE
from dem.push import push
from dem.settings import CHECKS, DemSettings
from dem.stages.simulate import simulate
from limitmason.answers.method import DISPLACED, Look, Method

DEM = Method(
    "dem",
    collapse,
    DemSettings,
    look=Look("DEM", "VERMILION", "o"),
    cheap={"error_budget": ()},  # dearer than the answer itself
    stated={"error_budget": CHECKS},
    kept=("error budget",),
    theorem="simulation",
    drive=push,
    follow=simulate,
    references=COLLAPSE,
    levers=DISPLACED,
)
