# amaranth: UnusedElaboratable=no

"""What ISE is given: pins, options, scripts; and the scripts at work on pretended tools."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from amaranth import Elaboratable, Module, Signal
from amaranth.lib import io, memory
from amaranth.lib.cdc import FFSynchronizer

from fresa_boards.nexys2 import Nexys2_1200Platform, Nexys2Platform

TOOLS = ["xst", "ngdbuild", "map", "par", "trce", "bitgen", "bitgen", "promgen"]


class Demo(Elaboratable):
    """One of each kind of pin: direct, registered, active low, in both directions."""

    def __init__(self, platform):
        def request(*resource) -> io.SingleEndedPort:
            return platform.request(*resource, dir="-")

        self.ports = {
            "go": request("switch", 7),
            "busy": request("led", 7),
            "leds": request("led", 0) + request("led", 1),
            "digits": request("display_7seg_an"),
            "keyboard": request("ps2"),
            "unused": request("button", 3),
        }

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.go = go = io.Buffer("i", self.ports["go"])
        m.submodules.busy = busy = io.Buffer("o", self.ports["busy"])
        m.submodules.leds = leds = io.FFBuffer("o", self.ports["leds"])
        m.submodules.digits = digits = io.FFBuffer("o", self.ports["digits"])
        m.submodules.data = data = io.FFBuffer("io", self.ports["keyboard"].dat)
        on = Signal()
        m.submodules.sync = FFSynchronizer(go.i, on)
        count = Signal(4)
        m.d.sync += count.eq(count + on)
        m.d.comb += [busy.o.eq(on), leds.o.eq(count), digits.o.eq(count)]
        m.d.comb += [data.o.eq(data.i), data.oe.eq(on)]
        return m


class Remembers(Demo):
    """And memories: of 3 block RAMs, of 1, and of what XST likes."""

    def elaborate(self, platform) -> Module:
        m = super().elaborate(platform)
        for name, shape, depth, attrs in [("wide", 5, 8192, {"ram_style": "block"}),
                                          ("small", 2, 2, {"ram_style": "block"}),
                                          ("any", 9, 64, {})]:
            m.submodules[name] = part = memory.Memory(shape=shape, depth=depth, init=[1],
                                                      attrs=attrs)
            port = part.read_port()
            address = Signal.like(port.addr, name=f"{name}_address")
            seen = Signal(name=f"{name}_seen", attrs={"keep": 1})
            m.d.sync += [address.eq(address + 1), seen.eq(port.data.xor())]
            m.d.comb += port.addr.eq(address)
        return m


def demo_plan(board=Nexys2Platform):
    platform = board()
    return platform.prepare(Demo(platform), "demo")


@pytest.fixture(scope="module")
def plan():
    return demo_plan()


@pytest.fixture
def folder(plan, tmp_path) -> Path:
    return plan.extract(tmp_path / "a folder")


@pytest.fixture
def ise(tmp_path) -> Path:
    """A folder of tools that only note how they were called and make the files they name."""
    tools = tmp_path / "pretended tools"
    tools.mkdir()
    for name in set(TOOLS):
        (tools / name).write_text(
            "#!/bin/sh\n"
            'echo "${0##*/} $*" >> calls\n'
            '[ "${0##*/}" != "$FAILS" ] || exit 3\n'
            'for word; do case $word in *.bit|*.mcs) [ -e "$word" ] || echo "$*" > "$word";;\n'
            '    *.twr) echo "Timing errors: ${ERRORS:-0}  Score: 0" > "$word";;\n'
            '    *_map.ncd) echo "  Number of RAMB16s:    ${RAMS:-9} out of      20   45%" '
            '> "${word%.ncd}.mrp";; esac; done\n')
        (tools / name).chmod(0o755)
    return tools


def run(script: Path, *, path: Path | None = None, cwd: Path | None = None, **env: str):
    """Run a script where there is no ISE but the one given."""
    if shutil.which("xst", path="/usr/bin:/bin") or Path("/opt/Xilinx/14.7/ISE_DS").exists():
        pytest.skip("a real ISE is installed here")
    search = f"{path}:/usr/bin:/bin" if path else "/usr/bin:/bin"
    return subprocess.run(
        ["sh", str(script)], env={"PATH": search, **env}, cwd=cwd or "/",
        capture_output=True, text=True, check=False)


class TestFiles:
    def test_names(self, plan):
        assert set(plan.files) == {
            "demo.v", "demo.ucf", "demo.prj", "demo.xst", "build.sh", "build.bat"}
        assert plan.script == "build"

    def test_line_ends(self, plan):
        for name, text in plan.files.items():
            assert text.endswith("\n")
            assert text.count("\r\n") == (text.count("\n") if name == "build.bat" else 0)

    def test_pins(self, plan):
        """Only what is used: the button and the other line of the keyboard are not."""
        assert dict(re.findall(r'^NET "(\S+)" LOC="(\w+)" \|', plan.files["demo.ucf"], re.M)) == {
            "clk50_0__io": "B8",
            "switch_7__io": "R17",
            "led_0__io": "J14",
            "led_1__io": "J15",
            "led_7__io": "R4",
            "display_7seg_an_0__io<0>": "F17",
            "display_7seg_an_0__io<1>": "H17",
            "display_7seg_an_0__io<2>": "C18",
            "display_7seg_an_0__io<3>": "F15",
            "ps2_0__dat__io": "P11",
        }

    def test_pin_attributes(self, plan):
        ucf = plan.files["demo.ucf"]
        assert 'NET "switch_7__io" LOC="R17" | IOSTANDARD=LVCMOS33;\n' in ucf
        assert 'NET "ps2_0__dat__io" LOC="P11" | IOSTANDARD=LVCMOS33 | PULLUP;\n' in ucf

    def test_clock(self, plan):
        ucf = plan.files["demo.ucf"]
        assert 'NET "clk50_0__io" TNM_NET="clk50_0__io";\n' in ucf
        assert 'TIMESPEC "TS_clk50_0__io" = PERIOD "clk50_0__io" 20 ns HIGH 50%;\n' in ucf

    @pytest.mark.parametrize(
        ("board", "part"), [(Nexys2Platform, "500e"), (Nexys2_1200Platform, "1200e")])
    def test_part(self, board, part):
        files = demo_plan(board).files
        assert f"\n-p xc3s{part}-4-fg320\n" in files["demo.xst"]
        for script in ("build.sh", "build.bat"):
            assert files[script].count(f" -p xc3s{part}-fg320-4 ") == 2

    def test_synthesis_options(self, plan):
        first, *lines = plan.files["demo.xst"].splitlines()
        options = dict(line.split(" ") for line in lines)
        assert first == "run"
        assert options["-ifn"] == "demo.prj" and plan.files["demo.prj"] == 'verilog work "demo.v"\n'
        assert (options["-top"], options["-ofn"]) == ("demo", "demo.ngc")
        for switch in ("-fsm_extract", "-shreg_extract", "-equivalent_register_removal"):
            assert options[switch] == "No"
        assert options["-iobuf"] == "Yes"
        assert "-use_new_parser" not in options

    def test_both_scripts_do_the_same(self, plan):
        sh = re.findall(r"^step (.*)$", plan.files["build.sh"], re.M)
        bat = re.findall(r"^call (.*) \|\| goto failed\r$", plan.files["build.bat"], re.M)
        assert sh == bat and [command.split()[0] for command in sh] == TOOLS

    def test_names_of_the_machine_stay_outside(self, plan):
        for text in plan.files.values():
            assert str(Path.home()) not in text and str(Path(__file__).parents[2]) not in text


class TestSameBytes:
    @pytest.mark.parametrize("seed", ["1", "2"])
    def test_any_run(self, plan, seed):
        assert self.digest(PYTHONHASHSEED=seed) == plan.digest().hex()

    def test_any_yosys_on_path(self, plan, tmp_path):
        yosys = tmp_path / "yosys"
        yosys.write_text(f'#!/bin/sh\ntouch "{tmp_path}/called"\necho "Yosys 9.99"\n')
        yosys.chmod(0o755)
        path = f"{tmp_path}:{os.environ['PATH']}"
        assert self.digest(PATH=path, AMARANTH_USE_YOSYS="system") == plan.digest().hex()
        assert not (tmp_path / "called").exists()

    @staticmethod
    def digest(**env: str) -> str:
        code = "import runpy, sys; plan = runpy.run_path(sys.argv[1])['demo_plan']()"
        return subprocess.run(
            [sys.executable, "-c", f"{code}; print(plan.digest().hex())", __file__],
            env={**os.environ, **env}, capture_output=True, text=True, check=True).stdout.strip()


class TestBuildScript:
    def test_syntax(self, folder):
        subprocess.run(["sh", "-n", folder / "build.sh"], check=True)

    def test_makes_two_bitstreams(self, folder, ise):
        result = run(folder / "build.sh", path=ise)
        assert (result.returncode, result.stderr) == (0, "")
        calls = (folder / "calls").read_text().splitlines()
        assert [call.split()[0] for call in calls] == TOOLS
        assert "-pr b" in calls[2]
        assert "-g StartUpClk:JTAGClk" in (folder / "demo_usb.bit").read_text()
        assert "-g StartUpClk:CCLK" in (folder / "demo_flash.bit").read_text()
        assert "-p mcs" in (folder / "demo_flash.mcs").read_text()
        assert "-x xcf04s" in calls[-1] and calls[-1].endswith(" -u 0 demo_flash.bit")
        assert "djtgcfg prog -d Nexys2 -i 0 -f demo_usb.bit\n" in result.stdout

    def test_lists_the_boards_by_the_names_that_they_are_loaded_by(self, folder, ise):
        (ise / "djtgcfg").write_text('#!/bin/sh\necho "Device: Nexys2-1200 ($*)"\nexit 1\n')
        (ise / "djtgcfg").chmod(0o755)
        result = run(folder / "build.sh", path=ise)
        assert result.returncode == 0 and "Device: Nexys2-1200 (enum)\n" in result.stdout
        assert "the board's name as djtgcfg enum lists it" in result.stdout
        assert "djtgcfg enum" in (folder / "build.bat").read_text()

    def test_called_by_its_bare_name(self, folder, ise):
        assert run(Path("build.sh"), path=ise, cwd=folder).returncode == 0
        assert (folder / "demo_flash.mcs").exists()

    def test_without_ise(self, folder):
        result = run(folder / "build.sh")
        assert (result.returncode, result.stdout) == (1, "")
        assert "Install ISE WebPACK 14.7" in result.stderr
        assert "run this script again" in result.stderr
        assert len(result.stderr.splitlines()) < 10
        assert {path.name for path in folder.iterdir()} == set(demo_plan().files)

    def test_finds_ise_by_its_variable(self, folder, ise, tmp_path):
        """The vendor's script expects no arguments, runs into an error, and is none the worse."""
        settings = tmp_path / "Xilinx 14.7" / "ISE_DS" / "settings64.sh"
        (settings.parent / "ISE").mkdir(parents=True)
        settings.write_text(f'[ $# = 0 ] || return\nfalse\nPATH="{ise}:$PATH"\nunset NOTHING[1]\n')
        result = run(folder / "build.sh", XILINX=str(settings.parent / "ISE"))
        assert result.returncode == 0 and (folder / "demo_usb.bit").exists()

    @pytest.mark.parametrize("tool", dict.fromkeys(TOOLS))
    def test_stops_at_the_first_error(self, folder, ise, tool):
        for stale in ("demo_usb.bit", "demo_flash.bit", "demo_flash.mcs"):
            (folder / stale).write_text("stale")
        result = run(folder / "build.sh", path=ise, FAILS=tool)
        assert result.returncode == 3 and f"{tool} failed" in result.stderr
        calls = (folder / "calls").read_text().splitlines()
        assert [call.split()[0] for call in calls] == TOOLS[: TOOLS.index(tool) + 1]
        assert not (folder / "demo_flash.mcs").exists()

    def test_too_slow_makes_no_bitstream(self, folder, ise):
        result = run(folder / "build.sh", path=ise, ERRORS="12")
        assert result.returncode == 1 and "too slow" in result.stderr
        assert not list(folder.glob("*.bit"))

    @pytest.mark.parametrize("rams", ["4", "5", "20"])
    def test_memories_are_in_block_ram(self, ise, tmp_path, rams):
        folder = self.with_memories(tmp_path)
        assert run(folder / "build.sh", path=ise, RAMS=rams).returncode == 0
        assert (folder / "demo_usb.bit").exists()

    @pytest.mark.parametrize("rams", ["0", "3"])
    def test_a_memory_that_was_dropped_makes_no_bitstream(self, ise, tmp_path, rams):
        folder = self.with_memories(tmp_path)
        result = run(folder / "build.sh", path=ise, RAMS=rams)
        assert result.returncode == 1 and not list(folder.glob("*.bit"))
        assert result.stderr == (f"build.sh stopped: {rams} block RAMs, not 4: a memory was "
                                 "dropped, see demo.srp.\n")

    def test_nor_does_a_report_without_block_ram(self, ise, tmp_path):
        folder = self.with_memories(tmp_path)
        result = run(folder / "build.sh", path=ise, RAMS="none")
        assert (result.returncode, "0 block RAMs, not 4" in result.stderr) == (1, True)

    def test_both_scripts_compare_with_the_same_number(self, plan, tmp_path):
        text = (self.with_memories(tmp_path) / "build.bat").read_text()
        assert "if %rams% lss 4 goto dropped\n" in text and "\n:dropped\nset needed=4\n" in text
        assert not any("rams" in plan.files[name] for name in ("build.sh", "build.bat"))

    @staticmethod
    def with_memories(tmp_path) -> Path:
        platform = Nexys2Platform()
        return platform.prepare(Remembers(platform), "demo").extract(tmp_path / "memories")


