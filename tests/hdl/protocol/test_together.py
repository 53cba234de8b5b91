# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false

"""From the pin of a serial line to words and numbers and back: nothing on it stops the rest."""

import random

import pytest
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out, connect

from fresa.protocol import (
    DecimalReader,
    DecimalWriter,
    LineEnd,
    LineReader,
    UARTReceiver,
    UARTTransmitter,
    WordReader,
)
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.uart import decode_output, encode

PERIOD = 16
SKIP, WORD, NUMBER = range(3)


class Echo(wiring.Component):
    """Reads lines by the reader that `reads` selects. Sends the number when `send` is high."""

    rx: In(1)
    tx: Out(1)
    reads: In(2)
    item: Out(9)  # the one that comes next
    offered: Out(1)
    word: Out(3)
    word_valid: Out(1)
    number: Out(34)
    number_valid: Out(1)
    send: In(1)
    drop: In(1)

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.receiver = receiver = UARTReceiver(period=PERIOD)
        m.submodules.lines = lines = LineReader(length=12, start=b":")
        m.submodules.words = words = WordReader((b"X", b"V", b"X?", b"V?"))
        m.submodules.number = number = DecimalReader()
        m.submodules.writer = writer = DecimalWriter()
        m.submodules.transmitter = transmitter = UARTTransmitter(period=PERIOD)
        connect(m, receiver.bytes, lines.bytes)
        connect(m, writer.bytes, transmitter.bytes)
        m.d.comb += [
            receiver.rx.eq(self.rx), self.tx.eq(transmitter.tx),
            self.item.eq(lines.items.payload), self.offered.eq(lines.items.valid),
            self.word.eq(words.words.payload), self.word_valid.eq(words.words.valid),
            self.number.eq(number.numbers.payload), self.number_valid.eq(number.numbers.valid),
            words.words.ready.eq(1), number.numbers.ready.eq(self.send | self.drop),
            words.items.payload.eq(lines.items.payload),
            number.items.payload.eq(lines.items.payload),
            words.items.valid.eq(lines.items.valid & (self.reads == WORD)),
            number.items.valid.eq(lines.items.valid & (self.reads == NUMBER)),
            writer.numbers.payload.eq(number.numbers.p.value),
            writer.numbers.valid.eq(self.send),
        ]
        with m.Switch(self.reads):
            with m.Case(SKIP):
                m.d.comb += lines.items.ready.eq(1)
            with m.Case(WORD):
                m.d.comb += lines.items.ready.eq(words.items.ready)
            with m.Case(NUMBER):
                m.d.comb += lines.items.ready.eq(number.items.ready)
        return m


def run(levels: list[int]) -> tuple[list[tuple], bytes]:
    """Apply the levels of a line; return how each line of text was read, and the bytes sent.

    A number is sent when its line has ended well, and not before.
    """
    answers: list[tuple] = []
    sent: list[int] = []
    reads, known, value, right = WORD, False, None, False
    with AmaranthEngine(component("echo", Echo())) as engine:
        for level in [*levels, *[1] * 60 * PERIOD]:
            engine.set(rx=level, reads=reads, send=0, drop=0)
            item, offered, word, word_valid, number, number_valid, tx = engine.get(
                "item", "offered", "word", "word_valid", "number", "number_valid", "tx")
            sent.append(tx)
            if reads == WORD and word_valid:
                known, value = bool(word >> 2), None
                right = known
                reads = NUMBER if known and word & 3 < 2 else SKIP
            elif reads == NUMBER and number_valid:
                right = number >> 32 == 0
                value = number % 2**32 if right else None
                reads = SKIP
            elif reads == SKIP and offered:
                if item >> 8:
                    right = right and item & 0xFF == LineEnd.GOOD.value
                    answers.append((LineEnd(item & 0xFF), known, value, right))
                    engine.set(send=right and number_valid, drop=1)
                    reads = WORD
                else:
                    right = False  # more than there should be
            engine.run(1)
    return answers, decode_output(sent, PERIOD).text


class TestTogether:
    def test_frames(self):
        answers, sent = run([1] * 9 + encode(
            b"?:x12\r:v?\r:X4294967296\r:x\r:y1\r:v60 \r:x123456789012\r:V7\r", PERIOD))
        good = LineEnd.GOOD
        assert answers == [
            (good, True, 12, True), (good, True, None, True), (good, True, None, False),
            (good, True, None, False), (good, False, None, False), (good, True, 60, False),
            (LineEnd.LONG, False, None, False), (good, True, 7, True)]
        assert sent == b"127"

    @pytest.mark.parametrize("seed", range(2))
    def test_after_noise_of_any_kind_a_frame_is_read(self, seed):
        rng = random.Random(seed)
        noise = []
        while len(noise) < 100 * PERIOD:
            kind = rng.randrange(4)
            if kind == 0:
                noise += encode(bytes(rng.choices(b":x?v0189\r +", k=rng.randrange(20))), PERIOD)
            elif kind == 1:
                noise += [rng.randrange(2)] * rng.randrange(30 * PERIOD)
            elif kind == 2:
                noise += [rng.randrange(2) for _ in range(rng.randrange(90))]
            else:
                noise += encode(rng.randbytes(rng.randrange(8)), PERIOD)
        answers, sent = run([1] * 9 + noise + [1] * 20 * PERIOD + encode(b":x9876\r", PERIOD))
        assert answers[-1] == (LineEnd.GOOD, True, 9876, True)
        assert sent.endswith(b"9876")
