"""What people rely on, as properties of contracts."""

import functools
from collections.abc import Mapping, Sequence

import pytest

from tb.contracts.contract import Property
from tb.coverage import with_state_machine
from tb.machine import Machine
from tb.registry import components

__all__ = ["check_stated", "properties", "stated"]


@functools.cache
def properties(component: str) -> Mapping[str, Property]:
    """Return the properties of a component, by name."""
    return components()[component].properties()


def check_stated(relied_on: Mapping[str, Sequence[str]]) -> None:
    """Check that there are properties: their names by component, ``{}`` for each of three axes."""
    for component, names in relied_on.items():
        for name in names:
            assert {name.format(axis) for axis in "xyz"} <= properties(component).keys()


def stated(machine: Machine, relied_on: Mapping[str, Mapping[str, Sequence[str]]],
           state_machines: Sequence[str]) -> type:
    """Return the tests that what people rely on is stated, and that state machines are found.

    Parameters
    ----------
    machine : Machine
        Its declaration.
    relied_on : mapping of str to mapping
        Sentences, and the properties that state each, as for :func:`check_stated`.
    state_machines : sequence of str
        Components with a contract that have a state machine.
    """
    class Tests:
        @pytest.mark.parametrize("sentence", relied_on)
        def test_what_people_rely_on_is_a_property(self, sentence):
            check_stated(relied_on[sentence])

        def test_parts_with_a_state_machine_are_found(self, monkeypatch):
            assert machine.contracts
            # To elaborate those of all machines would take long.
            monkeypatch.setattr("tb.coverage.components", machine.contracts)
            found = with_state_machine()
            assert [name for name in machine.contracts() if name in found] == [*state_machines]

    return Tests
