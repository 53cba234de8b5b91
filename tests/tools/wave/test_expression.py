"""Conditions: what they mean, against a model that goes clock by clock, and what is refused."""

import tracemalloc

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tools.console import UserError
from tools.wave import trace
from tools.wave.expression import evaluate
from tools.wave.parser import LONGEST, parse
from tools.wave.radix import Radixes
from tools.wave.reader import Signal
from tools.wave.trace import Trace, collect

TIMES = 12


class Made:
    """A wave made of lists: a value a tick, None where it is unknown."""

    path = "made"
    span = (0, TIMES)

    def __init__(self, bits: int = 8, **values: list) -> None:
        self.signals, self._traces = [], {}
        for name, some in values.items():
            text = name == "s"
            kind = "text" if text else "real" if isinstance(some[0], float) else "bits"
            wide = bits if kind == "bits" else 0
            self.signals.append(Signal(("t", name), wide, kind, name, None))
            rows = [("x" * bits if value is None else value) for value in some]
            self._traces[name] = collect([(range(len(rows)), rows)], len(rows), kind=kind,
                                         bits=wide)

    def trace(self, signal: Signal) -> Trace:
        return self._traces[signal.name]


def holds(text: str, bits: int = 8, **values: list) -> list[bool]:
    """Say at which ticks a condition holds; an event, at which it happens."""
    wave = Made(bits, **values)
    condition = evaluate(parse(text), wave, Radixes(wave))  # pyright: ignore[reportArgumentType]
    begins, ends = condition.stretches(TIMES)
    if condition.event:
        return [tick in begins for tick in range(TIMES)]
    return [any(begin <= tick < end for begin, end in zip(begins, ends, strict=True))
            for tick in range(TIMES)]


# The model: every part is a value, or None for unknown; three-valued as in textbooks.
def _not(a):
    return None if a is None else not a


def _and(a, b):
    return False if a is False or b is False else None if a is None or b is None else True


def _or(a, b):
    return _not(_and(_not(a), _not(b)))


NUMBER = st.one_of(
    st.sampled_from([("a", lambda v: v["a"]), ("b", lambda v: v["b"])]),
    st.integers(0, 9).map(lambda n: (str(n), lambda v: n)),
)


def bitwise(parts):
    (one, f), sign, (two, g) = parts
    do = {"&": int.__and__, "|": int.__or__, "^": int.__xor__}[sign]
    return (f"({one} {sign} {two})",
            lambda v: None if f(v) is None or g(v) is None else do(f(v), g(v)))


def compared(parts):
    (one, f), sign, (two, g) = parts
    do = {"==": int.__eq__, "!=": int.__ne__, "<": int.__lt__, "<=": int.__le__,
          ">": int.__gt__, ">=": int.__ge__}[sign]
    return (f"{one} {sign} {two}",
            lambda v: None if f(v) is None or g(v) is None else do(f(v), g(v)))


NUMBERS = st.one_of(NUMBER, st.tuples(NUMBER, st.sampled_from("&|^"), NUMBER).map(bitwise))
COMPARED = st.tuples(
    NUMBERS, st.sampled_from(["==", "!=", "<", "<=", ">", ">="]), NUMBERS).map(compared)
CONDITIONS = st.recursive(COMPARED, lambda inner: st.one_of(
    inner.map(lambda c: (f"not ({c[0]})", lambda v: _not(c[1](v)))),
    st.tuples(inner, inner).map(lambda p: (
        f"({p[0][0]} and {p[1][0]})", lambda v: _and(p[0][1](v), p[1][1](v)))),
    st.tuples(inner, inner).map(lambda p: (
        f"({p[0][0]} or {p[1][0]})", lambda v: _or(p[0][1](v), p[1][1](v)))),
), max_leaves=6)
VALUES = st.lists(st.one_of(st.none(), st.integers(0, 9)), min_size=TIMES, max_size=TIMES)


