"""Machines that are served by the command, as their users have them: through pyserial."""

import subprocess
import sys
from collections.abc import Callable

import pytest

from tb.engines import ENGINES
from tests.tools.process import PATIENCE, ROOT, command


@pytest.fixture(scope="module")
def serve(libraries) -> Callable:
    """Serve a machine; give its port."""
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)  # the slow engine takes a minute for what a machine does in a second

    def serve(machine: str, *options: object, says: str = r"/dev/\S+"):
        return command("tools.serve", machine, *options, says=says)

    return serve


@pytest.fixture
def example() -> Callable[..., list[str]]:
    """Run an example with a port, and more arguments; return the lines that it prints."""
    def run(name: str, *arguments: object) -> list[str]:
        return subprocess.run([sys.executable, ROOT / "examples" / name, *map(str, arguments)],
                              text=True, capture_output=True, check=True, timeout=PATIENCE
                              ).stdout.splitlines()

    return run
