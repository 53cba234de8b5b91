# pyright: reportGeneralTypeIssues=false

"""Size and speed of every component, and of every machine without a board, on every family."""

import argparse
import json
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from amaranth import Cat, Elaboratable, Module, Mux, Signal, signed
from amaranth.back import rtlil
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.arithmetic import arc_formulas, line_formulas
from fresa.clock import CLOCK
from fresa.drive import RateGenerator, StepDirDriver
from fresa.machines import Mill
from fresa_boards.flow import ECP5, GOWIN, ICE40, Flow, run
from fresa_boards.programs import ProgramError, last_words
from tb.machines import machines
from tb.registry import components
from tools.console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    known,
    say,
    write_atomically,
)
from tools.machines.options import values_of

__all__ = ["Family", "Framed", "StepChain", "main", "parts"]

ABOUT = """\
Prints for every component, with the parameters with which machines are built, and for every
machine without a board, what it takes on an iCE40 (HX8K), an ECP5 (speed 6) and a Gowin GW2AR:
look-up tables and flip-flops as Yosys counts them, block RAMs, and the fastest clock by place and
route, between registers that stand at its ports. All of it takes some 20 minutes on two cores;
--no-fmax leaves out place and route.

step-chain is what other step generators are compared by: a rate in steps/s in, STEP, DIR and ENABLE
with exact times out, and the steps counted in 32 bits.
"""

EPILOG = """\
examples:
  python -m benchmarks.size step-chain axis
  python -m benchmarks.size --no-fmax --family ice40
  python -m benchmarks.size --json sizes.json
"""


@dataclass(frozen=True)
class Family:
    """A part of each family on which components are measured.

    Attributes
    ----------
    flow : Flow
        Its programs.
    synthesis : str
        The pass of Yosys.
    route : list of str
        The command of place and route, which reads ``top.json``.
    constraints : str
        What it reads as ``top.cst``.
    """

    flow: Flow
    synthesis: str
    route: list[str]
    constraints: str = ""


_ROUTE = ["--json", "top.json", "--report", "top.timing.json", "--freq", "100"]

FAMILIES = {
    "ice40": Family(ICE40, "synth_ice40", [
        "nextpnr-ice40", "--hx8k", "--package", "ct256", "--pcf-allow-unconstrained", *_ROUTE]),
    "ecp5": Family(ECP5, "synth_ecp5", [
        "nextpnr-ecp5", "--25k", "--speed", "6", "--package", "CABGA381",
        "--lpf-allow-unconstrained", *_ROUTE]),
    "gowin": Family(GOWIN, "synth_gowin", [
        "nextpnr-himbaechel-gowin", "--device", "GW2AR-LV18QN88C8/I7", "--vopt",
        "family=GW2A-18C", "--vopt", "cst=top.cst", *_ROUTE],
        # It wants a place for each pin.
        "".join(f'IO_LOC "{pin}" {place}; IO_PORT "{pin}" IO_TYPE=LVCMOS33;\n' for pin, place in
                {"clk": 4, "rst": 72, "feed": 73, "load": 74, "out": 77}.items())),
}


class StepChain(wiring.Component):
    """A rate generator, a driver, and a count of its steps.

    Parameters
    ----------
    modulus, max_rate : int
        See :class:`RateGenerator`.
    width, low, setup, hold : int
        See :class:`StepDirDriver`.

    Members
    -------
    rate : In(range(max_rate + 1))
        Steps in ``modulus`` clocks.
    run, direction, enable : In(1)
        Make steps, the way they go, and the power of the motor.
    step_pin, direction_pin, enable_pin : Out(1)
        To the driver module.
    position : Out(signed(32))
        Steps made.
    """

    def __init__(self, *, modulus: int, max_rate: int, width: int, low: int, setup: int,
                 hold: int) -> None:
        self._rate = RateGenerator(modulus=modulus, max_rate=max_rate)
        self._driver = StepDirDriver(width=width, low=low, setup=setup, hold=hold)
        super().__init__({
            "rate": In(range(max_rate + 1)), "run": In(1), "direction": In(1), "enable": In(1),
            "step_pin": Out(1), "direction_pin": Out(1), "enable_pin": Out(1),
            "position": Out(signed(32))})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.rate = rate = self._rate
        m.submodules.driver = driver = self._driver
        m.d.comb += [
            rate.rate.eq(self.rate), rate.moved.eq(driver.moved),
            driver.step.eq(self.run & rate.due), driver.direction.eq(self.direction),
            driver.enable.eq(self.enable), self.step_pin.eq(driver.step_pin),
            self.direction_pin.eq(driver.direction_pin), self.enable_pin.eq(driver.enable_pin),
        ]
        with m.If(driver.moved):
            m.d.sync += self.position.eq(self.position + Mux(self.direction, 1, -1))
        return m


