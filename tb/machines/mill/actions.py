"""Scripts: what people and order sources do to the mill, in words, and clock by clock.

Whoever waits for ``ready`` must see the outputs. A script sees those of the model, so that it
becomes a fixed stimulus that any engine plays at full speed.
"""

from collections.abc import Generator, Iterable
from dataclasses import dataclass, fields
from operator import attrgetter
from typing import TypeAlias

from .model import MillInputs, MillModel, MillOutputs

__all__ = [
    "Action",
    "Hold",
    "Jog",
    "Mode",
    "Order",
    "Recording",
    "Reset",
    "Select",
    "Stop",
    "Together",
    "record",
]

Clocks: TypeAlias = Generator[None, MillOutputs, None]
"""Sets pins, then yields, once for every clock; is sent the outputs of that clock."""


@dataclass(frozen=True)
class Hold:
    """Leave the pins as they are."""

    clocks: int = 1

    def act(self, pins: MillInputs) -> Clocks:
        """Take so many clocks."""
        for _ in range(self.clocks):
            yield


@dataclass(frozen=True)
class Mode:
    """Go to automatic mode, or with 0 to manual mode. Takes no clock."""

    automatic: int

    def act(self, pins: MillInputs) -> Clocks:
        """Turn the switch."""
        pins.mode = self.automatic
        yield from ()


@dataclass(frozen=True)
class Select:
    """Choose the count to show. Takes no clock."""

    count: int

    def act(self, pins: MillInputs) -> Clocks:
        """Turn the switches."""
        pins.counter_select = self.count
        yield from ()


@dataclass(frozen=True)
class Jog:
    """Hold jog switches on; with `release` they are off afterwards."""

    mask: int
    clocks: int = 1
    release: bool = True

    def act(self, pins: MillInputs) -> Clocks:
        """Take so many clocks."""
        pins.jog = self.mask
        yield from Hold(self.clocks).act(pins)
        if self.release:
            pins.jog = 0


@dataclass(frozen=True)
class Reset:
    """Hold reset."""

    clocks: int = 1

    def act(self, pins: MillInputs) -> Clocks:
        """Take so many clocks."""
        pins.rst = 1
        yield from Hold(self.clocks).act(pins)
        pins.rst = 0


@dataclass(frozen=True)
class Stop:
    """Hold stop."""

    clocks: int = 1

    def act(self, pins: MillInputs) -> Clocks:
        """Take so many clocks."""
        pins.stop = 1
        yield from Hold(self.clocks).act(pins)
        pins.stop = 0


@dataclass(frozen=True)
class Order:
    """Give an order, and let go of ``start``.

    Attributes
    ----------
    x, y : int
        Target.
    up, down : int
        Tool order.
    start : int
        Clocks for which ``start`` is high.
    wait : int, optional
        Clocks to wait then. Without it, until the machine is ready or `PATIENCE` is at an end.
    """

    x: int = 0
    y: int = 0
    up: int = 0
    down: int = 0
    start: int = 1
    wait: int | None = None

    PATIENCE = 3000

    def act(self, pins: MillInputs) -> Clocks:
        """Take as many clocks as the machine needs."""
        pins.position_x, pins.position_y = self.x, self.y
        pins.up, pins.down = self.up, self.down
        pins.start = 1
        yield from Hold(self.start).act(pins)
        pins.start = 0
        if self.wait is not None:
            yield from Hold(self.wait).act(pins)
        elif pins.mode:  # in manual mode it is never ready
            for _ in range(self.PATIENCE):
                seen = yield
                if seen.ready:
                    break


@dataclass(frozen=True)
class Together:
    """Set any pins, for so many clocks; they stay so."""

    pins: tuple[tuple[str, int], ...]
    clocks: int = 1

    def act(self, pins: MillInputs) -> Clocks:
        """Take so many clocks."""
        for name, level in self.pins:
            setattr(pins, name, level)
        yield from Hold(self.clocks).act(pins)


Action: TypeAlias = Hold | Mode | Select | Jog | Reset | Stop | Order | Together


@dataclass(frozen=True)
class Recording:
    """A script, clock by clock.

    Attributes
    ----------
    stimulus : dict of str to list of int
        Levels of every input at every clock.
    expected : dict of str to list of int
        Levels of every output at every clock, by the model.
    actions : list of (int, Action)
        Clock in which each action begins.
    """

    stimulus: dict[str, list[int]]
    expected: dict[str, list[int]]
    actions: list[tuple[int, Action]]

    def __len__(self) -> int:
        return len(self.stimulus["rst"])

    def during(self, clock: int) -> Action | None:
        """Return the action that is under way in a clock."""
        begun = [action for first, action in self.actions if first <= clock]
        return begun[-1] if begun else None


def record(model: MillModel, script: Iterable[Action], pins: MillInputs | None = None) -> Recording:
    """Play a script to the model, one action after the other.

    Parameters
    ----------
    model : MillModel
        Goes on from where it is.
    script : iterable of Action
        What to do.
    pins : MillInputs, optional
        Levels to begin with, and where those at the end are left. All 0 without it.
    """
    pins = MillInputs() if pins is None else pins
    inputs: list[tuple[int, ...]] = []
    outputs: list[MillOutputs] = []
    actions: list[tuple[int, Action]] = []
    in_names = [f.name for f in fields(MillInputs)]
    levels = attrgetter(*in_names)
    out_names = [f.name for f in fields(MillOutputs)]
    for action in script:
        actions.append((len(inputs), action))
        clocks = action.act(pins)
        try:
            next(clocks)
            while True:
                inputs.append(levels(pins))
                outputs.append(model.outputs(pins))
                model.edge(pins)
                clocks.send(outputs[-1])
        except StopIteration:
            pass
    return Recording(
        {name: [row[n] for row in inputs] for n, name in enumerate(in_names)},
        {name: list(map(attrgetter(name), outputs)) for name in out_names},
        actions,
    )
