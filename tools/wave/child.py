"""A process that may die: where a file asks for too much memory, the reader in Rust ends it."""

import os
import signal
import sys

from ..console import colour

__all__ = ["go_on_in_child"]


def go_on_in_child() -> None:
    """Return in a child only. The parent waits, tells in a line if it dies, and ends as it ended.

    Where a system has no fork this does nothing.
    """
    if not hasattr(os, "fork"):
        return
    for stream in (sys.stdout, sys.stderr):
        if stream is not None:
            stream.flush()
    child = os.fork()
    if child == 0:
        return
    # Control-C reaches the child as well, which says what is to be said.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if status < 0:
        why = ("it does not fit into memory" if -status == signal.SIGKILL else
               "something in it is not as a waveform file should be")
        print(colour("error:", 31, sys.stderr), f"the file cannot be read: {why}", file=sys.stderr)
        status = 2
    sys.exit(status)
