"""Draw the timing diagrams of the documentation from the benches."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

from tb.bench import CheckFailed
from tb.benches import BENCHES

from .console import Parser, Progress, UserError, command, say, write_folder_atomically
from .wave.draw import draw
from .wave.reader import Wave

__all__ = ["DIAGRAMS", "Diagram", "main", "made"]

DOCS = Path(__file__).parent.parent / "docs"

WIDTH = 960
"""Width of a diagram in pixels."""

PAGE, FOLDER = "timing.md", "timing"
"""The page, and the folder of its pictures beside it."""

ABOUT = """\
Runs the bench of each component on Amaranth's simulator, and draws a part of its waveform:
docs/timing/*.svg, and the page docs/timing.md that shows them. The same gateware gives the same
bytes.
"""

EPILOG = """\
examples:
  python -m tools.diagrams
      Draw them all again.

  python -m tools.diagrams --check
      Only say which are not as the gateware is now.

exit status: 0 if all went well, 1 if one is stale or a bench fails, 2 if they cannot be written.
"""

HEAD = """\
# Timing diagrams

One for each component of the mill, drawn from the waveform of its bench by `python -m
tools.diagrams`; a test fails when one is not as the gateware is. The benches run the components
with much shorter periods than the machine has. The numbers below count clocks; what changes at one
is there after its rising edge.

`python -m tb NAME --vcd FILE` makes the whole waveform, and `python -m tools.wave` looks into it.
"""


@dataclass(frozen=True)
class Diagram:
    """A part of the waveform of a bench.

    Attributes
    ----------
    bench : str
        Name of the bench, and of the diagram.
    shows : str
        What there is to be seen.
    signals : str
        Signals and headings, with spaces between.
    start, end : int
        The clocks from and to which it goes.
    radix : tuple of str
        How values are written, such as ``value=hex``.
    """

    bench: str
    shows: str
    signals: str
    start: int
    end: int
    radix: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """Its name in words."""
        return self.bench.replace("-", " ").capitalize()

    def svg(self) -> str:
        """Run the bench, and draw it."""
        with tempfile.TemporaryDirectory() as folder:
            vcd = Path(folder) / "wave.vcd"
            BENCHES[self.bench].run(vcd)
            return draw(Wave(vcd), self.signals.split(), f"{self.start}clk", f"{self.end}clk",
                        cycles=True, title=self.title, radix=self.radix, width=WIDTH)


DIAGRAMS = (
    Diagram(
        "frequency-divider",
        "A tick every 5 clocks while `enable` is on. Without it the count stays where it is; "
        "`clear` begins a period anew.",
        "inputs: enable clear outputs: tick inside: dut.count", 0, 32, radix=("dut.count=dec",)),
    Diagram(
        "coil-driver",
        "Each step takes the coils one word on in the motor's table, or with `direction` 0 one "
        "back. At the end `step` is kept on: what is asked for sooner than 4 clocks after a step "
        "is refused, and the coils stay.",
        "inputs: step direction outputs: coils moved refused inside: dut.rest", 20, 72),
    Diagram(
        "axis-drivers",
        "Three motors, a bit of `step` and of `direction` for each, X the lowest: every motor "
        "follows its own and no other.",
        "inputs: step direction outputs: moved axis_x axis_y axis_z", 90, 112),
    Diagram(
        "step-counter",
        "Up, down through 0 to 65534, and up again. Without a step it holds; `clear` makes it 0.",
        "inputs: step direction clear outputs: count", 0, 17, radix=("count=dec",)),
    Diagram(
        "order-control",
        "A movement of X and Y by 5 steps is taken with `valid` and `ready`. Its steps come a "
        "period of 4 clocks apart, until the counter has as many as were ordered; then it is ready "
        "for the next.",
        "order: moves_valid moves_ready moves_payload.axes moves_payload.steps "
        "state: dut.order_state_state outputs: clear step direction counter: count", 25, 51,
        radix=("count=dec",)),
    Diagram(
        "motion-sequencer",
        "An order to (9, 1) from (3, 3) becomes two movements: 2 steps along a diagonal, X forward "
        "and Y back, then 4 of X alone.",
        "order: start order.x order.y outputs: ready error state: dut.motion_state_state "
        "movements: moves_valid moves_payload.axes moves_payload.direction moves_payload.steps "
        "position: at_x at_y", 6, 20),
    Diagram(
        "automatic-control",
        "A movement of X by 5 becomes steps and counts. The second step is refused by the motors: "
        "it is not counted, and comes again. `shown` is the count that `select` asks for.",
        "movement: moves_valid moves_ready moves_payload.axes moves_payload.steps "
        "steps: step moved direction display: select shown counts: x.count", 0, 26,
        radix=("shown=dec",)),
    Diagram(
        "manual-control",
        "Two switches an axis: X up, X down, and both, which is up. While a switch is on, a step "
        "comes every 4 clocks; between two jogs nothing moves.",
        "inputs: enable jog outputs: active direction step", 0, 28),
    Diagram(
        "numerical-controller",
        "By hand X makes three steps; with `mode` this place becomes the origin, and the order to "
        "(3, 1) goes there by a step of X and Y together, then two of X alone. The coils go on "
        "from where they were.",
        "inputs: mode jog start order.x order.y outputs: ready axis_x axis_y counts: x.count "
        "y.count", 0, 36),
    Diagram(
        "guarded-controller",
        "Two controllers side by side, of which the first drives the motors. At clock 31 a bit of "
        "its count of X is upset. A clock later the error shows, and the coils stay as they are, "
        "in manual mode too, until a reset; then the next order is carried out.",
        "inputs: rst mode jog start order.x outputs: ready error axis_x "
        "drives: main.automatic.x.count watches: shadow.automatic.x.count", 18, 67),
    Diagram(
        "start-handshake",
        "An order is handed on by `start`, which holds until `ready` falls; it is taken from its "
        "source only when `ready` has risen again. After an error no order is taken or started.",
        "orders: orders_valid orders_ready orders_payload.x machine: ready error start order.x "
        "state: dut.handshake_state_state", 0, 39),
    Diagram(
        "spiral-walk",
        "Around a pixel in ever larger rings. `near` holds for the pixel and the ring that touches "
        "it; `inside` says whether a place is in the picture, of 4 rows and 5 columns. What lies "
        "before the first row or column counts down from 31.",
        "inputs: home centre advance outputs: row column inside near", 0, 40),
    Diagram(
        "square-generator",
        "Four corners for every start, each offered until it is taken.",
        "inputs: start orders_ready outputs: busy orders_valid orders_payload.x orders_payload.y "
        "state: dut.square_state_state", 0, 40),
    Diagram(
        "coordinate-generator",
        "Once the picture is copied from block RAM, it searches in rings for the nearest pixel "
        "that is left to mill, and orders the tool up, there, and down.",
        "inputs: orders_ready outputs: busy orders_valid orders_payload.x orders_payload.y "
        "orders_payload.up orders_payload.down state: dut.coordinates_state_state "
        "picture: dut.row dut.column", 32, 60),
    Diagram(
        "debouncer",
        "Bounces do not pass. A level that lasts does, at the second tick after it began; a gap of "
        "7 clocks, less than the period of 8, is not seen.",
        "contacts: i levels: o inside: dut.divider.tick", 60, 155),
    Diagram(
        "seven-segment",
        "One digit at a time, from the right, dark between two: the value is 0123. Digits and "
        "segments are lit by 0.",
        "inputs: value enable outputs: digits segments", 0, 66),
    Diagram(
        "monitor",
        "By hand the LEDs show the coils of the axis that is jogged, X before Y before Z, and the "
        "display is dark. In automatic mode it shows the count, and the LEDs are dark.",
        "inputs: mode jogging axis_x axis_y axis_z count outputs: leds digits segments", 0, 96),
    Diagram(
        "mill",
        "The whole machine by its own pins: X and Y by hand to the origin; then orders to (5, 2), "
        "the tool down, and a cut to (8, 5). The curves are the positions in steps.",
        "inputs: mode jog start position_x position_y down outputs: ready error axis_x axis_y "
        "axis_z positions: x.count y.count z.count", 0, 115),
)
"""In the order of the page: from steps to pins, from orders to steps, where orders come from."""


def made() -> dict[str, bytes]:
    """Draw everything: files by their names below docs.

    Raises
    ------
    CheckFailed
        If a bench fails.
    """
    files = {}
    page = [HEAD]
    with Progress(len(DIAGRAMS), "diagrams", "drawing") as progress:
        for diagram in DIAGRAMS:
            name = f"{FOLDER}/{diagram.bench}.svg"
            files[name] = diagram.svg().encode()
            page.append(f"## {diagram.title}\n\n{diagram.shows}\n\n"
                        f"![{diagram.title}: timing diagram]({name})\n")
            progress.advance()
    return {**files, PAGE: "\n".join(page).encode()}


@command
def main(argv: list[str] | None = None) -> int:
    """Run the command; give its exit status."""
    parser = Parser(prog="python -m tools.diagrams", description=ABOUT, epilog=EPILOG)
    parser.add_argument("--check", action="store_true", help="write nothing, say what is stale")
    parser.add_argument("--docs", metavar="FOLDER", type=Path, default=DOCS,
                        help="where the page is (default: docs)")
    args = parser.parse_args(argv)
    if not args.docs.is_dir():
        raise UserError(f"{args.docs} is no folder")
    try:
        files = made()
    except CheckFailed as failure:
        say(f"a bench failed at {failure}; python -m tb all tells which")
        return 1
    if args.check:
        return _check(args.docs, files)
    write_folder_atomically(args.docs, files)
    say(f"wrote {args.docs / PAGE} and {len(files) - 1} diagrams in {args.docs / FOLDER}")
    return 0


def _check(docs: Path, files: dict[str, bytes]) -> int:
    there = {f"{FOLDER}/{path.name}" for path in (docs / FOLDER).glob("*.svg")}
    stale = [f"{name} is stale" for name, data in files.items()
             if not (docs / name).is_file() or (docs / name).read_bytes() != data]
    stale += [f"{name} belongs to no component" for name in sorted(there - set(files))]
    for line in stale:
        say(line)
    say(f"{len(stale)} of {len(files)} files are not as the gateware; python -m tools.diagrams "
        "draws them again" if stale else f"{len(files)} files are as the gateware")
    return 1 if stale else 0


if __name__ == "__main__":
    raise SystemExit(main())
