"""Send a picture, or a list of orders, to a mill over its serial line."""

import argparse
import time
from contextlib import closing
from pathlib import Path

from fresa_host.delivery import ReopenedPort, deliver
from fresa_host.errors import LineLost, MachineError
from fresa_host.jobs import begin_raised, check_cuts
from fresa_host.orders import JobHalfDone, Sender
from fresa_host.port import BAUD

from .console import (
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    say,
    warn,
    whole,
    write_atomically,
)
from .image import add_picture_arguments, picture_from_arguments, prepares_picture
from .job import picture_orders, read_orders, stroke_start, write_orders
from .keyboard import Ended, Keyboard

__all__ = ["main"]

ABOUT = f"""\
Sends a job to a mill that was built with  python -m tools.build --orders serial,  over RS-232 at
{BAUD} baud, and sees it done. JOB is a picture, prepared as python -m tools.image does and milled
the nearest pixel next; or, if its name ends in .txt, a list of orders, one a line:

  go X Y   go there, in steps from the origin (128 are a pixel, 0.56 mm): X rows, Y columns
  up       raise the tool
  down     lower it; while it is down, go leads along one of 8 directions
  # ...    a comment

First bring the tool to the origin by hand, and put SW7 on. A job begins by raising the tool, which
another may have left down: a list that does not is given one  up  more, its order 1. Each order is
carried out once, over whatever line: what is lost or damaged is sent again. If the line is
unplugged it goes on when it is back. Ctrl-C, or p and Return, stops sending: at most two more
orders are carried out. Then Return goes on, and Ctrl-C again (or q and Return) ends; the same
command, but without --from, --again and --force, goes on later, from any computer, for the mill
knows the job. It has forgotten it after a reset and in manual mode, when the origin is another:
then the job begins at order 1, or with --from where you say. A job that is half done
is thrown away by no other job without a question; without a keyboard only --force says yes to it,
and the first Ctrl-C ends.
"""

EPILOG = """\
examples:
  python -m tools.send logo.png --port /dev/ttyUSB0
      Mill a picture.

  python -m tools.send photo.jpg --size 200x200 --thin --port COM3
      Prepare a photograph first; see python -m tools.image --help.

  python -m tools.send logo.png -o logo.txt
      Write the list of its orders, send nothing. Change it, and send that.

  python -m tools.send logo.txt --port /dev/ttyUSB0 --from 1200
      After a power cut, with the tool raised and brought back to the same origin: begin with the
      stroke that order 1200 is in.

exit status: 0 if all is done, 1 if the mill cannot go on, 2 if the job or the port is not right,
130 if you ended it.
"""

SILENT_AFTER_S = 3.0
"""Seconds without an answer after which that is said."""

ANSWER_TIMEOUT_S = 30.0
"""Seconds in which a mill that was never heard must answer."""


class Watch:
    """Shows how a job goes on, and passes on what the keyboard says."""

    def __init__(self, sender: Sender, keyboard: Keyboard, progress: Progress) -> None:
        self._sender, self._keyboard, self._progress = sender, keyboard, progress
        self._shown = sender.done
        self._connected, self._silent, self._resumed = True, False, False
        self._since = time.monotonic()

    def __call__(self, connected: bool) -> None:
        sender = self._sender
        paused = self._keyboard.paused(sender.paused)
        if paused != sender.paused:
            warn(f"paused, {sender.done} of {sender.total} orders done; Return goes on, Ctrl-C "
                 "ends" if paused else "going on")
        sender.paused = paused
        if sender.resumed and not self._resumed:
            self._resumed = True
            warn(f"the mill is at this job: going on behind order {sender.taken} of {sender.total}")
        if sender.done != self._shown:
            self._progress.advance(sender.done - self._shown)
            self._shown = sender.done
        self._line(connected)

    def _line(self, connected: bool) -> None:
        now, sender = time.monotonic(), self._sender
        if connected != self._connected:
            self._connected, self._since = connected, now
            warn("the line is back" if connected else "the port is gone: waiting for it")
        quiet = now - max(self._since, sender.heard or 0)
        if sender.heard is None and quiet > ANSWER_TIMEOUT_S:
            raise UserError("the mill does not answer: is this its port, is it on, and was it "
                            "built with --orders serial?")
        silent = connected and quiet > SILENT_AFTER_S
        if silent and not self._silent:
            warn("the mill does not answer: is the line plugged in, and the mill on?")
        self._silent = silent


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    args = _parser().parse_args(argv)
    if (args.port is None) == (args.output is None):
        raise UserError("say either --port, to send the job, or -o, to write its orders")
    if args.output is not None and (args.first != 1 or args.again or args.force):
        raise UserError("a list has all orders of a job: leave out --from, --again and --force "
                        "with -o")
    check_output(args.output)
    if args.output is not None:
        orders = _orders(args)
        write_atomically(args.output, write_orders(orders))
        say(f"wrote {args.output}: {len(orders)} orders")
        return 0
    try:
        with closing(ReopenedPort(args.port)) as port:
            port.open()  # if it cannot be had, that is said at once
            orders = _orders(args)
            if not args.first <= len(orders):
                raise UserError(f"the job has {len(orders)} orders: --from {args.first} is none "
                                "of them")
            return _send(orders, port, args)
    except LineLost as error:
        raise UserError(str(error)) from error


