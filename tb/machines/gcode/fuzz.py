"""What the line of `gcode` is fuzzed with, and how a session is checked.

What each line is answered and where it leads is that of the model of the language, which a sender
would know; nothing is looked at but pins. A session ends with a reset in whatever goes on, and a
motion to 0: an axis that has lost a step, or made one too many, does not get there. Nothing steps
while an alarm is shown.
"""

import random
import re
from collections.abc import Iterable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from fresa.machines.gcode import GCode, GCodeSettings
from tb import boards
from tb.fuzz.inputs import Input, LineProtocol
from tb.fuzz.target import Findings, Floods, FuzzTarget, Seen
from tb.fuzz.trajectory import Failure
from tb.models.gcode_language import (
    Action,
    Interpreter,
    Probe,
    RefusedLine,
    read_jog,
    read_words,
)
from tb.uart import FRAME, Levels, decode, decode_output, high, levels

from . import SHORT, SHORT_GANTRY

__all__ = ["FUZZ"]

BIT = SHORT.bit
SECOND = SHORT_GANTRY.second_axis or 0
"""The axis that has a second motor, if any has."""
AXES = "XYZ"
PER_MM = 80
ROOM = 126
"""Bytes of lines that can wait for sure."""
STEP = 10**6 // PER_MM
"""Nm of a step."""
RESET = 0x18
REALTIME = {RESET, *b"?!~"}
GREETING = b"Grbl 1.1h ['$' for help]"
UNLOCK = b"[MSG:'$H'|'$X' to unlock]"
DAMAGED = 11
CONTACTS = {"limits": len(AXES), "stop": 1, "door": 1, "probe": 1, "motor_fault": 1, "hold": 1,
            "start": 1, "abort": 1}
BRAKES = 200_000
"""Clocks in which a reset is greeted, whatever moves."""
STOPPING = 4
"""Clocks of an alarm in which a step may still begin."""
PLACED = b"ok", b"error:33", b"error:34"
"""Answers that depend on where a motion ends."""

LINES = (b"G21", b"G90", b"G91", b"G54", b"G55", b"G17", b"G18", b"G19", b"M3S500", b"M5", b"M8",
         b"M9", b"G4P0.001", b"G92X0.1", b"G92.1", b"G10L20P1X0", b"G10L2P2Y0.2", b"G43.1Z0.1",
         b"G49", b"G28", b"G28.1", b"G30Z0", b"$X", b"G20", b"G93G1X0.1F6000", b"G94", b"G80",
         b"T1", b"(a comment) G1", b"; and no more", b"", b"X1X2", b"G1X", b"G2X1", b"M30",
         b"G38.3X0.1F6000\nG1", b"G38.2", b"G1X0.00000000000000000000000000000000000000001",
         b"G53G0X0Y0Z0",
         b"$H", b"$", b"$G", b"$#", b"$I", b"$N", b"%")

STORED = (b"$N0=G54G21G90", b"$n1 = m9", b"$N0=", b"$N1=", b"$I=Mine (2)")
"""Lines that store what changes nothing that is compared."""

ANOTHER = (b"$C", b"$C", b"$SLP", b"$RST=#", b"$RST=*", b"$rst=$", b"$J=G91X0.2F900",
           b"$j=G91Y-.3Z.1F6000", b"$J=X0F9000", *STORED, b"G38.2X.1F6000\n$X\nG0",
           b"G38.5Z-.2F6000\n$X\nG0", b"$10=0", b"$10=3", b"$13=1")
"""Lines after which it is not known what others are answered, until a reset."""


def _legal(rng: random.Random) -> bytes:
    """Give a line, most often a short motion; with real-time commands now and then."""
    if rng.random() < 0.02:
        return ANEW
    if rng.random() < 0.01:
        line = rng.choice(ANOTHER)
    elif rng.random() < 0.65:
        size = rng.choice([0.02, 0.1, 0.4])
        axes = "".join(f"{axis}{rng.uniform(-size, size):.3f}" for axis in AXES
                       if rng.random() < 0.6)
        line = rng.choice([
            f"G0{axes}", f"G1{axes}F{rng.randint(2000, 12_000)}", axes, f"G90 {axes}",
            f"G91G{rng.choice('23')}X0Y0I{size:.3f}F6000 G90",
            f"G17G2X{size / 2:.3f}Y0R{size}F9000"]).encode()
    else:
        line = rng.choice(LINES)
    line += rng.choice([b"\n", b"\n", b"\r\n", b"\r"])
    if rng.random() < 0.1:
        place = rng.randrange(len(line) + 1)
        line = line[:place] + rng.choice(COMMANDS) + line[place:]
    return line


