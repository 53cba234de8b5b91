# amaranth: UnusedElaboratable=no

"""Upsets and resets: what the machine is struck with, and that what comes of it is seen."""

import json
import subprocess
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from itertools import islice, pairwise

import numpy as np
import pytest
from amaranth import Const, Mux

from tb.engines import source
from tb.engines.build import missing
from tb.faults.rows import Rows, rows_of_stimulus
from tb.faults.session import BIT
from tb.faults.target import FaultTarget
from tb.faults.upsets import Trial
from tb.faults.verdicts import Verdict, WrongReset
from tb.machines.mill.actions import Hold, Jog, Mode, Order, Reset, record
from tb.machines.mill.faults import TIMING, TRAVEL, actions, rows_of_actions
from tb.machines.mill.faults import target as mill
from tb.machines.mill.model import MillInputs, MillModel
from tb.machines.mill.stimulus import orders, random_rows
from tb.machines.positioner import faults as positioner_faults
from tb.machines.single import faults as single_faults
from tb.mistake import Mistake
from tb.uart import decode
from tb.yosys import YOSYS

compiled = pytest.mark.skipif(missing() is not None, reason=missing() or "")


def model() -> MillModel:
    return MillModel(period=TIMING.period, scan_bits=TIMING.scan_bits, z_travel=TRAVEL)


class TestWork:
    def test_rows_are_what_the_script_does(self):
        """Played to the model, row by row, they give the pins that a recording of it gives."""
        script = [*actions(3, 40), *islice(orders(3), 30)]
        rows, seen = rows_of_actions(script), []
        machine = model()
        every = zip(rows.levels.tolist(), rows.clocks, rows.waits, strict=True)
        for levels, clocks, waits in every:
            pins, ready, made = MillInputs(*levels), 0, 0
            while made < clocks or (waits and not ready):
                seen.append(levels)
                ready = machine.outputs(pins).ready
                machine.edge(pins)
                made += 1
        recorded = np.array(list(record(model(), script).stimulus.values())).T
        assert seen == recorded.tolist()

    def test_rows_of_levels(self):
        stimulus = random_rows(1, 0, 3000)
        rows = rows_of_stimulus(stimulus, vars(MillInputs()))
        levels = np.repeat(rows.levels, rows.clocks, axis=0)
        assert (levels == np.stack([stimulus[name] for name in vars(MillInputs())], axis=1)).all()
        assert not rows.waits.any()

    def test_sessions_are_lines(self):
        """All that they say on the line is heard, and each begins with the line at rest."""
        for sessions, first, end in ((positioner_faults.sessions, b"CONNECT\n", b"\n"),
                                     (single_faults.sessions, b":v", b"\r")):
            rows = sessions(3)
            begins = np.flatnonzero(rows.begins)
            for begin, stop in pairwise([*begins, len(rows)]):
                line = np.repeat(rows.levels[begin:stop, 1], rows.clocks[begin:stop])
                said = [received.byte for received in decode(line.astype(np.uint8), BIT)]
                assert bytes(said).startswith(first) and bytes(said).endswith(end)
            assert len(begins) == 40

    def test_every_error_is_over_before_the_next_reset(self):
        """Nor may manual mode end one: an upset in it would be seen by nobody."""
        recording = record(model(), actions(5, 300))
        error = np.array(recording.expected["error"], bool)
        rst, mode = (np.array(recording.stimulus[name], bool) for name in ("rst", "mode"))
        ends = rst | ~mode
        assert error.any() and ends.any()
        assert not (error & ends).any()


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "guarded"])
def guard(request) -> bool:
    return request.param


@pytest.fixture(scope="module")
def trial(guard):
    trial = Trial(mill(guard=guard))
    trial.load(rows_of_actions(actions(1, 100)))
    trial.work()
    yield trial
    trial.close()


