"""Fuzz a serial line, and check the answers and the motors."""

import argparse
import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from textwrap import fill

from tb.engines import CXXRTLEngine
from tb.fuzz import (
    FuzzTarget,
    Outcome,
    Times,
    fuzz,
    measure,
    run_session,
    shortest,
    spread,
)
from tb.machines import machines
from tb.registry import fuzz_targets

from .console import (
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    known,
    say,
    staged,
    whole,
    write_files_atomically,
)

__all__ = ["main"]

ABOUT = """\
Fuzzes the serial line of a machine: valid lines, mutated lines and lines that are too long, random
bytes, bytes without a stop bit, breaks (some begin inside a byte), glitches, noise, and floods of
lines. The results are checked against the description of the protocol, with no model of the
gateware in between:

  each line, valid or not, has one answer, in order and in time; a valid line has its effect
  each step lies on a path that a valid line requested, and comes when the rate demands, to the
  clock; all steps that were requested are made
  a reported position is that of the steps at the pins, less those that take up backlash
  a switch, pressed at any time, blocks the steps towards it and ends the movement that it blocks;
  that is reported once, and sounds the buzzer
  whatever was sent, at the end of each session the machine answers and moves

{machines}

Then step times are measured at the pins, for many rates, each on every motor, all motors at once,
while the line is flooded: the most clocks by which one step is later than another, each compared
with its exact time. Where each comes in the first clock that is not too early this is under 1:
nothing is left beyond that rounding.
"""

EPILOG = """\
machines: {names}

examples:
  python -m tools.fuzz
      100 000 bytes into each line, and 60 rates: some minutes.

  python -m tools.fuzz {example} --bytes 1000000 --seed 7
      A million into one, others than those of the first run.

  python -m tools.fuzz {example} --bytes 0 --rates 1500
      Only step times, of 1500 rates.

Each session has some 20 000 bytes and begins at power-up. If one finds something, as much of it is
left out as can be; what is left is printed, and written as bytes (PREFIX-MACHINE.bin) and as a
waveform of all signals (PREFIX-MACHINE.vcd). The same seed finds it again.

exit status: 0 if nothing was found, 1 if something was, 2 if it cannot be carried out.
"""

_BANDS = (1, 10, 100, 1000, 10_000, 100_000)


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    known_targets = fuzz_targets()
    about = "\n".join(
        fill(target.about, 100, initial_indent=f"  {name:12}", subsequent_indent=" " * 14)
        for name, target in known_targets.items() if target.about)
    example = next((name for name, target in known_targets.items() if target.rates), "MACHINE")
    parser = Parser(prog="python -m tools.fuzz", description=ABOUT.format(machines=about),
                    epilog=EPILOG.format(names=", ".join(known_targets), example=example),
                    machines=True)
    parser.add_argument("names", metavar="MACHINE", nargs="*", help="which (default: all)")
    parser.add_argument("--bytes", metavar="N", type=whole(0, 10**9), default=100_000,
                        help="bytes to send to each (default: %(default)s)")
    parser.add_argument("--rates", metavar="N", type=whole(0, 10**6), default=60,
                        help="rates of which step times are measured, from the least to the most; "
                             "0 for none (default: %(default)s)")
    parser.add_argument("--seed", metavar="S", type=whole(0, 2**32 - 1), default=1,
                        help="seed of what is sent (default: %(default)s)")
    parser.add_argument("--save", metavar="PREFIX", default="fuzz",
                        help="begin of the names of what is written if something is found "
                             "(default: %(default)s)")
    parser.add_argument("--shrink-seconds", metavar="S", type=whole(0, 3600), default=60,
                        help="time to make it shorter (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    chosen = [_target(name, known_targets)
              for name in dict.fromkeys(args.names or known_targets)]
    check_output(args.json)
    if not Path(args.save).parent.is_dir():
        raise UserError(f"cannot write {args.save}-MACHINE.vcd: its folder does not exist")
    if reason := CXXRTLEngine.missing():
        raise UserError(reason)
    facts = {"seed": args.seed, "machines": []}
    for target in chosen:
        own = {"name": target.name, **_fuzz(target, args)}
        if args.rates and target.rates and own["good"]:
            own["times"] = _times(target, args)
            own["good"] = own["times"]["good"]
        facts["machines"].append(own)
    if args.json is not None:
        write_files_atomically({args.json: (json.dumps(facts, indent=2) + "\n").encode()})
        say(f"wrote      {args.json}")
    return 0 if all(own["good"] for own in facts["machines"]) else 1


