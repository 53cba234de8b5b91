"""Input pins: each reaches logic only through two flip-flops in a row.

A level that comes when it likes can leave the first flip-flop undecided for a while. So nothing may
look at that one but the second, and nothing at the pin but the first: a gate between them, an
inverter even, is logic that two flip-flops may see differently.
"""

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from .flat import Bit, Cell, Flat

__all__ = ["Pins", "check"]

_BUFFERS = ("IBUF",)
_CONTROLS = {"CE": "1", "R": "0", "S": "0", "CLR": "0", "PRE": "0"}


@dataclass(frozen=True)
class Pins:
    """What became of the input pins.

    Attributes
    ----------
    synchronised, unused : int
        Pins that pass through two flip-flops, and pins that nothing reads.
    wrong : list of str
        Pins that do not, each with what is wrong.
    """

    synchronised: int
    unused: int
    wrong: list[str]


def check(flat: Flat, *, clock: str) -> Pins:
    """Follow every input pin into the netlist.

    Parameters
    ----------
    flat : Flat
        The netlist, cell by cell.
    clock : str
        The input that is the clock.
    """
    clocks = set(_nets(flat, flat.inputs[clock][0]))
    synchronised, unused, wrong = 0, 0, []
    for port, bits in flat.inputs.items():
        if port == clock:
            continue
        for index, bit in enumerate(bits):
            name = f"{port}[{index}]" if len(bits) > 1 else port
            end = _end(flat, bit)
            if not flat.readers.get(end) and end not in _shown(flat):
                unused += 1
            elif why := _why_not(flat, end, clocks):
                wrong.append(f"{name} {why}")
            else:
                synchronised += 1
    return Pins(synchronised, unused, wrong)


def _why_not(flat: Flat, bit: Bit, clocks: Collection[Bit]) -> str | None:
    """Return why a net is not synchronised; None if it is."""
    clock = None
    for stage in ("the first flip-flop", "the second flip-flop"):
        if bit in _shown(flat):
            return f"reaches an output before {stage}"
        pins = flat.readers.get(bit, [])
        if len(pins) != 1:
            return f"reaches {len(pins)} inputs of cells where {stage} should be"
        (pin,) = pins
        if not pin.cell.is_flip_flop or pin.port != "D":
            return f"reaches {pin.port} of {pin.cell.type} {pin.cell.name} before {stage}"
        if held := [f"{port} of {pin.cell.type}" for port, level in _CONTROLS.items()
                    if pin.cell.inputs.get(port, (level,)) != (level,)]:
            return f"has logic at {' and '.join(held)} {pin.cell.name}, {stage}"
        edge = _edge(pin.cell)
        if edge[0] not in clocks or clock not in (None, edge):
            return f"has another clock at {stage}, {pin.cell.name}"
        clock = edge
        (bit,) = pin.cell.outputs["Q"]
    return None


def _edge(cell: Cell) -> tuple[Bit, bool]:
    """Return the clock of a flip-flop, and whether it takes the falling edge."""
    return cell.inputs["C"][0], cell.type.endswith("_1")


def _end(flat: Flat, bit: Bit) -> Bit:
    """Follow a net through the buffer of its pin."""
    pins = flat.readers.get(bit, [])
    if len(pins) == 1 and pins[0].cell.type in _BUFFERS:
        return pins[0].cell.outputs["O"][0]
    return bit


def _nets(flat: Flat, bit: Bit) -> Iterator[Bit]:
    """Follow a clock through its buffers."""
    yield bit
    for pin in flat.readers.get(bit, []):
        if pin.cell.type in (*_BUFFERS, "BUFG", "IBUFG", "BUFGP"):
            yield from _nets(flat, pin.cell.outputs["O"][0])


def _shown(flat: Flat) -> set[Bit]:
    return {bit for bits in flat.outputs.values() for bit in bits}
