"""Waveform files of every kind, whole and broken, become arrays or one line of error."""

import os
import shutil
import subprocess
from fractions import Fraction

import numpy as np
import pytest

from tools.console import UserError
from tools.wave import names
from tools.wave.reader import LATEST, Wave

needs = {name: pytest.mark.skipif(shutil.which(name) is None, reason=f"{name} is missing")
         for name in ("iverilog", "ghdl", "verilator")}

VERILOG = """
`timescale 1ns/1ps
module t;
  reg clk = 0; reg [3:0] \\esc.q = 0; reg [99:0] wide; real r = 1.5; integer i = -3; reg [2:0] x;
  always #5 clk = ~clk;
  always @(posedge clk) \\esc.q <= \\esc.q + 1;
  initial begin
    $dumpfile("t.out"); $dumpvars(0, t);
    #12 wide = 100'd1 << 80; x = 3'b1x0; #10 x = 5; r = -2.25; #20 $finish;
  end
endmodule
"""

VHDL = """
library ieee; use ieee.std_logic_1164.all; use ieee.numeric_std.all;
entity t is end;
architecture a of t is
  type states is (rest, moving);
  signal state : states := rest;
  signal clk : std_logic := '0';
  signal n : unsigned(7 downto 0);
  signal i : integer := -5;
begin
  process begin
    wait for 10 ns; clk <= '1'; state <= moving; n <= x"5A"; i <= 7;
    wait for 10 ns; clk <= '0'; wait;
  end process;
end;
"""


def rows(wave: Wave, path: str) -> list[tuple[int, object]]:
    """All changes of a signal: times and values."""
    trace = wave.trace(next(signal for signal in wave.signals if signal.path == path))
    return [(int(time), trace.value(row)) for row, time in enumerate(trace.times)]


class TestVCD:
    def test_names_of_states(self, mill):
        wave = Wave(mill)
        state, = (s.path for s in wave.signals if s.name == "motion_state_state")
        assert {"REST/0", "DECIDE/3"} <= {value for _, value in rows(wave, state)}
        assert wave.tick == Fraction(1, 10**15) and wave.format == "VCD"

    def test_every_kind_of_value(self, vcd):
        wave = Wave(vcd(
            "wire 1 a bit\nwire 70 b wide\nreal 64 c real\nstring 1 d text\ninteger 32 e whole\n"
            "event 1 f event\nwire 4 g \\odd.name",
            "#0|xa|b1" + "0" * 69 + " b|r-1.5 c|sIDLE d|b" + "1" * 32 + " e|b1x0z g"
            "|#7|1a|1f|b11 g|#9|za|1f"))
        assert rows(wave, "top.bit") == [(0, "x"), (7, 1), (9, "z")]
        assert rows(wave, "top.wide") == [(0, 1 << 69)]
        assert rows(wave, "top.real") == [(0, -1.5)]
        assert rows(wave, "top.text") == [(0, "IDLE")]
        assert rows(wave, "top.whole") == [(0, (1 << 32) - 1)]
        assert len(rows(wave, "top.event")) == 2
        assert rows(wave, "top.odd.name") == [(0, "1x0z"), (7, 3)]
        kinds = {signal.name: signal.kind for signal in wave.signals}
        assert kinds == {"bit": "bits", "wide": "bits", "real": "real", "text": "text",
                         "whole": "signed", "event": "event", "name": "bits"}
        assert wave.span == (0, 9)

    def test_of_one_time_the_last_value_counts(self, vcd):
        """Glitches between two settled values are left out, and so is what changes nothing."""
        wave = Wave(vcd("wire 1 a a", "#0|0a|#5|1a|0a|1a|#6|0a|1a|#8|0a"))
        assert rows(wave, "top.a") == [(0, 0), (5, 1), (8, 0)]

    def test_nan_again_is_no_change(self, vcd):
        wave = Wave(vcd("real 64 a a", "#0|rnan a|#5|r1 a|rnan a|#6|r1 a|#7|rnan a"))
        assert [time for time, _ in rows(wave, "top.a")] == [0, 6, 7]

    def test_what_is_looked_at_once_is_not_kept(self, vcd):
        wave = Wave(vcd("wire 1 a a", "#0|1a"))
        signal, = wave.signals
        assert wave.trace(signal, keep=False) is not wave.trace(signal)
        assert wave.trace(signal, keep=False) is wave.trace(signal)

    @pytest.mark.parametrize(("timescale", "tick"), [
        ("100 ps", Fraction(1, 10**10)), ("1 s", Fraction(1)), ("", Fraction(1, 10**9))])
    def test_timescale(self, vcd, timescale, tick):
        assert Wave(vcd("wire 1 a a", "#3|1a", timescale=timescale)).tick == tick

    def test_before_the_first_change_nothing_is_known(self, vcd):
        wave = Wave(vcd("wire 1 a a\nwire 8 b b", "#0|1a|#30|b101 b"))
        trace = wave.trace(wave.signals[1])
        assert [trace.at(time) for time in (0, 29, 30, 99)] == ["x", "x", 5, 5]

    def test_no_change_at_all(self, vcd):
        wave = Wave(vcd("wire 1 a a", ""))
        assert rows(wave, "top.a") == [] and wave.span == (0, 0)
        assert wave.trace(wave.signals[0]).at(5) == "x"

    def test_more_changes_than_a_block(self, vcd):
        count = 20_000
        wave = Wave(vcd("wire 16 a a", "|".join(
            f"#{2 * n}|b{'x' if n == 9000 else format(n, 'b')} a" for n in range(count))))
        trace = wave.trace(wave.signals[0])
        assert len(trace) == count and trace.unknown.sum() == 1
        known = ~trace.unknown
        assert np.array_equal(trace.times, 2 * np.arange(count))
        assert np.array_equal(trace.numbers[known], np.arange(count)[known])
        assert trace.value(9000) == "x" * 16

    def test_edges_need_both_levels(self, vcd):
        wave = Wave(vcd("wire 1 a a", "#0|xa|#1|1a|#2|0a|#3|1a|#4|xa|#5|0a"))
        trace = wave.trace(wave.signals[0])
        assert trace.edges(rising=True).tolist() == [3]
        assert trace.edges(rising=False).tolist() == [2]

    def test_what_would_reach_the_terminal_is_escaped(self, tmp_path):
        path = tmp_path / "a.vcd"
        path.write_bytes(b"$timescale 1 ns $end\n$scope module t $end\n"
                         b"$var string 1 ! a\x1b[31m $end\n$upscope $end\n"
                         b"$enddefinitions $end\n#0\ns\x1b[2J !\n")
        wave = Wave(path)
        assert wave.signals[0].path.isprintable()
        assert str(wave.trace(wave.signals[0]).value(0)).isprintable()


