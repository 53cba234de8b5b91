# amaranth: UnusedElaboratable=no

"""Lines through a FIFO: against a model in every clock, and each line with its end."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.protocol import LineBuffer
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.gcode_line import DAMAGED, GOOD, LineBufferModel

INPUTS = ("rst", "bytes_valid", "bytes_payload", "items_ready")
OUTPUTS = ["bytes_ready", "items_valid", "items_payload", "free", "overflow"]
RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=40)
KINDS = [{"depth": 2}, {"depth": 3, "silence": 1}, {"depth": 4, "silence": 3},
         {"depth": 5, "silence": 9}, {"depth": 128}]


def check(kind, offered, ready, rst=None) -> tuple[list[int], int]:
    """Compare every clock; `offered` has a byte or None. Return items, and bytes that got lost."""
    rst = rst or [0] * len(offered)
    with AmaranthEngine(component("buffer", LineBuffer(**kind))) as engine:
        seen = engine.apply({"rst": rst, "items_ready": ready,
                             "bytes_valid": [int(byte is not None) for byte in offered],
                             "bytes_payload": [byte or 0 for byte in offered]}, OUTPUTS)
    model, taken, lost = LineBufferModel(**kind), [], 0
    for clock, (byte, take, reset) in enumerate(zip(offered, ready, rst, strict=True)):
        row = {name: int(seen[name][clock]) for name in OUTPUTS}
        expected = model.outputs(byte)
        if expected["items_payload"] is None:
            del expected["items_payload"]
        assert {name: row[name] for name in expected} == expected, clock
        if row["items_valid"] and take:
            taken.append(row["items_payload"])
        lost += row["overflow"]
        model.clock(byte, bool(take))
        if reset:
            model.reset()
    return taken, lost


def lines(text: bytes, *, wait: int = 0, gap: int = 3, **kind) -> list[int]:
    """Send bytes, one every `gap` clocks, and take nothing in the first `wait`."""
    offered = [item for byte in text for item in (byte, *[None] * (gap - 1))]
    offered += [None] * (wait + 400)
    return check(kind, offered, [int(clock >= wait) for clock in range(len(offered))])[0]


class TestEveryClock:
    @pytest.mark.parametrize("kind", KINDS, ids=str)
    @pytest.mark.parametrize(("share", "rate"), [(0.05, 0.1), (1.0, 0.6), (0.5, 0.5)])
    def test_bytes_of_any_kind(self, kind, share, rate):
        rng = random.Random(f"{kind} {share}")
        offered = [rng.choice([13, 10, 10, 65, 66, 67, rng.randrange(256)])
                   | (rng.random() < 0.04) << 8 if rng.random() < rate else None
                   for _ in range(1500)]
        taken, lost = check(kind, offered, [int(rng.random() < share) for _ in offered],
                            [int(rng.random() < 0.003) for _ in offered])
        assert {GOOD, DAMAGED} & {*taken}
        assert kind["depth"] > 5 or lost

    @RANDOM
    @given(st.lists(st.sampled_from([None, None, 10, 13, 65, 0x141, 0x10A]), max_size=80),
           st.integers(0, 80), st.sampled_from(KINDS))
    def test_any_bytes_and_a_wait(self, offered, wait, kind):
        check(kind, offered, [int(clock >= wait) for clock in range(len(offered))])


class TestLines:
    def test_ends(self):
        assert lines(b"a\nb\rc\r\n\n\r\rd\n\r") == [
            *b"a", GOOD, *b"b", GOOD, *b"c", GOOD, GOOD, GOOD, GOOD, *b"d", GOOD, GOOD]

    def test_silence(self):
        kind = {"silence": 20}
        assert lines(b"a", **kind) == [*b"a", GOOD]
        assert lines(b"a\nb", **kind) == [*b"a", GOOD, *b"b", GOOD]
        assert lines(b"a\nb", gap=25, **kind) == [*b"a", GOOD, *b"b", GOOD]
        assert lines(b"a\r\nb", gap=25, **kind) == [*b"a", GOOD, GOOD, *b"b", GOOD]
        assert lines(b"ab", gap=19, **kind) == [*b"ab", GOOD]
        assert lines(b"a" * 150) == [*b"a" * 150]

    @pytest.mark.parametrize("count", [6, 8, 60])
    def test_every_line_has_its_end_when_nothing_is_taken(self, count):
        """And a line that comes when there is room again is whole, whatever was lost before."""
        offered = [*(b"ab\n" * count), *[None] * 200, *b"cde\n", *[None] * 30]
        ready = [int(clock >= 3 * count + 50) for clock in range(len(offered))]
        taken, lost = check({"depth": 7}, offered, ready)
        ends = min(count, 2 + 7)
        assert taken[:6] == [*b"ab", GOOD, *b"ab", GOOD] and lost
        assert [item for item in taken if item >> 8] == [GOOD] * 2 + [DAMAGED] * (ends - 2) + [GOOD]
        assert taken[-4:] == [*b"cde", GOOD]

    def test_framing_errors(self):
        with_errors = [65, 0x142, 67, 10, 68, 10, 0x10A, 13, 0x10A, 69, 10]
        offered = [item for byte in with_errors for item in (byte, None, None)] + [None] * 20
        assert check({"depth": 64}, offered, [1] * len(offered))[0] == [
            65, DAMAGED, 68, GOOD, DAMAGED, GOOD, DAMAGED, 69, GOOD]

    def test_three_clocks_and_then_two_an_item(self):
        kind, offered = {"depth": 16}, [*b"abcdef", *[None] * 20]
        with AmaranthEngine(component("buffer", LineBuffer(**kind))) as engine:
            seen = engine.apply({"bytes_valid": [int(byte is not None) for byte in offered],
                                 "bytes_payload": [byte or 0 for byte in offered],
                                 "items_ready": [1] * 26}, OUTPUTS)["items_valid"]
        assert [clock for clock, valid in enumerate(seen) if valid] == [3, 5, 7, 9, 11, 13]
