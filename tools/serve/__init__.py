"""Machines in simulation, with their serial lines on a pseudo-terminal or TCP port."""

from .machines import Served, build, servable
from .running import Running
from .service import Service
from .switches import Switches

__all__ = ["Running", "Served", "Service", "Switches", "build", "servable"]
