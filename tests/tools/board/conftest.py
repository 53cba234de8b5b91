"""A real board behind a real browser."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest

from tests.tools.board.browser import Page, save, serve

FIGURE = [
    "......",
    ".##...",
    ".#....",
    ".##.#.",
    "....#.",
]


@pytest.fixture(scope="session")
def figure() -> np.ndarray:
    """Give a small picture that looks different however it is turned or mirrored."""
    return np.array([[pixel == "#" for pixel in row] for row in FIGURE])


@pytest.fixture(autouse=True)
def no_thread_is_left() -> Iterator[None]:
    """See that the threads of a board end with it."""
    before = threading.enumerate()
    yield
    for thread in threading.enumerate():
        if thread not in before and thread.name.startswith("board "):
            thread.join(10)
            assert not thread.is_alive(), f"{thread.name} is left"


@pytest.fixture(scope="module")
def board(libraries, tmp_path_factory, figure) -> Iterator[str]:
    """Give the address of a board with the figure as its job."""
    picture = save(figure, tmp_path_factory.mktemp("board") / "figure.png")
    with serve(picture, "--period", "10") as address:
        yield address


@pytest.fixture(scope="module")
def page(chromium, board) -> Page:
    """Give the page of the board, open in a browser."""
    return Page(chromium(), board)


@pytest.fixture
def fresh(page) -> Page:
    """Give the page with the machine as it was when it was switched on."""
    page.fresh()
    return page
