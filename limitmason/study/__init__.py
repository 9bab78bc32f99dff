"""Studies: many runs of one question, random joints, and what dilatancy, block size and contact points do.

Every study returns a :class:`Table`, runs on any executor, and goes on after a kill where it has a store.
"""

from limitmason.display.notebook import shows
from limitmason.study.block_size import block_size_study
from limitmason.study.dilatancy import contact_point_study, dilatancy_study, with_dilatancy
from limitmason.study.fragility import Fragility, fragility
from limitmason.study.memo import Memo
from limitmason.study.montecarlo import SobolIndices, curves_of, monte_carlo, sobol
from limitmason.study.random_joints import Random, lognormal, normal, uniform
from limitmason.study.run_fingerprint import fingerprint
from limitmason.study.sampling import Running, Stop, running
from limitmason.study.sweep import sweep
from limitmason.study.table import Table
from limitmason.study.workers import Unfinished

__all__ = [
    "Fragility", "Memo", "Random", "Running", "SobolIndices", "Stop", "Table", "Unfinished", "block_size_study",
    "contact_point_study", "curves_of", "dilatancy_study", "fingerprint", "fragility", "lognormal", "monte_carlo",
    "normal", "running", "sobol", "sweep", "uniform", "with_dilatancy",
]

shows(__name__)
