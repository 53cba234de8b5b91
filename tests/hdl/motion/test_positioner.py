# amaranth: UnusedElaboratable=no

"""What orders do: against a model in every clock, and each by itself."""

import random
import re

import pytest

from fresa.motion.positioner import WAITING, Positioning
from fresa.protocol.positioner import Answer, Command
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.machines.positioner.model import DOWN, UP, PositioningModel

TOP = 1500
REASONS = ["DAMAGED", "LONG", "COMMAND", "ARGUMENT", "RANGE"]


def words(order) -> dict[str, int]:
    """Put an order on the pins."""
    wrong, word, numbers = order
    numbers = list(numbers)
    command = Command[word].value if word in Command.__members__ else 15
    payload = Answer[wrong or "NONE"].value | command << 4
    if not wrong and word in ("MOV", "STOP", "VEL"):
        payload |= numbers.pop(0) << 8
        payload |= numbers.pop(0) << 10 if word == "MOV" else 0
    if not wrong and word in ("P", "GOTO"):
        payload |= numbers.pop(0) << 11
    numbers = ([0] * 3 + numbers)[-3:] if not wrong else [1, 2, 3]
    return {"orders_payload": payload,
            **{f"numbers_{n}": number % 2**32 for n, number in enumerate(numbers)}}


class Bench:
    """Positioning and its model, side by side."""

    def __init__(self, waiting: int = WAITING) -> None:
        options = {"top_speed": TOP, "waiting": waiting}
        self.engine = AmaranthEngine(component("positioning", Positioning(**options)))
        self.model = PositioningModel(**options)
        self.in_position, self.limit_hit = [0] * 3, [0] * 3
        self.answers: list[str] = []

    def clock(self, order=None, *, tick=0, listens=1, halt=0, rst=0) -> bool:
        """Make a clock, and compare; tell whether the order was taken."""
        engine, model = self.engine, self.model
        engine.set(orders_valid=int(order is not None), tick=tick, answers_ready=listens, rst=rst,
                   halt=halt, in_position=bits(self.in_position), limit_hit=bits(self.limit_hit),
                   **(words(order) if order else {}))
        answered = bool(model.answer) and bool(listens)
        load, takes = model.load(order), model.takes(order)
        expected = {
            "orders_ready": int(takes), "answers_valid": int(bool(model.answer)),
            "connected": int(model.connected), "run": bits(map(bool, model.movement)),
            "load": int(load is not None), "buzzer": int(model.sound > 0),
            **{f"rate_{n}": model.rate[n] for n in range(3)},
            **{f"target_n_{n}": ~model.target[n] % 2**32 for n in range(3)},
            **({f"place_{n}": load[n] % 2**32 for n in range(3)} if load else {}),
            **({"answers_payload": Answer[model.answer.replace(" ", "_")].value}
               if model.answer else {}),
        }
        assert dict(zip(expected, engine.get(*expected), strict=True)) == expected
        self.answers += [model.answer] if answered else []
        model.clock(order, in_position=self.in_position, limit_hit=self.limit_hit, tick=bool(tick),
                    answer_taken=answered, halt=bool(halt))
        if rst:
            model.reset()
        engine.run(1)
        return takes

    def order(self, word: str, *numbers: int, wrong: str = "", **levels: int) -> None:
        """Give an order, which is taken with the second clock, whatever waits to be answered."""
        order = wrong, word, list(numbers)
        assert not self.clock(order, **levels) and self.clock(order, **levels)

    def settle(self) -> None:
        """Listen until all is said."""
        quiet = 0
        while quiet < 3:
            quiet = 0 if self.model.answer or self.model.waiting_answers else quiet + 1
            self.clock()

    @property
    def runs(self) -> int:
        return self.engine.get("run")

    def targets(self) -> list[int]:
        return [(~self.engine.get(f"target_n_{n}") + 2**31) % 2**32 - 2**31 for n in range(3)]


def bits(levels) -> int:
    return sum(int(level) << place for place, level in enumerate(levels))


@pytest.fixture
def bench():
    made = Bench()
    yield made
    made.engine.close()