@pytest.mark.icarus
@needs["iverilog"]
@pytest.mark.parametrize("kind", ["VCD", "FST"])
def test_icarus(tmp_path, kind):
    (tmp_path / "t.v").write_text(VERILOG)
    subprocess.run(["iverilog", "-o", "t.vvp", "t.v"], cwd=tmp_path, check=True)
    subprocess.run(["vvp", "-n", "t.vvp", *["-fst"] * (kind == "FST")], cwd=tmp_path, check=True,
                   capture_output=True)
    wave = Wave(tmp_path / "t.out")
    assert wave.format == kind
    assert rows(wave, "t.wide") == [(0, "x" * 100), (12000, 1 << 80)]
    assert rows(wave, "t.x") == [(0, "xxx"), (12000, "1x0"), (22000, 5)]
    assert rows(wave, "t.r") == [(0, 1.5), (22000, -2.25)]
    assert rows(wave, "t.esc.q")[:3] == [(0, 0), (5000, 1), (15000, 2)]
    assert next(signal.kind for signal in wave.signals if signal.path == "t.i") == "signed"


@pytest.mark.ghdl
@needs["ghdl"]
@pytest.mark.parametrize("kind", ["GHW", "FST", "VCD"])
def test_ghdl(tmp_path, kind):
    (tmp_path / "t.vhd").write_text(VHDL)
    for step in (["-a"], ["-e"]):
        what = "t.vhd" if step == ["-a"] else "t"
        subprocess.run(["ghdl", *step, "--std=08", what], cwd=tmp_path, check=True)
    option = {"GHW": "--wave", "FST": "--fst", "VCD": "--vcd"}[kind] + "=t.wave"
    subprocess.run(["ghdl", "-r", "--std=08", "t", option], cwd=tmp_path, check=True)
    wave = Wave(tmp_path / "t.wave")
    assert wave.format == kind
    if kind != "VCD":  # GHDL leaves states out there
        path, = (signal.path for signal in wave.signals if signal.name == "state")
        assert rows(wave, path) == [(0, "rest"), (10_000_000, "moving")]
    path, = (signal.path for signal in wave.signals if signal.name == "n")
    assert rows(wave, path) == [(0, "u" * 8), (10_000_000, 0x5A)]


