"""Sends a drawing to a machine, pen by pen, with holds."""

import re
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from contextlib import suppress

from fresa_host import GCode, JobStopped, MachineError
from fresa_host.gcode_lines import Position, program

from ..console import Progress, UserError, warn
from ..keyboard import Ended, Keyboard
from .program import Section
from .wall import Wall

__all__ = ["send"]

NEAR_MM = 1.0
"""How far a machine may be from the place of rest, and its wall from that of the drawing."""

POLL_S = 0.1
"""Seconds from one look at the keyboard to the next."""


def send(sections: Sequence[Section], open_machine: Callable[[], GCode], wall: Wall, *,
         home: bool = False) -> float:
    """Draw; return how many seconds that has taken.

    Parameters
    ----------
    sections : sequence of Section
        The G-code of each pen. Before each but the first, a Return is waited for.
    open_machine : callable
        Opens the machine.
    wall : Wall
        For which the G-code is made.
    home : bool
        Seek the home switches first.

    Raises
    ------
    UserError
        If the machine cannot be opened, is locked or hangs on another wall, or pens are to be
        changed and there is no keyboard.
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
            area = _area(machine)
            if area is not None:
                _check_wall(*area, wall)
            if home:
                with Progress(1, "machines", "homing"):
                    _watched(machine, keyboard, lambda: machine.home())
                if area is not None:
                    _check_rest(machine.machine_position, area[1], wall)
            elif machine.state == "Alarm":
                raise UserError("the machine is locked, as its place is unknown: home it, by "
                                "--home")
            with Progress(sum(map(len, blocks)), "lines", "drawing") as progress:
                for index, section in enumerate(sections):
                    if index:
                        _change_pens(keyboard, index + 1, section.pen)
                    _draw(machine, keyboard, section, progress)
    return time.monotonic() - begun


def _check_wall(width: float, height: float, wall: Wall) -> None:
    """Refuse a machine of another wall, as far as the size of where it draws tells, in mm."""
    lowest = wall.height - wall.top
    if abs(width - wall.width) > NEAR_MM or not (
            lowest - NEAR_MM <= height < wall.height + NEAR_MM):
        raise UserError(
            f"the machine hangs on another wall, by its $130 and $131: that is {width:g} mm wide, "
            f"and {height:g} mm of its height are drawn on, not {wall.width:g} and at least "
            f"{lowest:g}; see --wall and --top")


def _check_rest(position: Position, height: float, wall: Wall) -> None:
    """Refuse a machine that is not at the place of rest when it has homed: so is its height known.

    Its positions count from the upper right corner of where it draws, which is so high, in mm.
    """
    place = complex(wall.width + position.x, wall.height - height - position.y)
    if abs(place - wall.resting) > NEAR_MM:
        raise UserError(
            f"the machine hangs on another wall, or rests elsewhere: by its position it is at "
            f"{place.real:g},{place.imag:g}, not at {wall.resting.real:g},{wall.resting.imag:g}; "
            "see --wall and --rest")


def _area(machine: GCode) -> tuple[float, float] | None:
    """Return width and height of where the machine draws, in mm, if it says so."""
    said = dict(re.findall(r"^\$(\d+)=([\d.]+)$", "\n".join(machine.command("$$")), re.M))
    return (float(said["130"]), float(said["131"])) if {"130", "131"} <= said.keys() else None


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
