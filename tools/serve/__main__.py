"""Serve a simulated machine: its serial line on a pseudo-terminal or TCP port."""

import argparse
import asyncio
import sys

from fresa_boards.boards import BOARDS
from tb.engines import Engine
from tb.machines import machines

from ..console import Parser, UserError, command, known, say, whole
from ..web import stopping
from .machines import Served, build, servable
from .service import HOST, Service, check_port
from .switches import Switches
from .typed import Typed

__all__ = ["main"]

ABOUT = """\
Simulates the gateware of a machine and connects its serial line to a pseudo-terminal, whose path it
prints. Open that like the serial port of the real machine: with a terminal program, or with
Python's pyserial. The baud rate that a program sets does not matter. With --tcp the line is also
a TCP port of this computer.

Simulated time is real time where the computer is fast enough; if it falls behind, that is said.
All connected programs receive what the machine sends; what it sends while none is connected is
lost. Lines of several programs are sent one after the other. Ctrl-C ends the simulation.

Commands that can be typed here:

  limit x on    presses the limit switch of an axis, if it has any, or of a plotter's motor, l or
                r; limit x off releases it
  door on       switches another input on, of those that the machine has; door off
  break         holds the line to the machine low for two bytes' time, since neither a
                pseudo-terminal nor TCP carries a break condition
"""

EPILOG = """\
machines:
{machines}

Other inputs that can be switched, on a board as far as they have a pin, and its reset:
{contacts}

Options of the machine are as for python -m tools.build:  python -m tools.serve single --help  shows
those of one.

examples:
  python -m tools.serve single
      Open the printed path in another terminal:  picocom --echo /dev/pts/7
      Type :x100 and Return: the motor goes to 100, and it answers ok. For a machine whose
      lines end with line feed:  picocom --echo --omap crlf /dev/pts/7

  python -m tools.serve {example} --tcp 4000
      Also for  nc 127.0.0.1 4000,  and as socket://127.0.0.1:4000 for pyserial. Any program and
      any person on this computer can connect to that port.

  python -m tools.serve single --ramp 1000 --top-speed 600
      A machine with a ramp.

  python -m tools.serve gcode --board icepi-zero
      The same as it is on that board, between its pins and contacts.

  python -m tools.serve single --speed 10
      Ten times real time, if the computer is fast enough; max is without a limit.

engines:
  cxxrtl     the gateware as C++; needs a C++ compiler; by far the faster one
  amaranth   Amaranth's own simulator; always available; slower than real time, and too slow for
             some machines

The simulated clock is lower than the board's, so a bit takes fewer clocks: the line is no slower
than that of the real machine all the same, and a motor has its speed.
"""


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    # Each machine adds options of its own, so its name is looked up first.
    given = sys.argv[1:] if argv is None else argv
    served_by_name = servable()
    named = next((name for name in given if name in served_by_name), None)
    listed = "\n".join(f"  {name:<12}{each.how.about}" for name, each in served_by_name.items())
    contacts = "\n".join(f"  {name:<12}{', '.join(each.how.contacts)}"
                         for name, each in served_by_name.items() if each.how.contacts)
    parser = Parser(prog="python -m tools.serve", machines=True, description=ABOUT,
                    epilog=EPILOG.format(machines=listed, contacts=contacts,
                                         example=list(served_by_name)[-1]))
    parser.add_argument("machine", metavar="MACHINE", help="which one, see below")
    parser.add_argument("--tcp", metavar="PORT", type=whole(0, 65535),
                        help="also serve a TCP port; 0 for any free one")
    parser.add_argument("--speed", metavar="TIMES", type=_speed, default=1.0,
                        help="times as fast as the real machine, or max (default: 1)")
    parser.add_argument("--board", metavar="NAME", choices=BOARDS,
                        help="behind the pins of a board, with its levels, its start-up and its "
                             "debouncing, and what a small one leaves out: one of %(choices)s")
    parser.add_argument("--engine", metavar="NAME", choices=["cxxrtl", "amaranth"],
                        help="see below (default: the fastest available)")
    if named is not None:
        served_by_name[named].add_options(parser.add_argument_group(named))
    args, unknown = parser.parse_known_args(given)
    if args.machine in machines() and args.machine not in served_by_name:
        raise UserError(f"{args.machine} has no serial line")
    served = served_by_name[known(args.machine, served_by_name, "machine")]
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    served = served.chosen(args)
    if args.board is not None:
        try:
            served = served.on(BOARDS[args.board])
        except ValueError as error:
            raise UserError(f"{error}: leave out --board, or choose another") from error
    if args.tcp is not None:
        check_port(args.tcp)
    engine, period = build(served, args.engine)
    asyncio.run(_serve(engine, period, served, args))
    return 0


async def _serve(engine: Engine, period: int, served: Served,
                 args: argparse.Namespace) -> None:
    """Serve until Ctrl-C."""
    speed = args.speed and args.speed * period * served.how.baud
    with stopping() as stop:
        async with Service(engine, period, speed=speed, port=args.tcp) as service:
            say(service.path)
            if service.port is not None:
                say(f"socket://{HOST}:{service.port}")
            if sys.stdout is not None:
                sys.stdout.flush()
            stopped = asyncio.create_task(stop.wait())
            switches = Switches(served.switches, service, served.further_switches)
            typed = asyncio.create_task(_listen(Typed(service, switches, served.contacts)))
            await asyncio.wait([stopped, service.ended], return_when=asyncio.FIRST_COMPLETED)
            stopped.cancel()
            typed.cancel()
            if service.ended.done():
                raise UserError(service.ended.result())


async def _listen(typed: Typed) -> None:
    """Execute commands from stdin, if there is one."""
    if sys.stdin is not None:
        await typed.listen(sys.stdin.fileno())


def _speed(text: str) -> float | None:
    """Parse a multiple of real time; None for no limit."""
    if text == "max":
        return None
    try:
        speed = float(text)
    except ValueError:
        speed = 0.0
    if not 0.001 <= speed <= 1000:
        raise argparse.ArgumentTypeError(f"must be 0.001 to 1000, or max, not {text!r}")
    return speed


if __name__ == "__main__":
    raise SystemExit(main())
