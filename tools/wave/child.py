"""Run the reader in a child process: it aborts where a file asks for too much memory."""

import ctypes
import os
import signal
import sys

from ..console import colour

__all__ = ["UNREADABLE", "end_with", "go_on_in_child", "why_ended"]

UNREADABLE = "the file cannot be read:"

_PR_SET_PDEATHSIG = 1
"""Of prctl(2) in Linux: the signal that a process gets when its parent ends."""


def go_on_in_child() -> None:
    """Return in the child only; the parent waits, reports a crash, and exits with its status.

    The child does not outlive the parent: signals are passed on, and on Linux the child ends even
    with a parent that is killed. On a system without fork this does nothing.
    """
    if not hasattr(os, "fork"):
        return
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    parent, child = os.getpid(), os.fork()
    if child == 0:
        end_with(parent)
        return
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda number, _: os.kill(child, number))
    # Control-C reaches the child as well, which prints the message.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status < 0:
        status = _died(-status)
    sys.exit(status)


def end_with(parent: int) -> None:
    """Have the kernel end this process when its parent ends (Linux)."""
    if not sys.platform.startswith("linux"):
        return
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:  # it has ended already
        os.kill(os.getpid(), signal.SIGKILL)


def why_ended(number: int) -> str | None:
    """Return what it means that a signal ended the reader; None if it came from outside."""
    if number == signal.SIGKILL:
        return "it does not fit into memory"
    broken = (signal.SIGABRT, signal.SIGSEGV, signal.SIGBUS, signal.SIGILL, signal.SIGFPE)
    return "its contents are malformed" if number in broken else None


def _died(number: int) -> int:
    """Report why a signal ended the child, or end by the same signal if it came from outside."""
    if (why := why_ended(number)) is None:
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
        return 128 + number  # where this process ignores the signal
    print(colour("error:", 31, sys.stderr), UNREADABLE, why, file=sys.stderr)
    return 2
