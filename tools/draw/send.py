"""Sends a drawing to a machine, pen by pen, with holds."""

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress

from fresa_host import GCode, JobStopped, MachineError
from fresa_host.gcode_lines import program

from ..console import Progress, UserError, warn
from ..keyboard import Ended, Keyboard
from .program import Section

__all__ = ["send"]

POLL_S = 0.1
"""Seconds from one look at the keyboard to the next."""


def send(sections: Sequence[Section], open_machine: Callable[[], GCode], *, home: bool = False
         ) -> float:
    """Draw; return how many seconds that has taken.

    Parameters
    ----------
    sections : sequence of Section
        The G-code of each pen. Before each but the first, a Return is waited for.
    open_machine : callable
        Opens the machine.
    home : bool
        Seek the home switches first.

    Raises
    ------
    UserError
        If the machine cannot be opened or is locked, or pens are to be changed and there is no
        keyboard.
    MachineError
        If the machine cannot go on. It was stopped then.
    Ended
        If the keyboard says so. It was stopped then: it stands, with the pen raised.
    """
    blocks = [program(section.lines) for section in sections]
    begun = time.monotonic()
    with (keyboard := Keyboard()).listening():
        if len(sections) > 1 and not keyboard.present:
            raise UserError(f"{len(sections)} pens are to be changed, and there is no keyboard to "
                            "say when that is done: --pens one draws all with one")
        try:
            machine = open_machine()
        except MachineError as error:
            raise UserError(str(error)) from error
        with machine:
            if home:
                with Progress(1, "machines", "homing"):
                    _watched(machine, keyboard, lambda: machine.home())
            elif machine.state == "Alarm":
                raise UserError("the machine is locked, as its place is unknown: home it, by "
                                "--home")
            with Progress(sum(map(len, blocks)), "lines", "drawing") as progress:
                for index, section in enumerate(sections):
                    if index:
                        _change_pens(keyboard, index + 1, section.pen)
                    _draw(machine, keyboard, section, progress)
    return time.monotonic() - begun


def _draw(machine: GCode, keyboard: Keyboard, section: Section, progress: Progress) -> None:
    shown = 0

    def show(done: int, _: int) -> None:
        nonlocal shown
        progress.advance(done - shown)
        shown = done

    def work() -> None:
        machine.stream(section.lines, show)
        machine.wait()

    _watched(machine, keyboard, work)


def _watched(machine: GCode, keyboard: Keyboard, work: Callable[[], object]) -> None:
    """Do what takes long in a thread, while the keyboard may hold, resume, or end it."""
    held = False
    with ThreadPoolExecutor(1) as pool:
        working = pool.submit(work)
        try:
            while not wait([working], POLL_S).done:
                paused = keyboard.paused(held)
                if paused != held:
                    (machine.hold if paused else machine.resume)()
                    warn("held; Return goes on, Ctrl-C ends" if paused else "going on")
                held = paused
        except BaseException:
            machine.stop()
            with suppress(JobStopped):
                working.result()
            raise
        working.result()


def _change_pens(keyboard: Keyboard, number: int, name: str) -> None:
    """Wait until pens are changed."""
    warn(f"change to pen {number}: {name}; then Return goes on, Ctrl-C ends")
    keyboard.interrupts = 1
    while keyboard.paused(True):
        if not keyboard.present:
            raise Ended
        time.sleep(POLL_S)
