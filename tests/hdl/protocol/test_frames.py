# amaranth: UnusedElaboratable=no

"""Frames: each is answered once, and only a good one does anything."""

import gc
from collections.abc import Iterable

import pytest

from fresa.protocol import FrameInterpreter
from fresa.protocol.frames import GREETING, HELP
from tb.boards import component
from tb.engines import AmaranthEngine

GOOD = 0x100  # end of a line
GREETED, HELPED = b"hi\r\n", b"help\r\n"


def answered(texts: Iterable[bytes], *, position: int) -> tuple[bytes, tuple[int, ...]]:
    """Return the answers to frames, and then target, speed and power."""
    left = [item for text in texts for item in [*text, GOOD]]
    sent, idle = bytearray(), 0
    with AmaranthEngine(component("frames", FrameInterpreter(
            greeting=GREETED, help_text=HELPED))) as engine:
        engine.set(position=position, bytes_ready=1)
        while idle < 40:
            engine.set(items_valid=bool(left), items_payload=left[0] if left else 0)
            taken, valid, byte = engine.get("items_ready", "bytes_valid", "bytes_payload")
            if valid:
                sent.append(byte)
            if taken and left:
                left.pop(0)
            idle = 0 if left or valid else idle + 1
            engine.run(1)
        return bytes(sent), engine.get("target", "speed", "enable")


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
        sent, state = answered(answers, position=1234)
        assert sent == GREETED + HELPED + b"".join(answers.values())
        assert state == (12, 59_999, 1)


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
        gc.collect()  # what is not elaborated is let go of here, not later

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    def test_too_long_a_help(self):
        raised = None
        try:
            FrameInterpreter(help_text=b"?" * 9000)
        except ValueError as error:
            raised = str(error)
        gc.collect()
        assert raised == "all texts together have 16384 bytes at most, not 18082"
