"""Bit-exact models of components in plain Python, written from their specification."""

from collections.abc import Callable, Mapping

from numpy.typing import NDArray

__all__ = ["played"]


def played(clock: Callable[..., dict[str, int]], stimulus: Mapping[str, NDArray]
           ) -> dict[str, list[int]]:
    """Run a stimulus on a model, one row per clock; return its outputs.

    Parameters
    ----------
    clock : callable
        Takes the inputs of a clock by name, and returns the outputs in it.
    stimulus : mapping of str to array
        As for an engine.
    """
    rows = [clock(**dict(zip(stimulus, map(int, row), strict=True)))
            for row in zip(*stimulus.values(), strict=True)]
    return {name: [row[name] for row in rows] for name in rows[0]}