COMMANDS = (b"?", b"?", b"?", b"!~", b"~", b"\x85", *(
    bytes([code]) for code in (0x90, 0x91, 0x93, 0x94, 0x95, 0x96, *range(0x99, 0x9F), 0xA0, 0xA1)))
"""Commands within lines: none that makes motion much slower."""

ANEW = b"~\x18" + bytes(400) + b"\n"
"""A reset, and bytes of value 0, which are skipped, for the time in which it brakes."""

PROTOCOL = LineProtocol(
    legal=_legal, quiet=(b"\n", b"X1X2\n", b"G5\n", b"(quiet)\n", b"G1X\n"), end=b"\n",
    letters=b"GMXYZFSPIJKRNT0123456789.-+ ()?", longest=80, room=ROOM, answer=60, begin=b"G21\n",
    alive=ANEW + b"$X\nG90G94G53G0X0Y0Z0\n" + b"\n" * 60, spared=b"\x18!\x84")


def _contacts(rng: random.Random, period: int) -> Input:
    """Give lines, most of them motions, with contacts meanwhile; and what unlocks it thereafter."""
    sent, line = [], []
    for _ in range(rng.randrange(2, 9)):
        size = rng.choice([0.4, 2])
        sent.append(rng.choice([
            f"G91G1X{rng.uniform(-size, size):.3f}F{rng.randint(3000, 12_000)}\n".encode(),
            f"G91G0Y{rng.uniform(-size, size):.3f}Z{rng.uniform(-size, size):.3f}\n".encode(),
            f"G91G2X0Y0I{size}F9000\n".encode(),
            f"G38.3X{rng.uniform(-size, size):.3f}F6000\n".encode(),
            f"$J=G91X{rng.uniform(-size, size):.3f}F9000\n".encode(),
            b"G4P0.004\n", b"M0\n", b"$X\n", *COMMANDS[2:6]]))
        line += [levels(sent[-1], period), high(rng.randint(0, rng.choice([3, 300, 9000, 30_000])))]
    clocks = sum(map(len, line))
    pressed = np.zeros(clocks, np.uint16)
    for _ in range(rng.randint(1, 5)):
        place = rng.randrange(clocks)
        pressed[place:place + rng.randint(1, rng.choice([3, 40, 3000, 30_000]))] |= (
            1 << rng.randrange(sum(CONTACTS.values())))
    sent.append(ANEW + b"$X\n" + ANEW)
    line.append(levels(sent[-1], period))
    return Input("contacts", b"".join(sent), np.concatenate(line),
                 np.concatenate([pressed, np.zeros(len(line[-1]), np.uint16)]))


@dataclass
class _Line:
    """A line of the host: when its end came, its text, and whether bytes of it were damaged."""

    clock: int
    text: bytes
    damaged: bool
    size: int


def _lines(received: Iterable[tuple[int, int, bool]]) -> Iterator[_Line]:
    """Split bytes into lines, without real-time commands."""
    text, size, damaged, after_cr = bytearray(), 0, False, False
    for clock, byte, error in received:
        if not error and byte in b"\r\n":
            if not (byte == ord("\n") and after_cr):
                yield _Line(clock, bytes(text), damaged, size + 1)
                text, size, damaged = bytearray(), 0, False
            after_cr = byte == ord("\r")
            continue
        after_cr = False
        size, damaged = size + (byte != 0), damaged or error  # 0 waits for nothing
        if not damaged:  # what follows a damaged byte is dropped
            text.append(byte)
        if error and byte in b"\r\n":
            yield _Line(clock, bytes(text), True, size)
            text, size, damaged = bytearray(), 0, False
            after_cr = byte == ord("\r")