class TestPositioning:
    @pytest.mark.parametrize(("seed", "waiting"), [(0, 2), (1, 3), (2, 5), (3, WAITING)])
    def test_is_its_model_in_every_clock(self, seed, waiting):
        rng = random.Random(seed)
        bench = Bench(waiting)
        order = None
        for _ in range(5000):
            if order is None and rng.random() < 0.4:
                motor, point = rng.randrange(3), rng.randint(1, 7)
                places = [rng.choice([0, 1, -1, UP, DOWN]) for _ in range(3)]
                order = rng.choice([
                    ("", "CONNECT", []), ("", "CONNECT", []), ("", "MOV", [motor, point & 1]),
                    ("", "MOV", [motor, 1]), ("", "STOP", [motor]), ("", "VEL", [motor, point]),
                    ("", "P", [point, *places]), ("", "P", [point, *places]),
                    ("", "GOTO", [point]), ("", "GOTO", [point]), ("", "ORIGIN", []),
                    ("", "POS", places), ("", "ACK", [rng.randrange(2)]), ("", "STATE", []),
                    (rng.choice(REASONS), "", []),
                    ("", "DISCONNECT" if rng.random() < 0.3 else "CONNECT", [])])
            bench.in_position = [rng.random() < 0.05 for _ in range(3)]
            bench.limit_hit = [rng.random() < 0.02 for _ in range(3)]
            if bench.clock(order, tick=rng.random() < 0.2, listens=rng.random() < 0.05,
                           halt=rng.random() < 0.01, rst=rng.random() < 0.002):
                order = None
        bench.engine.close()
        expected = {"DISCONNECTED", "EMPTY", "RANGE", "LIMIT MOT1", "LIMIT MOT3", "OK", "STATE"}
        assert expected | ({"OVERFLOW"} if waiting < 5 else set()) <= {*bench.answers}

    def test_goto_sends_all_and_each_stops_where_it_arrives(self, bench):
        bench.order("CONNECT")
        bench.order("P", 3, 10, -20, 30)
        bench.order("GOTO", 3)
        assert bench.runs == 7 and bench.targets() == [10, -20, 30]
        for motor in (1, 0, 2):
            bench.in_position[motor] = 1
            bench.clock()
            assert bench.runs >> motor & 1 == 0
            bench.in_position = [0, 0, 0]  # as after ORIGIN, or POS
            bench.clock()
        assert bench.runs == 0

    @pytest.mark.parametrize("refused", [1, 33])
    def test_stop_acts_at_once_whatever_waits_to_be_answered(self, bench, refused):
        bench.order("CONNECT")
        bench.order("MOV", 1, 1)
        reasons = [REASONS[number % len(REASONS)] for number in range(refused)]
        for reason in reasons:
            bench.order("", wrong=reason, listens=0)
        assert bench.runs == 0b010
        bench.order("STOP", 1, listens=0)
        assert bench.runs == 0
        bench.settle()
        # One was being handed on, 31 wait by name, and one answer is for all the others.
        assert bench.answers == reasons[:32] + ["OVERFLOW"] * (refused > 32)
        bench.order("GOTO", 5)
        bench.settle()
        assert bench.answers[-1] == "EMPTY"

    def test_each_order_is_answered_once_from_ack_1_to_ack_0(self, bench):
        for word, *numbers in [("CONNECT",), ("ACK", 1), ("VEL", 0, 9), ("GOTO", 1), ("STATE",),
                               ("ACK", 1), ("ACK", 0), ("ORIGIN",), ("STATE",), ("ACK", 0)]:
            bench.order(word, *numbers)
        bench.settle()
        assert bench.answers == ["OK", "OK", "EMPTY", "STATE", "OK", "STATE"]

    @pytest.mark.parametrize(("top", "start"), [(1500, 200), (200, 200), (20, 20)])
    def test_speeds_start_at_200_or_at_the_top(self, top, start):
        with AmaranthEngine(component("positioning", Positioning(top_speed=top))) as engine:
            assert engine.get("rate_0", "rate_1", "rate_2") == (start,) * 3

    @pytest.mark.parametrize("speed", [0, -1, 2**31, 1.5])
    def test_impossible_speeds(self, speed):
        message = f"top_speed must be a whole number from 1 to 2147483647, not {speed!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Positioning(top_speed=speed)

    @pytest.mark.parametrize("waiting", [1, 1025, 2.0, True])
    def test_impossible_queues(self, waiting):
        message = f"waiting must be a whole number from 2 to 1024, not {waiting!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Positioning(top_speed=TOP, waiting=waiting)
