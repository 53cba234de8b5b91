"""The machines that ``python -m tools.build`` builds: one module and one entry each."""

from .job import BOARDS, Built, Job, Kind
from .mill import MILL
from .single import SINGLE

__all__ = ["BOARDS", "MACHINES", "Built", "Job", "Kind"]

MACHINES: dict[str, Kind] = {
    "mill": MILL,
    "single": SINGLE,
}
"""How each is built, by its name."""
