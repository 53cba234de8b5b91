# amaranth: UnusedElaboratable=no

"""The receiver, against its model."""

import random

import pytest

from fresa.protocol import UARTReceiver
from tb.boards import component
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.models.protocol import ReceiverModel, bits

OUTPUTS = ("bytes_valid", "bytes_payload", "framing", "overrun", "line_break", "fault")


def wave(levels: list[int], period: float, *, start: float = 0.0) -> list[int]:
    """Sample bits that each last `period` clocks, which may be a fraction."""
    length = int(len(levels) * period + start)
    return [levels[max(0, min(len(levels) - 1, int((clock - start) / period)))]
            for clock in range(length)]


def model(line, ready, period):
    """Yield the outputs of each clock."""
    receiver, payload = ReceiverModel(period=period), 0
    for rx, taken in zip(line, ready, strict=True):
        valid, line_break = receiver.byte is not None, receiver.line_break
        if receiver.byte:
            byte, error = receiver.byte
            payload = byte | error << 8
        receiver.clock(rx, taken)
        yield valid, payload, receiver.framing, receiver.overrun, line_break, 0


def run(line, ready, period):
    dut = UARTReceiver(period=period)
    assert dut.period == period
    with AmaranthEngine(component("receiver", dut)) as engine:
        seen = engine.apply({"rx": line, "bytes_ready": ready}, list(OUTPUTS))
    return list(zip(*(seen[name].tolist() for name in OUTPUTS), strict=True))


def check(line, ready, period):
    rows = run(line, ready, period)
    for clock, pair in enumerate(zip(rows, model(line, ready, period), strict=True)):
        assert pair[0] == pair[1], clock
    return rows


def taken(rows, ready):
    return [row[1] for row, take in zip(rows, ready, strict=True) if row[0] and take]


class TestTolerance:
    """How far the rate of a sender may be off, for bytes one right behind the other.

    The figures are those of docs/host.md and of `bit_period`; 5208 clocks are a bit of 9600 baud on
    a board with 50 MHz, 64 one in real-time simulation.
    """

    SENT = (0x00, 0xFF, 0x7F, 0x80, 0x55, 0xAA, 0xFE, 0x01, 0x00, 0x00, 0xFF, 0xFF, 0x0F)

    def received(self, period: int, error: float) -> list[int]:
        """Return what comes of bytes whose bits are longer by a part; errors are above 255."""
        levels = [level for byte in self.SENT for level in bits(byte)]
        line = [1] * period + wave(levels, period * (1 + error)) + [1] * 2 * period
        kind = CXXRTLEngine if period > 64 else AmaranthEngine
        with kind(component("receiver", UARTReceiver(period=period))) as engine:
            seen = engine.apply({"rx": line, "bytes_ready": [1] * len(line)},
                                ["bytes_valid", "bytes_payload"])
        return seen["bytes_payload"][seen["bytes_valid"] == 1].tolist()

    @pytest.mark.parametrize(("period", "slower", "faster"), [
        (16, 0.055, 0.038), (64, 0.055, 0.042),
        pytest.param(5208, 0.055, 0.044, marks=pytest.mark.compiler)])
    def test_of_the_rate(self, period, slower, faster):
        for error in (slower, 0.02, 0, -0.02, -faster):
            assert self.received(period, error) == list(self.SENT), error
        for error in (slower + 0.003, -faster - 0.003):
            assert self.received(period, error) != list(self.SENT), error

    @pytest.mark.parametrize("period", [16, 17, 31, 50])
    def test_at_any_period(self, period):
        for error in (0.052, -0.038):
            assert self.received(period, error) == list(self.SENT)


