"""Bit-exact models in plain Python, written from what the machines promise."""

from collections.abc import Callable, Mapping

from numpy.typing import NDArray

__all__ = ["played"]


def played(clock: Callable[..., dict[str, int]], stimulus: Mapping[str, NDArray]
           ) -> dict[str, list[int]]:
    """Play a stimulus, a row a clock, to a model; return its outputs.

    Parameters
    ----------
    clock : callable
        Is given the inputs of a clock by name, and returns the outputs in it.
    stimulus : mapping of str to array
        As for an engine.
    """
    rows = [clock(**dict(zip(stimulus, map(int, row), strict=True)))
            for row in zip(*stimulus.values(), strict=True)]
    return {name: [row[name] for row in rows] for name in rows[0]}
