"""What the mill is to do, as a list of orders: of a picture, or of a text."""

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fresa.machines.mill import PIXEL_STEPS
from fresa_host.order_lines import LAST_NUMBER, Kind, Order

from .console import UserError

__all__ = ["picture_orders", "read_orders", "stroke_start", "write_orders"]

LARGEST = 1 << 29
"""Bytes of the longest text that is read: one of all orders that a job may have, and more."""

MOST = LAST_NUMBER - 1
"""Orders of the longest list: one that raises the tool may be put before them."""

NEAR = 9
"""Places of the spiral that the tool reaches without being raised: a pixel and its neighbours."""

SHOWN = 40


def picture_orders(pixels: NDArray[np.bool_], pitch: int = PIXEL_STEPS) -> list[Order]:
    """Return the orders that mill a picture: always the nearest pixel next.

    They are those of :class:`fresa.motion.CoordinateGenerator`, one for one.

    Parameters
    ----------
    pixels : array of bool
        Rows of pixels, at least one of which is set.
    pitch : int
        Steps from pixel to pixel.
    """
    rows, columns = pixels.shape
    margin = max(rows, columns)
    left = np.zeros((rows + 2 * margin, columns + 2 * margin), bool)
    left[margin:margin + rows, margin:margin + columns] = pixels
    width = left.shape[1]
    flat = left.reshape(-1)  # a step in a direction is a number, and outside nothing is set
    spiral = _spiral(margin, width)
    near = [int(offset) for offset in spiral[:NEAR]]

    up, down = Order(Kind.UP), Order(Kind.DOWN)
    orders, at, lowered = [], margin * width + margin, False
    for _ in range(int(np.count_nonzero(pixels))):
        step = next((offset for offset in near if flat[at + offset]), None)
        walk = lowered and step is not None
        at += _first(flat, at, spiral) if step is None else step
        flat[at] = False
        row, column = at // width - margin, at % width - margin
        go = Order(Kind.GO, row * pitch, column * pitch)
        orders += [go] if walk else [up, go, down]
        lowered = True
    return [*orders, up, Order(Kind.GO)]


def _spiral(rings: int, width: int) -> NDArray[np.int64]:
    """Return the way round a pixel: runs of 1, 1, 2, 2, 3, 3 ... west, south, east, north."""
    runs = np.repeat(np.arange(1, 2 * rings), 2)
    headings = np.resize([-1, width, 1, -width], len(runs))
    return np.concatenate([[0], np.cumsum(np.repeat(headings, runs))])


def _first(flat: NDArray[np.bool_], at: int, spiral: NDArray[np.int64]) -> int:
    """Return the first offset of the spiral at which a pixel is set; there is one."""
    begin, size = NEAR, 64
    while True:
        found = np.flatnonzero(flat[at + spiral[begin:begin + size]])
        if len(found):
            return int(spiral[begin + found[0]])
        begin, size = begin + size, 2 * size


def read_orders(path: Path) -> list[Order]:
    """Read a list of orders: ``go X Y``, ``up`` or ``down``, one a line; ``#`` begins a comment.

    Raises
    ------
    UserError
        If the file cannot be read, or a line is no order.
    """
    with path.open("rb") as file:
        data = file.read(LARGEST + 1)  # a device may have no end
    if len(data) > LARGEST:
        raise UserError(f"{path} is too long for a list of orders")
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        raise UserError(f"{path} is no list of orders: it is not text") from error
    orders = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.partition("#")[0].lower().split()
        if words:
            orders.append(_order(words, f"{path}, line {number}"))
    if not 1 <= len(orders) <= MOST:
        raise UserError(f"{path} has {len(orders)} orders; a job has 1 to {MOST}")
    return orders


def _order(words: list[str], where: str) -> Order:
    kind, *places = words
    if kind in ("up", "down") and not places:
        return Order(Kind[kind.upper()])
    if kind == "go" and len(places) == 2 and all(
            re.fullmatch(r"[0-9]{1,5}", place) and int(place) <= 0xFFFF for place in places):
        return Order(Kind.GO, *map(int, places))
    said = " ".join(words)
    said = said if len(said) <= SHOWN else f"{said[:SHOWN]}..."
    raise UserError(f"{where}: an order is 'go X Y' with steps from 0 to 65535, 'up' or 'down', "
                    f"not {said!r}")


def write_orders(orders: list[Order]) -> bytes:
    """Return a text that `read_orders` reads."""
    return "".join(f"{order}\n" for order in orders).encode()


def stroke_start(orders: list[Order], number: int) -> int:
    """Return the number of the order that raises the tool before order `number`, or 1.

    After a reset the tool counts as raised: from there on a job can begin.
    """
    raised = (n for n in range(number, 0, -1) if orders[n - 1].kind == Kind.UP)
    return next(raised, 1)
