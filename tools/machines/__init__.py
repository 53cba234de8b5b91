"""The machines that ``python -m tools.build`` builds: as declared, or in a way of their own.

A machine that is made of more than options, such as a picture, has a module here with its name, in
which ``KIND`` says how it is built.
"""

from importlib import import_module
from importlib.util import find_spec

from tb.machines import machines

from .job import BOARDS, Built, Job, Kind, declared_kind

__all__ = ["BOARDS", "Built", "Job", "Kind", "kinds"]


def kinds() -> dict[str, Kind]:
    """Return how each machine is built, by its name."""
    return {name: import_module(f"{__name__}.{name}").KIND if find_spec(f"{__name__}.{name}")
            else declared_kind(machine) for name, machine in machines().items()}
