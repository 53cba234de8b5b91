"""Run a bench, or list all."""

import argparse
import difflib
import os
import sys
import textwrap
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import NoReturn

from .bench import Bench, CheckFailed
from .benches import benches, groups
from .machines import added, split_option

__all__ = ["main"]

ABOUT = """\
Benches: each runs a part of the gateware on Amaranth's simulator, checks it, and prints the result
in one or two lines. Without a name they are listed.
"""

EPILOG = """\
examples:
  {prog}
      List the benches.

  {prog} coil-driver
      Run one.

  {prog} motion-sequencer --vcd motion.vcd
      Also write its waveform, and the save file motion.gtkw for GTKWave:
          gtkwave motion.gtkw

  {prog} all
      Run them all.

Clocks are counted from 1; one takes 20 ns in the waveform. When a check fails, the marker of
GTKWave is at its clock.

exit status: 0 if all checks passed, 1 if a check failed, 2 if the command cannot be carried out.
"""


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line."""

    def error(self, message: str) -> NoReturn:
        self.exit(2, f"error: {message} (see {self.prog} --help)\n")


def main(argv: list[str] | None = None, *, prog: str = "python -m tb") -> int:
    """Run the command.

    Parameters
    ----------
    argv : list of str, optional
        Its arguments; by default those of the process.
    prog : str
        Name of the command, for help and errors.

    Returns
    -------
    int
        The exit status.
    """
    with ExitStack() as stack:
        try:
            folders, rest = split_option(sys.argv[1:] if argv is None else argv)
            stack.enter_context(added(folders))
        except ValueError as wrong:
            return error(str(wrong))
        return _run(rest, prog)


def _run(argv: Sequence[str], prog: str) -> int:
    parser = Parser(prog=prog, description=ABOUT, epilog=EPILOG.format(prog=prog),
                    allow_abbrev=False, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", metavar="NAME", nargs="?", help="the bench to run, or all")
    parser.add_argument("--vcd", metavar="FILE", type=Path, help="write the waveform to a file")
    parser.add_argument("--machines", metavar="FOLDER", default=argparse.SUPPRESS,
                        help="add the machines of a folder; may be repeated")
    args = parser.parse_args(argv)
    try:
        if args.vcd is not None and args.name in (None, "all"):
            parser.error("--vcd goes with one bench")
        if args.name is None:
            print(listing())
            print(f"\n{prog} NAME runs one, {prog} all runs all; see also --help.")
            return 0
        if args.name == "all":
            return run_all()
        if args.name not in (known := benches()):
            return error(f"no bench is named {args.name!r}; {nearest(args.name, prog)}")
        return run_one(known[args.name], args.vcd)
    except BrokenPipeError:
        # The reader of the output has gone. Python flushes stdout once more at exit: give it a
        # sink.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return 1
    except KeyboardInterrupt:
        return error("interrupted", status=130)


def error(message: str, *, status: int = 2) -> int:
    """Print an error; return the exit status."""
    print(f"error: {message}", file=sys.stderr)
    return status


def listing() -> str:
    """Return the names of all benches, one per line, by group."""
    width = max(map(len, benches()))
    lines = []
    for group, members in groups().items():
        lines += [group, *(f"  {bench.name:{width}}  {bench.shows}" for bench in members)]
    return "\n".join(lines)


def nearest(name: str, prog: str) -> str:
    """Suggest similar names, or else the command that lists them."""
    names = list(benches())
    near = [known for known in names if name and name in known]
    near += [known for known in difflib.get_close_matches(name, names) if known not in near]
    return f"did you mean {' or '.join(near[:3])}?" if near else f"{prog} lists them"


def run_one(bench: Bench, vcd: Path | None) -> int:
    """Run a bench and print its result."""
    status = 0
    try:
        result = bench.run(vcd)
    except CheckFailed as failure:
        result, status = f"FAILED at {failure}", 1
    except OSError as reason:
        return error(f"cannot write {reason.filename or vcd}: {reason.strerror or reason}")
    print(textwrap.fill(f"{bench.name}: {result}", 100, subsequent_indent="  "))
    if vcd is not None:
        print(f"wrote {vcd} and {vcd.with_suffix('.gtkw')}")
    return status


def run_all() -> int:
    """Run every bench, and print a line for each."""
    failed, known = [], benches()
    width = max(map(len, known))
    for number, bench in enumerate(known.values(), start=1):
        print(f"{number:2}/{len(known)} {bench.name:{width}}  ", end="", flush=True)
        begun = time.perf_counter()
        try:
            bench.run()
        except CheckFailed as failure:
            failed.append(bench.name)
            print(f"FAILED at {failure}")
        else:
            print(f"passed in {time.perf_counter() - begun:.2f} s")
    print(f"{len(known) - len(failed)} of {len(known)} benches passed"
          + (f"; failed: {', '.join(failed)}" if failed else ""))
    return 1 if failed else 0


if __name__ == "__main__":
    raise SystemExit(main())
