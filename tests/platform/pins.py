# amaranth: UnusedElaboratable=no

"""What the tests of each machine on its board share: the pins that are committed, the netlist."""

import re
from collections.abc import Mapping

from amaranth import Fragment
from amaranth.hdl import _nir as nir
from amaranth.hdl._ir import build_netlist

from fresa.roles import MachineComponent
from fresa_boards.board import Board
from fresa_boards.wiring import prepare, wire

__all__ = ["DISPLAY", "LINE", "buffers", "check_pins", "netlist_of", "pins_of", "users"]

LINE = {"RXD": "rx", "TXD": "tx"}
DISPLAY = {**{f"C{part}": f"segments[{bit}]"
              for bit, part in enumerate("A B C D E F G DP".split())},
           **{f"AN{digit}": f"digits[{digit}]" for digit in range(4)}}


def pins_of(labels: str, bits: str) -> dict[str, str]:
    """Give the bits of a machine by the labels of their pins."""
    return dict(zip(labels.split(), bits.split(), strict=True))


def check_pins(board: Board, name: str, machine: MachineComponent, committed: Mapping[str, str],
               spare: int = 0) -> None:
    """Check which pin of a board has which bit of a machine.

    Parameters
    ----------
    board : Board
        The board.
    name : str
        The machine's.
    machine : MachineComponent
        The machine.
    committed : mapping of str to str
        The bit at each place, by the board's label: somebody's machine is wired by it.
    spare : int
        Pins that are requested and have no meaning.
    """
    assert {*machine.roles} == {*machine.signature.members}, "a port without a role"
    allotment = board.allotment(name)
    ports = {*machine.roles, "reset", "-"}
    ports |= {"segments", "digits"} if allotment.number else set()
    assert {*allotment.header} | set(" ".join(allotment.panel.values()).split()) <= ports
    assert allotment.number is None or allotment.number in ports

    rows = board.pin_rows(machine, allotment)
    assert {row.place: row.port for row in rows} == committed, (
        "a pin that somebody has wired would change its meaning: put it back; or, if that is "
        "meant, change it here, too, and say so in CHANGELOG.md")

    pins = re.findall(r'LOC="(\w+)"', prepare(board, name, machine).files[f"{name}.ucf"].decode())
    assert {row.pin for row in rows} < {*pins}
    assert len(pins) == len(rows) + spare + 1  # and the clock


def netlist_of(board: Board, name: str, machine: MachineComponent) -> nir.Netlist:
    """Wire a machine to a board; return Amaranth's netlist of it."""
    platform, allotment = board.platform(), board.allotment(name)
    top = wire(machine, board.request(platform, machine, allotment), allotment, clock=board.clock)
    return build_netlist(Fragment.get(top, platform), ports=[])


def buffers(netlist: nir.Netlist, name: str) -> list[tuple[int, nir.IOBuffer]]:
    """Return the I/O buffers of a resource, with the numbers of their cells."""
    return [(n, cell) for n, cell in enumerate(netlist.cells) if isinstance(cell, nir.IOBuffer)
            and all(netlist.io_ports[net.port].name.startswith(name) for net in cell.port)]


def users(netlist: nir.Netlist, numbers: set[int]) -> set[int]:
    """Return the cells that have an output of some cells at an input."""
    return {n for n, cell in enumerate(netlist.cells)
            if any(net.is_cell and net.cell in numbers for net in cell.input_nets())}
