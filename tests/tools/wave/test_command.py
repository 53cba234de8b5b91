"""The command as people use it: list, at, table, find, stats, and its manners."""

import json
import os
import shlex
import shutil
import signal
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tools.__main__ import commands
from tools.wave import trace
from tools.wave.__main__ import SUBCOMMANDS, main
from tools.wave.options import LEFT
from tools.wave.trace import collect

ROOT = Path(__file__).parents[3]

UNTIED = """
from tools.wave import child
from tools.wave.__main__ import main
child._end_with = lambda parent: None
child.go_on_in_child()
raise SystemExit(main())
"""


class TestList:
    def test_tree_with_widths(self, vcd, wave):
        path = vcd("wire 1 a clk\nwire 34 b order\nwire 16 c \\order.x\n$scope module x $end\n"
                   "string 1 d state\nreal 64 e level\n$upscope $end", "#0|1a")
        assert wave("list", path) == (0, (
            "top\n  clk      1 bit\n  order    34 bits\n    x      16 bits\n  x\n"
            "    state  text\n    level  real\n"), "")

    def test_pattern(self, vcd, wave):
        path = vcd("wire 1 a one\nwire 2 b two", "#0|1a")
        status, out, _ = wave("list", path, "t?o")
        assert status == 0 and "two" in out and "one" not in out
        assert wave("list", path, "x*") == (2, "", f"error: {path} has no signal like 'x*'\n")

    def test_json(self, vcd, wave):
        path = vcd("wire 1 a one\nstring 1 b two", "#0|1a")
        assert json.loads(wave("list", path, "--json")[1]) == [
            {"path": "top.one", "bits": 1, "kind": "bits"},
            {"path": "top.two", "bits": 0, "kind": "text"}]

    def test_scopes_without_end(self, vcd, wave):
        path = vcd("wire 1 a one", "#0|1a", scope=".".join(["s"] * 500))
        status, out, _ = wave("list", path)
        assert status == 0 and max(map(len, out.splitlines())) < 100


class TestAt:
    def test_values_as_they_are_read(self, clocked, wave):
        status, out, _ = wave("at", clocked, "5clk", "count", "state", "ready", "word")
        assert status == 0
        assert [line.split() for line in out.splitlines()] == [
            ["45ns", "(5clk)"], ["top.count", "0x5"], ["top.state", "MOVING/1"],
            ["top.ready", "0"], ["top.word", "5"]]

    def test_unknown_and_radix(self, clocked, wave):
        status, out, _ = wave("at", clocked, "12clk", "word", "count", "--radix", "count=bin")
        assert status == 0 and "top.word   z01" in out and "top.count  0b1100" in out

    def test_json(self, clocked, wave):
        assert json.loads(wave("at", clocked, "46ns", "count", "state", "--json")[1]) == {
            "seconds": 4.6e-8, "time": "46ns", "clock": 5,
            "values": {"top.count": 5, "top.state": "MOVING/1"}}

    def test_after_the_end_it_stays_as_it_was(self, clocked, wave):
        assert wave("at", clocked, "9s", "count")[1].startswith("200ns (20clk)\n  top.count  0x4")

    def test_infinite_numbers_are_json(self, vcd, wave):
        path = vcd("real 64 a a", "#0|rinf a")
        assert json.loads(wave("at", path, "0", "a", "--json")[1])["values"] == {"top.a": "inf"}


class TestTable:
    def test_a_row_each_change_within(self, clocked, wave):
        _, out, _ = wave("table", clocked, "ready", "state", "--from", "4clk", "--to", "12clk")
        assert [line.split() for line in out.splitlines()] == [
            ["time", "clk", "ready", "state"], ["35ns", "4", "0", "REST/0"],
            ["45ns", "5", "0", "MOVING/1"], ["95ns", "10", "1", "MOVING/1"],
            ["115ns", "12", "1", "REST/0"]]
        assert len({len(line) for line in out.splitlines()}) == 1

    def test_json(self, clocked, wave):
        rows = json.loads(wave("table", clocked, "count", "--json")[1])
        assert [row["values"]["top.count"] for row in rows] == [n % 16 for n in range(21)]

    def test_more_rows_than_a_block(self, vcd, wave):
        path = vcd("wire 16 a a", "|".join(f"#{n}|b{n:b} a" for n in range(10_000)))
        rows = json.loads(wave("table", path, "a", "--json")[1])
        assert [row["values"]["top.a"] for row in rows] == list(range(10_000))


