# amaranth: UnusedElaboratable=no

"""Upsets and resets: what the machine is struck with, and that what comes of it is seen."""

import json
import subprocess
from itertools import islice

import numpy as np
import pytest
from amaranth import Mux

from tb.engines import source
from tb.faults.rows import rows_of_stimulus
from tb.faults.upsets import Trial
from tb.faults.verdicts import Verdict
from tb.machines.mill.actions import Hold, Jog, Mode, Order, Reset, record
from tb.machines.mill.faults import TIMING, TRAVEL, actions, rows_of_actions
from tb.machines.mill.faults import target as mill
from tb.machines.mill.model import MillInputs, MillModel
from tb.machines.mill.stimulus import orders, random_rows
from tb.mistake import Mistake
from tb.yosys import YOSYS
from tests.machines.faults import run_with_fault


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


@pytest.mark.compiler
class TestUpsets:
    # With a guard: tests/hdl/motion/test_guard.py shows that none of its registers is merged.
    @pytest.mark.parametrize("guard", [False], indirect=True)
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
            away = np.abs(np.subtract(upset.place, upset.expected))
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
        assert any(upset.place == upset.expected for upset in silent) != guard

    def test_chance_is_of_the_seed_and_the_number(self, trial):
        whole, _ = trial.upsets(3, 100, 400)
        parts = trial.upsets(3, 100, 150)[0] + trial.upsets(3, 250, 250)[0]
        assert (whole == parts).all()
        assert (whole != trial.upsets(4, 100, 400)[0]).any()

    def test_work_that_cannot_be_done(self, trial):
        trial.load(rows_of_actions([Mode(1), Order(9000, 0)]))
        with pytest.raises(ValueError, match="does not do this work"):
            trial.work()


WORK = [Reset(), Mode(1), Hold(), Order(5, 3), Order(down=1), Order(2, 1), Order(up=1), Mode(0),
        Hold(2), Jog(0b010101, 9), Jog(0, 2)]


@pytest.mark.compiler
class TestResets:
    @pytest.mark.parametrize(("mistake", "found"), [
        pytest.param(
            Mistake("x.coils", lambda right, _: right ^ 0b0010), "the coil word of x is illegal",
            marks=pytest.mark.long, id="illegal"),
        pytest.param(
            Mistake("x.orange", lambda right, at: Mux(at("x.moved"), ~at("x.orange"), right)),
            "the coil word of x jumps", id="jump"),
        pytest.param(
            Mistake("x.moved", lambda _, at: at("drivers.x.step") & at("x.rested")),
            "a reset moves x", marks=pytest.mark.long, id="moves"),
        pytest.param(
            Mistake("sequencer.refused", reset_less=True),
            "controller.sequencer.refused is not as from power-up after a reset",
            marks=pytest.mark.long, id="keeps"),
    ])
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
