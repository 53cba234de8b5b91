# amaranth: UnusedElaboratable=no

"""Lines, against a model that splits a list."""

import random
import re

import pytest

from fresa.protocol import LineReader
from tb.boards import component
from tb.engines import AmaranthEngine

GOOD, LONG, DAMAGED = 0x100, 0x101, 0x102
OUTPUTS = ("bytes_ready", "items_valid", "items_payload")
KINDS = [
    {"length": 1},
    {"length": 2, "start": b":"},
    {"length": 3, "ends": b"\r\n", "skip_empty": True},
    {"length": 5, "ends": b"\n", "start": b"\r", "skip_empty": True},
    {"length": 8, "ends": b"\r\n"},
    {"length": 3, "ends": b"\n", "crlf": True},
    {"length": 2, "ends": b"\n", "start": b":", "skip_empty": True, "crlf": True},
]


class Model:
    """Splits bytes into lines; the buffer is a list."""

    def __init__(self, dut: LineReader) -> None:
        self.dut = dut
        self.reset()

    def reset(self) -> None:
        self.line: list[int] | None = None if self.dut.start else []
        self.verdict = GOOD
        self.waiting: list[int] = []
        self.fetching = 0  # clocks for which the next item waits

    def outputs(self) -> tuple[int, int, int | None]:
        room = self.dut.depth - 1 - len(self.waiting) - len(self.line or [])
        seen = self.fetching >= 2
        return int(room > 0), int(seen), self.waiting[0] if seen else None

    def edge(self, item: int | None, taken: int, reset: int) -> None:
        room, seen, _ = self.outputs()
        self.fetching = self.fetching + 1 if self.waiting else 0
        if seen and taken:
            self.waiting.pop(0)
            self.fetching = 0
        if item is not None and room:
            self.read(item & 0xFF, item >> 8)
        if reset:
            self.reset()

    def read(self, byte: int, error: int) -> None:
        dut = self.dut
        if byte in dut.start:
            self.line, self.verdict = [], DAMAGED if error else GOOD
            return
        if self.line is None and not error:
            return
        self.line = self.line or []
        if byte in dut.ends:
            verdict = DAMAGED if error else self.verdict
            if dut.crlf and self.line[-1:] == [13]:
                self.line.pop()
            if verdict != GOOD:
                self.line = []
            if self.line or verdict != GOOD or not dut.skip_empty:
                self.waiting += [*self.line, verdict]
            self.line, self.verdict = None if dut.start else [], GOOD
        else:
            if error:
                self.verdict = DAMAGED
            elif self.verdict == GOOD and len(self.line) == dut.length:
                self.verdict = LONG
            self.line = [*self.line, byte] if self.verdict == GOOD else []


def check(kind, offered, ready, rst=None):
    """Compare every clock; `offered` has an item or None for each. Return what was taken."""
    dut = LineReader(**kind)
    rst = rst or [0] * len(offered)
    with AmaranthEngine(component("line", dut)) as engine:
        seen = engine.apply({
            "bytes_valid": [int(item is not None) for item in offered],
            "bytes_payload": [item or 0 for item in offered],
            "items_ready": ready, "rst": rst,
        }, list(OUTPUTS))
    model = Model(LineReader(**kind))
    taken = []
    for clock, (item, take, reset) in enumerate(zip(offered, ready, rst, strict=True)):
        room, valid, payload = (int(seen[name][clock]) for name in OUTPUTS)
        expected = model.outputs()
        assert (room, valid, payload if valid else None) == expected, clock
        if valid and take:
            taken.append(payload)
        model.edge(item, take, reset)
    return taken


def lines(kind, items, *, wait: int = 0) -> list[int]:
    """Feed items, each held until it is taken; take lines from clock `wait` on."""
    taken, left = [], list(items)
    with AmaranthEngine(component("line", LineReader(**kind))) as engine:
        idle = 0
        while idle < 5:
            engine.set(bytes_valid=bool(left), bytes_payload=left[0] if left else 0,
                       items_ready=engine.clock >= wait)
            room, valid, payload = engine.get(*OUTPUTS)
            idle = 0 if left or valid else idle + 1
            if left and room:
                left.pop(0)
            if valid and engine.clock >= wait:
                taken.append(payload)
            engine.run(1)
            assert engine.clock < 10_000
    return taken


class TestEveryClock:
    @pytest.mark.parametrize("kind", KINDS, ids=str)
    @pytest.mark.parametrize("share", [0.05, 1.0])
    def test_bytes_of_any_kind(self, kind, share):
        rng = random.Random(f"{kind} {share}")
        special = [*kind.get("ends", b"\r"), *kind.get("start", b""), *b"\r" * ("crlf" in kind)]
        bytes_ = [None, *special, *special, rng.randrange(256), *b"ab" * kind["length"]]
        offered = [rng.choice(bytes_) for _ in range(1500)]
        offered = [None if item is None else item | (rng.random() < 0.04) << 8 for item in offered]
        taken = check(kind, offered, [int(rng.random() < share) for _ in offered],
                      [int(rng.random() < 0.01) for _ in offered])
        assert {item for item in taken if item >> 8} == {GOOD, LONG, DAMAGED}


class TestLineReader:
    FRAMES = {"length": 4, "start": b":"}

    def test_frames(self):
        assert lines(self.FRAMES, b"no:x?\r no\r:\r:v1:v12\r") == [
            *b"x?", GOOD, GOOD, *b"v12", GOOD]

    @pytest.mark.parametrize("length", [1, 2, 3, 6, 7, 80, 126, 127, 1022])
    def test_the_longest_line_has_room(self, length):
        dut = LineReader(length=length)
        assert length + 2 <= dut.depth < 2 * length + 4 and dut.depth & dut.depth - 1 == 0
        assert lines({"length": length}, b"a" * length + b"\r" + b"b" * (length + 1) + b"\r") == [
            *b"a" * length, GOOD, LONG]


class TestParameters:
    @pytest.mark.parametrize(("ends", "start"), [(b"", b""), (b"\r", b"\r"), (b"\r", b"::")])
    def test_impossible_characters(self, ends, start):
        with pytest.raises(ValueError, match=f"not ends={re.escape(repr(ends))} and start="):
            LineReader(length=8, ends=ends, start=start)

    @pytest.mark.parametrize(("ends", "start"), [(b"\r\n", b""), (b"\n", b"\r")])
    def test_a_cr_is_one_thing(self, ends, start):
        with pytest.raises(ValueError, match="with crlf a CR neither starts nor ends a line, not "
                           f"ends={re.escape(repr(ends))} and start="):
            LineReader(length=8, ends=ends, start=start, crlf=True)
