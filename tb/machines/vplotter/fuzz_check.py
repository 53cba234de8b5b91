"""How a session of `vplotter` is checked, by what is seen at its pins."""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fresa.drive import HALF_STEP
from fresa.protocol import wall_texts
from tb.fuzz.target import Findings, Floods, Seen
from tb.fuzz.trajectory import Failure
from tb.uart import FRAME, Levels, decode, decode_output

from . import SHORT
from .fuzz_bowed import REST, Bow, bows, ends, without_pen

__all__ = ["BIT", "ROOM", "check", "check_bowed"]

BIT = SHORT.bit
ROOM = 126
"""Bytes of lines that can wait for sure."""
RESET = 0x18
REALTIME = {RESET, *b"?!~"}
GREETING = b"Grbl 1.1h ['$' for help]"
SLACK = 2 * SHORT.period
"""Clocks after a motion in which a motor makes its last step."""
BRAKES = 200_000
"""Clocks in which a reset is greeted, whatever moves."""
LEFT = 2
"""Steps that a motor makes later: what it was kept from by an alarm, or a motor without power."""
EVERY = SHORT.servo_us * SHORT.clock // 10**6
"""Clocks from a pulse of the servo to the next."""
SAMPLED = 17 * SHORT.clock // 10**6 + 4
"""Clocks before a pulse in which its length is chosen."""
PULSES = {False: 200, True: 600}
"""Clocks of a pulse of the servo, by whether the pen touches: $210 and $211."""

TEXTS = [text.removesuffix(b"\r\n") for text in wall_texts(
    width=SHORT.wall_width, top=SHORT.least_y, height=SHORT.wall_height,
    feed=int(max(SHORT.max_rate[:2]))) if text.endswith(b"\r\n")]
(POWERED, REFUSED, HOME_FIRST, START_FIRST, OFF_THE_WALL, BUSY, EMERGENCY, DAMAGED, COMMANDS, OF_P,
 OF_H, OF_I, OF_F, OF_S) = (TEXTS[number] for number in (4, *range(11, 24)))
STATE = b"state"
DRAWS = b"2D"
"""State of the master and of the motors while a bowed line is drawn."""
LOST = b"error:11"
"""Answer to a line that is damaged, or had no room."""
REPLIES = {POWERED, HOME_FIRST, START_FIRST, OFF_THE_WALL, BUSY, EMERGENCY, DAMAGED, COMMANDS,
           OF_P, OF_H, OF_I, OF_F, OF_S, STATE}
OUTCOMES = {TEXTS[3], TEXTS[5], TEXTS[6], TEXTS[8], REFUSED}
"""What is said of a command without a reply: homed, released, on its way, drawing, refused."""
OUTCOMES_BOWED = {TEXTS[3], TEXTS[5], TEXTS[6], TEXTS[9], REFUSED}
"""The same where lines are bowed: one that was being drawn may be refused by then."""
ENDED_EARLY = rb"ALARM:[16-9]"
"""Behind it a bowed line that had not begun to be drawn has ended, and its begin is forgotten."""

OF_GRBL = re.compile(
    rb"ok|error:\d+|ALARM:\d+|\[MSG:.*\]|\$\d+=\d+(?:\.\d{3})?|\$N[01]=.*|Grbl 1.1h .*|"
    rb">.*:(?:ok|error:\d+)|\[VER:.*\]|"
    rb"\[(?:HLP|OPT|GC|G\d\d|TLO|PRB):[^\]]*\]?|"  # a reset ends a line of a list
    rb"<(?:Idle|Run|Jog|Hold:[01]|Alarm|Door:[0-3]|Check|Sleep|Home)"
    rb"\|[MW]Pos:(?:-?\d+\.\d{3,4},){2}-?\d+\.\d{3,4}(?:\|Bf:\d+,\d+)?"
    rb"\|FS:\d+(?:\.\d)?,\d+(?:\|.*)?>")

