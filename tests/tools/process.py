"""Commands that go on until Ctrl-C, run as a person does."""

import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import Empty, Queue

__all__ = ["PATIENCE", "ROOT", "Command", "command", "running"]

ROOT = Path(__file__).parents[2]
PATIENCE = 180
"""Seconds after which something that should have happened is held not to happen."""

#: The same for a command to begin: the first time on a machine both Yosys must be made ready.
FIRST_PATIENCE = 600


class Command:
    """A command that goes on until Ctrl-C.

    Parameters
    ----------
    process : subprocess.Popen
        It, with pipes for what is typed and what it prints.
    lines : queue.Queue of str
        What it has printed.
    """

    def __init__(self, process: subprocess.Popen, lines: Queue[str]) -> None:
        self._process, self._lines = process, lines

    def first(self, pattern: str) -> str:
        """Return the next text that it prints of a regular expression."""
        for _ in range(FIRST_PATIENCE):
            try:
                found = re.search(pattern, self._lines.get(timeout=1))
            except Empty:
                assert self._process.poll() is None, "the command has ended"
                continue
            if found:
                return found[0]
        raise AssertionError(f"the command printed nothing like {pattern!r}")

    def type(self, line: str) -> None:
        """Type a line."""
        assert self._process.stdin
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()


@contextmanager
def running(module: str, *arguments: object, ends: int = 0) -> Iterator[Command]:
    """Run a command, and end it by Ctrl-C.

    Parameters
    ----------
    module : str
        What ``python -m`` takes.
    *arguments
        Its arguments.
    ends : int
        Exit status that it should have.
    """
    process = subprocess.Popen([sys.executable, "-m", module, *map(str, arguments)], cwd=ROOT,
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    lines: Queue[str] = Queue()
    assert process.stdin and process.stdout
    reader = threading.Thread(target=lambda: [lines.put(line) for line in process.stdout or ()])
    reader.start()
    try:
        yield Command(process, lines)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == ends
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()
            reader.join(PATIENCE)
            process.stdin.close()
            process.stdout.close()


@contextmanager
def command(module: str, *arguments: object, says: str, ends: int = 0) -> Iterator[str]:
    """Run a command as `running` does, and give the first text that it prints of a pattern."""
    with running(module, *arguments, ends=ends) as command:
        yield command.first(says)
