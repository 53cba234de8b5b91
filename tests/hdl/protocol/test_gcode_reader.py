# amaranth: UnusedElaboratable=no

"""G-code to words: against a model in every clock, and against what each line means."""

import random

import pytest
from amaranth import Cat, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.protocol import GCodeKind, GCodeReader, GCodeStatus, gcode_layout
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.gcode_line import DAMAGED, GOOD, GCodeReaderModel, Item, number

INPUTS = ("rst", "items_valid", "items_payload", "words_ready")
OUTPUTS = ["items_ready", "words_valid", "low", "high", "seen", "character"]
RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=60)
GRAMMAR = "GMXF$J=$N0=N0123456789.+- \t/();%ax\x7f\x00"


class Halves(wiring.Component):
    """A reader whose payload is two ports: those of an engine have 64 bits at most."""

    def __init__(self, dut: GCodeReader) -> None:
        self.dut = dut
        super().__init__({"items": dut.signature.members["items"],
                          "words_valid": Out(1), "words_ready": In(1), "low": Out(64),
                          "high": Out(64), "seen": Out(1), "character": Out(8)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.dut = dut = self.dut
        wiring.connect(m, wiring.flipped(self.items), dut.items)
        m.d.comb += [self.words_valid.eq(dut.words.valid), dut.words.ready.eq(self.words_ready),
                     Cat(self.low, self.high).eq(dut.words.payload.as_value()),
                     self.seen.eq(dut.seen), self.character.eq(dut.character)]
        return m


def bits(value: int, place: int, width: int) -> int:
    return value >> place & (1 << width) - 1


def fields(payload: int, layout) -> dict[str, int]:
    """Read the members of a number off its bits."""
    found = {name: bits(payload, member.offset, member.width) for name, member in layout}
    if "value" in found and found["value"] >> layout["value"].width - 1:
        found["value"] -= 1 << layout["value"].width
    return found


def shown(item: Item) -> tuple:
    """Return what there is to see of an item."""
    defined = {name: value for name, value in item.number.items()
               if name != "value" or not item.number["overflow"]}
    return item.kind, item.system, item.character, item.status, defined


def seen_as(payload: int, width: int) -> tuple:
    """Read an item off the pins, as `shown` shows it."""
    layout = gcode_layout(width)
    item = fields(payload, layout)
    kind = GCodeKind(item["kind"]).name
    digits = fields(item["number"], layout["number"].shape) if kind == "WORD" else {}
    if digits.get("overflow"):
        del digits["value"]
    return (kind, bool(item["system"]), "" if kind == "END" else chr(item["character"]),
            item["status"] if kind == "END" else 0, digits)


class Reader:
    """A reader beside its model, clock by clock."""

    def __init__(self, **kind: int) -> None:
        self.kind = kind
        self.width = kind.get("width", 44)
        self.engine = AmaranthEngine(component("gcode", Halves(GCodeReader(**kind))))

    def __enter__(self) -> "Reader":
        return self

    def __exit__(self, *_) -> None:
        self.engine.close()

    def read(self, items, rng: random.Random | None = None) -> list[Item]:
        """Offer items, and compare every clock; in haste, or with pauses of both sides."""
        model, taken, left = GCodeReaderModel(**self.kind), [], list(items)
        rows: list[tuple[int, ...]] = [(1, 0, 0, 0)]
        expected: list[tuple[bool, Item | None, str]] = []
        valid, self.clocks = False, 0
        while left or model.held is not None or model.delay or model.offered:
            self.clocks += 1
            valid = bool(left) and (valid or not rng or rng.random() < 0.7)
            ready = not rng or rng.random() < 0.7
            item = left[0] if valid else None
            rows.append((0, int(valid), item or 0, int(ready)))
            room = model.ready
            offered, before = model.offered, len(model.seen)
            if offered and ready:
                taken.append(offered)
            model.clock(item, ready)
            expected.append((room, offered, "".join(model.seen[before:])))
            if valid and room:
                left.pop(0)
                valid = False
        seen = self.engine.apply(dict(zip(INPUTS, map(list, zip(*rows, strict=True)),
                                          strict=True)), OUTPUTS)
        for clock, (ready, item, character) in enumerate(expected, 1):
            room, valid, low, high, reads, read = (int(seen[name][clock]) for name in OUTPUTS)
            if rows[clock][1]:
                assert room == ready, clock
            assert valid == bool(item), clock
            assert (chr(read) if reads else "") == character, clock
            assert not item or seen_as(high << 64 | low, self.width) == shown(item), clock
        return taken

    def line(self, text: str) -> str:
        """Read one good line, and write what comes of it."""
        *items, end = self.read([*text.encode("latin-1"), GOOD])
        assert end.kind == "END"
        words = [item.character if item.kind == "CHARACTER" else
                 item.character + ("?" if item.number["overflow"] else f"{item.number['value']}")
                 for item in items]
        return " ".join([*words, "$" * end.system + str(end.status)])


@pytest.fixture(scope="module")
def reader():
    with Reader() as found:
        yield found


@pytest.fixture(scope="module")
def small():
    with Reader(width=9, decimals=2) as found:
        yield found


class TestEveryClock:
    @RANDOM
    @given(st.lists(st.integers(0, 255) | st.sampled_from([GOOD, DAMAGED, 0x101]), max_size=60))
    def test_any_bytes(self, reader, items):
        reader.read([*items, GOOD], random.Random(0))

    @RANDOM
    @given(st.lists(st.text(GRAMMAR, max_size=20), max_size=6), st.integers(0, 9))
    def test_bytes_of_the_grammar(self, small, lines, seed):
        items = [item for line in lines for item in (*line.encode("latin-1"), GOOD)]
        taken = small.read(items, random.Random(seed))
        assert [item.kind for item in taken].count("END") == len(lines)

    @RANDOM
    @given(st.text("0123456789", max_size=40), st.text("0123456789", max_size=40),
           st.sampled_from(["", "-", "+"]))
    def test_numbers(self, reader, whole, decimals, sign):
        if whole + decimals:
            word, end = reader.read([*f"X{sign}{whole}.{decimals}".encode(), GOOD])
            assert word.number == number(f"{sign}{whole}.{decimals}") and not end.status

    def test_reset_in_any_clock(self, reader):
        line = [*b"$N1=X1(", *b"Y-2.5)Z", DAMAGED]
        for clocks in range(len(line)):
            reader.engine.apply({"rst": [0] * clocks, "items_valid": [1] * clocks,
                                 "items_payload": line[:clocks], "words_ready": [1] * clocks},
                                OUTPUTS)
            assert reader.line("X1") == "X1000000 0"


class TestWords:
    @pytest.mark.parametrize(("text", "words"), [
        ("", "0"), (" \t\x00/", "0"), ("(G0)", "0"), (";G0 X1", "0"), ("(G0 X1", "0"),
        ("G0X1", "G0 X1000000 0"), ("g1 x-.5 y+2.", "G1000000 X-500000 Y2000000 0"),
        ("G 1 X 1 0", "G1000000 X10000000 0"), ("X1(a)0(b)Y2", "X10000000 Y2000000 0"),
        ("/X1", "X1000000 0"), ("X1/2", "X12000000 0"), ("N10G0", "N10000000 G0 0"),
        ("(a(b)X1", "X1000000 0"), ("(a(b)c)X1", "2"), ("(a;b)X1", "X1000000 0"),
        (";a(b)\x01X1", "0"), ("X1;Y(2", "X1000000 0"), ("X1E5", "X1000000 E5000000 0"),
        ("X", "2"), ("XY1", "2"), ("X.", "2"), ("X-", "2"), ("X--1", "2"), ("X+-1", "2"),
        ("1", "1"), ("%", "1"), ("X1-2", "X1000000 1"), ("X1.2.3Y", "X1200000 1"),
        ("X1 = Y", "X1000000 1"), ("[X1]", "1"), (")", "1"), ("XNaN", "2"), ("Xinf", "2"),
        ("X1\xe9", "X1000000 1"), ("X1\x7f", "X1000000 1"), ("X1$H", "X1000000 1"),
        ("X@1", "2"), ("@1", "1"), ("`1", "1"), ("{1", "1"), ("[1", "1"), ("Z0z1a2",
                                                                      "Z0 Z1000000 A2000000 0"),
        ("$", "$ $0"), ("$$", "$ $ $0"), ("$h", "$ H $0"), (" / $ # (x)", "$ # $0"),
        ("$100=2.5", "$ 1 0 0 $100000 = 2 . 5 =2500 $0"), ("$J5", "$ J 5 J5000 $0"),
        ("$J=G91X-1", "$ J = G91000000 X-1000000 $0"), ("$J=X", "$ J = $2"),
        ("$N0=G1X2", "$ N 0 N0 = G1000000 X2000000 $0"), ("$n1 = x", "$ N 1 N1000 = $2"),
        ("$N2=X1", "$ N 2 N2000 = X 1 X1000 $0"), ("$N=X1", "$ N = X 1 X1000 $0"),
        ("$N01=X1", "$ N 0 1 N1000 = X 1 X1000 $0"), ("$I=a b", "$ I = A B $0"),
        ("$N0", "$ N 0 N0 $0"), ("$JN0=1", "$ J N 0 N0 = 1 =1000 $0"),
        ("$j = 5", "$ J = $1"), ("$J=$J=", "$ J = $1"), ("$$J=1", "$ $ J = 1 =1000 $0"),
        ("$=-", "$ = - $0"), ("$1.2.3-4", "$ 1 . 2 $1200 . 3 .3000 - 4 -4000 $0"),
    ])
    def test_lines(self, reader, text, words):
        assert reader.line(text) == words

    @pytest.mark.parametrize(("text", "expected"), [
        ("0.0000005", 1), ("-0.0000005", -1), ("0.00000049999", 0), ("-0.0000004", 0),
        ("8796093.022207", 2**43 - 1), ("-8796093.022207", 1 - 2**43),
        ("8796093.0222074", 2**43 - 1), ("8796093.022208", None), ("-8796093.022208", None),
        ("8796093.0222075", None), ("9" * 40, None), ("0" * 40 + "1", 10**6),
        ("." + "9" * 40, 10**6), ("1" + "0" * 80, None), ("18446744073709551616", None),
    ])
    def test_values(self, reader, text, expected):
        word = reader.read([*f"X{text}".encode(), GOOD])[0].number
        assert word["overflow"] == (expected is None)
        assert expected is None or word["value"] == expected

    @pytest.mark.parametrize(("text", "whole", "hundredths", "exact", "integer"), [
        ("38.2", 38, 20, 1, 0), ("43.10", 43, 10, 1, 0), ("28.100000000", 28, 10, 1, 0),
        ("1.001", 1, 0, 0, 0), ("1.0000000001", 1, 0, 0, 0), ("-0", 0, 0, 1, 1),
        ("257", 257, 0, 1, 1), ("10000000", 10_000_000, 0, 1, 1),
        ("16777214.9", 2**24 - 2, 90, 1, 0),
        ("16777215", 2**24 - 1, 0, 1, 1), ("16777216", 2**24 - 1, 0, 1, 1),
        ("9" * 40, 2**24 - 1, 0, 1, 1), (".07", 0, 7, 1, 0), ("5.", 5, 0, 1, 1),
    ])
    def test_commands(self, reader, text, whole, hundredths, exact, integer):
        word = reader.read([*f"G{text}".encode(), GOOD])[0].number
        del word["value"], word["overflow"]
        assert word == {"whole": whole, "hundredths": hundredths, "exact": exact,
                        "integer": integer}

    def test_first_error_wins(self, reader):
        for text, end, status in [
            (b"X1%Y", GOOD, GCodeStatus.NO_LETTER), (b"X Y1 5", GOOD, GCodeStatus.NO_NUMBER),
            (b"X", DAMAGED, GCodeStatus.DAMAGED), (b"XY1", DAMAGED, GCodeStatus.NO_NUMBER),
            (b"$$", DAMAGED, GCodeStatus.DAMAGED), (b"", DAMAGED, GCodeStatus.DAMAGED),
        ]:
            assert reader.read([*text, end])[-1].status == status.value

    def test_a_line_is_read_in_nine_clocks_a_byte(self, reader):
        for text in [b"X1Y2Z3", b"G1X-1Y-2F3", b"$100=2.5", b"G1 X10.123 Y-20.456 F1500"]:
            reader.read([*text, GOOD] * 20)
            assert reader.clocks <= 9 * 20 * (len(text) + 1)

    def test_no_limit_of_length(self, reader):
        items = reader.read([*b"X1 " * 500, GOOD])
        assert [item.kind for item in items] == ["WORD"] * 500 + ["END"]
