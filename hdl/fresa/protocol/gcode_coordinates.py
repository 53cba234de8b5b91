"""Coordinates of G-code: a memory of words, and sums of them."""

from collections.abc import Sequence
from enum import IntEnum

from amaranth import Array, Cat, Const, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import enum, memory, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice
from .gcode_modes import LETTERS, AxisUse, GCodeLineState, NonModal

__all__ = ["CoordinateSum", "GCodeCoordinates", "Operand"]

SLICE = 22
"""Largest number of bits of a memory."""


class Operand(IntEnum):
    """Addresses of what actions are about, and of what reports show."""

    RATE = 0  # F of the line: nm/s, or with `inverse` 10^-6 per minute
    CENTRE = 1  # I, J and K, in nm, 0 if not given
    DWELL = 6  # P of the line, in us
    RADIUS = 7  # R, in nm
    PROBED = 13  # where the probe touched, in nm
    SYSTEM = 16  # origins of the coordinate systems, in nm, three words each
    OFFSET = 34  # of G92
    LENGTH = 37  # of the tool
    PREDEFINED = 38  # positions of G28 and G30
    POSITION = 44  # at the end of the last motion
    FEED = 47  # as RATE, of the last line that had one
    SPEED = 48  # of the spindle, in 10^-6 rev/min
    TOOL = 49  # in 10^-6
    NEW = 50  # origin that the line sets
    TARGET = 53  # of the motion
    HOME = 56  # of G28 and G30
    ORIGIN = 60  # of the work coordinates


class CoordinateSum(enum.Enum, shape=unsigned(5)):
    """What is computed, for each axis, as a sum of stored words."""

    TARGET = 0
    COORDINATES = 1  # that G10 sets
    OFFSET = 2  # that G92 sets
    HOME = 3
    DISTANCE = 4  # from the position to the target
    SET_COORDINATES = 5
    SET_OFFSET = 6
    SET_LENGTH = 7
    ORIGIN_CHANGE = 8
    SET_ORIGIN = 9
    PREDEFINE = 10
    TAKE_HOME = 11  # as the target
    ARRIVE = 12
    SET_FEED = 13
    SET_SPEED = 14
    CLEAR_OFFSET = 15
    CLEAR_LENGTH = 16
    CLEAR_RATES = 17  # feed, speed and tool
    SET_TOOL = 18
    CLEAR_PROBED = 19


