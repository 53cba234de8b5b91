"""Programs that others made, while they run."""

import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from tests.tools.process import PATIENCE

__all__ = ["program"]


@contextmanager
def program(*command: object, **options) -> Iterator[tuple[subprocess.Popen, list[str]]]:
    """Run a program; give it, and the lines that it prints."""
    process = subprocess.Popen([*map(str, command)], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, text=True, **options)
    assert process.stdin and process.stdout
    lines: list[str] = []
    reader = threading.Thread(target=lambda: lines.extend(process.stdout or ()))
    reader.start()
    try:
        yield process, lines
    finally:
        process.terminate()
        process.wait(PATIENCE)
        reader.join(PATIENCE)
        process.stdin.close()
        process.stdout.close()
