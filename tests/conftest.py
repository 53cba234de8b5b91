"""Fixtures of more than one room."""

import gc
import os
import warnings
from contextlib import suppress
from pathlib import Path

import platformdirs
import pytest
from amaranth.hdl import UnusedElaboratable
from hypothesis import HealthCheck, settings

from fresa_boards.flow import installed
from tb.contracts import proof
from tb.engines import ENGINES
from tests.tb import linuxcnc
from tools.draw.order import vpype_missing

# How long a test takes says nothing on a machine that others use as well.
settings.register_profile("any machine", deadline=None,
                          suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")

ASKED_FOR = ("proof", "long", "senders", "drawings")
"""Marks of tests that run only if ``-m`` names them: they take long."""


def place_and_route_missing() -> str | None:
    """Return which extra makes bitstreams, if it is not installed, or None."""
    for extra, program in {"ice40": "nextpnr-ice40", "ecp5": "nextpnr-ecp5",
                           "gowin": "nextpnr-himbaechel-gowin"}.items():
        if not installed(program):
            return f"{program} missing: pip install -e '.[{extra}]'"
    return None


NO_COMPILER = ENGINES["cxxrtl"].missing()
MISSING = {"compiler": NO_COMPILER, "prover": proof.missing(), "place": place_and_route_missing(),
           "linuxcnc": linuxcnc.MISSING, "vpype": vpype_missing(),
           **{name: ENGINES[name].missing() for name in ("icarus", "verilator", "ghdl")}}
"""What to install before tests with a mark can run, or None."""


def pytest_runtest_setup(item):
    """Skip what takes long, unless it is asked for, and what needs more than there is."""
    for mark, reason in MISSING.items():
        if reason is not None and item.get_closest_marker(mark):
            pytest.skip(reason)
    for mark in ASKED_FOR:
        if item.get_closest_marker(mark) and mark not in item.config.getoption("markexpr"):
            pytest.skip(f"takes long: pytest -m {mark}")


def pytest_report_header():
    """Tell before the tests that they will take longer."""
    if NO_COMPILER is not None:
        return f"the fast engine is missing: {NO_COMPILER}; what can, runs on the slow one"
    return None


def pytest_terminal_summary(terminalreporter):
    """Tell what a missing compiler leaves out, and what brings it back."""
    left_out = sum("C++ compiler" in str(report.longrepr)
                   for report in terminalreporter.stats.get("skipped", []))
    if NO_COMPILER is not None and left_out:
        terminalreporter.write_line(
            f"no C++ compiler: {left_out} tests left out; pip install -e '.[fast]'")


@pytest.fixture
def unused():
    """Collect machines that were made for their roles alone while their warning is ignored."""
    yield
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UnusedElaboratable)
        gc.collect()


@pytest.fixture(scope="module")
def libraries():
    """Keep what is built where all checkouts find it, and share what the tools keep themselves."""
    user = Path(os.environ.get("XDG_CACHE_HOME") or platformdirs.user_cache_dir())
    own = user / "fresa-tests"
    own.mkdir(parents=True, exist_ok=True)
    for name in ("wasmtime", "zig"):  # what Yosys and the compiler from pip keep for themselves
        (user / name).mkdir(parents=True, exist_ok=True)
        with suppress(FileExistsError):
            (own / name).symlink_to(user / name)
    with pytest.MonkeyPatch.context() as patch:
        if "YOWASP_CACHE_DIR" not in os.environ:
            patch.setenv("YOWASP_CACHE_DIR", str(user / "YoWASP"))
        patch.setenv("XDG_CACHE_HOME", str(own))
        yield


@pytest.fixture
def fresh(libraries, tmp_path, monkeypatch) -> Path:
    """Have a cache in which no design is; return the folder where CXXRTL's will be."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    return tmp_path / "fresa" / "cxxrtl"
