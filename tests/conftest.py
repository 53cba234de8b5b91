"""Fixtures of more than one room."""

import os
from contextlib import suppress
from pathlib import Path

import pytest

ASKED_FOR = ("proof", "long")
"""Marks of tests that take a minute or more, and run only if ``-m`` names them."""


def pytest_runtest_setup(item):
    """Leave out what takes long, unless it is asked for."""
    for mark in ASKED_FOR:
        if item.get_closest_marker(mark) and mark not in item.config.getoption("markexpr"):
            pytest.skip(f"takes a minute: pytest -m {mark}")



@pytest.fixture(scope="module")
def libraries(tmp_path_factory):
    """Keep what is built out of the user's cache, but leave both Yosys theirs: they take long."""
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    own = tmp_path_factory.getbasetemp()
    own = (own.parent if "PYTEST_XDIST_WORKER" in os.environ else own) / "cache"  # for all workers
    (user / "wasmtime").mkdir(parents=True, exist_ok=True)
    own.mkdir(exist_ok=True)
    with suppress(FileExistsError):
        (own / "wasmtime").symlink_to(user / "wasmtime")
    with pytest.MonkeyPatch.context() as patch:
        if "YOWASP_CACHE_DIR" not in os.environ:
            patch.setenv("YOWASP_CACHE_DIR", str(user / "YoWASP"))
        patch.setenv("XDG_CACHE_HOME", str(own))
        yield
