"""Speed of the machines that are served, next to real time."""

import json
import random
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from tb.engines import CXXRTLEngine
from tb.uart import SerialLine
from tools.console import (
    FIRST_TIME,
    Parser,
    Progress,
    UserError,
    command,
    say,
    whole,
    write_files_atomically,
)
from tools.serve.machines import CLOCK, Served, servable

from .pages import with_figures

__all__ = ["FIGURES", "PAGE", "Speed", "main", "report"]

DOCS = Path(__file__).parent.parent / "docs"
FIGURES, PAGE = DOCS / "serving.json", DOCS / "evidence.md"

ABOUT = """\
Builds each machine as tools.serve does by default. For some simulated seconds its line is quiet,
then it gets random valid lines, one every quarter of a second, and obeys them. Both are run clock
by clock and with stretches of clocks made at once, in alternation. Prints clocks per second of
processor time of each, the most of some rounds, for other load only slows it; their ratio; and how
many times as fast as real time it is with stretches, on one core.

With --write the figures are kept in docs/serving.json, and the table in docs/evidence.md is written
anew.
"""

GAP_S = 0.25
"""Seconds from the beginning of a line to that of the next."""

KINDS = "a quiet line", "four lines a second"


@dataclass(frozen=True)
class Speed:
    """Clocks a second of processor time of a machine, with a kind of line."""

    machine: str
    line: str
    single: float
    stretched: float


def lines(served: Served, seconds: float) -> list[bytes]:
    """Return what is sent, one text for each gap."""
    fuzz = served.machine.fuzz
    assert fuzz is not None
    protocol, rng = fuzz().protocol, random.Random(1)
    return [protocol.begin, *(protocol.legal(rng) for _ in range(round(seconds / GAP_S) - 1))]


def speeds(served: Served, seconds: float, *, stretches: bool) -> tuple[float, float]:
    """Return the clocks per second of a quiet machine, and of one that is sent lines."""
    baud = served.how.baud
    with CXXRTLEngine(served.design(CLOCK, baud), stretches=stretches) as engine:
        engine.set(**served.how.levels)
        line = SerialLine(engine, CLOCK // baud)
        line.run(CLOCK // 10)
        made = []
        texts = lines(served, seconds)
        for sent in ([b""] * len(texts), texts):
            begun, clock = time.thread_time(), engine.clock
            for text in sent:
                line.send(text)
                line.run(round(GAP_S * CLOCK))
            made.append((engine.clock - clock) / (time.thread_time() - begun))
    return made[0], made[1]


def _short(number: float) -> str:
    return f"{number:.3g}" if number < 1000 else f"{number:.0f}"


def report(clock_hz: int, seconds: int, rounds: int, found: list[Speed]) -> str:
    """Return the figures in Markdown."""
    rows = [f"| `{each.machine}`, {each.line} | {_short(each.single / 1e6)} | "
            f"{_short(each.stretched / 1e6)} | {_short(each.stretched / each.single)} | "
            f"{_short(each.stretched / clock_hz)} |" for each in found]
    return "\n".join([
        f"{seconds} simulated seconds of each machine at {clock_hz / 1e6:g} MHz, in million clocks "
        f"a second of a core, the most of {rounds} rounds:", "",
        "| machine | clock by clock | in stretches | times | times real time |",
        "| --- | --- | --- | --- | --- |", *rows]) + "\n"


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.serving", description=ABOUT)
    parser.add_argument("--seconds", metavar="N", type=whole(1, 3600), default=5,
                        help="simulated seconds of each (default: %(default)s)")
    parser.add_argument("--rounds", metavar="N", type=whole(1, 100), default=3,
                        help="how often each is run (default: %(default)s)")
    parser.add_argument("--write", action="store_true",
                        help="keep the figures, and write the table of the page")
    args = parser.parse_args(argv)
    if reason := CXXRTLEngine.missing():
        raise UserError(reason)
    found = []
    with Progress(2 * args.rounds * len(servable()), "runs", f"serving{FIRST_TIME}") as progress:
        for name, served in servable().items():
            made = {False: (0.0, 0.0), True: (0.0, 0.0)}
            for stretches in [False, True] * args.rounds:
                quiet, sent = speeds(served, args.seconds, stretches=stretches)
                made[stretches] = max(made[stretches][0], quiet), max(made[stretches][1], sent)
                progress.advance()
            found += [Speed(name, *each) for each in zip(KINDS, *made.values(), strict=True)]
    text = report(CLOCK, args.seconds, args.rounds, found)
    say(text)
    if args.write:
        kept = {"clock_hz": CLOCK, "seconds": args.seconds, "rounds": args.rounds,
                "found": [asdict(each) for each in found]}
        write_files_atomically({
            FIGURES: (json.dumps(kept, indent=1) + "\n").encode(),
            PAGE: with_figures(PAGE.read_text(encoding="utf-8"), "serving", text).encode()})
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