def test_verilator_tells_ranges_and_one_signal_by_several_names(tmp_path):
    path = tmp_path / "v.vcd"
    path.write_text(
        "$version Generated by VerilatedVcd $end\n$timescale 1ps $end\n\n"
        " $scope module TOP $end\n  $var wire  1 # clk $end\n"
        "  $scope module t $end\n   $var wire  1 # clk $end\n   $var wire  4 $ count [3:0] $end\n"
        "  $upscope $end\n $upscope $end\n$enddefinitions $end\n\n\n"
        "#0\n0#\nb0000 $\n#5000\n1#\nb0001 $\n")
    wave = Wave(path)
    assert {(signal.path, signal.bits) for signal in wave.signals} == {
        ("TOP.clk", 1), ("TOP.t.clk", 1), ("TOP.t.count", 4)}
    assert names.one(wave, "t.clk").id == names.one(wave, "TOP.clk").id
    assert rows(wave, "TOP.t.count") == [(0, 0), (5000, 1)]


HEAD = "$timescale 1 ns $end\n$scope module t $end\n$var wire 2 ! a $end\n"
END = "$upscope $end\n$enddefinitions $end\n"


class TestBroken:
    @pytest.mark.parametrize("content", [
        b"", b"\0" * 3000, b"hello", b"\x89PNG\r\n\x1a\n" + bytes(range(256)),
        HEAD.encode(),  # breaks off in its declarations
        (HEAD + "$upscope $end\n" * 9 + END + "#1\nb1 !\n").encode(),
        (HEAD + END + "#1\nb1 !\nb1 unheard\nqqq\n").encode(),
        (HEAD + END + "#1\nb10101010 !\n#2\nr1.5 !\n").encode(),
        b"GHDLwave\n\x10\x01\x01\x04\x08\x00\x00STR",
        b"\x00\x00\x00\x00\x00\x00\x00\x01\x49" + bytes(300),
    ])
    def test_one_line_and_nothing_of_rust(self, tmp_path, content, capfd):
        """A panic is no traceback here, and its own words do not reach the terminal."""
        from tools.wave.__main__ import main

        path = tmp_path / "bad.vcd"
        path.write_bytes(content)
        assert main(["stats", str(path), "*"]) == 2
        out, err = capfd.readouterr()
        assert out == "" and err.startswith("error: cannot read") and err.count("\n") == 1
        assert "panicked" not in err and len(err) < 400

    def test_what_breaks_off_among_its_changes_is_read_so_far(self, mill, tmp_path):
        data = mill.read_bytes()
        path = tmp_path / "part.vcd"
        path.write_bytes(data[:len(data) * 3 // 4])
        whole, part = Wave(mill), Wave(path)
        clock = next(signal.path for signal in part.signals if signal.name == "clk")
        some = rows(part, clock)
        assert 100 < len(some) < len(rows(whole, clock))
        # The last line may be torn.
        assert some[:-1] == rows(whole, clock)[:len(some) - 1]

    def test_stdout_and_stderr_work_afterwards(self, tmp_path, capfd):
        path = tmp_path / "bad.vcd"
        path.write_text(HEAD + END + "#1\nb1 !\nb1 unheard\n")
        wave = Wave(path)
        with pytest.raises(UserError, match="its contents are malformed"):
            wave.trace(wave.signals[0])
        print("still here", flush=True)
        assert capfd.readouterr() == ("still here\n", "")

    def test_time_that_goes_back_is_left_out_quietly(self, vcd, capfd):
        wave = Wave(vcd("wire 1 a a", "#10|1a|#5|0a|#20|0a"))
        assert rows(wave, "top.a") == [(10, 1), (20, 0)]
        assert capfd.readouterr() == ("", "")

    def test_no_such_file_and_no_file(self, tmp_path):
        with pytest.raises(FileNotFoundError):
            Wave(tmp_path / "none.vcd")
        os.mkfifo(tmp_path / "pipe")
        for path in (tmp_path, tmp_path / "pipe"):
            with pytest.raises(UserError, match="not a file"):
                Wave(path)

    def test_too_wide(self, vcd, wave):
        """Each change of such a signal would take memory: nothing of the file is read but names."""
        path = vcd("wire 4000000000 a a\nwire 1 b b", "#0|b1 a|0b")
        assert "4000000000 bits" in wave("list", path)[1]
        assert "a signal of 4000000000 bits" in wave("at", path, "0", "b")[2]
        path = vcd("wire 1048576 a a", "#0|b1 a")
        assert wave("at", path, "0", "a", "--radix", "a=dec")[1].split()[-1] == "1"

    def test_too_late(self, vcd):
        wave = Wave(vcd("wire 1 b b", f"#0|0b|#{LATEST + 1}|1b"))
        for ask in (lambda: wave.trace(wave.signals[0]), lambda: wave.span):
            with pytest.raises(UserError, match="too large"):
                ask()
