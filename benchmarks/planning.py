"""What the depth of the queue of blocks gives: clocks of a pass, and speed in short segments."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from math import sqrt
from pathlib import Path

from tb.models.plan import BlockQueueModel, plan
from tools.console import Parser, UserError, check_output, command, say, whole, write_atomically

__all__ = ["Run", "main", "pass_clocks", "sustained"]

ABOUT = """\
Prints for each depth of the queue the clocks of a pass that changes every entry, from the last word
of a block to the next that is accepted, by the clock-exact model; and the speed that a long
straight job of equal segments sustains, by simulation of the queue, its plan and a motion engine.

The speed is that of the slower of two: braking over the blocks in the queue, v = sqrt(2 a depth c)
for segments c and acceleration a ("by depth"), and the segments that arrive, c times lines a second
("by lines"). With few lines the engine brakes until as many blocks wait as it needs to stop from
the speed of their arrival; only if that is less than two it finds the queue empty and may stand
after a segment. "brakes" are the segments of the middle half of the job that ended slower than
they began, "empty" those that began with no other in the queue.
"""

EPILOG = """\
examples:
  python -m benchmarks.planning
  python -m benchmarks.planning --segment 0.2 --acceleration 1000 --lines 500 --lines 5000
  python -m benchmarks.planning --depth 16 --depth 256 --json planning.json
