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

__all__ = ["PATIENCE", "ROOT", "command"]

ROOT = Path(__file__).parents[2]
PATIENCE = 180
"""Seconds after which something that should have happened is held not to happen."""

#: The same for a command to begin: the first time on a machine both Yosys must be made ready.
FIRST_PATIENCE = 180


@contextmanager
def command(module: str, *arguments: object, says: str, ends: int = 0) -> Iterator[str]:
    """Run a command, give the first text that it prints of this pattern, and end it by Ctrl-C.

    Parameters
    ----------
    module : str
        What ``python -m`` takes.
    *arguments
        Its arguments.
    says : str
        A regular expression.
    ends : int
        Exit status that it should have.
    """
    process = subprocess.Popen([sys.executable, "-m", module, *map(str, arguments)], cwd=ROOT,
                               stdout=subprocess.PIPE, text=True)
    lines: Queue[str] = Queue()
    assert process.stdout
    reader = threading.Thread(target=lambda: [lines.put(line) for line in process.stdout or ()])
    reader.start()
    try:
        yield _first(says, lines, process)
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == ends
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(PATIENCE)
        finally:
            process.kill()
            reader.join(PATIENCE)
            process.stdout.close()


def _first(pattern: str, lines: Queue[str], process: subprocess.Popen) -> str:
    for _ in range(FIRST_PATIENCE):
        try:
            found = re.search(pattern, lines.get(timeout=1))
        except Empty:
            assert process.poll() is None, "the command has ended"
            continue
        if found:
            return found[0]
    raise AssertionError(f"the command printed nothing like {pattern!r}")