class TestMeaning:
    @settings(max_examples=150, deadline=None)
    @given(CONDITIONS, VALUES, VALUES)
    def test_as_the_model(self, condition, a, b):
        text, model = condition
        text = f"({text}) and (a == a or unknown a)"  # names a signal, and changes nothing
        expected = [model({"a": x, "b": y}) is True for x, y in zip(a, b, strict=True)]
        assert holds(text, a=a, b=b) == expected

    @settings(max_examples=100, deadline=None)
    @given(CONDITIONS, VALUES, VALUES)
    def test_edges_as_the_model(self, condition, a, b):
        text, model = condition
        truth = [model({"a": x, "b": y}) for x, y in zip(a, b, strict=True)]
        pairs = list(zip([None, *truth], truth, strict=False))
        anchor = " and (a == a or unknown a)"
        for edge, wanted in (("rise", (False, True)), ("fall", (True, False))):
            assert holds(f"{edge} ({text}){anchor}", a=a, b=b) == [
                pair == wanted for pair in pairs]

    @pytest.mark.parametrize(("text", "ticks"), [
        ("a", [1, 2, 4]), ("not a", [0, 5, 6, 7, 8, 9, 10, 11]), ("unknown a", [3]),
        ("change a", [1, 2, 3, 4, 5]), ("rise a", [1]), ("fall a", [5]),
        ("a == 1", [1]), ("a[1]", [2, 4]), ("a[1:0] == 0b10", [2]), ("a > 0x1", [2, 4]),
        ("a == 25_5", [4]), ("a > 1 and s == 'B'", [2]), ('s == "B/1"', [2, 3]),
        ('rise a or change s == "B"', None), ("rise a or change s", [1, 2, 4]),
        ("change a and s == 'A'", [1, 4, 5]), ("a < -1", []),
        ("a < 300", [*range(3), *range(4, 12)]),
        ("`a` == 1", [1]), ("t.a == 2", [2]), ("a != 0 and a != 2", [1, 4]),
    ])
    def test_by_hand(self, text, ticks):
        values = {"a": [0, 1, 2, None, 255] + [0] * 7,
                  "s": ["A/0", "A/0", "B/1", "B/1"] + ["A/0"] * 8}
        if ticks is None:
            with pytest.raises(UserError, match="an event"):
                holds(text, **values)
        else:
            assert [tick for tick, true in enumerate(holds(text, **values)) if true] == ticks

    def test_positions_go_below_0(self):
        values = [0, 255, 254, 3] + [0] * 8
        assert [n for n, true in enumerate(holds("at_x < 0", at_x=values)) if true] == [1, 2]
        assert holds("at_x == -2", at_x=values)[2]


    @pytest.mark.parametrize(("text", "ticks"), [
        ("unknown a[0]", [1, 2]), ("a[0] == 0", [0, 4, 5, 6, 7, 8, 9, 10, 11]), ("a[0]", [3]),
        ("unknown a[1]", [0, 1, 3]), ("a[3:2] == 0b01", [3]), ("unknown a[3:1]", [0, 1, 3]),
        ("(a[3:1])[1]", [0, 3]), ("unknown a", [0, 1, 2, 3]), ("a[2] and unknown a", [0, 3]),
        ("fall a[0]", [4]), ("a[9:8] == 0", [*range(12)]),
    ])
    def test_bits_are_known_by_themselves(self, text, ticks):
        words = ["0000x1x0", "xxxxxxxx", "0000100x", "000001x1"]
        found = holds(text, a=[*words] + [0] * 8)
        assert [tick for tick, true in enumerate(found) if true] == ticks

    def test_bits_of_what_is_signed_and_of_what_is_wide(self):
        assert holds("at_x[9:6] == 0b1111", at_x=[-1 & 255] + [1] * 11) == [True] + [False] * 11
        assert holds("unknown at_x[9:8]", at_x=["x" + "0" * 7] + [1] * 11)[:2] == [True, False]
        wide = [1 << 99, "x" + "0" * 98 + "1", *[0] * 10]
        assert holds("w[99] == 1", bits=100, w=wide)[:3] == [True, False, False]
        assert holds("w[98:0] == 1", bits=100, w=wide)[:3] == [False, True, False]

    def test_nan_is_no_change(self):
        nan = float("nan")
        assert [n for n, true in enumerate(holds(
            "change r and a < 99", r=[nan, nan, 1.0, 1.0, nan] + [nan] * 7,
            a=list(range(12)))) if true] == [2, 4]

    @settings(max_examples=60, deadline=None)
    @given(CONDITIONS, VALUES, VALUES, st.sampled_from(["", "rise ", "fall "]))
    def test_block_by_block_as_at_once(self, condition, a, b, edge):
        text = f"{edge}({condition[0]}) and (a == a or unknown a)"
        whole = holds(text, a=a, b=b)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(trace, "BLOCK", 2)
            assert holds(text, a=a, b=b) == whole

    def test_what_holds_through_several_blocks_begins_once(self, monkeypatch):
        monkeypatch.setattr(trace, "BLOCK", 2)
        wave = Made(a=list(range(TIMES)))
        condition = evaluate(parse("a > 2 and a < 9"), wave,  # pyright: ignore[reportArgumentType]
                             Radixes(wave))  # pyright: ignore[reportArgumentType]
        assert [some.tolist() for some in condition.stretches(TIMES)] == [[3], [9]]

    def test_memory_is_that_of_the_answer(self):
        count = 100_000
        wave = Made(a=[n & 1 for n in range(count)], b=[n & 7 for n in range(count)])
        tree, radixes = parse("a and b[2:1] == 3 and change b"), Radixes(
            wave)  # pyright: ignore[reportArgumentType]
        tracemalloc.start()
        try:
            evaluate(tree, wave, radixes)  # pyright: ignore[reportArgumentType]
            assert tracemalloc.get_traced_memory()[1] < 40 * count
        finally:
            tracemalloc.stop()


