"""What connecting is made of: to wait until the machine stands still, and know where it is."""

import asyncio

from fresa_host import TimedOut
from fresa_host import positioner_lines as lines
from fresa_host.heard import SETTLED
from fresa_host.positioner_lines import AXES, POINTS, Refusal, Steps

from .line import Line

__all__ = ["PATIENCE", "WITNESS", "ZERO", "find_place", "rest"]

#: Seconds that a machine has for standing still.
PATIENCE = 2.0

ZERO = Steps(0, 0, 0)

#: The point that is `ZERO` in the machine, except on the way to what the user calls so.
WITNESS = POINTS[-1]

#: A line that is always refused, for a reason that no other has here: so what was before is known.
FENCE = b"VEL MOT1 0\n"

#: Times that a machine is asked whether it was reset, or told its place, and reports in which it
#: must answer or be there.
TRIES = 3
MUTE = 10


async def find_place(line: Line, left: Steps) -> tuple[Steps, bool]:
    """Stop what moves; give where the machine is, and whether it had to be told that.

    It is told where it was left, if it was reset, and left elsewhere. It was if it stands at
    (0, 0, 0) and has no `WITNESS`: a reset forgets points, and somebody's origin does not. To ask
    for that point moves nothing, for that is (0, 0, 0) too. If another program has put it
    elsewhere, the speed is the lowest and the order to stop right behind: an axis makes a step at
    most.

    Raises
    ------
    LineLost
        If the port is gone.
    TimedOut
        If no machine reports, or it does not stop, or the line is too bad to know.
    """
    # What somebody had typed before may be taken for the beginning of the first line.
    line.say(b"CONNECT\n" + lines.stop() + b"CONNECT\n")
    await line.hear()
    line.say(lines.stop())
    place = await rest(line)
    if place == ZERO != left and await was_reset(line):
        return await tell_place(line, left), True
    return await rest(line), False


async def rest(line: Line) -> Steps:
    """Wait until two reports say the same; end all movement until they do."""
    loop = asyncio.get_running_loop()
    end, before = loop.time() + PATIENCE, None
    while loop.time() < end:
        if isinstance(said := await line.hear(), Steps):
            if said == before:
                return said
            if before is not None:
                line.halt()
            before = said
    raise TimedOut(f"the positioner at {line.port} does not stop: it moves")


async def was_reset(line: Line) -> bool:
    """Ask a machine that stands at `ZERO` for its `WITNESS`."""
    slow = b"".join(lines.speed(axis, 1) for axis in AXES)
    for _ in range(TRIES):
        line.say(slow + lines.go_to(WITNESS) + lines.stop() + FENCE)
        answers, quiet = [], 0
        while quiet < (SETTLED if answers else MUTE):
            said = await line.hear()
            if isinstance(said, Refusal):
                answers.append(said.reason)
            quiet = quiet + 1 if isinstance(said, Steps) else 0
        if sorted(answers) in (["RANGE"], ["EMPTY", "RANGE"]):
            return "EMPTY" in answers
    raise TimedOut(f"the line to the positioner at {line.port} is disturbed")


async def tell_place(line: Line, steps: Steps) -> Steps:
    """Tell it where it is, until it says so itself."""
    for _ in range(TRIES):
        line.say(lines.place(steps))
        for _ in range(MUTE):
            if await line.hear() == steps:
                return steps
    raise TimedOut(f"the line to the positioner at {line.port} is disturbed")
