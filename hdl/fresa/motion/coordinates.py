"""Orders that mill a picture."""

from collections.abc import Sequence

from amaranth import Cat, Module, Signal
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .orders import Order
from .spiral import PICTURE_LIMIT, SpiralWalk

__all__ = ["CoordinateGenerator"]

BANK_BITS = 14
"""A block RAM of the Spartan-3E has 2 ** 14 words of one bit."""

BLOCK_RAM = {"ram_style": "block"}
"""Attribute of a memory that is to be in block RAM whatever XST would choose."""


class CoordinateGenerator(wiring.Component):
    """Mills a one-bit picture: always the nearest pixel next.

    *Módulo de Generación de Coordenadas* (thesis, 5.4).

    From where the tool is, a search goes round in a spiral (:class:`SpiralWalk`) until it meets a
    pixel that is set and not yet milled. If it is one of the 8 neighbours and the tool is down, the
    tool walks there; otherwise it is raised, goes there in the air and is lowered. When no pixel is
    left, the tool is raised and goes back to the origin.

    The picture is never written to. A job begins with a copy of it, in which the pixels are cleared
    as they are milled, so that a new start mills all of it again however the job before ended. Both
    memories hold pixel number n in word ``n % depth``, bit ``n // depth``: to choose a pixel takes
    a multiplexer of one bit. Both are marked as block RAM, and have at least two bits a word: of
    arrays of one bit that are only read XST is reported to make constants.

    A search that ends while pixels are left to mill has met none of them: the memory does not hold
    the picture. That is a fault.

    =======  ================================================================  ====================
    state    does                                                              next
    =======  ================================================================  ====================
    IDLE     waits for ``start``                                               COPY
    COPY     copies the picture, a word a clock                                READ
    READ     takes the word of a pixel from the copy                           SEARCH
    SEARCH   goes on to the next pixel, which is read, has found one, all are  READ, WALK, RAISE or
             milled, or has seen all pixels and found none                     FAULT
    WALK     orders the tool, which is down, to the pixel found, and clears    MARK
             the pixel in the copy
    RAISE    orders the tool up                                                TRAVEL
    TRAVEL   orders the tool to the pixel found, or back to the origin         LOWER or IDLE
    LOWER    orders the tool down, and clears the pixel in the copy            MARK
    MARK     counts the pixel, begins a new spiral                             READ
    FAULT    orders nothing, shows ``fault``                                   stays until reset
    =======  ================================================================  ====================

    Parameters
    ----------
    picture : sequence of sequences of bool
        Rows of pixels, the same number in each, true where to mill. At least one is.
    pixel_steps : int
        Steps from one pixel to the next, so that the last pixel is within 65 535 steps.

    Members
    -------
    start : In(1)
        Begin, if not ``busy``.
    orders : Out(stream.Signature(Order))
        Orders. Each must be taken only once it has been carried out.
    busy : Out(1)
        A job is under way.
    fault : Out(1)
        The state register was upset, or the memory does not hold the picture. Stays until reset.

    Raises
    ------
    ValueError
        If the picture is empty, ragged or too large, or a parameter is out of range.
    """

    start: In(1)
    orders: Out(stream.Signature(Order))
    busy: Out(1)
    fault: Out(1)

    def __init__(self, picture: Sequence[Sequence[bool]], *, pixel_steps: int) -> None:
        self.rows = len(picture)
        self.columns = len(picture[0]) if self.rows else 0
        if not self.columns or any(len(row) != self.columns for row in picture):
            raise ValueError("picture must have rows of the same length, and at least one pixel, "
                             f"not rows of {sorted({len(row) for row in picture})!r} pixels")
        longest = max(self.rows, self.columns)
        in_range("rows and columns of the picture", longest, 1, PICTURE_LIMIT)
        self.pixel_steps = in_range("pixel_steps", pixel_steps, 1, 65_535 // max(1, longest - 1))

        pixels = [bool(pixel) for row in picture for pixel in row]
        self.pixels_set = sum(pixels)
        if not self.pixels_set:
            raise ValueError("picture must have a pixel to mill, not 0")
        # A power of two, so that a word outside the picture can be read, and ignored; half of the
        # pixels or less, so that there are two banks.
        self._depth_bits = min(max(1, (len(pixels) - 1).bit_length() - 1), BANK_BITS)
        depth = 1 << self._depth_bits
        self._words = [
            sum(pixel << bank for bank, pixel in enumerate(pixels[word::depth]))
            for word in range(depth)
        ]
        self._banks = max(2, -(-len(pixels) // depth))
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        depth = 1 << self._depth_bits
        m.submodules.walk = walk = SpiralWalk(rows=self.rows, columns=self.columns)
        m.submodules.to_mill = to_mill = memory.Memory(
            shape=self._banks, depth=depth, init=[], attrs=BLOCK_RAM)
        copy, sink = to_mill.read_port(), to_mill.write_port()
        pixel = walk.number[:self._depth_bits]
        bank = walk.number[self._depth_bits:][:(self._banks - 1).bit_length()]
        held = Signal(self._banks)  # the word of the pixel, since reading takes long
        here = Signal(self._banks)  # its bit of it
        found = Signal()
        m.d.comb += [
            here.eq(1 << bank),
            found.eq(walk.inside & (held & here).any()),
        ]

        # Word n of the picture is read while word n - 1 is written. At the end word 0 is written
        # once more, and with that read, as it is the word of the first pixel.
        reading = Signal(self._depth_bits + 1)
        writing = Signal.like(reading)
        m.d.sync += [reading.eq(0), writing.eq(reading)]
        picture = []
        most = 8 if self._banks % 8 != 1 else 7  # wider ones are split in ways that cost much logic
        for low in range(0, self._banks, most):
            width = min(most, self._banks - low)
            m.submodules[f"picture_{low}"] = part = memory.Memory(
                shape=width, depth=depth,
                init=[word >> low & (1 << width) - 1 for word in self._words], attrs=BLOCK_RAM)
            port = part.read_port()
            m.d.comb += port.addr.eq(reading)
            picture.append(port.data)

        lowered = Signal()
        milled = Signal(range(-self.pixels_set, 1), init=-self.pixels_set)  # counts up to 0
        word = Signal(self._depth_bits)
        m.d.comb += [
            word.eq(pixel),
            copy.addr.eq(word),
            sink.addr.eq(word),
            sink.data.eq(held & ~here),
            self.orders.p.x.eq(walk.row * self.pixel_steps),
            self.orders.p.y.eq(walk.column * self.pixel_steps),
        ]

        with m.FSM(name="coordinates_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += walk.centre.eq(1)
                m.d.sync += milled.eq(milled.init)
                with m.If(self.start):
                    m.d.sync += reading.eq(1)
                    m.next = "COPY"

            with m.State("COPY"):
                m.d.comb += [word.eq(writing), sink.en.eq(1), sink.data.eq(Cat(*picture))]
                m.d.sync += reading.eq(reading + 1)
                with m.If(writing[-1]):
                    m.next = "READ"

            with m.State("READ"):
                m.d.sync += held.eq(copy.data)
                m.next = "SEARCH"

            with m.State("SEARCH"):
                m.d.comb += word.eq(walk.following)
                with m.If(milled >= 0):
                    m.next = "RAISE"
                with m.Elif(found & walk.near & lowered):
                    m.next = "WALK"
                with m.Elif(found):
                    m.next = "RAISE"
                with m.Elif(walk.last):
                    m.next = "FAULT"
                with m.Else():
                    m.d.comb += walk.advance.eq(1)
                    m.next = "READ"

            with m.State("WALK"):
                m.d.comb += self.orders.valid.eq(1)
                with m.If(self.orders.ready):
                    m.d.comb += sink.en.eq(1)
                    m.next = "MARK"

            with m.State("RAISE"):
                m.d.comb += [self.orders.valid.eq(1), self.orders.p.up.eq(1)]
                with m.If(self.orders.ready):
                    m.d.sync += lowered.eq(0)
                    m.d.comb += walk.home.eq(milled >= 0)
                    m.next = "TRAVEL"

            with m.State("TRAVEL"):
                m.d.comb += self.orders.valid.eq(1)
                with m.If(self.orders.ready):
                    m.next = "LOWER"
                    with m.If(milled >= 0):
                        m.next = "IDLE"

            with m.State("LOWER"):
                m.d.comb += [self.orders.valid.eq(1), self.orders.p.down.eq(1)]
                with m.If(self.orders.ready):
                    m.d.comb += sink.en.eq(1)
                    m.d.sync += lowered.eq(1)
                    m.next = "MARK"

            with m.State("MARK"):
                m.d.comb += walk.centre.eq(1)
                m.d.sync += milled.eq(milled + 1)
                m.next = "READ"

            with m.State("FAULT"):
                pass

        m.d.comb += [
            self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT")),
            self.busy.eq(~fsm.ongoing("IDLE") & ~self.fault),
        ]
        return m