def _answer(model: Interpreter, line: _Line) -> tuple[tuple[bytes, ...], bool]:
    """Do a line; return the answers that it may have, and whether it is known what follows.

    It is not after a line that may have another mode or setting follow, nor after a probing that
    is an alarm: nothing ever touches.
    """
    if re.search(rb"\$.*(?:=|C|S)", line.text, re.I):
        return _answers_to(model, line)[0], False
    answers, actions = _answers_to(model, line)
    probings = [action for action in actions if isinstance(action, Probe)]
    if probings:  # it goes on where the motors are
        for axis, place in enumerate(model.position):
            model.set_position(axis, STEP * ((2 * place + STEP) // (2 * STEP)))
    return answers, all(each.no_error and not each.away for each in probings)


def _stores(line: _Line) -> bool:
    """Return whether a line may store another one, that is none of `STORED`."""
    return line.text not in STORED and bool(re.search(rb"\$.*N.*=", line.text, re.I | re.S))


def _answers_to(model: Interpreter, line: _Line) -> tuple[tuple[bytes, ...], Sequence[Action]]:
    """Do a line; return the answers that it may have, and what it does."""
    damage = (b"error:%d" % DAMAGED,) if line.damaged else ()
    try:
        text = line.text.decode("latin-1")
        plain = re.sub(r"[\0- /]|\([^)]*(?:\)|$)|;.*", "", text, flags=re.S)
        if not plain and b"\0" in line.text:  # damage in the time of a reset may be gone
            return (b"ok", *damage), ()
        if plain[:3].upper() == "$J=":
            return (_answer_jog(model, text), b"error:8", *damage), ()
        if plain.startswith("$"):
            return (b"ok", *(b"error:%d" % number for number in (2, 3, 4, 5, 8, 11, 13, 38))), ()
        items, status = read_words(text)
        if status or line.damaged:
            model.read(items)
            return (*damage, b"error:%d" % status), ()
        return (b"ok",), model.line(items)
    except RefusedLine as refused:
        return (*damage, b"error:%d" % refused.args[0]), ()


def _answer_jog(model: Interpreter, text: str) -> bytes:
    """Return how a jog is answered, if it may be one."""
    items, status = read_jog(text)
    try:
        model.read(items)
        if not status:
            deepcopy(model).jog(items)
    except RefusedLine as refused:
        status = refused.args[0]
    return b"error:%d" % status if status else b"ok"


def _pins(seen: Seen) -> tuple[list[Failure], NDArray[np.int64], int]:
    """Check the pulses; return failures, the position at the end, and how many steps there are."""
    times, failures = SHORT.driver, []
    position, count = np.zeros(3, np.int64), 0
    stopped = np.convolve(seen["alarm"], np.ones(STOPPING))[:len(seen["alarm"])] == STOPPING
    for axis, name in enumerate(AXES):
        step = (seen["step"] >> axis & 1).astype(np.int8)
        forward = seen["direction"] >> axis & 1
        changes = np.flatnonzero(np.diff(step, prepend=0))
        rises, falls = changes[::2], changes[1::2]
        turns = np.flatnonzero(np.diff(forward.astype(np.int8), prepend=forward[0]))
        count += len(rises)
        position[axis] = np.where(forward[rises] == 1, 1, -1).sum()
        high = falls - rises[:len(falls)]
        low = rises[1:] - falls[:len(rises) - 1]
        before = np.searchsorted(turns, rises, side="right")
        setup = rises[before > 0] - turns[before[before > 0] - 1]
        last = np.searchsorted(falls, turns)
        hold = turns[last > 0] - falls[last[last > 0] - 1]
        for what, gaps, least in (("STEP is high", high, times["width"]),
                                  ("STEP is low", low, times["low"]),
                                  ("DIR is set up", setup, times["setup"]),
                                  ("DIR holds", hold, times["hold"])):
            if gaps.size and gaps.min() < least:
                failures.append(Failure(0, "pins", f"{what} of {name} for {gaps.min()} clocks, "
                                        f"not {least}"))
        moving = np.concatenate([[0], seen["moving"]])
        late = rises[stopped[rises]]
        if late.size:
            failures.append(Failure(int(late[0]), "step", f"{name} steps while there is an alarm"))
        if rises.size and not (moving[rises] | moving[np.maximum(rises - 40, 0)]).all():
            failures.append(Failure(int(rises[0]), "step", f"{name} steps where nothing moves"))
    return failures, position, count


def _second(seen: Seen) -> list[Failure]:
    """Check that a second motor makes the steps of the first one: none is homed here."""
    first = seen["step"] >> SECOND & 1
    alone = np.flatnonzero(first != seen["second_step"])
    rises = np.flatnonzero(np.diff(first.astype(np.int8), prepend=0) == 1)
    other = rises[(seen["direction"][rises] >> SECOND & 1) != seen["second_direction"][rises]]
    name = AXES[SECOND]
    return ([Failure(int(clock), "pins", f"one motor of {name} steps alone")
             for clock in alone[:1]]
            + [Failure(int(clock), "pins", f"the motors of {name} step both ways")
               for clock in other[:1]])


def _check(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
    findings.failures, position, findings.steps = _pins(seen)
    if "second_step" in seen:
        findings.failures += _second(seen)
    received = [(each.clock, each.byte, each.error) for each in decode(line, BIT)]
    findings.bytes = len(received)
    output = decode_output(seen["tx"], BIT)
    said = [(output.starts[found.start()], found[1]) for found in re.finditer(
        rb"([^\r\n]*)\r\n", output.text)]
    answers = [(clock, text) for clock, text in said
               if re.fullmatch(rb"ok|error:\d+", text)]
    findings.answers = len(answers)
    wrong = [(clock, text) for clock, text in said if not re.fullmatch(
        rb"ok|error:\d+|ALARM:\d+|\[MSG:.*\]|\$\d+=\d+(?:\.\d{3})?|\$N[01]=.*|Grbl 1.1h .*|"
        rb">.*:(?:ok|error:\d+)|\[VER:.*\]|"
        rb"\[(?:HLP|OPT|GC|G\d\d|TLO|PRB):[^\]]*\]?|"  # a reset ends a line of a list
        rb"<(?:Idle|Run|Jog|Hold:[01]|Alarm|Door:[0-3]|Check|Sleep)"
        rb"\|[MW]Pos:(?:-?\d+\.\d{3,4},){2}-?\d+\.\d{3,4}(?:\|Bf:\d+,\d+)?"
        rb"\|FS:\d+(?:\.\d)?,\d+(?:\|.*)?>", text)]
    if wrong:
        findings.failures.append(Failure(wrong[0][0], "answer", f"it says {wrong[0][1]!r}"))
    commands = [(clock, byte) for clock, byte, error in received
                if not error and (byte in REALTIME or byte >= 0x80)]
    resets = [clock for clock, byte in commands if byte == RESET]
    rest = [each for each in received if each[2] or not (each[1] in REALTIME or each[1] >= 0x80)]
    findings.failures += _answers(findings, rest, resets, said, seen)
    reports = sum(text.startswith(b"<") for _, text in said)
    if reports > sum(byte == ord("?") for _, byte in commands):
        findings.failures.append(Failure(0, "answer", "more reports than were asked for"))
    if resets and not any(_stores(line) for line in _lines(rest)):
        _alive(findings, said, resets[-1], seen, position)
    findings.failures.sort()


def _answers(findings: Findings, received: list[tuple[int, int, bool]], resets: list[int],
             said: list[tuple[int, bytes]], seen: Seen) -> list[Failure]:
    """Compare all answers with what lines are answered, from one reset to the next."""
    model, known = Interpreter(steps_per_metre=(1000 * PER_MM,) * 3), True
    touched = np.flatnonzero(sum((seen.get(name, 0) for name in CONTACTS),
                                 np.zeros(len(seen["step"]), np.uint8)))
    for begin, end in zip([0, *resets], [*resets, len(seen["step"])], strict=True):
        after = [each for each in received if begin < each[0] <= end]
        greeted = begin and next((clock for clock, text in said
                                  if clock > begin and text == GREETING), None)
        if greeted is None or (greeted > end > begin + BRAKES):
            return [Failure(begin, "answer", "no greeting after a reset")]
        if any(_stores(line) for line in _lines(after)):
            return []  # what is run from now on at each start
        left = touched[np.searchsorted(touched, begin):]
        quiet = min([end, *left[:1].tolist()])
        lines = [*_lines(each for each in after if each[0] <= quiet)]
        locked = any(text == UNLOCK for clock, text in said if begin < clock < end)
        gone = begin and any(byte or error for clock, byte, error in after if clock < greeted)
        noise = begin and [byte for _, byte, _ in after[:100]] != [0] * 100
        if greeted > quiet or (begin and (noise or locked or gone or (
                lines and greeted > lines[0].clock))):
            # What noise is may have been a reset, at some time in what follows; or it slept, or
            # braked for so long that bytes or lines are gone.
            known = False
            continue
        own = [(clock, text) for clock, text in said if greeted <= clock < quiet
               and re.fullmatch(rb"ok|error:\d+", text)]
        if begin:
            model.reset()
            for axis, place in enumerate(_position(seen, greeted)):
                model.set_position(axis, STEP * place)
        count, failures, sure = _compare(model, lines, own, quiet, known)
        findings.lines += count
        if failures:
            return failures
        known = known and sure and quiet == end
    return []


def _compare(model: Interpreter, lines: list[_Line], answers: list[tuple[int, bytes]], end: int,
             known: bool) -> tuple[int, list[Failure], bool]:
    """Compare answers with what lines are answered, while it is known.

    Return how many were compared, failures, and whether it is known what all lines did. If origins
    of coordinates are not `known`, so is not what depends on where a motion ends.
    """
    for number, (clock, text) in enumerate(answers):
        if number >= len(lines) or lines[number].clock > clock:
            return 0, [Failure(clock, "answer", f"{text!r} answers no line")], False
    begins = 0
    for number, line in enumerate(lines):
        # Of the lines that are not answered some bytes may have had no room.
        while begins < len(answers) and answers[begins][0] < line.clock - line.size * FRAME * BIT:
            begins += 1
        if sum(each.size for each in lines[min(begins, number):number + 1]) > ROOM:
            return number, [], False
        if number >= len(answers):
            late = end - line.clock > 60 * FRAME * BIT and not _slow(lines[:number + 1])
            left = b" ".join(each.text for each in lines[number:])
            # Of some it is not known whether they were done.
            failures = [Failure(line.clock, "answer", f"{line.text!r} is not answered")] * late
            return number, failures, not re.search(rb"10|28|30", left)
        (expected, sure), answer = _answer(model, line), answers[number][1]
        if not known and expected[0] in PLACED and answer in PLACED:
            if answer != expected[0]:
                return number, [], False
        elif answer not in expected:
            return number, [Failure(line.clock, "answer", f"{line.text!r} is answered {answer!r}, "
                                    f"not {expected[0]!r}")], False
        if not sure:
            return number, [], False
    return len(lines), [], True


def _position(seen: Seen, clock: int) -> list[int]:
    """Return where the motors are, in steps."""
    return [int(np.where(seen["direction"][:clock][at] >> axis & 1, 1, -1).sum())
            for axis, at in ((axis, np.flatnonzero(np.diff(
                seen["step"][:clock] >> axis & 1, prepend=0) == 1)) for axis in range(3))]


def _slow(lines: list[_Line]) -> bool:
    """Return whether a line may wait for motions, a dwell, or a pause."""
    return len(lines) > 60 or any(re.search(rb"[GM]\s*0*[04]|P|F|\$", line.text, re.I)
                                  for line in lines)


def _alive(findings: Findings, said: list[tuple[int, bytes]], reset: int, seen: Seen,
           position: NDArray[np.int64]) -> None:
    """Look at what follows the last reset: the machine is there, and goes to 0."""
    after = [text for clock, text in said if clock > reset]
    if GREETING not in after or any(text.startswith(b"ALARM") for text in after):
        return
    answers = after[after.index(GREETING):]
    if b"error" in b"".join(answers) or answers.count(b"ok") > 63:
        findings.failures.append(Failure(reset, "answer", f"after a reset it says {answers[:9]}"))
    if not seen["moving"][-1] and answers.count(b"ok") >= 3 and position.any():
        findings.failures.append(Failure(len(seen["moving"]) - 1, "place",
                                         f"at {position.tolist()} instead of 0"))


def _target(settings: GCodeSettings, *further: str, others: tuple[FuzzTarget, ...] = ()
            ) -> FuzzTarget:
    return FuzzTarget(
        "gcode", BIT, PROTOCOL, lambda: boards.component("gcode", GCode(settings=settings)),
        ("tx", "step", "direction", "enable", "moving", "alarm", "fault", *further), _check,
        times=False, others=others,
        about="Each session ends with a reset in what goes on, and a motion to 0. They take turns: "
              "a plain machine, one with a second motor on Z, and a plain one of which contacts, "
              "such as limit switches, emergency stop, door and probe, close in motions.")


FUZZ = _target(SHORT, others=(
    _target(SHORT_GANTRY, "second_step", "second_direction"),
    replace(_target(SHORT), protocol=replace(PROTOCOL, sequence=_contacts), switches=CONTACTS,
            presses=False)))
