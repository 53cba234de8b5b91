"""The G-code machine under load and faults: what it answers, and where its pins are."""

import os
import random
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import islice
from math import sqrt
from pathlib import Path as FilePath
from typing import NamedTuple

import numpy as np

from fresa.machines.gcode import AXES, GCode
from tb.boards import component
from tb.engines import CXXRTLEngine
from tb.models.gcode_blocks import ProgramModel
from tb.models.gcode_ends import moved
from tb.models.gcode_plan import PlanSettings
from tb.uart import Levels, decode, levels
from tools.console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    check_output,
    command,
    whole,
)
from tools.processes import pool

from .gcode import GRANULE, Figure, report
from .load_sender import (
    BYTE,
    PER_MM,
    SETTINGS,
    Line,
    Machine,
    Path,
    Sender,
    nearest,
    ordered,
)

__all__ = ["figures", "main", "received_ends"]

ABOUT = """\
Runs the G-code machine in simulation, clock by clock, at 16 MHz and 1 Mbaud, which is 16 clocks a
bit and the least that its receiver takes, and compares what it answers with what it was sent, and
its pins with what its lines say:

streaming  a sender that counts characters, with no pause, and asks for a report every 20 ms; short
           lines, absolute and relative, some of them refused; bytes of overrides, and bytes that
           mean nothing, between and within them. First lines as CAM programs write them, some 24
           bytes, and overrides that only make it faster: the line is the limit. Then lines of some
           17 bytes, for which the planner is, as 16 MHz is few for it; and all overrides
overrun    a sender that takes the buffer to be larger than it is: what is lost is answered error:11
noise      bits that flip, breaks, a line that floats, cuts within a byte: then a line feed, and it
           goes to 0. No reset, unless noise has ordered a motion that takes seconds
reaction   `!`, 0x85 and 0x18 at some time of a motion at up to 1 m/s: clocks from the start of the
           byte for which the way that it takes, beyond v²/2a, is one at full speed, and those to
           the last edge of STEP, beyond v / a. The very last step may be later than that: a profile
           ends on a tick, and what is left of its speed may be little for the last one

With --model-hours lines of the same kind, for so long a time of the line, are run on the model of
the machine, which is that of the gateware to the bit from a line to the steps of its block, in
pieces of a minute that begin at rest: each end is compared with the sum of the lines. What is
between the line and the planner is not in that model.

Exit status 1 if one is not as asked.
"""

EPILOG = """\
examples:
  python -m benchmarks.load
  python -m benchmarks.load --seconds 60 --json load.json
      A minute without pause: some half an hour of a core.
  python -m benchmarks.load --seconds 0 --model-hours 1
      Some twenty million lines on the model: one to two hours of a core.

see also: benchmarks.gcode for lines a second and steps a second, benchmarks.end_positions for ends
of arcs, and `python -m tools.fuzz` for answers to whatever comes.
"""

FASTER = b"\x90\x91\x93\x95\x99\x9a\x9b\x9c\x9d"
"""Overrides with which the path gets no slower than at first."""
OVERRIDES = bytes(code for code in range(0x90, 0x9E) if code != 0x98)
NOTHING = bytes([*range(0x80, 0x84), *range(0x86, 0x90), 0x98, 0x9F, *range(0xA2, 0x100)])
"""Bytes that are dropped."""
PLAIN = b"\x90\x95\x99"
"""Overrides that are 100 % again."""
HOME = b"G21G90G94G17G54G49\nG92.1\nG53G0X0Y0Z0\n"
"""Back to where the machine was at power-up, whatever came before."""
BEGIN = b"G21G91G94G1F12000\n"
FEEDS = 100, 400, 1000
"""Mm/s of motions in which it reacts."""
MOST = ((1 << 34) - 1) / 1e6
"""Mm/s² along a path at most, as the planner has them."""
ALLOWED = BYTE + 2 * GRANULE
"""Clocks of a reaction beyond v / a: the byte, the granule that has begun, and one to rest."""
PIECE = 60
"""Seconds of a piece on the model."""
CHUNK = 20_000
"""Lines of which the ends are computed at once."""


