"""Inspect waveforms: values, changes, times, steps, differences, timing diagrams."""

import os
import sys

from ..console import Parser, UserError, command
from . import compare, draw, measure, show, steps, view
from .child import go_on_in_child
from .options import LEFT

__all__ = ["main"]

ABOUT = """\
Reads a waveform of any simulator, a VCD, FST or GHW file, and prints what is requested.

  signals   the end of a path is enough (ready, x.count) if it is unique, or if the scope of one
              match contains all the others; * ? [ ] are patterns
  times     12us, 1.5ms, 300clk: clock 1 is the first rising edge, and values at a clock are those
            after its edge
"""

EPILOG = f"""\
examples:
  python -m tb mill --vcd mill.vcd
      Make a waveform.

  python -m tools.wave list mill.vcd
      Print its signals.

  python -m tools.wave find mill.vcd 'rise ready'
      Print the times at which it becomes ready.

  python -m tools.wave find --help
      Describe a subcommand, with its options and examples.

exit status: 0 on success, 1 if find finds nothing, diff a difference or steps a fault, 2 if the
command cannot be carried out, {LEFT} if the output pipe is closed early, as head does.
"""

SUBCOMMANDS = (show.list_signals, show.at, show.table, measure.find, measure.stats,
               compare.diff, steps.steps, draw.draw_wave, view.view)


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.wave", description=ABOUT, epilog=EPILOG)
    subparsers = parser.add_subparsers(title="subcommands", metavar="SUBCOMMAND", required=True)
    for subcommand in SUBCOMMANDS:
        subcommand(subparsers)
    args = parser.parse_args(argv)
    try:
        status = args.run(args)
        if sys.stdout is not None:
            sys.stdout.flush()
        return status
    except BrokenPipeError:
        # Python flushes stdout once more at exit: give it a sink.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        return LEFT
    except MemoryError:
        raise UserError(f"{args.file} does not fit into memory") from None


if __name__ == "__main__":
    go_on_in_child()
    raise SystemExit(main())
