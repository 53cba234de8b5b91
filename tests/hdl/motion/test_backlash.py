# amaranth: UnusedElaboratable=no

"""The backlash of gears, against a motor and the load that it pushes."""

import random

import pytest
from amaranth import Module, Mux, ResetInserter, Signal
from amaranth.sim import Simulator

from fresa.drive import PendingSteps
from fresa.motion import Backlash, BacklashCompensator
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.motion import BacklashModel
from tb.stimulus import bursts


def counted(max_backlash: int, **rows) -> list[int]:
    with AmaranthEngine(component("backlash", Backlash(max_backlash=max_backlash))) as engine:
        return engine.apply(rows, ["counted"])["counted"].tolist()


class TestBacklash:
    @pytest.mark.parametrize("max_backlash", [1, 2, 5, 12, 1000])
    @pytest.mark.parametrize("seed", range(3))
    def test_is_its_model_in_every_clock(self, max_backlash, seed):
        """Also where the backlash changes while it is taken up."""
        stimulus = bursts({"backlash": [max_backlash.bit_length()], "moved": [1], "direction": [1],
                          "rst": [1]}, seed, max_backlash, 3000)
        assert counted(max_backlash, **stimulus) == played(BacklashModel().clock,
                                                           stimulus)["counted"]

    @pytest.mark.parametrize("backlash", range(6))
    def test_a_load_follows_its_motor(self, backlash):
        """By a mechanism of two bodies: a pin of the motor in a slot of the load."""
        rng = random.Random(backlash)
        ways = [way for _ in range(150) for way in [rng.randrange(2)] * rng.randrange(1, 9)]
        seen = counted(5, backlash=[backlash] * len(ways), moved=[1] * len(ways), direction=ways)
        # the slot is from `slot` to `slot + backlash`; it rests where down leaves it
        pin = slot = 0
        for way, counts in zip(ways, seen, strict=True):
            pin += 1 if way else -1
            pushed = max(slot, pin - backlash) if way else min(slot, pin)
            assert counts == (pushed != slot)
            slot = pushed


@pytest.mark.parametrize("backlash", [0, 1, 2, 9])
@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_a_load_is_where_steps_were_requested(backlash, seed):
    """By a mechanism of two bodies, with a driver that takes its time, stops and resets."""
    rng = random.Random(100 * backlash + seed)
    m, dut, pending = Module(), BacklashCompensator(max_backlash=9), PendingSteps(width=8)
    m.submodules += dut, ResetInserter(dut.stop)(pending)
    moved, way = Signal(), Signal()
    m.d.comb += [
        pending.step.eq(dut.step | dut.extra),
        pending.direction.eq(Mux(dut.extra, dut.extra_direction, way)),
        dut.direction.eq(pending.driver_direction),
        dut.pending.eq(pending.driver_step), dut.moved.eq(moved & pending.driver_step & ~dut.stop),
        pending.moved.eq(dut.moved),
    ]

    async def test(ctx):
        motor = count = load = requested = 0
        up, last = 0, -1
        stopped = False  # no step was requested since
        ctx.set(dut.backlash, backlash)
        for clock in range(6000):
            rest = clock % 300 > 200
            up = up if rng.random() < 0.9 else rng.getrandbits(1)
            stop = not rest and rng.random() < 0.01
            step = not rest and clock - last >= 3 and rng.random() < 0.4 and not stop
            last = clock if step else last
            ctx.set(dut.step, step)
            ctx.set(way, up)
            ctx.set(dut.stop, stop)
            ctx.set(dut.tick, rng.random() < 0.5)
            ctx.set(moved, rng.random() < 0.8)
            made, made_up, corrects, correct_up, busy, waits, extra = (ctx.get(each) for each in (
                dut.moved, pending.driver_direction, dut.correct, dut.correct_direction, dut.busy,
                pending.driver_step, dut.extra))
            assert not (extra and (step or waits))
            requested += (1 if up else -1) if step else 0
            motor += (1 if made_up else -1) if made else 0
            count += (1 if made_up else -1) if made else 0
            count += (1 if correct_up else -1) if corrects else 0
            load = min(max(load, motor - backlash), motor)
            if stop and waits:  # what is dropped is not requested any more
                requested = count
            if rest and clock % 300 == 299:
                assert not waits
                assert count == requested
                assert not busy
                assert load == count or stopped
            stopped = stop or (stopped and not step)
            await ctx.tick()

    simulator = Simulator(m)
    simulator.add_clock(1e-6)
    simulator.add_testbench(test)
    simulator.run()