def _target(name: str, known_targets: Mapping[str, FuzzTarget]) -> FuzzTarget:
    if name in machines() and name not in known_targets:
        raise UserError(f"{name} has no serial line")
    return known_targets[known(name, known_targets, "machine")]


def _fuzz(target: FuzzTarget, args: argparse.Namespace) -> dict:
    """Fuzz a machine; say what came of it, and give it for the JSON."""
    total = dict.fromkeys(("sessions", "bytes", "clocks", "lines", "answers", "blocked", "steps",
                           "timed"), 0)
    deviation, sent, found = 0.0, {}, None
    with Progress(args.bytes, "bytes", target.name) as progress:
        for outcome in fuzz(target, args.seed, args.bytes):
            findings = outcome.findings
            total["sessions"] += 1
            total["clocks"] += outcome.clocks
            for name in ("bytes", "lines", "answers", "blocked", "steps", "timed"):
                total[name] += getattr(findings, name)
            for item in outcome.inputs:
                sent[item.kind] = sent.get(item.kind, 0) + 1
            deviation = max(deviation, findings.deviation)
            progress.advance(findings.bytes)
            if findings.failures:
                found = outcome
                break
    facts = {**total, "deviation": deviation, "pieces": sent, "good": found is None}
    if args.bytes:
        say(f"{target.name:11}" + ", ".join(f"{count} {name}" for name, count in total.items()
                                            if name != "timed"))
        if target.times:
            say(f"           {total['timed']} steps at times that can be told, at most "
                f"{deviation:.4f} clocks apart from them")
    return facts if found is None else facts | _explain(target, found, args)


def _explain(target: FuzzTarget, found: Outcome, args: argparse.Namespace) -> dict:
    """Show what was found, make what finds it shorter, and write it."""
    first = found.findings.failures[0]
    say(f"FOUND      clock {first.clock} of session {found.seed}: {first.message}")
    say(f"shrinking  for up to {args.shrink_seconds} s")
    short = shortest(found.target, found.inputs, args.shrink_seconds)
    least = short.findings.failures[0]
    say(f"shortest   clock {least.clock}: {least.message}")
    shown = [item for item in short.inputs if item.kind != "rest"]
    for item in shown[:20]:
        say(f"             {item}")
    if len(shown) > 20:
        say(f"             and {len(shown) - 20} more")
    data, wave = Path(f"{args.save}-{target.name}.bin"), Path(f"{args.save}-{target.name}.vcd")
    with staged(wave) as path, CXXRTLEngine(found.target.design(), vcd=path) as engine:
        run_session(found.target, engine, short.inputs)
    write_files_atomically({data: b"".join(item.data for item in short.inputs)})
    say(f"wrote      {data} and {wave}")
    return {"found": {"session": found.seed, "clock": first.clock, "message": first.message},
            "shortest": {"clock": least.clock, "message": least.message,
                         "pieces": [str(item) for item in short.inputs],
                         "files": [str(data), str(wave)]}}


def _times(target: FuzzTarget, args: argparse.Namespace) -> dict:
    """Measure step times; print them as a table, and give them for the JSON."""
    assert target.rates is not None
    chosen = spread(target.rates, args.rates)
    measured = []
    motors = target.rates.motors
    with Progress(-(-len(chosen) // motors) * motors, "measurements", "step times") as progress:
        for times in measure(target, chosen, args.seed):
            measured.append(times)
            progress.advance()
    good = all(times.beyond == 0 and times.steps and not times.failures for times in measured)
    say("step times " + f"{'rates':>14} {'steps':>9}  {'apart':>8}  beyond rounding")
    for low, high in zip(_BANDS, _BANDS[1:], strict=False):
        if own := [times for times in measured if low <= min(times.rates) < high]:
            say(f"           {f'{min(min(times.rates) for times in own)}..':>6}"
                f"{max(max(times.rates) for times in own):<8} {_steps(own):>9}  "
                f"{max(times.deviation for times in own):8.4f}  "
                f"{max(times.beyond for times in own)} clocks")
    for times in measured:
        if times.beyond or times.failures or not times.steps:
            message = (times.failures[0].message if times.failures
                       else "steps are not at their times")
            say(f"WRONG      rates {times.rates}, {times.steps} steps: {message}")
    return {"rates": len(chosen), "motors": motors, "steps": _steps(measured),
            "deviation": max(times.deviation for times in measured),
            "beyond_rounding": max(times.beyond for times in measured), "good": good,
            "measured": [{"rates": times.rates, "steps": times.steps,
                          "deviation": round(times.deviation, 6)} for times in measured]}


def _steps(measured: Iterable[Times]) -> int:
    return sum(times.steps for times in measured)


if __name__ == "__main__":
    raise SystemExit(main())