"""

GRANULES = 8
"""Parts of a segment in which the engine keeps to one acceleration."""


@dataclass(frozen=True)
class Run:
    """A simulated job.

    Attributes
    ----------
    depth, lines : int
        Of the queue; lines a second that arrive at most.
    speed, by_depth, by_lines : float
        Mean speed over its middle half, and what depth and lines allow, mm/min.
    waiting : float
        Blocks in the queue, on average, when one begins.
    brakes : int
        Segments of the middle half that ended slower than they began.
    empty : int
        Segments of the middle half that began with no other in the queue.
    """

    depth: int
    lines: int
    speed: float
    by_depth: float
    by_lines: float
    waiting: float
    brakes: int
    empty: int


def pass_clocks(depth: int) -> int:
    """Return the clocks of the longest pass of a queue, by its clock-exact model."""
    queue = BlockQueueModel(depth=depth, words=4)
    spent = 0
    for number in range(depth):
        # Entries are 0 until the newest block has a gain, which changes them all.
        for address, value in ((4, number == depth - 1), (6, 1)):
            while not queue.ready:
                queue.edge()
            queue.edge(write=(address, int(value), address == 6))
        spent = 0
        while queue.planning:
            queue.edge()
            spent += 1
    return spent + 1  # in the first clock after it none is accepted


def sustained(depth: int, lines: int, *, segment: float, acceleration: float,
              feed: float, segments: int, clock: int) -> Run:
    """Simulate a straight job.

    Parameters
    ----------
    depth, lines : int
        See :class:`Run`.
    segment, acceleration, feed : float
        In mm, mm/s^2 and mm/s.
    segments : int
        Length of the job.
    clock : int
        Clocks a second, for the time of a pass.
    """
    nanometres = 1_000_000
    top = round((feed * nanometres) ** 2)
    gain = round(2 * acceleration * segment * nanometres ** 2)
    blocks: list[tuple[int, int]] = []  # in the queue
    entries: list[int] = []
    time = arrives = 0.0
    sent = w = brakes = empty = waiting = 0
    began, middle = [], range(segments // 4, segments - segments // 4)

    def receive() -> None:
        """Commit the lines that have come, as far as there is room."""
        nonlocal sent, arrives, entries
        changed = False
        while sent < segments and len(blocks) < depth and arrives <= time:
            blocks.append((top if sent else 0, gain))
            sent += 1
            arrives = max(arrives + 1 / lines, time + 8 * (len(blocks) + 1) / clock)
            changed = True
        if changed:
            entries = plan(blocks)

    for number in range(segments):
        receive()
        if not blocks:
            time = arrives
            receive()
        blocks.pop(0)
        entries.pop(0)
        began.append(time)
        if number in middle:
            empty += not blocks
            waiting += len(blocks)
        first, step = w, gain // GRANULES
        for part in range(GRANULES, 0, -1):
            receive()
            after = (entries[0] if blocks else 0) + (part - 1) * step
            new = max(min(w + step, top, after), w - step, 0)
            time += 2 * segment / GRANULES * nanometres / max(sqrt(w) + sqrt(new), 1)
            w = new
        brakes += number in middle and w < first
    spent = began[middle[-1]] - began[middle[0]]
    return Run(depth, lines, round((len(middle) - 1) * segment / spent * 60, 1),
               round(sqrt(2 * acceleration * depth * segment) * 60, 1),
               round(segment * lines * 60, 1), round(waiting / len(middle), 1), brakes, empty)


def runs(depths: Sequence[int], rates: Sequence[int], **job) -> Iterator[Run]:
    """Simulate a job for every depth and number of lines a second."""
    for depth in depths:
        for lines in rates:
            yield sustained(depth, lines, **job)


def positive(text: str) -> float:
    """Return a number above 0, for the parser."""
    value = float(text)
    if not 0 < value < 1e6:
        raise ValueError(text)
    return value


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.planning", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--depth", metavar="N", type=whole(4, 256), action="append",
                        help="blocks in the queue; may be repeated (default: 16, 64 and 128)")
    parser.add_argument("--lines", metavar="N", type=whole(1, 100_000), action="append",
                        help="lines a second; may be repeated (default: 500, 2000 and 5000)")
    parser.add_argument("--segment", metavar="MM", type=positive, default=0.05,
                        help="length of a segment (default: %(default)s)")
    parser.add_argument("--acceleration", metavar="MM/S2", type=positive, default=500.0,
                        help="acceleration (default: %(default)s)")
    parser.add_argument("--feed", metavar="MM/MIN", type=positive, default=60_000.0,
                        help="highest speed (default: %(default)s)")
    parser.add_argument("--segments", metavar="N", type=whole(100, 1_000_000), default=2000,
                        help="length of the job (default: %(default)s)")
    parser.add_argument("--clock", metavar="HZ", type=whole(2_000_000, 1_000_000_000),
                        default=50_000_000, help="clock (default: %(default)s)")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures there")
    args = parser.parse_args(argv)
    depths = args.depth or [16, 64, 128]
    for depth in depths:
        if depth & (depth - 1):
            raise UserError(f"a depth is a power of two, not {depth}")
    check_output(args.json)

    passes = {depth: pass_clocks(depth) for depth in depths}
    say(f"{'depth':>5} {'pass clocks':>11} {'us':>7} {'passes a second':>15}")
    for depth, clocks in passes.items():
        say(f"{depth:5} {clocks:11} {clocks / args.clock * 1e6:7.2f} {args.clock // clocks:15}")
    say(f"\nsegments of {args.segment:g} mm, {args.acceleration:g} mm/s2; speeds in mm/min")
    say(f"{'depth':>5} {'lines/s':>7} {'speed':>8} {'by depth':>8} {'by lines':>8} "
        f"{'waiting':>7} {'brakes':>6} {'empty':>6}")
    found = []
    for run in runs(depths, args.lines or [500, 2000, 5000], segment=args.segment,
                    acceleration=args.acceleration, feed=args.feed / 60, segments=args.segments,
                    clock=args.clock):
        say(f"{run.depth:5} {run.lines:7} {run.speed:8.1f} {run.by_depth:8.1f} "
            f"{run.by_lines:8.1f} {run.waiting:7.1f} {run.brakes:6} {run.empty:6}")
        found.append(run)
    if args.json:
        write_atomically(args.json, (json.dumps({
            "pass_clocks": passes, "runs": [asdict(run) for run in found]}, indent=1)
            + "\n").encode())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