@compiled
@pytest.mark.compiler
class TestUpsets:
    def test_they_are_the_flip_flops_of_the_netlist(self, trial, guard, tmp_path):
        (tmp_path / "mill.il").write_text(source.rtlil(mill(guard=guard).design))
        script = ("read_rtlil mill.il; synth_xilinx -family xc3se -flatten -top mill; "
                  "tee -q -o stat.json stat -json")
        subprocess.run([*YOSYS, "-q", "-p", script], cwd=tmp_path, check=True, capture_output=True)
        cells = json.loads((tmp_path / "stat.json").read_text())["design"]["num_cells_by_type"]
        assert sum(register.width for register in trial.registers) == sum(
            count for cell, count in cells.items() if cell.startswith("FD"))

    def test_what_they_come_to(self, trial, guard):
        verdicts, silent = trial.upsets(7, 0, 20_000)
        assert verdicts.sum() == 20_000
        come = {register.name.replace("main.", "", 1): set(np.flatnonzero(row))
                for register, row in zip(trial.registers, verdicts, strict=True)}
        # What is known of some by thinking, without the guard and with it.
        known = {
            "monitor.display.time": ({Verdict.HARMLESS}, {Verdict.HARMLESS}),
            "controller.drivers.y.black": ({Verdict.SILENT}, {Verdict.VISIBLE}),
            "controller.drivers.z.orange": ({Verdict.SILENT}, {Verdict.VISIBLE}),
        }
        for name, verdict in known.items():
            assert come[name] == verdict[guard], name
        assert (Verdict.STUCK in come["controller.stopped"]) != guard
        counts = come["controller.automatic.x.count"]
        assert counts == {Verdict.VISIBLE} if guard else Verdict.SILENT in counts
        assert bool(silent) != guard
        for upset in silent:
            away = np.abs(np.subtract(upset.place, upset.asked))
            if ".drivers." in upset.register and not upset.register.endswith("rest"):
                assert away.sum() == away["xyz".index(upset.register.split(".")[-2])] == 1
            else:
                assert away.any() or upset.register.endswith(".count")

    def test_wrong_count_of_a_right_place(self, trial, guard):
        """The tool goes up and down by its travel whatever Z is counted: only the count tells."""
        tool = [Order(down=1), Order(up=1)] * 60
        trial.load(rows_of_actions([Reset(), Mode(1), *tool, Order(1, 1), Hold()]))
        trial.work()
        verdicts, silent = trial.upsets(1, 0, 3000)
        z = [row for register, row in zip(trial.registers, verdicts, strict=True)
             if register.name.endswith("automatic.z.count")]
        assert all(row[Verdict.HARMLESS] == 0 for row in z)
        assert any(row[Verdict.SILENT] for row in z) != guard
        assert any(upset.place == upset.asked for upset in silent) != guard

    def test_chance_is_of_the_seed_and_the_number(self, trial):
        whole, _ = trial.upsets(3, 100, 400)
        parts = trial.upsets(3, 100, 150)[0] + trial.upsets(3, 250, 250)[0]
        assert (whole == parts).all()
        assert (whole != trial.upsets(4, 100, 400)[0]).any()

    def test_work_that_cannot_be_done(self, trial):
        trial.load(rows_of_actions([Mode(1), Order(9000, 0)]))
        with pytest.raises(ValueError, match="does not do this work"):
            trial.work()


def run_with_fault(mistake: Mistake, make: Callable[[], FaultTarget], rows: Rows, gap: int
           ) -> tuple[int, WrongReset | None]:
    """Reset a machine with a mistake in it; give the clocks that it took, and what is wrong."""
    machine = make()
    machine = replace(machine, design=mistake.planted(machine.design))
    rng = np.random.default_rng(1)
    with closing(Trial(machine)) as trial:
        trial.load(rows)
        asks = [machine.line is not None and place % 5 == 0 for place in range(500)]
        clocks, _, wrong = trial.resets(rng.integers(1, gap, 500).tolist(), [1] * 500, asks)
    return clocks, wrong


WORK = [Reset(), Mode(1), Hold(), Order(5, 3), Order(down=1), Order(2, 1), Order(up=1), Mode(0),
        Hold(2), Jog(0b010101, 9), Jog(0, 2)]


