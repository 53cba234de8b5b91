# amaranth: UnusedElaboratable=no

"""The commands of the positioner: against a model, and against what each line means."""

import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.protocol.positioner import Answer, Command, PositionerCommands
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.machines.positioner.model import CommandsModel
from tb.models.protocol import DAMAGED, GOOD, LONG

TOP = 1500
OUTPUTS = ["items_ready", "orders_valid", "orders_payload", "numbers_0", "numbers_1", "numbers_2"]
ORDERS = ["CONNECT", "DISCONNECT", "MOV MOT1 C", "MOV MOT3 CC", "STOP MOT2", "VEL MOT2 1500",
          "VEL MOT1 1", "P 7 1 -2 2147483647", "P 1 -2147483648 +5 000", "GOTO 3", "ORIGIN",
          "POS 0 -0 99", "POS 4294967246 2147483648 4294967295", "ACK 0", "ACK +1", "STATE"]
REFUSED = {
    "COMMAND": ["", " ", "MOVE MOT1 C", "mov MOT1 C", "MOT1", "C", "CC", "1", "# POS 1 2 3 :",
                " CONNECT", "CONNECTED", "CONNEC", "x" * 80, "\r", "CONNECT\r"],
    "ARGUMENT": ["CONNECT ", "CONNECT 1", "ORIGIN0", "MOV", "MOV ", "MOV MOT1",
                 "MOV MOT1 ", "MOV  MOT1 C", "MOV MOT1  C", "MOV MOT4 C", "MOV MOT0 C",
                 "MOV MOT12 C", "MOV MOT C", "MOV MOT1 D", "MOV MOT1 c", "MOV MOT1 CCC",
                 "MOV MOT1 MOT", "MOV C MOT1", "MOV CC1 C", "MOV MOT1 C C", "MOV MOT+1 C",
                 "STOP", "STOP MOT1 C", "VEL MOT1", "VEL MOT1 x", "VEL MOT1 -", "VEL MOT1 5x",
                 "VEL MOT1 1.5", "P 1 2 3", "P 1 2 3 4 5", "P", "P1 2 3 4", "GOTO", "GOTO x",
                 "GOTO 1 2", "POS 1 2", "POS 1 2 --3", "POS 1 2 3-", "ACK", "ACK x", "ACK 1 1",
                 "STATE 1", "STATE "],
    "RANGE": ["VEL MOT1 0", "VEL MOT1 1501", "VEL MOT1 -1", "VEL MOT1 4294967297", "P 0 1 2 3",
              "P 8 1 2 3", "P 99 1 2 3", "P -1 1 2 3", "P 1 4294967296 0 0",
              "P 1 0 0 -2147483649", "GOTO 0", "GOTO 8", "GOTO 4294967299", "POS 0 0 " + "9" * 40,
              "ACK 2", "ACK -1", "ACK 8589934592"],
}


def items_of(lines) -> list[int]:
    return [item for line in lines for item in (line if isinstance(line, list)
                                                else [*line.encode("latin-1"), GOOD])]


def check(lines, seed: int, *, haste: float = 1) -> list[tuple[str, str, list[int]]]:
    """Compare every clock with the model, and return the orders."""
    rng = random.Random(seed)
    items, orders = items_of(lines), []
    model = CommandsModel(top_speed=TOP)
    with AmaranthEngine(component("commands", PositionerCommands(top_speed=TOP))) as engine:
        valid, clock = False, 0
        while items or model.order:
            clock += 1
            assert clock < 100_000
            valid = bool(items) and (valid or rng.random() < haste)
            ready = rng.random() < haste
            engine.set(items_valid=valid, items_payload=items[0] if valid else rng.getrandbits(9),
                       orders_ready=ready)
            seen = dict(zip(OUTPUTS, engine.get(*OUTPUTS), strict=True))
            assert seen["orders_valid"] == (model.order is not None)
            if model.order:
                assert order_of(seen) == shown(model.order)
                orders += [model.order] if ready else []
            took = model.clock(items[0] if valid else None, bool(model.order) and ready)
            if valid:
                assert seen["items_ready"] == took
            if took:
                items.pop(0)
                valid = False
            engine.run(1)
    return orders


