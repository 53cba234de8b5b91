# amaranth: UnusedElaboratable=no

"""Which lines reach the interpreter, and with which error."""

import random
from typing import Any

import pytest

from fresa.protocol import GCodeGate, GCodeKind, gcode_layout
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.gcode_line import read_lines

WIDTH = 12
LAYOUT = gcode_layout(WIDTH)


def passed(text: str, *, locked: bool, seed: int = 0) -> tuple[list[str], list[int], int]:
    """Send lines; return the letters that are passed, the statuses of ends, and the unlocks."""
    rng = random.Random(seed)
    letters, statuses, unlocks = [], [], 0
    with AmaranthEngine(component("gate", GCodeGate(width=WIDTH))) as engine:
        engine.set(locked=locked)
        for item in read_lines(text):
            engine.set(words_valid=1, words_payload=LAYOUT.const({
                "kind": GCodeKind[item.kind].value, "status": item.status, "system": item.system,
                "character": ord(item.character) if item.character else 0}).as_bits())
            while True:
                engine.set(passed_ready=rng.getrandbits(1))
                ready, valid, payload, unlock = engine.get(
                    "words_ready", "passed_valid", "passed_payload", "unlock")
                unlocks += unlock
                engine.run(1)
                if ready:
                    break
            out: Any = LAYOUT.from_bits(payload)
            if valid and out.kind == GCodeKind.END:
                statuses.append(out.status.value)
            elif valid:
                letters.append(chr(out.character))
    return letters, statuses, unlocks


@pytest.mark.parametrize(("locked", "text", "expected"), [
    (False, "G1X2\n", ("GX", [0], 0)), (True, "G1X2\n", ("GX", [9], 0)),
    (True, "\n", ("", [0], 0)), (False, "$X\n", ("", [0], 1)), (True, "$x\nG0\n", ("G", [0, 9], 1)),
    (False, "$\n", ("", [3], 0)), (False, "$H\n", ("", [5], 0)), (False, "$XX\n", ("", [3], 0)),
    (True, "$100=2.5\n", ("", [3], 0)), (False, "X 1 X\n", ("X", [2], 0)),
    (True, "G\n", ("", [2], 0)), (True, "$J=X1\nG1\n", ("G", [3, 9], 0))])
def test_lines(locked, text, expected):
    letters, statuses, unlocks = passed(text, locked=locked)
    assert ("".join(letters), statuses, unlocks) == expected
