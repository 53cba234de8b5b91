"""The picture of a wall."""

import numpy as np

from tools.draw.picture import ASKED, PALETTE, WORST, draw_wall, pen_colours, travels
from tools.draw.wall import Part, Wall

WALL = Wall(1000, 800, top=100, margin=50, rest=500 + 700j)
RED = Part("red \u2603", "#ff0000",
           [np.array([100 + 200j, 900 + 200j]), np.array([300 + 400j] * 2)])
WHITE = Part("paper", "#ffffff", [np.array([100 + 300j, 100 + 600j])])


def share(image, colour, slack=60):
    """Return how many pixels are about of a colour."""
    pixels = np.asarray(image).astype(int)
    return int((np.abs(pixels - colour).max(axis=2) < slack).sum())


def test_pens_have_their_colours():
    image = draw_wall([RED, WHITE], WALL, "title", ["a fact"])
    assert image.size[0] > 1000 and share(image, (255, 0, 0)) > 500
    assert pen_colours([RED, WHITE]) == [(255, 0, 0), (200, 200, 200)]  # white would not be seen
    assert pen_colours([RED, RED]) == list(PALETTE[:2])


def test_texts_are_not_cut_and_have_letters_that_the_font_has():
    narrow = Wall(2, 2000, top=1, margin=0)
    fact = "about a minute, half of it with the pen down"
    part = RED._replace(lines=[np.array([1 + 5j, 1 + 1500j])])
    image = draw_wall([part], narrow, "a", [fact])
    assert image.size[0] > 10 * len(fact) / 2
    paper = np.asarray(image)[:, -20:]
    assert (paper == paper[0, 0]).all()  # a margin
    long = draw_wall([part._replace(name="x" * 500)], narrow, "\u00c9t\u00e9\n" * 99, [fact])
    assert long.size[0] < 1000
    same = [draw_wall([part], narrow, title, [fact]) for title in ("\u00c9t\u00e9\nb", "Ete b")]
    assert same[0] == same[1]


def test_what_was_done_is_drawn_over_what_was_asked_for():
    done = [[np.array([100 + 245j, 900 + 195j])]]
    plain, both = (draw_wall([RED], WALL, "title", done=each) for each in ([], done))
    assert share(plain, ASKED, 20) < share(both, ASKED, 20) / 2  # a thin line of its own
    assert share(both, (255, 0, 0)) > 500 > 100 > share(both, WORST, 20)
    marked = draw_wall([RED], WALL, "title", done=done, worst=(400 + 225j, 20))
    assert share(marked, WORST, 20) > 500 and marked.size[1] > both.size[1]


def test_the_ways_with_the_pen_up():
    assert list(travels([RED, WHITE], 0j)) == [
        (0, 100 + 200j), (900 + 200j, 300 + 400j), (300 + 400j, 0), (0, 100 + 300j),
        (100 + 600j, 0)]