def order_of(seen: dict[str, int]) -> tuple:
    """Read an order off the pins, as `shown` writes it."""
    payload = seen["orders_payload"]
    answer, command = Answer(payload & 15).name, payload >> 4 & 15
    if answer != "NONE":
        return (answer,)
    word = Command(command).name
    motor, way, point = payload >> 8 & 3, payload >> 10 & 1, payload >> 11
    numbers = [(seen[f"numbers_{n}"] + 2**31) % 2**32 - 2**31 for n in range(3)]
    return (answer, word, *{"MOV": [motor, way], "STOP": [motor], "VEL": [motor, numbers[2]],
                            "P": [point, *numbers], "GOTO": [point], "POS": numbers,
                            "ACK": [numbers[2]]}.get(word, []))


def shown(order) -> tuple:
    wrong, word, numbers = order
    return (wrong,) if wrong else ("NONE", word, *numbers)


class TestPositionerCommands:
    def test_what_each_command_means(self):
        assert [shown(order)[1:] for order in check(ORDERS, 0)] == [
            ("CONNECT",), ("DISCONNECT",), ("MOV", 0, 1), ("MOV", 2, 0), ("STOP", 1),
            ("VEL", 1, 1500), ("VEL", 0, 1), ("P", 7, 1, -2, 2**31 - 1), ("P", 1, -2**31, 5, 0),
            ("GOTO", 3), ("ORIGIN",), ("POS", 0, 0, 99), ("POS", -50, -2**31, -1),
            ("ACK", 0), ("ACK", 1), ("STATE",)]

    @pytest.mark.parametrize("reason", REFUSED)
    def test_what_is_refused_has_its_reason_and_the_next_line_is_read(self, reason):
        orders = check([line for refused in REFUSED[reason] for line in (refused, "GOTO 5")], 1,
                       haste=0.7)
        assert [shown(order) for order in orders] == [
            (reason,), ("NONE", "GOTO", 5)] * len(REFUSED[reason])

    def test_lines_that_are_long_or_damaged(self):
        lines = [[LONG], [DAMAGED], "CONNECT", [*b"CONNECT", DAMAGED], [*b"FOO", LONG], [0x1FF]]
        assert [shown(order)[0] for order in check(lines, 2)] == [
            "LONG", "DAMAGED", "NONE", "DAMAGED", "LONG", "DAMAGED"]

    @pytest.mark.parametrize("seed", range(3))
    def test_is_its_model_in_every_clock(self, seed):
        """Also where lines are mutated, items come late, and orders are taken late."""
        rng = random.Random(seed)
        lines: list = []
        for _ in range(60):
            line = bytearray(rng.choice(ORDERS + sum(REFUSED.values(), [])).encode())
            for _ in range(rng.choice([0, 0, 1, 2])):
                place = rng.randrange(len(line) + 1)
                line[place:place + rng.randrange(2)] = rng.choice(
                    [b"", b" ", b"-", b"7", b"C", b"M", bytes([rng.randrange(256)])])
            lines.append([*line, rng.choice([GOOD] * 9 + [LONG, DAMAGED])])
        assert len(check(lines, seed, haste=rng.choice([1, 0.9, 0.3]))) == 60

    @settings(deadline=None, database=None, derandomize=True, max_examples=30)
    @given(st.lists(st.lists(st.sampled_from(b"MOVT123C PGO-+09"), max_size=14), max_size=6))
    def test_any_line_is_one_order(self, lines):
        assert len(check([[*line, GOOD] for line in lines], 0)) == len(lines)

    @pytest.mark.parametrize("clocks", range(0, 24, 3))
    def test_reset_begins_a_line_anew(self, clocks):
        with AmaranthEngine(component("commands", PositionerCommands(top_speed=TOP))) as engine:
            items = items_of(["MOV MOT2 C", "VEL MOT1 x"])
            for clock in range(clocks + 1):
                engine.set(items_valid=1, items_payload=items[0], rst=clock == clocks)
                if engine.get("items_ready"):
                    items.pop(0)
                engine.run(1)
            engine.set(rst=0, orders_ready=1)
            found = []
            items = items_of(["GOTO 5", "CONNECT"])
            while len(found) < 2:
                engine.set(items_valid=bool(items), items_payload=items[0] if items else 0)
                seen = dict(zip(OUTPUTS, engine.get(*OUTPUTS), strict=True))
                found += [order_of(seen)] if seen["orders_valid"] else []
                if items and seen["items_ready"]:
                    items.pop(0)
                engine.run(1)
        assert found == [("NONE", "GOTO", 5), ("NONE", "CONNECT")]

    @pytest.mark.parametrize("speed", [0, -1, 2**31, 1.5])
    def test_impossible(self, speed):
        message = f"top_speed must be a whole number from 1 to 2147483647, not {speed!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            PositionerCommands(top_speed=speed)