class TestFind:
    @pytest.mark.parametrize(("expression", "lines"), [
        ("rise ready", [["25ns", "3clk"], ["95ns", "10clk"]]),
        ("ready", [["25ns", "3clk", "for", "10ns", "(1clk)"],
                   ["95ns", "10clk", "for", "30ns", "(3clk)"]]),
        ('state == "MOVING"', [["45ns", "5clk", "for", "70ns", "(7clk)"]]),
        ("count > 0xD and not ready", [["135ns", "14clk", "for", "20ns", "(2clk)"]]),
        ("unknown word", [["0", "0clk", "for", "45ns", "(5clk)"],
                          ["115ns", "12clk", "for", "85ns", "(8clk)"]]),
    ])
    def test_times(self, clocked, wave, expression, lines):
        status, out, _ = wave("find", clocked, expression)
        assert status == 0 and [line.split() for line in out.splitlines()] == lines

    def test_within(self, clocked, wave):
        status, out, _ = wave("find", clocked, "rise ready", "--from", "26ns")
        assert status == 0 and out.split() == ["95ns", "10clk"]
        # What holds at the start began before it.
        status, out, _ = wave("find", clocked, "ready", "--from", "30ns", "--to", "40ns")
        assert status == 0 and out.split()[0] == "25ns"
        assert wave("find", clocked, "ready", "--from", "35ns", "--to", "40ns") == (1, "", "")

    def test_json(self, clocked, wave):
        found = json.loads(wave("find", clocked, "ready", "--json")[1])
        assert found[0] == {"seconds": 2.5e-8, "time": "25ns", "clock": 3,
                            "for": {"seconds": 1e-8, "time": "10ns", "clock": 1}}
        status, out, _ = wave("find", clocked, "count > 99", "--json")
        assert status == 1 and json.loads(out) == []

    def test_states_of_a_bench(self, mill, wave):
        status, out, _ = wave("find", mill, 'motion_state_state == "DIAGONAL"')
        assert status == 0 and out.count("for 20ns (1clk)") == 3  # there, a cut, home


class TestStats:
    def test_edges_periods_and_jitter(self, clocked, wave):
        facts, clock, bus = json.loads(
            wave("stats", clocked, "ready", "clk", "count", "--json")[1])
        assert (facts["rises"], facts["falls"], facts["changes"]) == (2, 2, 4)
        assert facts["high"]["least"] == {"ticks": 10, "seconds": 1e-8, "clocks": 1}
        assert facts["high"]["mean"]["ticks"] == 20 and facts["high"]["most"]["clocks"] == 3
        assert facts["period"]["mean"] == {"ticks": 70, "seconds": 7e-8, "clocks": 7}
        assert facts["jitter"] == {"ticks": 0, "seconds": 0, "clocks": 0}
        assert (clock["rises"], clock["falls"]) == (20, 20)
        assert clock["period"]["most"] == {"ticks": 10, "seconds": 1e-8}
        assert bus["changes"] == 20 and bus["period"]["least"]["clocks"] == 1

    def test_jitter(self, vcd, wave):
        rises = [0, 10, 20, 32, 40]
        changes = "|".join(f"#{t + 5}|1a|#{t + 7}|0a" for t in rises)
        fact, = json.loads(wave("stats", vcd("wire 1 a a", changes), "a", "--json")[1])
        assert fact["jitter"]["ticks"] == 12 - 8
        assert fact["rises"] == 4  # the first value is no edge

    def test_a_pulse_that_does_not_end_has_no_high_time(self, vcd, wave):
        fact, = json.loads(wave("stats", vcd("wire 1 a a", "#0|0a|#5|1a|#8|0a|#9|1a"), "a",
                                "--json")[1])
        assert fact["rises"] == 2 and fact["high"]["most"]["ticks"] == 3

    def test_in_words(self, clocked, wave):
        _, out, _ = wave("stats", clocked, "ready", "word")
        assert out == (
            "from 0 to 200ns, clock top.clk of 10ns\n"
            "top.ready\n  changes  4, 2 rises, 2 falls\n"
            "  period   least 70ns (7clk), mean 70ns (7clk), most 70ns (7clk)\n"
            "  high     least 10ns (1clk), mean 20ns (2clk), most 30ns (3clk)\n"
            "  jitter   0 (0clk)\n"
            "top.word\n  changes  2\n"
            "  period   least 70ns (7clk), mean 70ns (7clk), most 70ns (7clk)\n"
            "  jitter   0 (0clk)\n  unknown  2 times\n")


