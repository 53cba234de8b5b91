"""Rows of a timing diagram: bits, buses, names of states, curves."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from .scene import CHARACTER, Scene
from .segments import Segment, extent, segments
from .trace import Trace, Value

__all__ = ["GAP", "Frame", "Row", "draw_row", "short"]

GAP = 12.0
"""Pixels between names and waves."""

ROW, GRAPH, HEADING = 26.0, 62.0, 24.0
"""Heights of a row, of a row with a curve, of a heading."""

HALF = 8.0
"""Half the height of a wave in its row."""

SLOPE = 3.0
"""Width of a slanted edge, in pixels."""

EVENTS = 2000
"""Most events that are drawn; they are the first ones."""


@dataclass(frozen=True)
class Row:
    """A row of a diagram.

    Attributes
    ----------
    name : str
        Text to its left.
    trace : Trace, optional
        Its signal; None for a heading.
    text : callable
        Formats a value.
    signed : int
        Width of a signed number in bits, 0 if it is not signed.
    curve : bool
        Whether to draw a curve.
    """

    name: str
    trace: Trace | None = None
    text: Callable[[Value], str] = str
    signed: int = 0
    curve: bool = False

    @property
    def height(self) -> float:
        """Its height in pixels."""
        return HEADING if self.trace is None else GRAPH if self.curve else ROW


@dataclass(frozen=True)
class Frame:
    """The area of the waves.

    Attributes
    ----------
    left, right : float
        Its ends in pixels.
    start, end : int
        The interval that it shows, in ticks; the end is after the start.
    """

    left: float
    right: float
    start: int
    end: int

    def x(self, time: float) -> float:
        """Return the place of a time in pixels."""
        return self.left + (time - self.start) / (self.end - self.start) * (self.right - self.left)


def draw_row(scene: Scene, frame: Frame, row: Row, middle: float) -> None:
    """Draw a row that is no heading; `middle` is its height in the scene."""
    trace = row.trace
    assert trace is not None
    lane = _Lane(scene, row, trace, middle)
    if trace.kind == "event":
        inside = (trace.times >= frame.start) & (trace.times <= frame.end)
        for time in trace.times[inside][:EVENTS].tolist():
            scene.line("bit", [(frame.x(time), lane.bottom), (frame.x(time), lane.top)])
        return
    curve = row.curve and trace.kind != "text"
    found = segments(trace, frame.start, frame.end, frame.left, frame.right, fine=curve)
    if curve:
        lane.curve(frame, found)
    elif trace.bits == 1 and trace.kind == "bits":
        lane.bit(found)
    else:
        for segment in found:
            lane.hexagon(segment)


class _Lane:
    """Draws one row."""

    def __init__(self, scene: Scene, row: Row, trace: Trace, middle: float) -> None:
        self._scene, self._row, self._trace, self._middle = scene, row, trace, middle
        self.top, self.bottom = middle - HALF, middle + HALF

    def bit(self, found: Sequence[Segment]) -> None:
        line: list[tuple[float, float]] = []
        for segment, after in zip_longest(found, found[1:]):
            x, end = segment.left, segment.right
            if segment.busy or isinstance(segment.value, str):
                if line:
                    self._scene.line("bit", line)
                    line = []
                self._block("busy" if segment.busy else "unknown", segment)
                continue
            y = self.top if segment.value else self.bottom
            lean = min(SLOPE, (end - x) / 2) if line else 0
            if segment.value:
                # The slant belongs to the following segment.
                falls = min(SLOPE, after.width / 2) if after and not after.busy and (
                    after.value == 0) else 0
                self._scene.area("high", [(x, self.bottom), (x + lean, y), (end, y),
                                          (end + falls, self.bottom)])
            line += [(x + lean, y), (end, y)]
        if line:
            self._scene.line("bit", line)

    def hexagon(self, segment: Segment) -> None:
        if segment.busy:
            self._block("busy", segment)
            return
        names = self._trace.kind == "text"
        unknown = isinstance(segment.value, str) and not self._trace.named
        x, end, lean = segment.left, segment.right, min(SLOPE, segment.width / 2)
        # A value that continues beyond the picture has no point at its edge.
        left = [(x, self.bottom), (x, self.top)] if segment.cut_left else [
            (x + lean, self.bottom), (x, self._middle), (x + lean, self.top)]
        right = [(end, self.top), (end, self.bottom)] if segment.cut_right else [
            (end - lean, self.top), (end, self._middle), (end - lean, self.bottom)]
        self._scene.area("unknown" if unknown else "state" if names else "bus", [*left, *right])
        if unknown:
            self._hatch(segment)
            return
        room = int((segment.width - 2 * lean - 2) / CHARACTER)
        text = self._row.text(segment.value)
        # A shortened name can still be read; a shortened number would be wrong.
        if len(text) > room:
            text = short(text, room) if names and room >= 3 else ""
        if text:
            self._scene.text("value", (x + end) / 2, self._middle, text, "middle")

    def _block(self, style: str, segment: Segment) -> None:
        self._scene.area(style, [(segment.left, self.top), (segment.right, self.top),
                                 (segment.right, self.bottom), (segment.left, self.bottom)])
        if style == "unknown":
            self._hatch(segment)

    def _hatch(self, segment: Segment) -> None:
        """Hatch a segment with lines that rise to the right and end at its edges."""
        height = self.bottom - self.top
        x = segment.left - height + 6
        while x < segment.right:
            low, high = max(x, segment.left), min(x + height, segment.right)
            if high > low:
                self._scene.line("unknown", [(low, self.bottom - (low - x)),
                                             (high, self.bottom - (high - x))])
            x += 6

    def curve(self, frame: Frame, found: Sequence[Segment]) -> None:
        signed = self._row.signed
        top, bottom = self._middle - GRAPH / 2 + 7, self._middle + GRAPH / 2 - 7
        least, most = extent(self._trace, frame.start, frame.end, signed)
        scale = (bottom - top) / ((most - least) or 1)
        line: list[tuple[float, float]] = []

        def flush() -> None:
            if line:
                zero = bottom + least * scale
                self._scene.area("under", [(line[0][0], zero), *line, (line[-1][0], zero)])
                self._scene.line("curve", list(line))
                line.clear()

        for segment in found:
            values = segment.extremes(signed)
            if values is None:
                flush()
                self._block("unknown", segment)
                continue
            for value in values:
                line.append((segment.left, bottom - (value - least) * scale))
            line.append((segment.right, line[-1][1]))
        flush()
        for value, y in {most: top, least: bottom}.items():
            self._scene.text("note", frame.left - GAP / 2, y, f"{value:.6g}", "end")


def short(text: str, room: int, *, tail: bool = False) -> str:
    """Shorten a text to a number of characters, keeping its head or its tail."""
    if len(text) <= room:
        return text
    return "\u2026" + text[len(text) - room + 1:] if tail else text[:room - 1] + "\u2026"