class GCodeCoordinates(wiring.Component):
    """Stores the values of a line, coordinates and what else an `Operand` names, and sums them.

    Each word is a signed number at an address: those of the line's letters, by their place in
    `LETTERS`, then those of `Operand`. A sum is computed for X, Y and Z in turn, of up to five
    words each: the first four are the offset of G92, the length of the tool, the position and the
    origin of the coordinate system, where what is computed has them; the last depends on it.
    It takes 24 clocks. The memory has no reset.

    Parameters
    ----------
    width : int
        Bits of words.
    reach : int
        Bits of a coordinate, with its sign.
    origin : sequence of int
        Origin of G54 at power-up, in nm.

    Members
    -------
    run : In(1)
        Compute ``sum``; stays 1 until the clock with ``done``.
    sum : In(CoordinateSum)
        What; constant while ``run`` is 1.
    line : In(GCodeLineState)
        The line for which; constant while ``run`` is 1.
    done : Out(1)
        It is computed, and stored where it belongs.
    changed, beyond : Out(1)
        With ``done``: a sum is not 0; a sum has more than ``reach`` bits.
    address : In(6)
        Of a word that is read, or stored, while ``run`` is 0.
    word : Out(signed(width))
        The word that is read, a clock later.
    fetched : Out(signed(width))
        That word from a register, a clock later still.
    write : In(1)
        Store ``data`` at ``address``, unless ``run`` is 1.
    data : In(signed(width))
        What.
    operand_address : In(6)
        Of a word that is read at any time, but in a clock in which a word is stored.
    operand : Out(signed(width))
        That word, a clock later.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    TERMS = 5

    def __init__(self, *, width: int = 44, reach: int = 36,
                 origin: Sequence[int] = (0, 0, 0)) -> None:
        self.width = in_range("width", width, 4, 64)
        self.reach = in_range("reach", reach, 2, width)
        most = 1 << self.reach - 1
        self.origin = [in_range("origin in nm", each, -most, most - 1) for each in origin]
        super().__init__({
            "run": In(1), "sum": In(CoordinateSum), "line": In(GCodeLineState),
            "done": Out(1), "changed": Out(1), "beyond": Out(1),
            "address": In(6), "word": Out(signed(width)), "fetched": Out(signed(width)),
            "write": In(1), "data": In(signed(width)),
            "operand_address": In(6), "operand": Out(signed(width)),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        address, operand_address = Signal(6), Signal(6)
        writes = Signal()
        stored = Signal(self.width)
        m.d.comb += operand_address.eq(Mux(writes, address, self.operand_address))
        first = [0] * Operand.SYSTEM + self.origin if any(self.origin) else []
        # Two copies, so that each has one port, which does not read while it writes: else synthesis
        # would take RAMs with two ports, and put a bypass around them. Halves of a word fit those
        # with one port of a Spartan-3E and a Gowin. An ECP5 has 18 bits at one port, so there it
        # does that, in a part that has room for it.
        for name, place, word in (("words", address, self.word),
                                  ("operands", operand_address, self.operand)):
            for low in range(0, self.width, SLICE):
                bits = min(SLICE, self.width - low)
                words = memory.Memory(shape=unsigned(bits), depth=64,
                                      init=[each >> low & (1 << bits) - 1 for each in first],
                                      attrs={"ram_style": "block"})
                m.submodules[f"{name}_{low}"] = words
                write, read = words.write_port(), words.read_port()
                m.d.comb += [write.addr.eq(place), write.data.eq(stored[low:]), write.en.eq(writes),
                             read.addr.eq(place), read.en.eq(~writes),
                             word[low:low + bits].eq(read.data)]

        axis = Signal(2)
        step = Signal(3)  # a word is fetched, a clock later it is there, and in the next it counts
        total = Signal(signed(self.width + 3))
        uses, subtracts, addresses, keeps = self._terms(m, axis)
        counts = Signal()  # the word that is fetched
        minus = Signal()
        m.d.comb += [address.eq(self.address), stored.eq(self.data), writes.eq(self.write)]
        m.d.sync += [self.fetched.eq(self.word), self.done.eq(0),
                     counts.eq(Cat(Const(0), uses, Const(0, 2)).bit_select(step, 1)),
                     minus.eq(Cat(Const(0), subtracts, Const(0, 2)).bit_select(step, 1))]
        with m.If(self.run):
            m.d.comb += [address.eq(addresses[step]), stored.eq(total),
                         writes.eq(keeps & (step == 7))]
        with m.If(self.run & ~self.done):
            m.d.sync += step.eq(step + 1)
            with m.If((step == 0) & (axis == 0)):
                m.d.sync += [self.changed.eq(0), self.beyond.eq(0)]
        # A minus is an inversion and a carry: one adder does both.
        term, sum_ = Signal(self.width + 3), Signal(self.width + 3)
        m.d.comb += [term.eq(Mux(minus, ~self.fetched, self.fetched)),
                     sum_.eq(add_choice(total.as_unsigned(), term, minus))]
        with m.If(counts):
            m.d.sync += total.eq(sum_)
        with m.If(step == 7):
            high = total.as_unsigned()[self.reach - 1:]
            m.d.sync += [self.changed.eq(self.changed | (total != 0)),
                         self.beyond.eq(self.beyond | (high.any() & ~high.all())),
                         total.eq(0), axis.eq(Mux(axis == 2, 0, axis + 1)),
                         self.done.eq(axis == 2)]
        return m

    def _terms(self, m: Module, axis: Signal) -> tuple[Signal, Signal, Array, Signal]:
        """Return which words count, which with a minus, addresses, and whether the sum is stored.

        Addresses are those of the words, and where the sum goes.
        """
        line, modes = self.line, self.line.modes
        given = line.given
        here = Signal()  # the line gives this axis
        only_z = axis == 2
        machine, by_20 = line.non_modal == NonModal.MACHINE, line.l_whole == 20
        moved = Signal()  # by the words of the line
        absolute = Signal()  # in work coordinates
        m.d.comb += [
            here.eq(given.bit_select(axis, 1)),
            moved.eq(here & (line.axes != AxisUse.LENGTH)),
            absolute.eq(moved & ~modes.relative & ~machine),
        ]
        # They are constant while the words of an axis are added, and none counts in the first
        # clock of that, which chooses the offset.
        uses = Signal(self.TERMS)
        subtracts = Signal(self.TERMS)
        system = Signal(6)
        last = Signal(6)
        to = Signal(6)
        keeps = Signal()
        own = Signal(3)
        m.d.comb += own.eq(modes.system)
        with m.If(((self.sum == CoordinateSum.COORDINATES)
                   | (self.sum == CoordinateSum.SET_COORDINATES)) & (line.p_whole != 0)):
            m.d.comb += own.eq(line.p_whole - 1)
        own_system = (Operand.SYSTEM + (own << 1) + own + axis)[:6]
        m.d.sync += system.eq(own_system)
        predefined = Operand.PREDEFINED + Mux(line.second, 3, 0) + axis
        letter = LETTERS.index("X") + axis

        def terms(*counts: Value | int, minus: int = 0, at: Value | int = 0, kept: Value | int = 0,
                  keep: Value | int = 1) -> None:
            m.d.sync += [uses.eq(Cat(Const(use, 1) if isinstance(use, int) else use
                                     for use in counts)),
                         subtracts.eq(minus), last.eq(at), to.eq(kept), keeps.eq(keep)]

        set_20 = here & by_20
        with m.Switch(self.sum):
            with m.Case(CoordinateSum.TARGET):
                terms(absolute, absolute & only_z, ~absolute & ~(moved & machine), absolute, moved,
                      at=letter, kept=Operand.TARGET + axis)
            with m.Case(CoordinateSum.COORDINATES):
                terms(set_20, set_20 & only_z, set_20, ~here, here, minus=0b00011, at=letter,
                      kept=Operand.NEW + axis)
                with m.If(by_20):
                    m.d.sync += subtracts.eq(0b10011)
            with m.Case(CoordinateSum.OFFSET):
                terms(~here, here & only_z, here, here, here, minus=0b11010, at=letter,
                      kept=Operand.NEW + axis)
            with m.Case(CoordinateSum.HOME):
                terms(0, 0, given.any() & ~here, 0, here | ~given.any(), at=predefined,
                      kept=Operand.HOME + axis)
            with m.Case(CoordinateSum.DISTANCE):
                terms(0, 0, 1, 0, 1, minus=0b00100, at=Operand.TARGET + axis, keep=0)
            with m.Case(CoordinateSum.SET_COORDINATES):
                terms(0, 0, 0, 0, 1, at=Operand.NEW + axis, kept=own_system)
            with m.Case(CoordinateSum.SET_OFFSET):
                terms(0, 0, 0, 0, 1, at=Operand.NEW + axis, kept=Operand.OFFSET + axis)
            with m.Case(CoordinateSum.SET_LENGTH):
                terms(0, 0, 0, 0, 1, at=LETTERS.index("Z"), kept=Operand.LENGTH, keep=only_z)
            with m.Case(CoordinateSum.ORIGIN_CHANGE):
                terms(1, only_z, 0, 1, 1, minus=0b10000, at=Operand.ORIGIN + axis, keep=0)
            with m.Case(CoordinateSum.SET_ORIGIN):
                terms(1, only_z, 0, 1, 0, kept=Operand.ORIGIN + axis)
            with m.Case(CoordinateSum.PREDEFINE):
                terms(0, 0, 1, 0, 0, kept=predefined)
            with m.Case(CoordinateSum.TAKE_HOME):
                terms(0, 0, 0, 0, 1, at=Operand.HOME + axis, kept=Operand.TARGET + axis)
            with m.Case(CoordinateSum.ARRIVE):
                terms(0, 0, 0, 0, 1, at=Operand.TARGET + axis, kept=Operand.POSITION + axis)
            with m.Case(CoordinateSum.SET_FEED):
                terms(0, 0, 0, 0, 1, at=LETTERS.index("F"), kept=Operand.FEED, keep=axis == 0)
            with m.Case(CoordinateSum.SET_SPEED):
                terms(0, 0, 0, 0, 1, at=LETTERS.index("S"), kept=Operand.SPEED, keep=axis == 0)
            with m.Case(CoordinateSum.CLEAR_OFFSET):
                terms(kept=Operand.OFFSET + axis)
            with m.Case(CoordinateSum.CLEAR_LENGTH):
                terms(kept=Operand.LENGTH)
            with m.Case(CoordinateSum.CLEAR_RATES):
                terms(kept=Operand.FEED + axis)
            with m.Case(CoordinateSum.CLEAR_PROBED):
                terms(kept=Operand.PROBED + axis)
            with m.Case(CoordinateSum.SET_TOOL):
                terms(0, 0, 0, 0, 1, at=LETTERS.index("T"), kept=Operand.TOOL, keep=axis == 0)
        addresses = Array([Operand.OFFSET + axis, Const(Operand.LENGTH, 6),
                           Operand.POSITION + axis, system, last, last, last, to])
        return uses, subtracts, addresses, keeps
