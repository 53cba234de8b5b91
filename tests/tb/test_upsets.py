# amaranth: UnusedElaboratable=no

"""Upsets and resets: what the machine is struck with, and that what comes of it is seen."""

import json
import subprocess
from itertools import islice

import numpy as np
import pytest

from fresa.drive import coil
from fresa.motion import sequencer
from tb.boards import mill
from tb.contracts.contract import Bug
from tb.engines import source
from tb.engines.build import missing
from tb.faults.upsets import Trial, Verdict
from tb.faults.work import actions, rows_of_actions, rows_of_stimulus
from tb.models.mill import MillInputs, MillModel
from tb.script import Hold, Jog, Mode, Order, Reset, record
from tb.stimulus import chance, orders
from tb.yosys import YOSYS
from tools.faults.strike import KEPT, PACE, TRAVEL, machine

compiled = pytest.mark.skipif(missing() is not None, reason=missing() or "")


def model() -> MillModel:
    return MillModel(period=PACE.period, scan_bits=PACE.scan_bits, z_travel=TRAVEL)


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
        stimulus = chance(1, 0, 3000)
        rows = rows_of_stimulus(stimulus)
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
    trial = Trial(machine(guard=guard))
    trial.load(rows_of_actions(actions(1, 100)))
    trial.work()
    yield trial
    trial.close()


@compiled
@pytest.mark.compiler
class TestUpsets:
    def test_they_are_the_flip_flops_of_the_netlist(self, trial, guard, tmp_path):
        (tmp_path / "mill.il").write_text(source.rtlil(machine(guard=guard)))
        script = ("read_rtlil mill.il; synth_xilinx -family xc3se -flatten -top mill; "
                  "tee -q -o stat.json stat -json")
        subprocess.run([*YOSYS, "-q", "-p", script], cwd=tmp_path, check=True, capture_output=True)
        cells = json.loads((tmp_path / "stat.json").read_text())["design"]["num_cells_by_type"]
        assert sum(register.width for register in trial.registers) == sum(
            count for cell, count in cells.items() if cell.startswith("FD"))

    def test_what_they_come_to(self, trial, guard):
        verdicts, silent = trial.flips(7, 0, 20_000)
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
        verdicts, silent = trial.flips(1, 0, 3000)
        z = [row for register, row in zip(trial.registers, verdicts, strict=True)
             if register.name.endswith("automatic.z.count")]
        assert all(row[Verdict.HARMLESS] == 0 for row in z)
        assert any(row[Verdict.SILENT] for row in z) != guard
        assert any(upset.place == upset.asked for upset in silent) != guard

    def test_chance_is_of_the_seed_and_the_number(self, trial):
        whole, _ = trial.flips(3, 100, 400)
        parts = trial.flips(3, 100, 150)[0] + trial.flips(3, 250, 250)[0]
        assert (whole == parts).all()
        assert (whole != trial.flips(4, 100, 400)[0]).any()

    def test_work_that_cannot_be_done(self, trial):
        trial.load(rows_of_actions([Mode(1), Order(9000, 0)]))
        with pytest.raises(ValueError, match="does not do this work"):
            trial.work()


WORK = [Reset(), Mode(1), Hold(), Order(5, 3), Order(down=1), Order(2, 1), Order(up=1), Mode(0),
        Hold(2), Jog(0b010101, 9), Jog(0, 2)]


@compiled
@pytest.mark.compiler
class TestResets:
    @pytest.mark.parametrize(("bug", "found"), [
        (Bug(coil, "Cat(~orange, ~black, orange, black)", "Cat(~orange, black, orange, black)"),
         "the coil word of x is illegal"),
        (Bug(coil, "orange.eq(black ^ ~self.direction)", "orange.eq(~orange)"),
         "the coil word of x jumps"),
        (Bug(coil, "self.step & rested & ~ResetSignal()", "self.step & rested"),
         "a reset moves x"),
        (Bug(sequencer, "refused = Signal()", "refused = Signal(reset_less=True)"),
         "controller.sequencer.refused is not as from power-up after a reset"),
    ], ids=["illegal", "jump", "moves", "keeps"])
    def test_mistakes_are_found(self, bug, found):
        with bug.planted():
            design = mill(pace=PACE, z_travel=TRAVEL)
            source.rtlil(design)
        trial = Trial(design)
        trial.load(rows_of_actions(WORK))
        rng = np.random.default_rng(1)
        clocks, _, wrong = trial.resets(rng.integers(1, 40, 500).tolist(), [1] * 500, KEPT)
        trial.close()
        assert wrong is not None
        assert wrong.what == found and wrong.clock == clocks < 20_000

    def test_none_without_a_mistake(self, trial):
        trial.load(rows_of_actions(WORK))
        clocks, steps, wrong = trial.resets([30] * 500, [2] * 500, KEPT)
        assert wrong is None
        assert clocks == 500 * 32 and steps > 500
