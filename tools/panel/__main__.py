"""Show the panel of the stage on a page, for the machine or for its simulation."""

import argparse
import asyncio
import importlib.util
import sys
import webbrowser
from contextlib import AsyncExitStack, nullcontext

from tb.engines import CXXRTLEngine, Engine

from ..console import Parser, UserError, command, say, whole
from ..serve import Served, Service, Switches, build
from ..web import redirect, serve, stopping
from .panel import Panel
from .routes import panel_site
from .settings import folder
from .simulated import Simulated
from .stage import MACHINE, SERVED, TOP_SPEED

__all__ = ["main"]

ABOUT = """\
Serves a page to this computer only: the panel of a stage. It shows the position of the three axes,
jogs them while a button or a key is held, and moves to stored points.

It prints an address; open it in a browser, choose the serial port, and press Connect. Ctrl-C stops
the machine and ends the panel. Position, speeds and points are saved in a file. If the machine was
switched off meanwhile, its position is restored when it is connected again.
"""

EPILOG = f"""\
examples:
  python -m tools.panel
      The page offers all serial ports of this computer.

  python -m tools.panel /dev/ttyUSB0 --open
      This port is selected; a browser is opened.

  python -m tools.panel --simulate
      Without a machine: its gateware runs in simulation, in real time, if there is a C++ compiler.
      Its limit switches are pressed on the page. Its position and points are saved separately.

  python -m tools.panel --simulate --backlash 4 4 0
      The same, with backlash that the machine compensates.

  python -m tools.panel socket://127.0.0.1:4000
      A machine that python -m tools.serve {MACHINE} --tcp 4000 runs.

files:
  ~/.config/fresa/panel.json, or fresa/panel.json in XDG_CONFIG_HOME; with --simulate
  panel-simulated.json there.
"""


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; return its exit status."""
    parser = Parser(prog="python -m tools.panel", description=ABOUT, epilog=EPILOG)
    parser.add_argument("serial", metavar="PORT", nargs="?", help="serial port of the machine")
    parser.add_argument("--simulate", action="store_true", help="run the machine in simulation")
    parser.add_argument("--port", metavar="N", type=whole(0, 65535), default=0,
                        help="port of the page (default: any that is free)")
    parser.add_argument("--open", action="store_true", help="open the page in a browser")
    served = SERVED
    served.add_options(parser.add_argument_group("with --simulate, as it was built"))
    args = parser.parse_args(argv)
    if not args.simulate and served.options(args) != served.options(parser.parse_args([])):
        raise UserError("a machine at a PORT has the options that it was built with: leave them "
                        "out, or use --simulate")
    if args.original:
        raise UserError("with --original the machine does not answer, which the panel needs: leave "
                        "it out")
    if args.top_speed < TOP_SPEED:
        raise UserError(f"the panel's speeds go up to {TOP_SPEED} steps/s: --top-speed must not "
                        "be less")
    if args.simulate and args.serial:
        raise UserError("with --simulate there is no PORT: leave out one of them")
    if importlib.util.find_spec("serial") is None:
        raise UserError("pyserial is missing: pip install -e '.[host]'")
    # A button cannot be held on the slow engine.
    served = served.chosen(args)
    machine = build(served, CXXRTLEngine.name) if args.simulate else None
    asyncio.run(_serve(machine, served, args))
    return 0


async def _serve(machine: tuple[Engine, int] | None, served: Served,
                 args: argparse.Namespace) -> None:
    """Serve until Ctrl-C."""
    with stopping() as stop:
        async with AsyncExitStack() as stack:
            simulated, name, failed = None, "panel.json", asyncio.Future()
            if machine is not None:
                engine, period = machine
                service = await stack.enter_async_context(
                    Service(engine, period, speed=period * served.how.baud))
                switches = Switches(served.switches, service)
                simulated = Simulated(service, switches)
                name, failed = "panel-simulated.json", service.ended
            panel = Panel(folder() / name, args.serial, simulated=simulated)
            stack.push_async_callback(panel.close)
            address = await stack.enter_async_context(serve(panel_site(panel), args.port))
            say(address)
            if sys.stdout is not None:
                sys.stdout.flush()
            stopped = asyncio.create_task(stop.wait())
            with redirect(address) if args.open else nullcontext() as place:
                if place is not None and not stop.is_set():
                    await asyncio.to_thread(webbrowser.open, place)
                await asyncio.wait([stopped, failed], return_when=asyncio.FIRST_COMPLETED)
            stopped.cancel()
            if failed.done():
                raise UserError(failed.result())


if __name__ == "__main__":
    raise SystemExit(main())
