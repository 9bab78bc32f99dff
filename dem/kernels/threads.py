"""Threads that share the steps of a large structure: where they wait.

How many share a step is chosen in ``dem.model.shared_steps``.
"""

import multiprocessing
import os
import threading
from typing import Any

import numpy as np
from numba import config, types
from numba.extending import intrinsic

from dem.kernels.arrays import Index
from dem.kernels.compiled import kernel

SHUT = 1 << 40
"""What is added to a gate at which a thread will never arrive."""

SPIN = 20_000
"""Looks at a gate, about 150 us, after which a thread sleeps between looks: the one it waits for may need its core."""

SLEEP = 20
"""Length of such a sleep [us]; chosen."""


def _added(typing: Any, gate: Any, x: Any) -> Any:
    """Number of a gate after x is added to it, in one go for all threads.

    The arguments are those that numba asks of an intrinsic.

    Parameters
    ----------
    typing : numba's context of types, not used
    gate, x : types of the gate, an array of one integer, and of what is added

    Returns
    -------
    signature, code : types of the call, and what writes its instructions
    """

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        place = context.make_array(signature.args[0])(context, builder, args[0]).data
        x = context.cast(builder, args[1], signature.args[1], types.int64)
        return builder.add(builder.atomic_rmw("add", place, x, "seq_cst"), x)

    return types.int64(gate, x), code


added: Any = intrinsic(_added)

if os.name == "posix":
    sleep: Any = types.ExternalFunction("usleep", types.int32(types.uint32))
else:

    @kernel(forceinline=True)
    def sleep(microseconds: int) -> int:
        """No such call here: look again at once."""
        return 0


@kernel()
def meet(gate: Index, met: int, threads: int, spin: int = SPIN) -> int:
    """Wait until all parts of a step are here.

    Parameters
    ----------
    gate : first entry: arrivals of all threads at all gates, zero at first
    met : what the gate before gave, 0 at the first
    threads : how many meet
    spin : looks before it sleeps between them

    Returns
    -------
    int
        Arrivals at all gates so far; SHUT or more where a thread will never arrive.
    """
    goal, now, looks = met + threads, int(added(gate, 1)), 0
    while now < goal:
        looks += 1
        if looks > spin:
            sleep(np.uint32(SLEEP))
        now = int(added(gate, 0))  # adds nothing: it reads the gate
    return goal if now < SHUT else now


def threads_allowed() -> int:
    """Threads that may share a step: numba's number, 1 where processes share the work.

    NUMBA_NUM_THREADS sets it.

    That is in a process made by another Python process, and in any thread but the main one: as studies and dask run.
    """
    main = threading.current_thread() is threading.main_thread() and multiprocessing.parent_process() is None
    return int(vars(config)["NUMBA_NUM_THREADS"]) if main else 1
