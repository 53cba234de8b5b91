"""vpype, as a user runs it."""

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


@pytest.fixture
def vpype(tmp_path):
    """Give a function that runs vpype where Fresa is installed, as pip would have done it."""
    entries = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]
    about = tmp_path / "installed" / "fresa-0.1.0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: fresa\nVersion: 0.1.0\n")
    (about / "entry_points.txt").write_text("[vpype.plugins]\n" + "".join(
        f"{name} = {value}\n" for name, value in entries["vpype.plugins"].items()))
    path = [about.parent, *(ROOT / each for each in ("launcher", "hdl", "platform", "host"))]

    def run(*arguments: object) -> subprocess.CompletedProcess:
        return subprocess.run(
            [sys.executable, "-m", "vpype_cli", *map(str, arguments)], cwd=tmp_path, text=True,
            capture_output=True, env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, path))})

    return run