class TestRefused:
    @pytest.mark.parametrize(("text", "message"), [
        ("", "a signal or a value"), ("a ==", "where 'a ==' ends"), ("a b", "an operator"),
        ("a = 1", "unexpected character: '= 1'"), ("(a", "\\) is expected"),
        ("a[", "a bit number is"), ("a[0:3]", "\\[high:low\\]"), ("1 < a < 3", "joined by and"),
        ("a & b | 1 == 2", "parentheses"), ("3", "names no signal"), ("s", "compare it"),
        ("a == 'x'", "cannot compare a number with a name"), ("s < 'x'", "the same or not"),
        ("not rise a", "no opposite"), ("rise a or b", "one of each"),
        ("rise (rise a)", "of a value"), ("rise a == 1", "cannot compare an event"),
        ("s & 1", "whole numbers"), ("s[0]", "have bits"),
        ("absent", "no signal"), ("0x", "unexpected character"), ("a == 1__0", "not a number"),
        ("__import__('os')", "an operator"), ("a.__class__", "no signal"),
        ("rise", "is expected"),
        ("-a", "a number is"), ("a == 09", "not a number"),
        ("(" * 60 + "a" + ")" * 60, "nested"), ("a" * (LONGEST + 1), "at most"),
    ])
    def test_in_a_line(self, text, message):
        with pytest.raises(UserError, match=message) as error:
            holds(text, a=[0] * TIMES, b=[0] * TIMES, s=["A"] * TIMES)
        assert "\n" not in str(error.value) and len(str(error.value)) < 250

    @settings(max_examples=300, deadline=None)
    @given(st.lists(st.sampled_from(
        ["a", "b", "s", "rise", "not", "and", "or", "(", ")", "==", "<", "&", "|", "[", "]", ":",
         "1", "0xF", "'A'", "-", "unknown", "change", "1.5", "`", '"', "!"]), max_size=12))
    def test_anything_is_answered_or_refused(self, words):
        try:
            holds(" ".join(words), a=[0, None] * 6, b=list(range(TIMES)), s=["A", "B"] * 6)
        except UserError:
            pass