def _share(part: int, of: int) -> float:
    return round(100 * part / max(1, of), 2)


def _homed(machine: Machine) -> int:
    """Go to where it was at power-up; return by how many steps it is off there."""
    machine.send(HOME)
    machine.rest()
    return int(abs(machine.position).sum())


def _streaming(machine: Machine, clocks: int, rng: random.Random) -> Iterator[Figure]:
    for name, overrides, short, share, least in (
            ("streaming", FASTER, False, 2, 99.0),
            ("streaming, short lines", FASTER, True, 4, None),
            ("streaming, all overrides", OVERRIDES, True, 4, None)):
        machine.send(BEGIN)
        machine.wait(300 * BYTE)
        made, asked = machine.made.copy(), machine.asked
        reports = len(machine.reports)
        sender = Sender(machine, Path(f"{name} {rng.random()}", length=30, turn=0.1, short=short))
        begin, due = machine.engine.clock, 0
        while machine.engine.clock < begin + clocks // share:
            byte = b""
            if machine.engine.clock >= due:
                due = machine.engine.clock + rng.randrange(SETTINGS.clock // 20)
                byte = bytes([rng.choice(overrides if rng.random() < 0.7 else NOTHING)])
            sender.advance(byte)
        sender.drain()
        seconds = (machine.engine.clock - begin) / SETTINGS.clock
        machine.rest()
        end, steps = ordered([line.move for line in sender.lines])
        expected, found = [line.answer for line in sender.lines], sender.answers
        differing = sum(one != other for one, other in zip(expected, found, strict=False))
        yield Figure(f"{name}: line used", "%", _share(sender.used, sender.clocks), least)
        yield Figure(f"{name}: lines answered", "lines/s", round(len(found) / seconds))
        yield Figure(f"{name}: answers not as they should be", "lines",
                     differing + abs(len(expected) - len(found)), most=0)
        yield Figure(f"{name}: reports that did not come", "reports",
                     machine.asked - asked - len(machine.reports) + reports, most=0)
        yield Figure(f"{name}: reports that are not of the pins", "reports",
                     sum(not each.right for each in machine.reports[reports:]), most=0)
        yield Figure(f"{name}: steps off the end", "steps",
                     int(abs(machine.position - end).sum()), most=0)
        yield Figure(f"{name}: steps that were not ordered", "steps",
                     int(np.maximum(machine.made - made - steps, 0).sum()), most=0)
        machine.send(PLAIN)
        _homed(machine)


def _overrun(machine: Machine, clocks: int, rng: random.Random) -> Iterator[Figure]:
    end, lost, wrong, off, unanswered, lines = machine.engine.clock + clocks, 0, 0, 0, 0, 0
    while machine.engine.clock < end or not lost:
        machine.send(BEGIN)
        machine.wait(300 * BYTE)
        sender = Sender(machine, Path(f"overrun {rng.random()}", length=rng.choice([20, 100]),
                                      turn=9, relative=True), rng.randint(160, 400))
        until = machine.engine.clock + SETTINGS.clock // 10
        while machine.engine.clock < until:
            sender.advance()
        sender.drain()
        machine.rest()
        answers = sender.answers
        lines += len(sender.lines)
        unanswered += abs(len(sender.lines) - len(answers))
        lost += answers.count(b"error:11")
        wrong += sum(each not in (b"ok", b"error:11") for each in answers)
        place, _ = ordered([line.move for line, answer in zip(
            sender.lines, answers, strict=False) if answer == b"ok"])
        off += int(abs(machine.position - place).sum()) + _homed(machine)
    yield Figure("overrun: lines that were sent", "lines", lines)
    yield Figure("overrun: of them answered error:11", "lines", lost, least=1)
    yield Figure("overrun: answers that are neither ok nor that", "lines", wrong, most=0)
    yield Figure("overrun: lines answered twice or not at all", "lines", unanswered, most=0)
    yield Figure("overrun: steps off the sum of lines answered ok", "steps", off, most=0)


def _disturbed(line: Levels, rng: random.Random) -> Levels:
    """Return levels with some of them changed."""
    line, bit = line.copy(), SETTINGS.bit
    kind = rng.choice(["flips", "low", "high", "noise"])
    begin = rng.randrange(len(line))
    end = begin + rng.randint(1, 40 * BYTE)
    if kind == "flips":
        for _ in range(rng.randint(1, 20)):
            at = rng.randrange(len(line))
            line[at:at + rng.randint(1, 2 * bit)] ^= 1
    elif kind == "noise":
        while begin < min(end, len(line)):
            size = rng.randint(1, 2 * bit)
            line[begin:begin + size] = rng.getrandbits(1)
            begin += size
    else:
        line[begin:end] = kind == "high"
    return line


def received_ends(line: Levels) -> int | None:
    """Return how many ends of lines the receiver finds; None if there is a reset among the bytes.

    CR LF is one end.
    """
    ends, after_cr = 0, False
    for _, byte, error, _ in decode(line, SETTINGS.bit):
        if byte == 0x18 and not error:
            return None
        if error or byte < 0x80 and byte not in b"?!~":
            ends += byte in b"\r\n" and not (after_cr and byte == ord("\n") and not error)
            after_cr = byte == ord("\r")
    return ends


def _noise(machine: Machine, clocks: int, rng: random.Random) -> Iterator[Figure]:
    times = resets = off = wrong = silent = moved_on = 0
    end, idle = machine.engine.clock + clocks, np.ones(5 * BYTE, np.uint8)
    while machine.engine.clock < end or not times:
        machine.send(BEGIN)
        machine.wait(300 * BYTE)
        path = Path(f"noise {rng.random()}", length=rng.choice([30, 300]), turn=9)
        text = b"".join(path.line().text for _ in range(6))
        before = len(machine.answers)
        line = np.concatenate([idle, _disturbed(levels(text, SETTINGS.bit), rng), idle,
                               levels(b"\n", SETTINGS.bit), idle])
        machine.play(line)
        machine.wait(SETTINGS.clock // 50)  # noise may have said `!`
        machine.send(b"~")
        ended = machine.rest()
        ends = received_ends(line)
        if not ended:  # it goes on for metres
            resets += 1
            machine.send(b"\x18")
            machine.rest()
        elif ends is not None:
            wrong += abs(len(machine.answers) - before - ends)
        made = machine.made.copy()
        report = machine.report()
        silent += report is None
        off += report is not None and any(abs(at - pins) > 1 for at, pins in zip(
            report.position, machine.position.tolist(), strict=True))
        moved_on += int((machine.made - made).sum())
        off += _homed(machine)
        times += 1
    yield Figure("noise: times that the line was disturbed", "", times)
    yield Figure("noise: of them with a reset, as it went on", "", resets)
    yield Figure("noise: lines answered twice or not at all", "lines", wrong, most=0)
    yield Figure("noise: reports that did not come after it", "reports", silent, most=0)
    yield Figure("noise: steps off the pins, and off 0 at last", "steps", off, most=0)
    yield Figure("noise: steps at rest", "steps", moved_on, most=0)


def _line(rng: random.Random, feed: int) -> tuple[tuple[int, ...], float]:
    """Return a motion long enough for a feed in mm/s, in um, and its acceleration in mm/s²."""
    way = [rng.choice([-1, 1]) * rng.uniform(0.1, 1) for _ in range(AXES)]
    size = sqrt(sum(each * each for each in way))
    way = [each / size for each in way]
    acceleration = min(float(SETTINGS.acceleration[0]) / max(map(abs, way)), MOST)
    length = feed**2 / acceleration + 0.02 * feed
    return tuple(round(1000 * each * length) for each in way), acceleration


class _Reaction(NamedTuple):
    """What came of a command in a motion.

    Attributes
    ----------
    last : int
        Clocks from the start of the byte to the last edge of STEP, beyond v / a.
    after : int
        Steps of an axis, at most, that came later than `ALLOWED` beyond v / a.
    went_on : float
        Clocks for which the way that it took, beyond v²/2a and less a step, is one at full speed.
    off : int
        Steps off the report, the end that was ordered, and 0 at last.
    """

    last: int
    after: int
    went_on: float
    off: int


def _react(machine: Machine, rng: random.Random, kind: str, code: bytes) -> _Reaction:
    feed, clock = rng.choice(FEEDS), SETTINGS.clock
    move, acceleration = _line(rng, feed)
    words = "".join(f"{name}{by / 1000:.3f}" for name, by in zip("XYZ", move, strict=True))
    start = "$J=G21G91" if kind == "jog cancel" else "G21G91G1"
    machine.send(f"{start}{words}F{60 * feed}\n".encode())
    # It is planned in less than a ms, and goes on at full speed for 20.
    machine.wait(int((feed / acceleration + rng.uniform(0.001, 0.018)) * clock))
    begin, made = machine.engine.clock, machine.made.copy()
    machine.send(code)
    braking = int(feed / acceleration * clock)
    machine.wait(braking + ALLOWED - BYTE)
    in_time, report = machine.made.copy(), None
    for _ in range(50):
        machine.wait(clock // 100)
        report = machine.report()
        if report is None or report.state in ("Hold:0", "Idle"):
            break
    axis = max(range(AXES), key=lambda axis: abs(move[axis]))
    step = sqrt(sum(by * by for by in move)) / abs(move[axis]) / PER_MM[axis]  # mm
    way = int(machine.made[axis] - made[axis] - 1) * step
    off = 1 if report is None else int(any(abs(at - pins) > 1 for at, pins in zip(
        report.position, machine.position.tolist(), strict=True)))
    found = _Reaction(
        machine.last - begin - braking, int((machine.made - in_time).max()),
        (way - feed**2 / 2 / acceleration) / feed * clock, off)
    if kind == "hold":
        machine.send(b"~")
        machine.rest()
        off += int(abs(machine.position - nearest(np.array(move))).sum())
    return found._replace(off=off + _homed(machine))


def _reaction(machine: Machine, clocks: int, rng: random.Random) -> Iterator[Figure]:
    for kind, code in (("hold", b"!"), ("jog cancel", b"\x85"), ("reset", b"\x18")):
        end, found = machine.engine.clock + clocks // 3, []
        while machine.engine.clock < end or not found:
            found.append(_react(machine, rng, kind, code))
        last, after, went_on, off = zip(*found, strict=True)
        yield Figure(f"{kind}: times in a motion", "", len(found))
        yield Figure(f"{kind}: full speed before it brakes, the longest", "clocks",
                     round(max(went_on)), most=ALLOWED)
        yield Figure(f"{kind}: last edge beyond v / a, the latest", "clocks", max(last))
        yield Figure(f"{kind}: steps of an axis that are later", "steps", max(after), most=1)
        yield Figure(f"{kind}: steps off the report, and off 0 at last", "steps", sum(off), most=0)


def figures(seconds: float, seed: int = 1, passed: Callable[[int], object] = lambda _: None
            ) -> Iterator[Figure]:
    """Yield the figures of the gateware.

    Parameters
    ----------
    seconds : float
        Time of the machine for streaming; each other part takes a fifth of it, or as long as it
        has to for one time.
    seed : int
        Of the random numbers.
    passed : callable
        Called often, with the clock of the machine.
    """
    clocks = int(seconds * SETTINGS.clock)
    with CXXRTLEngine(component("gcode", GCode(settings=SETTINGS))) as engine:
        machine = Machine(engine, passed)
        for part, share in ((_streaming, 1), (_overrun, 5), (_noise, 5), (_reaction, 5)):
            yield from part(machine, clocks // share, random.Random(f"{seed} {part.__name__}"))
        yield Figure("faults shown", "", int(machine.fault), most=0)


def plan_settings() -> PlanSettings:
    """Return the settings of the machine, as its model has them."""
    return PlanSettings.stored(SETTINGS.clock, SETTINGS.store)


def on_model(seed: str, seconds: float = PIECE) -> tuple[int, int, int]:
    """Run lines for a time of the line on the model.

    Return how many there were, how many were not answered as they should be, and after how many an
    axis was not at the nearest step.
    """
    path, model = Path(seed, length=30, turn=0.1), ProgramModel(plan_settings())
    model.line(BEGIN.decode().strip())
    left, lines, wrong, off = int(seconds * SETTINGS.clock), 0, 0, 0
    um, steps = np.zeros(AXES, np.int64), np.zeros(AXES, np.int64)

    def until_the_end() -> Iterator[Line]:
        nonlocal left
        while left > 0:
            line = path.line()
            left -= len(line.text) * BYTE
            yield line

    source = until_the_end()
    while chunk := [*islice(source, CHUNK)]:
        blocks, ends = [], []
        for line in chunk:
            answer, made = model.line(line.text.decode().strip())
            wrong += answer.encode() != line.answer
            blocks += made
            ends.append(len(blocks))
        places = steps + np.cumsum([np.zeros(AXES, np.int64), *moved(blocks)], axis=0)
        wanted = um + np.cumsum([line.move for line in chunk], axis=0)
        off += int((places[ends] != nearest(wanted)).any(axis=1).sum())
        lines, um, steps = lines + len(chunk), wanted[-1], places[-1]
    return lines, wrong, off


def model_figures(hours: float, seed: int, jobs: int, done: Callable[[], object]
                  ) -> Iterator[Figure]:
    """Yield the figures of lines on the model."""
    pieces = max(1, round(hours * 3600 / PIECE))
    found: list[Sequence[int]] = []
    with pool(jobs) as running:
        for each in running.map(partial(on_model, seconds=min(PIECE, hours * 3600)),
                                [f"{seed} piece {number}" for number in range(pieces)]):
            found.append(each)
            done()
    lines, wrong, off = (sum(column) for column in zip(*found, strict=True))
    yield Figure("model: time of the line", "s", round(min(PIECE, hours * 3600) * pieces))
    yield Figure("model: lines", "lines", lines)
    yield Figure("model: answers not as they should be", "lines", wrong, most=0)
    yield Figure("model: lines after which an axis is off", "lines", off, most=0)


def _on_gateware(seconds: int, seed: int) -> list[Figure]:
    """Return the figures of the machine in simulation, with its progress."""
    total = seconds * 1600
    with Progress(total, "ms", f"sending{FIRST_TIME}") as progress:
        shown = 0

        def passed(clock: int) -> None:
            nonlocal shown
            now = min(total, clock * 1000 // SETTINGS.clock)
            if now > shown:
                progress.advance(now - shown)
                shown = now

        return list(figures(seconds, seed, passed))


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.load", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--seconds", metavar="N", type=whole(0, 10**5), default=10,
                        help="of the machine without a pause of the sender; each other part takes "
                             "a fifth of that; with 0 only the model runs (default: %(default)s)")
    parser.add_argument("--model-hours", metavar="N", type=whole(0, 1000), default=0,
                        help="hours of the line on the model (default: none)")
    parser.add_argument("--jobs", type=whole(1, 1000), default=os.cpu_count(), metavar="N",
                        help="processes for the model (default: %(default)s)")
    parser.add_argument("--seed", metavar="N", type=whole(0), default=1,
                        help="of the random numbers (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=FilePath, help="write the figures to a file")
    args = parser.parse_args(argv)
    if not args.seconds and not args.model_hours:
        raise UserError("nothing is to be run: give --seconds or --model-hours")
    if args.json:
        check_output(args.json)
    found: list[Figure] = []
    if args.seconds:
        found += _on_gateware(args.seconds, args.seed)
    if args.model_hours:
        with Progress(args.model_hours * 3600 // PIECE, "minutes", "planning") as progress:
            found += model_figures(args.model_hours, args.seed, args.jobs, progress.advance)
    return report(found, args.json)


if __name__ == "__main__":
    raise SystemExit(main())