class TestEveryClock:
    @pytest.mark.parametrize("period", [16, 33])
    def test_bytes_and_gaps(self, period):
        """Bytes, some without a stop bit, and breaks; they are taken now and then."""
        rng = random.Random(period)
        line = [0] * 5 + [1] * 3
        for _ in range(30):
            stop = int(rng.random() < 0.7)
            line += wave(bits(rng.choice([0, 0, 255, rng.randrange(256)]), stop=stop), period)
            line += [stop] * rng.choice([0, 1, 3 * period, 11 * period])
            line += [1] * rng.choice([1, 1, period])
        ready = [int(rng.random() < 0.15 / period) for _ in line]
        rows = check(line, ready, period)
        for column in range(5):
            assert len({row[column] for row in rows}) > 1, OUTPUTS[column]

    @pytest.mark.parametrize("period", [16, 40])
    def test_noise_of_any_kind(self, period):
        rng = random.Random(period)
        line = []
        while len(line) < 150 * period:
            line += [rng.randrange(2)] * rng.choice([1, 2, period // 4, period, 3 * period])
        check(line, [int(rng.random() < 0.1) for _ in line], period)


class TestUARTReceiver:
    @pytest.mark.parametrize("period", [32])
    def test_a_disturbance_a_bit_changes_nothing(self, period):
        """As long as a sixteenth, anywhere in each bit after the edge of the start bit."""
        rng = random.Random(period)
        data = [rng.randrange(256) for _ in range(40)]
        line = [1] * period
        for byte in data:
            for number, level in enumerate(bits(byte)):
                bit = [level] * period
                at = rng.randrange(1, period - period // 16)
                if number < 9 or at + period // 16 < period // 2:
                    bit[at:at + period // 16] = [1 - level] * (period // 16)
                line += bit
        line += [1] * period
        assert taken(run(line, [1] * len(line), period), [1] * len(line)) == data

    def test_break_is_one_byte(self):
        line = [1] * 4 + [0] * 1000 + [1] * 40
        rows = check(line, [1] * len(line), 16)
        assert taken(rows, [1] * len(line)) == [0x100]
        broken = [clock for clock, row in enumerate(rows) if row[4]]
        assert broken == list(range(4 + 9 * 16 + 8 + 1 + 1, 4 + 1000 + 3))

    @pytest.mark.parametrize(("byte", "sent"), [
        (0xFF, 1), (0x55, 4), (0x01, 7), (0x80, 9)])
    def test_break_in_the_middle_of_a_byte(self, byte, sent):
        """It is seen within two bytes from where the line fell, and is nothing but damage."""
        line = [1] * 20 + wave(bits(byte), 16)[:sent * 16]
        fell = len(line)
        line += [0] * 30 * 16 + [1] * 40
        rows = check(line, [1] * len(line), 16)
        broken = [clock for clock, row in enumerate(rows) if row[4]]
        assert broken == list(range(broken[0], len(line) - 40 + 3))
        assert broken[0] - fell <= 20 * 16
        assert all(item > 0xFF for item in taken(rows, [1] * len(line)))

    def test_zeros_are_no_break(self):
        """Even where it is not known where a byte begins, and the sender is slow."""
        line = [1] * 8 + [0] * 4
        for number in range(20):
            line += wave(bits(0), 16 * 1.019, start=number / 20)
        rows = check([*line, *[1] * 40], [1] * (len(line) + 40), 16)
        assert not any(row[4] for row in rows)

    def test_reset_in_a_byte(self):
        """After it the rest of the byte is not taken for another while the line is low."""
        period = 16
        line = [1] * 4 + wave(bits(0b1111_0000), period) + [1] * 8 + wave(bits(0x35), period)
        line += [1] * period
        rst = [0] * len(line)
        rst[4 + 2 * period] = 1
        with AmaranthEngine(component(
                "receiver", UARTReceiver(period=16))) as engine:
            seen = engine.apply({"rx": line, "rst": rst, "bytes_ready": [1] * len(line)},
                               ["bytes_valid", "bytes_payload"])
        assert seen["bytes_payload"][seen["bytes_valid"] == 1].tolist() == [0x35]