@compiled
@pytest.mark.compiler
class TestResets:
    @pytest.mark.parametrize(("mistake", "found"), [
        (Mistake("x.coils", lambda right, _: right ^ 0b0010), "the coil word of x is illegal"),
        (Mistake("x.orange", lambda right, at: Mux(at("x.moved"), ~at("x.orange"), right)),
         "the coil word of x jumps"),
        (Mistake("x.moved", lambda _, at: at("drivers.x.step") & at("x.rested")),
         "a reset moves x"),
        (Mistake("sequencer.refused", reset_less=True),
         "controller.sequencer.refused is not as from power-up after a reset"),
    ], ids=["illegal", "jump", "moves", "keeps"])
    def test_mistakes_are_found(self, mistake, found):
        clocks, wrong = run_with_fault(mistake, lambda: mill(guard=False), rows_of_actions(WORK),
                                       40)
        assert wrong is not None
        assert wrong.what == found and wrong.clock == clocks < 20_000

    def test_none_without_a_mistake(self, trial):
        trial.load(rows_of_actions(WORK))
        clocks, steps, wrong = trial.resets([30] * 500, [2] * 500)
        assert wrong is None
        assert clocks == 500 * 32 and steps > 500


def positioner() -> FaultTarget:
    return positioner_faults.target()


def single() -> FaultTarget:
    return single_faults.target()


ON_A_LINE = {"single": (single, single_faults.sessions),
             "positioner": (positioner, positioner_faults.sessions)}


@compiled
@pytest.mark.compiler
class TestResetsOnALine:
    @pytest.mark.parametrize(("name", "mistake", "found"), [
        ("positioner", Mistake("x.driver.ready", lambda _, at: (
            at("x.driver.over") & ~at("x.driver.step_pin") & at("x.driver.right")
            & at("x.driver.enable_pin"))), "a reset moves "),
        ("positioner", Mistake("x.driver.high", reset_less=False), "a pulse of "),
        ("positioner", Mistake("x.driver.power", reset_less=False), "DIR or ENABLE of "),
        ("positioner", Mistake("positioning.going", reset_less=True),
         "positioning.going is not as from power-up after a reset"),
        ("positioner", Mistake("positioning.halt", lambda *_: Const(1)),
         "after a reset it does not do what it is asked"),
        ("single", Mistake("driver.ready", lambda _, at: (
            at("driver.enable") & (at("driver.rest") >= 0))), "a reset moves "),
        ("single", Mistake("driver.coils", reset_less=False),
         "the coil word of the motor is illegal"),
        ("single", Mistake("tx", lambda *_: Const(1)),
         "after a reset it does not do what it is asked, or does not say so"),
    ], ids=["begins", "cuts", "turns", "keeps", "halts", "moves", "off", "dumb"])
    def test_mistakes_are_found(self, name, mistake, found):
        make, sessions = ON_A_LINE[name]
        _, wrong = run_with_fault(mistake, make, sessions(1), 9000)
        assert wrong is not None and wrong.what.startswith(found)

    def test_none_without_a_mistake(self):
        for make, sessions in ON_A_LINE.values():
            with closing(Trial(make())) as trial:
                trial.load(sessions(2))
                clocks, steps, wrong = trial.resets([6000] * 40, [3] * 40, [False, True] * 20)
                assert wrong is None
                assert clocks > 40 * 6003 and steps > 1000


@compiled
@pytest.mark.compiler
def test_upsets_of_single():
    """What is known of some by thinking: its row is where the motor stands."""
    machine = single()
    with closing(Trial(machine)) as trial:
        trial.load(machine.work(1))
        trial.work()
        verdicts, silent = trial.upsets(7, 0, 3000)
        come = {register.name: set(np.flatnonzero(row))
                for register, row in zip(trial.registers, verdicts, strict=True)}
    assert come["driver.row"] == {Verdict.SILENT}
    assert come["transmitter.word"] == come["driver.rest"] == {Verdict.HARMLESS}
    assert Verdict.VISIBLE in come["receiver.receiver_state_state"]  # shows a fault
    assert Verdict.VISIBLE in come["lines.tail"]  # a frame is refused
    assert silent and all(len(upset.place) == 1 for upset in silent)