def _orders(args: argparse.Namespace) -> list:
    """Return all orders of the job."""
    orders = _asked_for(args)
    try:
        check_cuts(orders)
    except ValueError as error:
        raise UserError(str(error)) from error
    return begin_raised(orders)


def _asked_for(args: argparse.Namespace) -> list:
    if args.image.suffix.lower() == ".txt":
        if prepares_picture(args):
            raise UserError(f"{args.image} is a list of orders: leave out what prepares pictures")
        return read_orders(args.image)
    prepared = picture_from_arguments(args)
    say(prepared.summary())
    with Progress(1, "pictures", "ordering the pixels"):
        return picture_orders(prepared.pixels)


def _send(orders: list, port: ReopenedPort, args: argparse.Namespace) -> int:
    def sender(force: bool) -> Sender:
        return Sender(orders, first=stroke_start(orders, args.first), again=args.again, force=force)

    with (keyboard := Keyboard()).listening():
        try:
            return _deliver(sender(args.force), port, keyboard, args)
        except JobHalfDone as other:
            if keyboard.present:
                warn(f"{other}; y and Return begin it all the same, Return alone does not")
            if not keyboard.confirms():
                raise UserError(f"{other}: send that job to go on with it, or this one with "
                                "--force") from other
        return _deliver(sender(True), port, keyboard, args)


def _deliver(sender: Sender, port: ReopenedPort, keyboard: Keyboard,
             args: argparse.Namespace) -> int:
    begun = time.monotonic()
    try:
        with Progress(sender.total, "orders", "milling") as progress:
            progress.advance(sender.done)
            deliver(sender, port, watch=Watch(sender, keyboard, progress))
    except JobHalfDone:
        raise
    except Ended:
        say(f"ended; {sender.done} of {sender.total} orders are done, {sender.taken} taken; "
            + _same(args))
        return 130
    except MachineError as error:
        say(f"{error}")
        say(f"{sender.done} of {sender.total} orders are done; once the tool is back at the same "
            f"origin, --from {min(sender.done + 1, sender.total)} goes on")
        return 1
    say(f"done: {sender.total} orders in {time.monotonic() - begun:.0f} s")
    return 0


def _same(args: argparse.Namespace) -> str:
    """Return which command goes on."""
    given = [("--from", args.first > 1), ("--again", args.again), ("--force", args.force)]
    less = " and ".join(name for name, is_given in given if is_given)
    return "the same command " + (f"without {less} " if less else "") + "goes on"


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="python -m tools.send", description=ABOUT, epilog=EPILOG)
    parser.add_argument("image", metavar="JOB", type=Path, help="a picture, or a list of orders")
    parser.add_argument("--port", metavar="PORT",
                        help="serial port: /dev/ttyUSB0, COM3, or what pyserial takes as a URL")
    parser.add_argument("-o", "--output", metavar="FILE.txt", type=Path,
                        help="write the list of orders there instead")
    parser.add_argument("--from", metavar="N", dest="first", type=whole(1), default=1,
                        help="begin with the stroke that order N is in (default: 1)")
    parser.add_argument("--again", action="store_true",
                        help="begin anew, also where the mill is in the middle of this job")
    parser.add_argument("--force", action="store_true",
                        help="throw away what the mill has half done of another job")
    add_picture_arguments(parser)
    return parser


if __name__ == "__main__":
    raise SystemExit(main())
