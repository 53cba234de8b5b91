"""What machines say, in lines: right, half, wrong, and noise."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fresa_host import Refused
from fresa_host.lines import LONGEST, LineSplitter
from fresa_host.single_lines import MOST_LINES, Reply, frame, question

WORDS = st.text(st.sampled_from("abc:#!? 0123-xv\x00\xff"), min_size=1, max_size=20)


class TestSplitter:
    @given(st.lists(WORDS, max_size=8), st.sampled_from(["\r", "\n", "\r\n"]), st.data())
    def test_lines_come_out_however_the_bytes_come_in(self, lines, end, draw):
        data = "".join(line + end for line in lines).encode("latin-1")
        cuts = sorted(draw.draw(st.lists(st.integers(0, len(data)), max_size=5)))
        splitter, received = LineSplitter(), []
        for begin, stop in zip([0, *cuts], [*cuts, len(data)], strict=True):
            received += splitter.feed(data[begin:stop])
        assert received == [line.replace("\xff", "\ufffd") for line in lines]

    @given(st.lists(st.binary(max_size=600), max_size=8))
    def test_nothing_makes_it_grow(self, parts):
        splitter = LineSplitter()
        for part in parts:
            for line in splitter.feed(part):
                assert 0 < len(line) <= LONGEST and "\n" not in line and "\r" not in line
            assert len(splitter._begun) <= LONGEST

    def test_a_line_that_is_too_long_is_left_out_and_the_next_is_not(self):
        splitter = LineSplitter()
        assert splitter.feed(b"x" * LONGEST + b"\n") == ["x" * LONGEST]
        assert splitter.feed(b"x" * LONGEST) == splitter.feed(b"x") == []
        assert splitter.feed(b"\nok\n") == ["ok"]

    def test_what_had_begun_can_be_forgotten(self):
        splitter = LineSplitter()
        splitter.feed(b"# POS 1")
        splitter.clear()
        assert splitter.feed(b"ok\n") == ["ok"]


class TestSingle:
    @pytest.mark.parametrize(("made", "expected"), [
        (question("x"), b":x?\r"), (frame("x", 0), b":x0\r"), (frame("x", 9999), b":x9999\r"),
        (frame("v", 1), b":v1\r"), (frame("v", 59_999), b":v59999\r"), (frame("e", 1), b":e1\r"),
        (frame("d"), b":d\r")])
    def test_frames_are_those_of_the_machine(self, made, expected):
        assert made == expected

    @pytest.mark.parametrize(("command", "value", "message"), [
        ("x", -1, "position in steps must be 0 to 9999"), ("x", 10_000, "position in steps"),
        ("v", 0, "speed in rpm must be 1 to 59999"), ("v", 60_000, "speed in rpm"),
        ("e", 2, "power must be 0 to 1"), ("x", 1.5, "position in steps must be a whole number"),
        ("v", "7", "whole number"), ("x", None, "whole number"), ("x", "?", "whole number")])
    def test_what_the_machine_would_refuse_is_not_sent(self, command, value, message):
        with pytest.raises(ValueError, match=f"{message}.*, not {re.escape(repr(value))}"):
            frame(command, value)

    def test_a_value_comes_before_ok(self):
        reply = Reply()
        assert not reply.add("x:123")
        assert reply.add("ok")
        assert reply.number("x") == 123 and reply.number("v") is None

    def test_errors_have_the_words_of_the_machine(self):
        with pytest.raises(Refused, match=r"the number may not be \(range\)") as caught:
            Reply().add("err range")
        assert caught.value.reason == "range"
        with pytest.raises(Refused, match="weather"):
            Reply().add("err weather")

    @given(st.lists(st.text(max_size=30), max_size=200))
    def test_any_lines_can_be_an_answer(self, lines):
        reply = Reply()
        try:
            ended = [reply.add(line) for line in lines]
        except Refused:
            ended = []
        assert len(reply.lines) <= MOST_LINES and sum(ended) == lines.count("ok") * bool(ended)
        assert reply.number("x") is None or 0 <= (reply.number("x") or 0) < 100_000
