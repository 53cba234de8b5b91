# amaranth: UnusedElaboratable=no

"""Real-time commands out of bytes: every byte, with and without an error."""

import random

import pytest

from fresa.protocol import RealtimeCode, RealtimeFilter
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ["bytes_ready", "rest_valid", "rest_payload", "command", "code"]
COMMANDS = {*b"?!~\x18\x84\x85", *range(0x90, 0x98), *range(0x99, 0x9F), 0xA0, 0xA1}


def test_codes_are_those_of_grbl():
    assert {code.value for code in RealtimeCode} == COMMANDS


@pytest.mark.parametrize("error", [0, 1])
def test_every_byte(error):
    """A command is taken whether the others can go on or not."""
    rng = random.Random(error)
    offered = [byte | error << 8 for byte in range(256) for _ in range(3)]
    valid = [int(rng.random() < 0.7) for _ in offered]
    ready = [int(rng.random() < 0.5) for _ in offered]
    with AmaranthEngine(component("filter", RealtimeFilter())) as engine:
        seen = engine.apply({"bytes_valid": valid, "bytes_payload": offered, "rest_ready": ready},
                            OUTPUTS)
    before = None
    for clock, item in enumerate(offered):
        row = {name: int(seen[name][clock]) for name in OUTPUTS}
        is_command = item in COMMANDS
        passes = bool(error) or (item < 0x80 and not is_command)
        assert row["rest_valid"] == int(valid[clock] and passes)
        assert not passes or row["rest_payload"] == item
        assert row["bytes_ready"] == int(ready[clock] or not passes)
        assert row["command"] == int(before is not None)
        assert before is None or row["code"] == before
        before = item if valid[clock] and is_command else None
