# amaranth: UnusedElaboratable=no

"""Frames: each is answered once, and only a good one does anything."""

import gc
import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.protocol import FrameInterpreter
from fresa.protocol.frames import GREETING, HELP
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.machines.single.stimulus import frames

GOOD, LONG, DAMAGED = 0x100, 0x101, 0x102
START = {"target": 0, "speed": 100, "enable": 1}
GREETED, HELPED = b"hi\r\n", b"help\r\n"
RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=20)


def interpreter() -> AmaranthEngine:
    return AmaranthEngine(component("frames", FrameInterpreter(
        greeting=GREETED, help_text=HELPED)))


def meaning(text: bytes, end: int, state: dict[str, int], position: int) -> bytes:
    """Do what a frame asks for, and return its answer."""
    if end != GOOD:
        return b"err length\r\n" if end == LONG else b"err command\r\n"
    text = text.upper()
    if text in (b"X?", b"V?"):
        value = position if text == b"X?" else state["speed"]
        return b"%c:%d\r\nok\r\n" % (text.lower()[0], value)
    if text == b"D":
        return HELPED + b"ok\r\n"
    if not re.match(rb"[XVE]([ 0-9+-]|$)", text):
        return b"err command\r\n"
    if not re.fullmatch(rb"[XVE][0-9]+", text):
        return b"err number\r\n"
    name, low, high = {"X": ("target", 0, 9999), "V": ("speed", 1, 59999),
                       "E": ("enable", 0, 1)}[chr(text[0])]
    if not low <= int(text[1:]) <= high:
        return b"err range\r\n"
    state[name] = int(text[1:])
    return b"ok\r\n"


def check(lines: list[tuple[bytes, int]], *, position: int = 0, seed: int = 0, eager: float = 1,
          prompt: float = 1) -> bytes:
    """Compare answers, and in every clock what the frames have done; return the answers."""
    rng = random.Random(seed)
    state, answers = dict(START), GREETED + HELPED
    left = [(item, end, text) for text, end in lines for item in [*text, end]]
    sent, idle = bytearray(), 0
    with interpreter() as engine:
        engine.set(position=position)
        offered = False
        while idle < 40:
            offered = bool(left) and (offered or rng.random() < prompt)
            ready = int(rng.random() < eager)
            engine.set(items_valid=offered, items_payload=left[0][0] if offered else 0,
                       bytes_ready=ready)
            taken, valid, byte, fault = engine.get("items_ready", "bytes_valid", "bytes_payload",
                                                   "fault")
            assert dict(zip(state, engine.get(*state), strict=True)) == state
            assert not fault
            if valid and ready:
                sent.append(byte)
            if taken and offered:
                item, end, text = left.pop(0)
                offered = False
                if item >= GOOD:
                    answers += meaning(text, end, state, position)
            idle = 0 if left or valid else idle + 1
            engine.run(1)
    assert bytes(sent) == answers
    return bytes(sent)


def answer(text: bytes, end: int = GOOD, position: int = 0) -> bytes:
    return check([(text, end)], position=position).removeprefix(b"hi\r\nhelp\r\n")


class TestFrameInterpreter:
    def test_answers(self):
        answers = {
            b"x?": b"x:1234\r\nok\r\n", b"v?": b"v:100\r\nok\r\n", b"d": b"help\r\nok\r\n",
            **dict.fromkeys([b"x0", b"x9999", b"X00000000000012", b"v1", b"V59999", b"e0", b"E01"],
                            b"ok\r\n"),
            **dict.fromkeys([b"x10000", b"x65536", b"v0", b"v60000", b"v65636", b"e2",
                             b"x4294967297"], b"err range\r\n"),
            **dict.fromkeys([b"x", b"e", b"x12a", b"x-1", b"x 1", b"x1 ", b"x99999z", b"v1.5"],
                            b"err number\r\n"),
            **dict.fromkeys([b"", b"y1", b"xx", b"x??", b"x?1", b"x? ", b"e?", b"d1", b"d ", b"1",
                             b" x1", b"\xf81"], b"err command\r\n"),
        }
        sent = check([(text, GOOD) for text in answers], position=1234)
        assert sent == b"hi\r\nhelp\r\n" + b"".join(answers.values())

    @pytest.mark.parametrize("seed", range(3))
    def test_frames_of_any_kind(self, seed):
        """Also where the line is slow, and items come one by one."""
        rng = random.Random(seed)
        source = frames(rng)
        lines = []
        for _ in range(120):
            text = next(source).strip(b":\r")
            if re.search(rb"[:\r]", text):
                continue
            end = rng.choice([GOOD] * 12 + [LONG, DAMAGED])
            lines.append((text if end == GOOD else b"", end))
        check(lines, position=rng.randrange(10_000), seed=seed,
              eager=rng.choice([0.1, 0.7, 1]), prompt=rng.choice([0.3, 1]))

    def test_any_frame(self):
        @RANDOM
        @given(st.lists(st.text("xXvVeEdD?0159 +-a\0", max_size=7).map(str.encode), max_size=5))
        def run(texts) -> None:
            check([(text, GOOD) for text in texts], position=9999)

        run()

    def test_reset_in_the_middle(self):
        """At any clock: what was set is forgotten, and it begins anew with the greeting."""
        items = [*b"x5", GOOD, *b"v7", GOOD, *b"x?", GOOD]
        for clock in range(1, 60, 11):
            with interpreter() as engine:
                sent, left = bytearray(), list(items)
                for now in range(clock + 80):
                    engine.set(rst=now == clock, bytes_ready=1, items_valid=bool(left) and
                               now <= clock, items_payload=left[0] if left else 0)
                    ready, valid, byte = engine.get("items_ready", "bytes_valid", "bytes_payload")
                    if left and ready and now <= clock:
                        left.pop(0)
                    if now > clock and valid:
                        sent.append(byte)
                    if now == clock + 1:
                        assert engine.get(*START) == tuple(START.values())
                    engine.run(1)
                assert bytes(sent) == b"hi\r\nhelp\r\n"


class TestTexts:
    def test_the_help_names_every_command(self):
        lines = HELP.decode().split("\r\n")
        for frame in (":x?", ":xN", ":v?", ":vN", ":e1", ":e0", ":d"):
            assert sum(line.split(" ")[0] == frame for line in lines) == 1

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    def test_texts_fit_into_a_block_ram(self):
        texts = FrameInterpreter().texts
        assert sum(map(len, texts.values())) <= 2048
        assert all(text.endswith(b"\r\n") for text in (GREETING, HELP))
        gc.collect()  # what nobody elaborates is let go of here, not later

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    def test_too_long_a_help(self):
        raised = None
        try:
            FrameInterpreter(help_text=b"?" * 9000)
        except ValueError as error:
            raised = str(error)
        gc.collect()
        assert raised == "all texts together have 16384 bytes at most, not 18082"
