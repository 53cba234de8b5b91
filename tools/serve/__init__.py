"""Machines that run in simulation, with their serial lines on this computer."""

from .machines import MACHINES, Served, build
from .running import Running
from .service import Service
from .switches import Switches

__all__ = ["MACHINES", "Running", "Served", "Service", "Switches", "build"]
