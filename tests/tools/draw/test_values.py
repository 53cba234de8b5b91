"""Lengths and transforms as SVG and CSS write them, by what each is worth."""

import pytest

from tools.draw.values import Unreadable, length, origin, transform

POINT = 3 + 5j


@pytest.mark.parametrize(("text", "pixels"), [
    ("2.54cm", 96), ("25.4mm", 96), ("25.4MM", 96), ("101.6q", 96), ("101.6Q", 96), ("1in", 96),
    ("72pt", 96), ("6pc", 96), ("7", 7), (" 7px ", 7), ("-.5e1px", -5), ("5.", 5), ("2em", 32),
    ("2rem", 32), ("2ex", 16), ("25%", 50), ("auto", None), ("foo", None), ("", None),
    (None, None), ("1 px", None), ("1,2", None)])
def test_lengths(text, pixels):
    assert length(text, 200) == (None if pixels is None else pytest.approx(pixels))


@pytest.mark.parametrize("text", ["5vw", "5vh", "5vmin", "5VMAX", "5svh", "calc(2px + 3px)",
                                  "var(--x)", "5foo"])
def test_lengths_that_are_not_understood_are_refused(text):
    with pytest.raises(Unreadable, match="cannot be read: give it in mm or px"):
        length(text, 200)


@pytest.mark.parametrize(("text", "image"), [
    ("", POINT), ("none", POINT), ("translate(1-2)", 4 + 3j), ("translate(1.5.5)", 4.5 + 5.5j),
    ("TRANSLATE(1PX, 2px)", 4 + 7j), ("translate(50%, 50%)", 103 + 55j), ("translate(1)", 4 + 5j),
    ("translateX(10%)", 23 + 5j), ("translateY(10%)", 3 + 15j), ("translate3d(1px,2px,0)", 4 + 7j),
    ("translateZ(0)", POINT), ("translate (1) , scale(2)", 7 + 10j), ("scale(200%)", 6 + 10j),
    ("scaleX(2)", 6 + 5j), ("scaleY(2)", 3 + 10j), ("rotate(90)", -5 + 3j),
    ("rotate(.25turn)", -5 + 3j), ("rotate(100grad)", -5 + 3j), ("rotate(90deg)", -5 + 3j),
    ("rotate(1.5707963267948966rad)", -5 + 3j), ("rotateZ(90deg)", -5 + 3j),
    ("rotate(90 3 4)", 2 + 4j), ("skewX(45)", 8 + 5j), ("skewY(45deg)", 3 + 8j),
    ("skew(45, 45)", 8 + 8j), ("matrix(1 2 3 4 5 6)", 23 + 32j), ("translate(1/**/2)", 4 + 7j)])
def test_transforms(text, image):
    assert transform(text, 200, 100)(POINT) == pytest.approx(image)


@pytest.mark.parametrize("text", [
    "foo(1)", "translate(1", "translate 1", "translate()", "translate(1 2 3)", "matrix(1 2 3)",
    "translate(calc(20px + 2px),0)", "translate(1deg)", "translate(1vw)", "scale(1px)",
    "rotate(1px)", "rotate(90 1)", "rotate(1e999)", "scale(2)junk", "scale(2) none", "rotate(a)",
    "rotate3d(0, 0, 1, 9deg)", "perspective(1px)", "skewX(1 2)", "scaleX(1 2)",
    pytest.param(f"rotate({'1' * 100_000}!)", id="long")])
def test_transforms_that_are_not_understood_are_refused(text):
    with pytest.raises(Unreadable, match="^transform '.{1,60}' cannot be read$"):
        transform(text, 200, 100)


@pytest.mark.parametrize(("text", "point"), [
    ("0 0", 0), ("1px 2mm", 1 + 192j / 25.4), ("50% 50%", 100 + 50j), ("center", 100 + 50j),
    ("left", 50j), ("top", 100), ("RIGHT bottom", 200 + 100j), ("bottom right", 200 + 100j),
    ("10px", 10 + 50j), ("10px top 0", 10), ("center 5px 0px", 100 + 5j)])
def test_origins(text, point):
    assert origin(text, 200, 100) == pytest.approx(point)


@pytest.mark.parametrize("text", ["", "a", "1 b", "left left", "1 2 3", "1 2 0 0"])
def test_origins_that_are_not_understood_are_refused(text):
    with pytest.raises(Unreadable, match="transform-origin '.*' cannot be read"):
        origin(text, 200, 100)
