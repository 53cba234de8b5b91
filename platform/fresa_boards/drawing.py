"""The pins of a machine on a board, drawn: headers as they lie, and what is wired to each pin."""

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree as ET

from fresa.roles import MachineComponent

from .board import Allotment, Board, Layout, PinRow

__all__ = ["pin_drawing"]

ROW, PIN, LABEL, GAP, MARGIN = 22, 76, 190, 6, 20
"""Height of a row; widths of a pin, of what is wired to it, between the columns, and around all."""

_PAPER, _INK, _FAINT = "#ffffff", "#202020", "#767676"
_UNUSED, _SUPPLY, _GROUND = "#f0f0f0", "#c62828", "#424242"
_USED = "#1565c0"
_DASHED = {"fill": _PAPER, "stroke": _FAINT, "stroke-dasharray": "3 3"}
_LEGEND = "dashed: connect nothing here, the board uses this pin or it has other levels"


class _Sheet:
    """An SVG that grows downwards."""

    def __init__(self, width: int, title: str) -> None:
        self.width, self.y = width, MARGIN
        self.svg = ET.Element("svg", {"xmlns": "http://www.w3.org/2000/svg", "role": "img",
                                      "font-family": "sans-serif", "font-size": "13"})
        ET.SubElement(self.svg, "title").text = title
        self._paper = self.box(0, 0, 0, 0, _PAPER)

    def box(self, x: float, y: float, width: float, height: float, fill: str) -> ET.Element:
        return ET.SubElement(self.svg, "rect", {
            "x": str(x), "y": str(y), "width": str(width), "height": str(height), "fill": fill})

    def text(self, x: float, y: float, words: str, fill: str = _INK, anchor: str = "start",
             **more: str) -> None:
        ET.SubElement(self.svg, "text", {"x": str(x), "y": str(y), "fill": fill,
                                         "text-anchor": anchor, **more}).text = words

    def line(self, words: str, fill: str = _INK, **more: str) -> None:
        self.y += ROW
        self.text(MARGIN, self.y - 6, words, fill, **more)

    def finish(self) -> str:
        height = self.y + MARGIN
        for element in (self.svg, self._paper):
            element.set("width", str(self.width))
            element.set("height", str(height))
        self.svg.set("viewBox", f"0 0 {self.width} {height}")
        ET.indent(self.svg)
        return ET.tostring(self.svg, encoding="unicode") + "\n"


def pin_drawing(board: Board, name: str, machine: MachineComponent,
                allotment: Allotment) -> str:
    """Draw the headers of a board that a machine uses as SVG, and list its other pins.

    Pins of a header that are no pins for machines have a dashed outline.

    Parameters
    ----------
    board : Board
        The board.
    name : str
        The machine's.
    machine : MachineComponent
        The machine.
    allotment : Allotment
        Its pins.
    """
    rows = board.pin_rows(machine, allotment)
    wired = {row.place: row for row in rows if row.place in board.header}
    sheet = _Sheet(2 * (MARGIN + LABEL + GAP + PIN) + GAP, f"{name} on {board.name}")
    sheet.line(f"{name} on {board.name}", **{"font-size": "17", "font-weight": "bold"})
    sheet.line(board.title, _FAINT)
    reserved = False
    for layout in board.layouts:
        labels = {*layout.left.split(), *layout.right.split()}
        if wired.keys() & labels:
            _header(sheet, layout, board.header, wired)
            reserved |= any(_is_reserved(label, board.header) for label in labels)
    if reserved:
        sheet.y += ROW // 2
        sheet.line(_LEGEND, _FAINT)
    others = [row for row in rows if row.place not in wired]
    if others:
        sheet.y += ROW // 2
        sheet.line("on the board", **{"font-weight": "bold"})
    for row in others:
        sheet.line(f"{row.place}: {row.port}")
    return sheet.finish()


def _header(sheet: _Sheet, layout: Layout, header: Mapping[str, str],
            wired: Mapping[str, PinRow]) -> None:
    sheet.y += ROW // 2
    sheet.line(layout.name, **{"font-weight": "bold"})
    sheet.line(layout.view, _FAINT)
    sheet.y += 4
    middle = sheet.width / 2
    columns: Sequence[tuple[str, int]] = ((layout.left, -1), (layout.right, 1))
    for column, side in columns:
        for number, label in enumerate(column.split()):
            y, row = sheet.y + number * ROW, wired.get(label)
            fill, ink = ((_USED, _PAPER) if row else (_GROUND, _PAPER) if label == "GND" else
                         (_SUPPLY, _PAPER) if _is_supply(label) else (_UNUSED, _FAINT))
            x = middle + (GAP / 2 if side > 0 else -GAP / 2 - PIN)
            box = sheet.box(x, y + 1, PIN, ROW - 2, fill)
            if _is_reserved(label, header):
                box.attrib.update(_DASHED)
            sheet.text(x + PIN / 2, y + 15, label, ink, "middle")
            if row:
                words = row.port if row.role == row.port else f"{row.port} ({row.role})"
                sheet.text(middle + side * (GAP + PIN + 4), y + 15, words,
                           anchor="start" if side > 0 else "end")
    sheet.y += ROW * max(len(column.split()) for column, _ in columns)


def _is_reserved(label: str, header: Mapping[str, str]) -> bool:
    return not (label in header or label == "GND" or _is_supply(label))


def _is_supply(label: str) -> bool:
    return label in ("VIN", "VIO", "1V2", "3V3", "5V")
