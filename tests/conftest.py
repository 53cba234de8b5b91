"""Fixtures of more than one room."""

import os
from contextlib import suppress
from pathlib import Path

import pytest


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
