"""Every benchmark finds what it measures."""

import importlib
from pathlib import Path

import pytest

import benchmarks


@pytest.mark.parametrize("name", sorted(
    path.stem for path in Path(benchmarks.__path__[0]).glob("*.py") if path.stem != "__init__"))
def test_it_can_be_imported(name):
    assert importlib.import_module(f"benchmarks.{name}").__doc__
