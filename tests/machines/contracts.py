"""What people rely on, as properties of contracts."""

from collections.abc import Mapping, Sequence

from tb.registry import components

__all__ = ["check_stated"]


def check_stated(relied_on: Mapping[str, Sequence[str]]) -> None:
    """Check that there are properties: their names by component, ``{}`` for each of three axes."""
    for component, names in relied_on.items():
        properties = components()[component].properties()
        for name in names:
            assert {name.format(axis) for axis in "xyz"} <= properties.keys()
