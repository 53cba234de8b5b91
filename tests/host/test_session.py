"""What no session knows."""

import ast
from pathlib import Path

import pytest

import fresa_host

HOST = Path(fresa_host.__file__).parent
SESSIONS = [*sorted(path.stem for path in HOST.glob("*session.py")), "orders"]


def imported(module: str) -> set[str]:
    """Modules that a module of the host imports, itself or by another, and itself."""
    known, waiting = set(), [module]
    while waiting:
        if (name := waiting.pop()) in known:
            continue
        known.add(name)
        if not (path := HOST / f"{name}.py").exists():
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                waiting += [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                waiting += [node.module] if node.module else [each.name for each in node.names]
    return known


@pytest.mark.parametrize("session", SESSIONS)
def test_a_session_has_no_clock_no_thread_and_no_port(session):
    assert imported(session) & {"time", "threading", "asyncio", "serial", "port"} == set()
    (driver,) = HOST.glob("*_driver.py")
    assert {"time", "threading", "port"} <= imported(driver.stem)
