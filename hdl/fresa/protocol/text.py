"""Texts out of a ROM."""

from collections.abc import Sequence

from amaranth import Module, Signal, unsigned
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..choice import look_up

__all__ = ["MAX_BYTES", "MAX_TEXTS", "TextSource"]

MAX_TEXTS, MAX_BYTES = 256, 2**14
"""Largest number of texts, and of bytes of all of them: eight block RAMs of a Spartan-3E."""


class TextSource(wiring.Component):
    """Sends texts by their numbers, byte by byte, out of a ROM.

    The texts are stored one after the other; a ninth bit marks the last byte of each. A text whose
    number is taken in clock t has its first byte valid in clock t + 2, and the others one a clock.
    The next number is taken when the last byte has been.

    Parameters
    ----------
    texts : sequence of bytes
        The texts, none empty.
    slot : int
        Bytes of a place that each text has by its number, unless it is longer; 0 for none. So there
        is little to look up.

    Members
    -------
    numbers : In(stream.Signature)
        Numbers of the texts to send, from 0. A number without a text sends nothing.
    bytes : Out(stream.Signature(8))
        Their bytes.

    Raises
    ------
    ValueError
        If there are no texts or more than ``MAX_TEXTS``, one is empty, or all together have more
        than ``MAX_BYTES``, with their slots.
    """

    def __init__(self, texts: Sequence[bytes], *, slot: int = 0) -> None:
        self.texts = tuple(texts)
        if not 1 <= len(self.texts) <= MAX_TEXTS:
            raise ValueError(f"there are 1 to {MAX_TEXTS} texts, not {len(self.texts)}")
        for text in self.texts:
            if not isinstance(text, bytes) or not text:
                raise ValueError(f"a text has bytes, at least one, not {text!r}")
        self.starts: list[int] = []
        self.size = len(self.texts) * slot
        for number, text in enumerate(self.texts):
            self.starts.append(number * slot if len(text) <= slot else self.size)
            if len(text) > slot:
                self.size += -(-len(text) // max(1, slot)) * max(1, slot)
        if self.size > MAX_BYTES:
            raise ValueError(f"all texts together have {MAX_BYTES} bytes at most, "
                             f"not {self.size}")
        super().__init__({
            "numbers": In(stream.Signature(
                unsigned(max(1, (len(self.texts) - 1).bit_length())))),
            "bytes": Out(stream.Signature(8)),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        words = [0] * self.size
        for start, text in zip(self.starts, self.texts, strict=True):
            words[start:start + len(text)] = [*text[:-1], text[-1] | 1 << 8]
        m.submodules.rom = rom = memory.Memory(shape=unsigned(9), depth=len(words), init=words)
        fetch = rom.read_port()

        place = Signal(range(len(words)))
        busy = Signal()
        given = Signal()
        after = Signal.like(place)
        m.d.comb += [
            given.eq(self.bytes.valid & self.bytes.ready),
            after.eq(place + given),
            fetch.addr.eq(after),
            self.bytes.payload.eq(fetch.data),
            self.numbers.ready.eq(~busy),
        ]
        m.d.sync += [place.eq(after), self.bytes.valid.eq(busy)]
        with m.If(given & fetch.data[8]):
            m.d.sync += [busy.eq(0), self.bytes.valid.eq(0)]
        with m.If(self.numbers.valid & ~busy):
            m.d.sync += [busy.eq(self.numbers.payload < len(self.starts)),
                         place.eq(look_up(self.starts, self.numbers.payload, len(place)))]

        return m