class TestBuffers:
    def test_no_primitives(self, plan):
        assert not re.search(r"\b(I?O?BUFT?G?|FD[CP]E)\b", plan.files["demo.v"])

    def test_outputs_are_not_tristate(self, plan):
        assert re.findall(r"assign (\w+) = .*'bz;", plan.files["demo.v"]) == ["ps2_0__dat__io"]

    def test_registers_go_to_the_pins(self, plan):
        """With the level of the pin at rest: dark LEDs, dark digits, a keyboard left alone."""
        verilog = plan.files["demo.v"]
        marked = re.findall(r'\(\* IOB = "TRUE" \*\)\n  reg (.*);', verilog)
        assert sorted(marked) == [
            "[1:0] o_ff = 2'h0", "[3:0] o_ff = 4'hf", "i_ff = 1'h0", "o_ff = 1'h0", "oe_ff = 1'h0"]

    def test_synchronisers_are_marked(self, plan):
        assert plan.files["demo.v"].count('(* ASYNC_REG = "TRUE" *)\n  reg') >= 2

    def test_double_rate_refused(self):
        platform = Nexys2Platform()
        with pytest.raises(NotImplementedError, match=r"^DDR buffers need primitives of the"):
            platform.prepare(io.DDRBuffer("o", platform.request("led", 0, dir="-")), "ddr")