Said = Sequence[tuple[int, bytes]]
"""Lines of the machine, and the clock in which each begins."""
Steps = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Clocks of the steps of a string, and which way they go."""


@dataclass
class _Line:
    """A line of the host: when its end came, its text, and whether bytes of it were damaged.

    Where its end is CR and LF, `feed` is when the LF came, and `clock` is of the CR.
    """

    clock: int
    text: bytes
    damaged: bool
    size: int
    feed: int | None = None

    @property
    def command(self) -> bool:
        """Whether it is a command of the thesis."""
        return self.text.startswith(b":")

    @property
    def plain(self) -> bytes:
        """What is read of it, if it is G-code."""
        return re.sub(rb"[\0- /]|\([^)]*(?:\)|$)|;.*", b"", self.text, flags=re.S).upper()


def _lines(received: Iterable[tuple[int, int, bool]]) -> Iterator[_Line]:
    """Split bytes into lines, without real-time commands."""
    text, size, damaged, after = bytearray(), 0, False, None
    for clock, byte, error in received:
        ends = byte in b"\r\n"
        if after is not None and byte == ord("\n") and not error:
            after.feed, after = clock, None
            continue
        after = None
        size, damaged = size + 1, damaged or error
        if ends:
            line = _Line(clock, bytes(text), damaged, size)
            yield line
            after = line if byte == ord("\r") else None
            text, size, damaged = bytearray(), 0, False
        elif not damaged:  # what follows a damaged byte is dropped
            text.append(byte)


def check(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
    """Check a session."""
    _check(findings, line, seen, bowed=False)


def check_bowed(findings: Findings, line: Levels, seen: Seen, floods: Floods) -> None:
    """Check a session of a build that draws bowed lines."""
    _check(findings, line, seen, bowed=True)


def _check(findings: Findings, line: Levels, seen: Seen, *, bowed: bool) -> None:
    received = [(each.clock, each.byte, each.error) for each in decode(line, BIT)]
    findings.bytes = len(received)
    output = decode_output(seen["tx"], BIT)
    said = [(output.starts[found.start()], found[1]) for found in re.finditer(
        rb"([^\r\n]*)\r\n", output.text)]
    findings.answers = sum(_is_answer(text) for _, text in said)
    for clock, text in said:
        if not (OF_GRBL.fullmatch(text) or text in TEXTS or _is_state(text)):
            findings.failures.append(Failure(clock, "answer", f"it says {text!r}"))
            break
    commands = [(clock, byte) for clock, byte, error in received
                if not error and (byte in REALTIME or byte >= 0x80)]
    resets = [clock for clock, byte in commands if byte == RESET]
    rest = [each for each in received if each[2] or not (each[1] in REALTIME or each[1] >= 0x80)]
    lines = [*_lines(rest)]
    findings.lines = len(lines)
    steps = {name: _steps(findings, name, seen[name]) for name in ("left", "right")}
    findings.steps += sum(len(clocks) for clocks, _ in steps.values())
    drawn = bows(seen, steps, said, LEFT) if bowed else []
    if bowed:
        findings.failures += without_pen(seen, said)
    for bow in drawn:
        findings.failures += bow.failures(steps, said)
    findings.failures += _answers(rest, resets, said, seen, drawn if bowed else None)
    if sum(text.startswith(b"<") for _, text in said) > sum(byte == ord("?")
                                                            for _, byte in commands):
        findings.failures.append(Failure(0, "answer", "more reports than were asked for"))
    sets = any(re.search(rb"\$0*21[01]=", each.plain) for each in lines)
    findings.failures += _pen(lines, seen, sets=sets)
    # Such a line may turn a motor the other way, or be run at each start.
    turned = any(re.search(rb"\$(?:0*3=|N)", each.plain) for each in lines)
    places = _strings(findings, seen, lines, said, steps, drawn if bowed else None, turned=turned)
    if resets and not turned:
        _alive(findings, said, resets[-1], seen, places)
    findings.failures.sort()


def _is_answer(text: bytes) -> bool:
    return bool(re.fullmatch(rb"ok|error:\d+", text))


def _is_state(text: bytes) -> bool:
    return bool(re.fullmatch(rb"[0-3][0-9A-F]", text))


def _strings(findings: Findings, seen: Seen, lines: Sequence[_Line], said: Said,
             steps: Mapping[str, Steps], drawn: Sequence[Bow] | None, *, turned: bool
             ) -> list[list[int]]:
    """Check the steps where nothing moves; return where the strings may be at the end.

    In a build with bowed lines, `drawn`, more than one place is possible behind an alarm, which may
    have come before or behind a line's end.

    Returns
    -------
    list of list of int
        The steps of each string from where it was at the place of rest.
    """
    moving = seen["moving"].astype(np.int8)
    edges = np.flatnonzero(np.diff(moving, prepend=0))
    begins, stops = edges[::2].tolist(), edges[1::2].tolist()
    homed = [each.clock for each in lines if each.plain in (b":H", b"$H")]
    since = [0]  # clocks from which the steps lead to the place: of the last homing cycle

    def place(begin: int, end: int) -> tuple[int, int]:
        left, right = (int(turns[np.searchsorted(clocks, begin):np.searchsorted(clocks, end)].sum())
                       for clocks, turns in steps.values())
        return left, right

    for begin, end in zip([0, *stops], [*begins, len(moving)], strict=False):
        at = begin + SLACK
        for bow in [*(bow for bow in drawn or () if begin <= bow.begin < end), None]:
            upto = end if bow is None else bow.begin
            late = [int(np.searchsorted(clocks, upto) - np.searchsorted(clocks, at))
                    for clocks, _ in steps.values()]
            if max(late) > LEFT:
                since = [upto]
                if not any(clock < upto for clock in homed):
                    findings.failures.append(Failure(begin, "step", "a string is wound, but "
                                                     f"nothing moves: {late} steps"))
            if bow is None:
                continue
            at = bow.end
            wanted = ends([(each.clock, each.text) for each in lines if not each.damaged], said,
                          bow)
            there = [clock for clock in since if tuple(
                REST + each for each in place(clock, bow.end)) in wanted]
            if bow.drawn is False:
                since = [*there, bow.end]
            elif bow.drawn and not turned and not there:
                found = {place(clock, bow.end) for clock in since}
                findings.failures.append(Failure(
                    bow.end, "bow", f"a line ends {found} steps from the place of rest, where the "
                    f"strings have {REST}, and should end with {wanted}"))
            elif bow.drawn:
                since = there or since
        alarmed = ENDED_EARLY if drawn is not None else rb"ALARM:[6-9]"
        if any(begin <= clock < end and re.fullmatch(alarmed, text) for clock, text in said):
            since = [end] if drawn is None else [*since, end]
    return [[*place(clock, len(moving))] for clock in since]


def _steps(findings: Findings, name: str, words: NDArray) -> Steps:
    """Check the coil words of a motor; return the clocks of its steps, and which way they go."""
    rows = np.full(16, -1)
    rows[list(HALF_STEP)] = range(8)
    on = np.flatnonzero(words != 0)
    row = rows[words[on]]
    if (row < 0).any():
        clock = int(on[np.flatnonzero(row < 0)[0]])
        findings.failures.append(Failure(clock, "pins", f"{words[clock]:04b} drives the motor of "
                                         f"the {name} string"))
    turns = (np.diff(row, prepend=row[:1]) + 4) % 8 - 4
    clocks, turns = on[turns != 0], turns[turns != 0]
    if (abs(turns) > 1).any():
        clock = int(clocks[np.flatnonzero(abs(turns) > 1)[0]])
        findings.failures.append(Failure(clock, "pins", f"the motor of the {name} string jumps"))
    near = np.flatnonzero(np.diff(clocks) < SHORT.period)
    if near.size:
        findings.failures.append(Failure(int(clocks[near[0]]), "pins", f"steps of the {name} "
                                         f"string are less than {SHORT.period} clocks apart"))
    return clocks, turns


def _pen(lines: Sequence[_Line], seen: Seen, *, sets: bool) -> list[Failure]:
    """Check that the pen touches only once a line has wanted it to, and that the servo follows."""
    pen = seen["pen"]
    first = next((line.clock for line in lines if not line.damaged and re.search(
        rb"M0*[34]|Z|28|30|\$N|^:F", line.plain, re.S)), len(pen))
    if pen[:first].any():
        return [Failure(int(pen.argmax()), "pen", "the pen touches, and no line is why")]
    edges = np.flatnonzero(np.diff(seen["servo"].astype(np.int8), prepend=0))
    rises, falls = edges[::2], edges[1::2]
    if (np.diff(rises) != EVERY).any() or len(rises) < len(pen) // EVERY - 1:
        return [Failure(0, "pen", f"pulses are not {EVERY} clocks apart")]
    for rise, width in zip(rises, falls - rises[:len(falls)], strict=False):
        levels = pen[max(0, rise - SAMPLED):rise + 1].tolist()
        if not sets and width not in {PULSES[bool(level)] for level in levels}:
            return [Failure(int(rise), "pen", f"a pulse of {width} clocks, while pen is "
                            f"{pen[rise]}")]
    return []


def _answers(received: list[tuple[int, int, bool]], resets: list[int], said: Said, seen: Seen,
             drawn: Sequence[Bow] | None) -> list[Failure]:
    """Compare answers and replies with lines, from one reset to the next."""
    for begin, end in zip([0, *resets], [*resets, len(seen["tx"])], strict=True):
        after = [each for each in received if begin < each[0] <= end]
        greeted = begin and next((clock for clock, text in said
                                  if clock > begin and text == GREETING), None)
        if greeted is None or (greeted > end > begin + BRAKES):
            return [Failure(begin, "answer", "no greeting after a reset")]
        if begin and [byte for _, byte, _ in after[:100]] != [0] * 100:
            continue  # noise may have been a reset, at some time in what follows
        lines = [*_lines(after)]
        if begin:
            if not lines[0].plain.startswith(b":"):  # a command begins with that, not with a 0
                lines[0].text = lines[0].text.lstrip(b"\0")
            gone = any(byte or error for clock, byte, error in after if clock < greeted)
            if gone or greeted > lines[0].clock:  # it braked for so long that they are gone
                continue
            lines[0].size = 1
        own = [(clock, text) for clock, text in said if greeted <= clock < end]
        # An alarm discards lines that wait.
        sure = min((clock for clock, text in own if text.startswith(b"ALARM")), default=end)
        failures = _one_each(lines, own) or _replies(
            [line for line in lines if line.clock < sure],
            [each for each in own if each[0] < sure], sure, drawn, again=begin > 0)
        if failures:
            return failures
    return []


def _one_each(lines: Sequence[_Line], said: Said) -> list[Failure]:
    """Check that each answer is behind a line of G-code of its own.

    A command that had no room is an empty line that is damaged. The LF behind a command that ends
    a sleep comes after the reset, and is an empty line.
    """
    feeds = [line.feed for line in lines if line.feed is not None and line.text.upper() == b":P1"]
    every = sorted([line.clock for line in lines] + feeds)
    code = sorted([line.clock for line in lines if not line.command] + feeds)
    count, own = 0, 0
    for clock, text in said:
        if not _is_answer(text):
            continue
        count, own = count + 1, own + (text != LOST)
        if any(number > len(ends) or (number and ends[number - 1] > clock)
               for number, ends in ((count, every), (own, code))):
            return [Failure(clock, "answer", f"{text!r} answers no line")]
    return []


def _replies(lines: Sequence[_Line], said: Said, end: int, drawn: Sequence[Bow] | None, *,
             again: bool) -> list[Failure]:
    """Compare replies with commands, while it is known that all lines had room.

    Some commands have a reply only where they are refused. Behind a reset the first reply may be
    that of a command before it.
    """
    replies = [(clock, STATE if _is_state(text) else text) for clock, text in said]
    done = [clock for clock, text in replies
            if _is_answer(text) or text in REPLIES
            or text in (OUTCOMES if drawn is None else OUTCOMES_BOWED)]
    replies = [each for each in replies if each[1] in REPLIES]
    states = [text for _, text in said if _is_state(text) or text in REPLIES]
    places = {0, 1} if again else {0}  # how many replies there may have been
    slept = False
    for number, line in enumerate(lines):
        begin = line.clock - line.size * FRAME * BIT
        answered = max(0, int(np.searchsorted(done, begin)) - again)
        if sum(each.size for each in lines[min(answered, number):number + 1]) > ROOM:
            return []  # some bytes may have had no room
        slept = slept or line.plain in (b":P0", b"$SLP")
        if not line.command:
            continue
        if slept and line.plain == b":P1":
            return []  # it is a reset
        allowed, optional = _reply_to(line)
        follow = {place + 1 for place in places if place < len(replies)
                  and replies[place][1] in allowed and replies[place][0] > line.clock}
        if not follow and not optional:
            if max(places) < len(replies):
                clock, text = replies[max(places)]
                return [Failure(clock, "answer", f"{line.text!r} is answered {text!r}")]
            late = end - line.clock > 200 * FRAME * BIT and not _slow(lines[:number + 1])
            return [Failure(line.clock, "answer", f"{line.text!r} is not answered")] * late
        if allowed == {STATE} and len(follow) == 1:
            at = min(follow) - 1
            if states[at] != DRAWS and any(bow.begin < line.clock and replies[at][0] < bow.end
                                           for bow in drawn or ()):
                return [Failure(line.clock, "answer", f"{line.text!r} is answered {states[at]!r} "
                                "while a line is drawn")]
        places = follow | places if optional else follow
    if len(replies) not in places:
        clock, text = replies[-1]
        return [Failure(clock, "answer", f"{text!r} answers no line")]
    return []


def _reply_to(line: _Line) -> tuple[set[bytes], bool]:
    """Return the replies that a command may have, and whether it may have none."""
    letter, digits = line.text[1:2].upper(), line.text[2:]
    wrong = not re.fullmatch(rb"\d*", digits)
    if line.damaged:
        return {DAMAGED}, False
    if letter == b"P":
        good = {b"0": {BUSY}, b"1": {POWERED, EMERGENCY}}
        return good.get(digits, {OF_P}), digits == b"0"
    if letter == b"H":
        return ({OF_H}, False) if digits else ({BUSY}, True)
    if letter == b"S":
        return ({STATE} if digits in (b"0", b"1", b"2") else {OF_S}), False
    if letter not in (b"I", b"F"):
        return {COMMANDS}, False
    if wrong or len(digits) != 8:
        return {OF_I if letter == b"I" else OF_F}, False
    x, y = int(digits[:4]), int(digits[4:])
    refusals = {BUSY, HOME_FIRST, *[START_FIRST] * (letter == b"F")}
    if x > SHORT.wall_width or not SHORT.least_y <= y <= SHORT.wall_height:
        return refusals | {OFF_THE_WALL}, False
    return refusals, True


def _slow(lines: Sequence[_Line]) -> bool:
    """Return whether a line may wait for motions, a dwell, or a pause."""
    return len(lines) > 60 or any(re.search(rb"[GM]0*[04]|P|F|\$|:[HIF]", line.plain)
                                  for line in lines)


def _alive(findings: Findings, said: Said, reset: int, seen: Seen,
           places: Sequence[Sequence[int]]) -> None:
    """Look at what follows the last reset: the machine is there, and goes to the place of rest."""
    after = [text for clock, text in said if clock > reset]
    if GREETING not in after or any(text.startswith(b"ALARM") for text in after):
        return
    answers = after[after.index(GREETING):]
    if b"error" in b"".join(answers) or answers.count(b"ok") > 64:
        findings.failures.append(Failure(reset, "answer", f"after a reset it says {answers[:9]}"))
    if not seen["moving"][-1] and answers.count(b"ok") >= 3 and all(map(any, places)):
        findings.failures.append(Failure(
            len(seen["moving"]) - 1, "place",
            f"strings are {places[0]} steps from where they should be"))