class TestManners:
    @pytest.mark.parametrize("arguments", [
        ["list", "none.vcd"], ["at", "{}", "12", "count"], ["at", "{}", "1ns", "nobody"],
        ["table", "{}", "count", "--from", "99clk"], ["find", "{}", "count =="],
        ["stats", "{}", "count", "--clock", "count"], ["stats", "{}"], ["draw", "{}", "count"],
        ["at", "{}", "1ns", "count", "--radix", "count=oct"], [], ["nothing"],
        ["at", "{}", "1ns", "count", "--radix", "=hex"], ["steps", "{}"],
        ["steps", "{}", "count", "--csv", "none/a.csv"], ["steps", "{}", "--pair", "ready"],
        ["draw", "{}", "count", "-o", "a.txt"], ["draw", "{}", "only:", "-o", "a.svg"],
        ["draw", "{}", "count", "-o", "a.svg", "--width", "3"], ["diff", "{}", "none.vcd"],
        ["diff", "{}", "{}", "--map", "count"], ["draw", "{}", "count", "-o", "{}"],
    ])
    def test_a_mistake_is_one_line(self, clocked, wave, arguments, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        before = {path: path.read_bytes() for path in tmp_path.iterdir()}
        status, out, err = wave(*(word.format(clocked) for word in arguments))
        assert (status, out) == (2, "") and err.startswith("error: ") and err.count("\n") == 1
        assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before

    def test_head_is_no_error(self, vcd):
        path = vcd("wire 16 a a", "|".join(f"#{n}|b{n:b} a" for n in range(60_000)))
        for command in (["table", "{}", "a"], ["find", "{}", "change a", "--json"]):
            child = subprocess.Popen(
                [sys.executable, "-m", "tools.wave", *(word.format(path) for word in command)],
                cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            assert child.stdout is not None and child.stderr is not None
            assert child.stdout.readline()
            child.stdout.close()
            assert child.stderr.read() == b""
            child.stderr.close()
            assert child.wait() == LEFT

    def test_little_output_and_nobody_who_reads_it(self, clocked):
        """It is only when all is done that so little is written."""
        reader, writer = os.pipe()
        os.close(reader)
        try:
            ended = subprocess.run(
                [sys.executable, "-m", "tools.wave", "find", clocked, "rise ready"], cwd=ROOT,
                stdout=writer, stderr=subprocess.PIPE,
                env={name: value for name, value in os.environ.items()
                     if name != "PYTHONUNBUFFERED"})
        finally:
            os.close(writer)
        assert (ended.returncode, ended.stderr) == (LEFT, b"")

    def test_the_status_of_an_early_end_of_output_is_in_the_help(self, capsys):
        for words in ([], ["find"], ["diff"], ["steps"]):
            with pytest.raises(SystemExit):
                main([*words, "--help"])
            assert LEFT not in (0, 1, 2)  # which have a meaning
            shown = " ".join(capsys.readouterr().out.split())
            assert f"{LEFT} if the output pipe is closed early" in shown

    @pytest.fixture
    def hangs_up(self):
        """Let SIGHUP end what is started, also where nohup keeps it from us."""
        before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
        yield
        signal.signal(signal.SIGHUP, before)

    @pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no child")
    @pytest.mark.parametrize(("number", "tied"), [
        (signal.SIGTERM, True), (signal.SIGHUP, True), (signal.SIGTERM, False),
        (signal.SIGHUP, False),
        pytest.param(signal.SIGKILL, True, marks=pytest.mark.skipif(
            not sys.platform.startswith("linux"), reason="nothing can be done about it"))])
    def test_what_ends_the_command_ends_its_child(self, vcd, hangs_up, number, tied):
        """The child waits for its pipe to be read; if it went on, it would write all the rest.

        Untied is as on a system that does not end it by itself.
        """
        path = vcd("wire 16 a a", "|".join(f"#{n}|b{n:b} a" for n in range(60_000)))
        program = (["-m", "tools.wave"] if tied else ["-c", UNTIED])
        with subprocess.Popen([sys.executable, *program, "table", path, "a"], cwd=ROOT,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE) as parent:
            assert parent.stdout is not None and parent.stderr is not None
            assert parent.stdout.readline()
            parent.send_signal(number)
            assert parent.wait(60) == -number
            assert len(parent.stdout.read()) < 300_000  # of 1.8 MB
            assert parent.stderr.read() == b""

    def test_moments_are_few_at_a_time(self, monkeypatch):
        rng = np.random.default_rng(7)
        traces = []
        for count in (0, 1, 50, 90):
            times = np.unique(rng.integers(0, 200, count)).tolist()
            traces.append(collect([(times, list(range(len(times))))], len(times), kind="bits",
                                  bits=8))
        monkeypatch.setattr(trace, "BLOCK", 7)
        blocks = list(trace.moments(traces, 20, 150, [1, 2, 1, 3]))
        wanted = {20} | {int(time) * factor for some, factor in zip(
            traces, [1, 2, 1, 3], strict=True) for time in some.times
            if 20 < time * factor <= 150}
        assert np.concatenate(blocks).tolist() == sorted(wanted)
        assert max(map(len, blocks)) <= 7 * len(traces) and len(blocks) > 5
        assert list(trace.each(np.arange(20), np.arange(20) * 2)) == [(n, 2 * n) for n in range(20)]

    def test_a_reader_that_dies_is_one_line(self, tmp_path):
        """An FST with more signals than any memory holds ends the process that reads it."""
        header = (bytes(15) + b"\x0a" + struct.pack("<d", 2.718281828459045)  # start, end, e
                  + b"".join(n.to_bytes(8, "big") for n in (1, 0, 1, 1, 1)) + bytes(257))
        blocks = [(0, header),
                  (3, b"".join(n.to_bytes(8, "big") for n in (1, 1 << 43)) + b"\x01")]
        path = tmp_path / "a.fst"
        path.write_bytes(b"".join(bytes([kind]) + (8 + len(data)).to_bytes(8, "big") + data
                                  for kind, data in blocks))
        ended = subprocess.run([sys.executable, "-m", "tools.wave", "list", path], cwd=ROOT,
                               capture_output=True, text=True)
        assert (ended.returncode, ended.stdout) == (2, "")
        assert ended.stderr.startswith("error: ") and ended.stderr.count("\n") == 1

    def test_each_subcommand_has_help_with_examples(self, capsys):
        for name in ("list", "at", "table", "find", "stats", "diff", "steps", "draw", "view"):
            with pytest.raises(SystemExit) as stop:
                main([name, "--help"])
            out = capsys.readouterr().out
            assert stop.value.code == 0 and f"python -m tools.wave {name} " in out.partition(
                "examples:")[2]
            assert max(map(len, out.splitlines())) <= 100
            assert "--json" in out
        assert len(SUBCOMMANDS) == 9

    def test_the_list_of_commands_has_packages(self, tmp_path):
        assert "wave" in commands()
        guard = 'if __name__ == "__main__":\n    pass\n'
        for name, text in (("one", f'"""Do one."""\n{guard}'), ("two", '"""Nothing to run."""\n')):
            (tmp_path / name).mkdir()
            (tmp_path / name / "__main__.py").write_text(text)
        assert commands(tmp_path) == {"one": "Do one."}


@pytest.mark.parametrize("subcommand", ["list", "at", "table", "find", "stats", "steps", "draw",
                                        "view"])
def test_examples_of_the_help_work(wave, mill, tmp_path, monkeypatch, capsys, subcommand):
    """Those that read the waveform of the bench; the help shows how to make it."""
    for name in ("mill.vcd", "mill.gtkw"):
        shutil.copy(mill.with_name(name), tmp_path)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        main([subcommand, "--help"])
    lines = [line.removeprefix("  python -m tools.wave ")
             for line in capsys.readouterr().out.splitlines()
             if line.startswith(f"  python -m tools.wave {subcommand} mill.vcd")]
    assert lines
    for line in lines:
        arguments = shlex.split(line.partition(" | ")[0])
        if subcommand == "view" and "--no-open" not in arguments:
            arguments.append("--no-open")
        status, _, err = wave(*arguments)
        assert (status, err) == (0, ""), line
