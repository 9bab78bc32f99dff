"""Processes that begin one thing at the same moment, and may be killed at any.

They share no lock: a process that is killed while it leaves a barrier keeps the lock, and the others wait for ever.
"""

import multiprocessing as mp

LONGEST = 120.0  # until a process must have ended [s]; a hundred times what any takes


def ready(pipe):
    """Say that this process has started, and wait until all have."""
    pipe.send("ready")
    pipe.recv()


def together(target, arguments):
    """Processes that run ``target(pipe, *arguments)`` from one moment on, and this side of their pipes."""
    context = mp.get_context("fork")
    children, pipes = [], []
    for given in arguments:
        here, there = context.Pipe()
        child = context.Process(target=target, args=(there, *given), daemon=True)
        child.start()
        there.close()  # else a child that ends without a word is waited for
        children.append(child)
        pipes.append(here)
    for pipe in pipes:
        assert pipe.recv() == "ready"
    for pipe in pipes:
        pipe.send("go")
    return children, pipes


def said(pipe):
    """What a process said at its end; None where it was killed before."""
    assert pipe.poll(LONGEST), f"a process says nothing for {LONGEST:g} s"
    try:
        return pipe.recv()
    except (EOFError, ConnectionResetError):
        return None


def ended(child):
    """The exit code of a process, which must end."""
    child.join(LONGEST)
    assert child.exitcode is not None, f"{child.name} still runs after {LONGEST:g} s"
    return child.exitcode