class Framed(Elaboratable):
    """A component between registers, behind three pins, so that any number of ports has place.

    Attributes
    ----------
    feed, load, out : Signal
        The pins: what is shifted through the registers at its inputs, when those at its outputs
        take them, and what is shifted out of these.
    """

    def __init__(self, component: wiring.Component) -> None:
        self._component = component
        self.feed, self.load, self.out = (Signal(name=name) for name in ("feed", "load", "out"))

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.component = dut = self._component
        given, taken = [], []
        for _, member, value in dut.signature.flatten(dut):
            (given if member.flow is In else taken).append(
                value.as_value() if hasattr(value, "as_value") else value)
        inputs, outputs = Cat(*given), Cat(*taken)
        shift, caught, load = Signal(len(inputs)), Signal(len(outputs)), Signal()
        m.d.sync += [shift.eq(Cat(self.feed, shift)), load.eq(self.load),
                     caught.eq(Mux(load, outputs, caught << 1)), self.out.eq(caught[-1])]
        offset = 0
        for value in given:
            m.d.comb += value.eq(shift[offset:offset + len(value)])
            offset += len(value)
        return m


def parts() -> dict[str, Callable[[], wiring.Component]]:
    """Return what makes each component and machine, with the parameters that are built."""
    found: dict[str, Callable[[], wiring.Component]] = {}
    for name, each in components().items():
        case = next((case for case in each.cases if case.real), each.cases[0])
        found[name] = lambda each=each, case=case: each.make(**case.parameters)
    # Rates up to 250 000 steps/s, and what else 18 bits express, so that none needs a limit.
    found["step-chain"] = lambda: StepChain(modulus=CLOCK, max_rate=2**18 - 1, width=95, low=95,
                                            setup=33, hold=33)
    found["formulas"] = line_formulas
    found["arc-formulas"] = arc_formulas
    for name, machine in machines().items():
        values = values_of(argparse.Namespace(), machine.options)
        found[name] = lambda machine=machine, values=values: machine.make(
            **machine.real(CLOCK, **values))
    return found | {"mill": Mill}


def _run(words: list[str], folder: Path, *, may_fail: bool = False) -> None:
    log: list[str] = []
    if run(words, folder, log.append) and not may_fail:
        raise ProgramError(f"{words[0]} failed: {last_words(''.join(log))}")


def count(family: Family, make: Callable[[], wiring.Component]) -> dict[str, int]:
    """Count the cells of a component alone."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        _synthesise(family, rtlil.convert(make(), name="top", emit_src=False), folder)
        return family.flow.count(folder, "top")


def fmax(family: Family, make: Callable[[], wiring.Component]) -> float:
    """Return the fastest clock of a component between registers, in MHz."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        top = Framed(make())
        text = rtlil.convert(top, name="top", ports=[top.feed, top.load, top.out], emit_src=False)
        _synthesise(family, text, folder)
        (folder / "top.cst").write_text(family.constraints)
        _run(family.route, folder, may_fail=True)  # slower than the 100 MHz that it aims at
        try:
            return family.flow.timing(folder, "top").fmax_mhz
        except (OSError, ValueError):
            raise ProgramError(f"{family.route[0]} failed: it leaves no report") from None


def _synthesise(family: Family, text: str, folder: Path) -> None:
    (folder / "top.il").write_text(text, encoding="utf-8")
    _run(["yosys", "-q", "-p", f"read_rtlil top.il; {family.synthesis} -top top -json top.json; "
          "tee -q -o top.cells.json stat -json"], folder)


def line(name: str, sizes: Mapping[str, dict]) -> str:
    """Return the figures of a component in a line."""
    return f"{name:20}" + "".join(
        f"{each['luts']:>7} {each['flip_flops']:>5} {each['block_rams']:>3} "
        f"{each['fmax_mhz'] if 'fmax_mhz' in each else '':>6}  " for each in sizes.values())


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.size", description=ABOUT, epilog=EPILOG,
                    machines=True)
    parser.add_argument("components", metavar="COMPONENT", nargs="*", help="which; all")
    parser.add_argument("--family", choices=FAMILIES, action="append",
                        help="one family; may be repeated (default: all)")
    parser.add_argument("--no-fmax", dest="fmax", action="store_false",
                        help="count cells alone, without place and route")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    made = parts()
    names = [known(name, made, "component") for name in args.components] or list(made)
    families = {name: FAMILIES[name] for name in args.family or FAMILIES}
    check_output(args.json)
    for family in families.values():
        needed = [["yosys"], family.route[:1] if args.fmax else ["yosys"]]
        if lacking := family.flow.missing(needed):
            raise UserError(f"{lacking}, or leave Fmax out with --no-fmax")

    say(f"{'':20}" + "".join(f"{name:>7}{'':>17}" for name in families))
    say(f"{'':20}" + "".join(f"{'LUTs':>7} {'FFs':>5} {'RAM':>3} {'MHz':>6}  " for _ in families))
    found: dict[str, dict[str, dict]] = {}
    with Progress(len(names) * len(families), "builds", f"measuring{FIRST_TIME}") as progress:
        for name in names:
            found[name] = {}
            for label, family in families.items():
                sizes: dict = count(family, made[name])
                if args.fmax:
                    sizes["fmax_mhz"] = round(fmax(family, made[name]), 1)
                found[name][label] = sizes
                progress.advance()
            say(line(name, found[name]))
    if args.json:
        write_atomically(args.json, (json.dumps(found, indent=1) + "\n").encode())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
