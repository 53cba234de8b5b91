"""What the registered machines declare, as tables by name: each check asks for the one it needs."""

from collections.abc import Mapping, Sequence
from functools import cache

from .contracts import GENERAL, Component
from .fuzz import FuzzTarget
from .machine import Machine
from .machines import machines
from .netlist import NetlistPart
from .runners import Dut, described_dut
from .vhdl import REFERENCES

__all__ = ["components", "duts", "fuzz_targets", "netlist_parts"]


def components() -> dict[str, Component]:
    """Return what has a contract, by name: general components, then those of each machine.

    Raises
    ------
    ValueError
        If a machine gives one the name of another.
    """
    return _components(tuple(machines().values()))


@cache
def _components(known: Sequence[Machine]) -> dict[str, Component]:
    found = dict(GENERAL)
    for machine in known:
        own = machine.contracts() if machine.contracts else {}
        if twice := found.keys() & own.keys():
            raise ValueError(f"{machine.name} declares {min(twice)}, which has a contract already")
        found |= own
    return found


def duts() -> Mapping[str, Dut]:
    """Return the builds of machines, and the components that are described in VHDL, by name."""
    return _duts(tuple(machines().values()))


@cache
def _duts(known: Sequence[Machine]) -> Mapping[str, Dut]:
    builds = {name: machine.dut(name) for machine in known for name in machine.builds}
    return {**builds, **{name: described_dut(name) for name in REFERENCES if name not in builds}}


def fuzz_targets() -> dict[str, FuzzTarget]:
    """Return what can be fuzzed, by the name of its machine."""
    return {name: machine.fuzz() for name, machine in machines().items() if machine.fuzz}


def netlist_parts() -> dict[str, NetlistPart]:
    """Return what is checked as a netlist, by the name of its machine."""
    return {name: machine.netlist() for name, machine in machines().items() if machine.netlist}
