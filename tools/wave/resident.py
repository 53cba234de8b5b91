"""Carry out commands of `tools.wave` one after the other, without starting Python for each.

Each line of stdin is a JSON list: arguments, and the files for stdout and stderr. Each command runs
in a child process of its own; its exit status is a line of stdout. It ends at the end of stdin.
"""

import json
import os
import sys
import traceback

from .__main__ import main
from .child import UNREADABLE, end_with, why_ended

__all__ = ["serve"]


def serve() -> None:
    """Carry out the commands on stdin."""
    parent = os.getpid()
    for line in sys.stdin.buffer:
        arguments, output, errors = json.loads(line)
        if (child := os.fork()) == 0:
            end_with(parent)
            _carry_out(arguments, output, errors)
        status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        if status < 0:
            with open(errors, "a") as file:
                print(UNREADABLE, why_ended(-status) or f"signal {-status}", file=file)
        print(status, flush=True)


def _carry_out(arguments: list[str], output: str, errors: str) -> None:
    """Carry out a command, and end this process."""
    status = 1
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        for number, file in enumerate((output, errors), start=1):
            os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), number)
        status = main(arguments)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)  # at once: to take Python down takes longer than most commands


if __name__ == "__main__":
    serve()
