"""The machines that ``python -m tools.build`` builds: one module and one entry each."""

from .job import BOARDS, Built, Job, Kind
from .mill import MILL
from .positioner import POSITIONER
from .single import SINGLE

__all__ = ["BOARDS", "MACHINES", "Built", "Job", "Kind"]

MACHINES: dict[str, Kind] = {
    "mill": MILL,
    "single": SINGLE,
    "positioner": POSITIONER,
}
"""How each is built, by its name."""
