"""SVG: every kind of shape, nesting, style; what is left out, and what is refused."""

import gzip
from math import cos, pi, radians, sin

import numpy as np
import pytest

from tests.tools.draw.drawings import distances, svg, write
from tools.console import UserError
from tools.draw import document
from tools.draw import svg as reading
from tools.draw.order import vpype_missing
from tools.draw.plan import plan
from tools.draw.svg import read_drawing
from tools.draw.wall import Wall


def lines(folder, body, attributes='width="100" height="100"'):
    """Return the points of each outline of a document."""
    drawing = read_drawing(write(folder, body, attributes))
    return [np.concatenate([curve.chords(1e-3) for curve in outline])
            for shape in drawing.shapes for outline in shape.outlines]


def corners(folder, body, attributes='width="100" height="100"'):
    """Return the bounding box of all: left, top, right, bottom."""
    low, high = read_drawing(write(folder, body, attributes)).bounds()
    return pytest.approx([low.real, low.imag, high.real, high.imag], abs=1e-5)


@pytest.mark.parametrize(("body", "box"), [
    ('<rect x="1" y="2" width="30" height="40"/>', [1, 2, 31, 42]),
    ('<rect x="10%" y="1mm" width="1in" height="3pt"/>', [10, 96 / 25.4, 106, 96 / 25.4 + 4]),
    ('<rect width="10" height="10" rx="3"/>', [0, 0, 10, 10]),
    ('<circle cx="5" cy="6" r="4"/>', [1, 2, 9, 10]),
    ('<ellipse cx="5" cy="6" rx="4" ry="2"/>', [1, 4, 9, 8]),
    ('<line x1="1" y1="2" x2="3" y2="4" stroke="red"/>', [1, 2, 3, 4]),
    ('<polyline points="1,2 3,4 5 0"/>', [1, 0, 5, 4]),
    ('<polygon points="1-2 3.5.5,5 0"/>', [1, -2, 5, .5]),
    ('<path d="M1 1h5v-2l2 2z"/>', [1, -1, 8, 1]),
    ('<path d="M0 0C0 8 6 8 6 0"/>', [0, 0, 6, 6]),
    ('<path d="M0 0Q3 8 6 0"/>', [0, 0, 6, 4]),
    ('<path d="M0 0Q2 4 4 0T8 0" stroke="red" fill="none"/>', [0, -2, 8, 2]),
    ('<path d="M0 0C0 2 2 2 2 0S4-2 4 0" stroke="red" fill="none"/>', [0, -1.5, 4, 1.5]),
    ('<path d="M-5 0a5 5 0 0110 0"/>', [-5, -5, 5, 0]),
    ('<path d="M0 0A0 5 0 0 1 5 5" stroke="red" fill="none"/>', [0, 0, 5, 5]),
])
def test_shapes(tmp_path, body, box):
    assert corners(tmp_path, body) == box


@pytest.mark.parametrize(("transform", "box"), [
    ("translate(10 5)", [10, 5, 12, 6]),
    ("scale(2, 3)", [0, 0, 4, 3]),
    ("rotate(90)", [-1, 0, 0, 2]),
    ("rotate(180, 1, 1)", [0, 1, 2, 2]),
    ("translate(10) rotate(90) scale(2)", [8, 0, 10, 4]),
    ("skewX(45)", [0, 0, 3, 1]),
    ("matrix(0 1 1 0 7 8)", [7, 8, 8, 10]),
    ("rotate(.25turn)", [-1, 0, 0, 2]), ("ROTATE(100grad)", [-1, 0, 0, 2]),
    ("translate(50%, 10%)", [50, 10, 52, 11]), ("translate3d(1mm, 0, 5px)",
                                                [96 / 25.4, 0, 2 + 96 / 25.4, 1]),
    ("translateX(5px)scaleY(200%)", [5, 0, 7, 2]),
])
def test_transforms(tmp_path, transform, box):
    rect = '<rect width="2" height="1"/>'
    assert corners(tmp_path, f'<g transform="{transform}">{rect}</g>') == box
    assert corners(tmp_path, f'<g style="transform: {transform}">{rect}</g>') == box
    halves = transform.split(") ")
    nested = "".join(f'<g transform="{half.rstrip(")")})">' for half in halves)
    assert corners(tmp_path, nested + rect + "</g>" * len(halves)) == box


@pytest.mark.parametrize("flags", ["0 0", "0 1", "1 0", "1 1"])
@pytest.mark.parametrize("skew", ["", "skewX(30) scale(1 2)", "scale(-1 1)"])
def test_arcs_lie_on_their_ellipse(tmp_path, flags, skew):
    rx, ry, turn, end = 6, 3, 30, 5 + 5j
    line, = lines(tmp_path, f'<path transform="{skew}" d="M0 0A{rx} {ry} {turn} {flags} 5 5" '
                            'fill="none" stroke="red"/>')
    if skew.startswith("skew"):
        line = line.real - np.tan(radians(30)) * line.imag + 1j * line.imag / 2
    if skew.startswith("scale"):
        line = -line.conjugate()
    assert line[0] == pytest.approx(0) and line[-1] == pytest.approx(end)
    # In the frame where the ellipse is a circle of radius 1, all points are as far from its centre.
    along = line * complex(cos(radians(turn)), -sin(radians(turn)))
    unit = along.real / rx + 1j * along.imag / ry
    half = (unit[-1] - unit[0]) / 2
    large, sweep = (flag == "1" for flag in flags.split())
    side = (1 - abs(half) ** 2) ** 0.5 * half / abs(half) * 1j
    centre = unit[0] + half + (side if large != sweep else -side)
    assert np.abs(np.abs(unit - centre) - 1).max() < 1e-6
    angles = np.unwrap(np.angle(unit - centre))
    assert (angles[-1] > angles[0]) == sweep and (abs(angles[-1] - angles[0]) > pi) == large


@pytest.mark.parametrize(("attributes", "box"), [
    ('width="200" height="100" viewBox="0 0 20 10"', [10, 10, 20, 20]),
    ('width="200" height="100" viewBox="0 0 10 10"', [60, 10, 70, 20]),
    ('width="200" height="100" viewBox="0 0 10 10" preserveAspectRatio="none"', [20, 10, 40, 20]),
    ('width="200" height="100" viewBox="0 0 10 10" preserveAspectRatio="xMinYMin slice"',
     [20, 20, 40, 40]),
    ('width="10mm" viewBox="0 0 10 10"', [96 / 25.4] * 2 + [192 / 25.4] * 2),
    ('width="100%" height="100%" viewBox="-1 -1 10 10"', [2, 2, 3, 3]),
    ('viewBox="bad"', [1, 1, 2, 2]),
    ('width="100vw" height="calc(5px)" viewBox="-1 -1 10 10"', [2, 2, 3, 3]),
    ('width="1" style="width: 100px; height: 100px" viewBox="0 0 10 10"', [10, 10, 20, 20]),
])
def test_view_boxes(tmp_path, attributes, box):
    assert corners(tmp_path, '<rect x="1" y="1" width="1" height="1"/>', attributes) == box


@pytest.mark.parametrize(("body", "box"), [
    ('<defs><rect id="a" width="2" height="1"/></defs><use xlink:href="#a" x="5" y="6"/>',
     [5, 6, 7, 7]),
    ('<rect id="a" width="2" height="1"/><use href="#a" transform="scale(2)" x="5"/>',
     [0, 0, 14, 2]),
    ('<symbol id="a" viewBox="0 0 2 1"><rect width="2" height="1"/></symbol>'
     '<use href="#a" x="5" y="6" width="20" height="10"/>', [5, 6, 25, 16]),
    ('<use href="#b" x="1"/><defs><g id="b"><use href="#a" x="1"/></g>'
     '<rect id="a" width="2" height="1"/></defs>', [2, 0, 4, 1]),
    ('<svg x="10" y="20" width="30" height="30"><rect width="50%" height="1"/></svg>'
     '<rect x="10" y="20" width="20%" height="1"/>', [10, 20, 30, 21]),
    ('<svg x="10" y="20" width="30" height="30" viewBox="0 0 3 3"><rect width="1" height="1"/>'
     '</svg>', [10, 20, 20, 30]),
    ('<switch><foreignObject width="9" height="9"/><rect width="1" height="1"/>'
     '<rect width="5" height="5"/></switch>', [0, 0, 1, 1]),
    ('<a href="x"><rect width="1" height="1"/></a>', [0, 0, 1, 1]),
    # What is not given is zero, whatever the document's own is.
    ('<rect x="3" width="10"/><rect y="1" width="1" height="1"/>', [0, 1, 1, 2]),
])
def test_nesting(tmp_path, body, box):
    assert corners(tmp_path, body) == box


SEEN = '<rect width="1" height="1"/>'


@pytest.mark.parametrize(("origin", "box"), [
    ("10px 20px", [-30, 20, 10, 50]), ("50% 50%", [40, 10, 80, 40]), ("center", [40, 10, 80, 40]),
    ("top right", [40, -90, 80, -60]), ("0 0 0", [-60, 10, -20, 40]),
])
def test_transforms_are_about_their_origin(tmp_path, origin, box):
    about = f'transform-origin:{origin}'
    rect = '<rect x="10" y="20" width="30" height="40"'
    assert corners(tmp_path, f'{rect} style="transform:rotate(90deg);{about}"/>') == box
    assert corners(tmp_path, f'{rect} transform="rotate(90)" transform-origin="{origin}"/>') == box


@pytest.mark.parametrize(("body", "box"), [
    ('<ellipse cx="50" cy="50" rx="30" ry="auto"/>', [20, 20, 80, 80]),
    ('<rect width="5" height="9" style="x:50px;width:30px"/>', [50, 0, 80, 9]),
    ('<rect width="101.6q" height="101.6Q"/>', [0, 0, 96, 96]),
    ('<symbol id="s" viewBox="0 0 10 10"><rect width="5" height="10"/></symbol>'
     '<use href="#s" width="auto"/>', [0, 0, 50, 100]),
    ('<switch><title>a</title><g systemLanguage="de"><rect width="9" height="9"/></g>'
     '<rect systemLanguage="en-GB" width="5" height="5"/><rect width="1" height="1"/></switch>',
     [0, 0, 5, 5]),
    ('<rect width="5" height="9"/><text><title>a tip</title></text>', [0, 0, 5, 9]),
])
def test_what_is_not_written_as_usual(tmp_path, body, box):
    assert corners(tmp_path, body) == box


def test_a_page_of_no_width_is_as_its_view_box(tmp_path):
    assert corners(tmp_path, '<rect width="5" height="9"/>', 'viewBox="0 0 10 10" width="foo"') == [
        0, 0, 5, 9]


@pytest.mark.parametrize("dot", ['path d="M50 50h0"', 'line x1="50" y1="50" x2="50" y2="50"'])
def test_lines_without_length_are_dots_if_their_ends_are_round(tmp_path, dot):
    round_one, = lines(tmp_path, f'<{dot} stroke="red" stroke-linecap="round"/>')
    assert set(round_one) == {50 + 50j}
    with pytest.raises(UserError, match="has nothing that a pen can draw"):
        lines(tmp_path, f'<{dot} stroke="red"/>')


def test_nesting_and_uses_together_are_bounded(tmp_path):
    links = "".join(f'<g id="l{link}">{"<g>" * 50}<use href="#l{link + 1}"/>{"</g>" * 50}</g>'
                    for link in range(60))
    with pytest.raises(UserError, match="nested deeper than 256, those used again included"):
        lines(tmp_path, f'<defs>{links}<rect id="l60" width="5" height="5"/></defs>'
                        '<use href="#l0"/>')


@pytest.mark.parametrize("hidden", [
    '<g display="none"><rect width="9" height="9"/></g>',
    '<rect width="9" height="9" style="display:none"/>',
    '<rect width="9" height="9" visibility="hidden"/>',
    '<g visibility="hidden"><rect width="9" height="9"/></g>',
    '<rect width="9" height="9" fill="none"/>',
    '<rect width="9" height="9" fill="none" stroke="red" stroke-width="0"/>',
    '<rect width="9" height="9" fill="none" stroke="red" stroke-opacity="0"/>',
    '<rect width="9" height="9" fill-opacity="0%"/>',
    '<g opacity="0"><rect width="9" height="9"/></g>',
    '<rect width="9" height="9" fill="transparent"/>',
    '<style>rect.a { fill: none }</style><rect class="a b" width="9" height="9"/>',
    '<style>g > rect { fill: none !important }</style><g><rect width="9" height="9" '
    'style="fill:red"/></g>',
    '<line x2="9" y2="9"/>',
    '<defs><rect width="9" height="9"/></defs>',
    '<clipPath><rect width="9" height="9"/></clipPath>',
    '<mask><rect width="9" height="9"/></mask>',
    '<pattern><rect width="9" height="9"/></pattern>',
    '<marker><rect width="9" height="9"/></marker>',
    '<symbol><rect width="9" height="9"/></symbol>',
    '<rect width="9" height="9" transform="scale(0)"/>',
    '<rect width="-9" height="9"/>',
    '<circle r="0"/>',
    '<path d=""/>',
    '<polygon points=""/>',
    '<svg width="0"><rect width="9" height="9"/></svg>',
    '<svg viewBox="0 0 0 0"><rect width="9" height="9"/></svg>',
    '<text display="none">no</text>',
    '<text>  </text>',
    '<text><tspan visibility="hidden">no</tspan></text>',
    '<path d="M9 9h0M9 9z" stroke="red"/>',
    '<path d="M9 9c0 0 0 0 0 0"/>',
    '<path d="M9 9" stroke="red" stroke-linecap="round"/>',
    '<inkscape:path d="M0 0H9"/>',
    '<unknown><rect width="9" height="9"/></unknown>',
])
def test_what_is_invisible_is_left_out(tmp_path, hidden):
    assert corners(tmp_path, hidden + SEEN) == [0, 0, 1, 1]


def test_children_of_what_is_hidden_may_be_seen(tmp_path):
    assert corners(tmp_path, '<g visibility="hidden"><rect width="9" height="9"/>'
                             '<rect width="2" height="2" visibility="visible"/></g>') == [
                                 0, 0, 2, 2]


def test_the_edge_of_a_fill_is_closed_and_a_stroke_is_not(tmp_path):
    filled, stroked = lines(tmp_path, '<path d="M0 0H5V5"/><polyline points="0 0 5 0 5 5" '
                                      'fill="none" stroke="red"/>')
    assert filled[-1] == filled[0] == 0 and stroked[-1] == 5 + 5j


def test_what_follows_a_close_begins_at_its_start(tmp_path):
    first, second = lines(tmp_path, '<path d="M1 1h4v4zl-5 0" stroke="red" fill="none"/>')
    assert first[0] == first[-1] == second[0] == 1 + 1j and second[-1] == -4 + 1j


@pytest.mark.parametrize("cap", ["round", "square"])
@pytest.mark.parametrize(("body", "points"), [
    ('<path d="M5 6h0"/>', [5 + 6j]),
    ('<path d="M5 6zM7 8h0v0M9 9"/>', [5 + 6j, 7 + 8j]),
    ('<path d="M5 6c0 0 0 0 0 0m1 1q0 0 0 0"/>', [5 + 6j, 6 + 7j]),
    ('<line x1="5" x2="5" y1="6" y2="6"/>', [5 + 6j]),
    ('<polyline points="5 6 5 6"/>', [5 + 6j]),
])
def test_lines_without_length_are_dots_if_they_have_caps(tmp_path, cap, body, points):
    dots = lines(tmp_path, f'<g stroke="red" stroke-linecap="{cap}">{body}</g>')
    assert [dot.tolist() for dot in dots] == [[point] * 2 for point in points]


def test_a_line_of_some_length_has_no_dots(tmp_path):
    line, = lines(tmp_path, '<path d="M5 6h0h4v0" fill="none" stroke="red" '
                            'stroke-linecap="round"/>')
    assert line.tolist() == [5 + 6j, 9 + 6j]


@pytest.mark.parametrize("vpype", [False, True])
def test_dots_come_to_the_wall(tmp_path, vpype):
    if vpype and (missing := vpype_missing()):
        pytest.skip(missing)
    drawing = read_drawing(write(tmp_path, '<path d="M0 0h0M9 0h0M0 9h0M9 0h0M5 5h4" stroke="red" '
                                           'fill="none" stroke-linecap="round"/>'))
    planned = plan(drawing, Wall(), effort=0.01, vpype=vpype)
    assert sorted(len(set(line.tolist())) for line in planned.lines) == [1, 1, 1, 2]


def test_layers_and_colours(tmp_path):
    drawing = read_drawing(write(tmp_path, """
        <g inkscape:groupmode="layer" inkscape:label="Sky" stroke="#00F">
          <g inkscape:groupmode="layer" inkscape:label="Clouds"><rect width="1" height="1"/></g>
          <rect width="2" height="2" stroke="currentColor" color="red"/></g>
        <g inkscape:groupmode="layer" id="layer2"><rect width="3" height="3" fill="lime"/></g>
        <g inkscape:groupmode="layer" inkscape:label="Off" style="display:none">
          <rect width="9" height="9"/></g>
        <rect width="4" height="4"/>"""))
    assert drawing.has_layers
    assert [(shape.layer, shape.colour) for shape in drawing.shapes] == [
        ("Sky", "#0000ff"), ("Sky", "#ff0000"), ("layer2", "#00ff00"), ("", "#000000")]


def test_groups_at_the_top_stand_for_layers(tmp_path):
    drawing = read_drawing(write(tmp_path, """<g id="a"><g id="b"><rect width="1" height="1"/></g>
        </g><g><rect width="1" height="1"/></g><rect width="1" height="1"/>"""))
    assert not drawing.has_layers
    assert [shape.layer for shape in drawing.shapes] == ["a", "group without name", ""]


@pytest.mark.parametrize(("body", "note"), [
    ('<image width="9" height="9" href="a.png"/>', "image"),
    ('<g clip-path="url(#a)"><rect width="1" height="1"/></g>', "clip-path ignored"),
    ('<rect width="1" height="1" mask="url(#a)"/>', "mask ignored"),
    ('<rect width="1" height="1" filter="url(#a)"/>', "filter ignored"),
    ('<path d="M0 0H5" stroke="red" stroke-dasharray="1 2"/>', "dashes drawn whole"),
    ('<path d="M0 0H5" stroke="red" marker-end="url(#a)"/>', "marker ignored"),
    ('<use href="other.svg#a"/>', "use of what is not in the file"),
    ('<path d="M0 0H5L bad" stroke="red"/>', "path data damaged, drawn up to there"),
    ('<foreignObject width="9" height="9"/>', "foreign object"),
    ('<style>@media print { rect { fill: none } }</style>', "style rules not understood"),
    ('<path d="M0 0H5" stroke="red" style="marker:url(#a)"/>', "marker ignored"),
    ('<path d="M0 0H5" stroke="red" style="d:path(&quot;M0 0H9&quot;)"/>',
     "path data of style ignored"),
    ('<svg width="9" height="9"><rect width="10" height="1"/></svg>', "viewport clipping ignored"),
    ('<svg width="9" height="9" viewBox="0 0 18 9" preserveAspectRatio="xMinYMin slice">'
     '<rect width="18" height="9"/></svg>', "viewport clipping ignored"),
    ('<rect x="99" width="9" height="9"/>', "outside the page, drawn all the same"),
    ('<rect systemLanguage="xx" width="1" height="1"/>',
     "what is for another language than English"),
    ('<svg refX="5" width="9" height="9"><rect width="1" height="1"/></svg>',
     "refX and refY ignored"),
])
def test_what_is_not_drawn_as_it_looks_is_noted(tmp_path, body, note):
    assert read_drawing(write(tmp_path, SEEN + body)).notes() == note
    twice = read_drawing(write(tmp_path, SEEN + body + body)).notes()
    assert twice == f"{note} (2)"


@pytest.mark.parametrize("body", [
    '<svg width="9" height="9"><circle cx="4.5" cy="4.5" r="4.5"/></svg>',
    '<svg width="9" height="9"><path d="M0 0C12 0 12 9 0 9"/></svg>',  # its control points are
    '<svg width="9" height="9" overflow="visible"><rect width="10" height="5"/></svg>',
    '<svg width="9" height="9" style="overflow: visible"><rect width="10" height="5"/></svg>',
    '<path d="M50 0V100.01"/>',
])
def test_what_is_not_cut_off_is_not_noted(tmp_path, body):
    assert not read_drawing(write(tmp_path, body)).notes()


@pytest.mark.parametrize("attributes", ["", 'width="100%" height="100%"', 'width="90mm"'])
def test_without_a_size_there_is_no_page(tmp_path, attributes):
    assert not read_drawing(write(tmp_path, '<rect width="9000" height="1"/>', attributes)).notes()


@pytest.mark.parametrize(("text", "message"), [
    ("", "is empty"),
    ("\n ", "is empty"),
    ("no XML", "is no SVG: syntax error"),
    ("<svg", "is no SVG: unclosed token"),
    ("<html/>", "is no SVG: its root is <html>"),
    (svg(""), "has nothing that a pen can draw"),
    (svg('<image href="a.png" width="1" height="1"/>'), "what there is: image"),
    (svg("<text>Hello &#8211; all of you who read this</text>"),
     "has text, 'Hello \u2013 all of you who r...': convert text to paths"),
    (svg('<g><text x="1">a <tspan>b</tspan></text></g>'), "has text, 'a b'"),
    (svg('<path d="M0 0L1e300 5"/>'), "coordinates that are too large"),
    (svg('<path d="M0 0L1e999 5"/>'), "coordinates that are too large"),
    (svg('<rect width="1e20" height="2"/>'), "coordinates that are too large"),
    (svg('<g transform="scale(1e999)"><rect width="1" height="2"/></g>'), "too large"),
    (svg('<g transform="scale(1e200)"><g transform="scale(1e200)"><rect width="1" height="2"/>'
         '</g></g>'), "too large"),
    *((svg(f'<rect width="1" height="1" transform="{each}"/>'), "cannot be read") for each in (
        "matrix(1 2)", "turn(1)", "translate(1", "translate(calc(1px + 2px))", "rotate(1px)")),
    *((svg(f'<rect width="1" height="1" style="{each}"/>'), message) for each, message in (
        ("translate:5px", "the property translate of CSS is not read"),
        ("transform:scale(2);transform-box:fill-box", "transform-box 'fill-box' is not read"),
        ("transform:scale(2);transform-origin:here", "transform-origin 'here' cannot be read"),
        ("width:5vw", "length '5vw' cannot be read"))),
    (svg('<text fill="none"><tspan fill="red">A</tspan></text>'), "has text, 'A'"),
    (svg('<text>a<title>t</title><tspan fill="none">b</tspan>c</text>'), "has text, 'ac'"),
    (svg('<g id="a"><use href="#a"/></g>'), "#a uses itself"),
    (svg('<defs><g id="a"><use href="#b"/></g><g id="b"><use href="#a"/></g></defs>'
         '<use href="#a"/>'), "uses itself"),
    ('<?xml version="1.0"?><!DOCTYPE svg [<!ENTITY a "b">]>' + svg("<rect/>"),
     "declares an XML entity, a, and those are not read"),
    ('<?xml version="1.0" encoding="klingon"?>' + svg("<rect/>"), "is no SVG"),
    ("<svg>" + "<g>" * 5000 + "</g>" * 5000 + "</svg>", "nested deeper than 256"),
])
def test_what_cannot_be_drawn_is_refused_in_one_line(tmp_path, text, message):
    path = tmp_path / "drawing.svg"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(UserError) as caught:
        read_drawing(path)
    assert message in str(caught.value) and str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_billion_laughs_are_refused(tmp_path):
    laughs = '<!ENTITY l0 "ha">' + "".join(
        f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
    path = tmp_path / "bomb.svg"
    path.write_text(f"<!DOCTYPE svg [{laughs}]>" + svg("<desc>&l9;</desc>"))
    with pytest.raises(UserError, match="declares an XML entity"):
        read_drawing(path)


def test_a_file_of_the_system_is_not_read(tmp_path):
    path = tmp_path / "bomb.svg"
    path.write_text('<!DOCTYPE svg [<!ENTITY a SYSTEM "file:///etc/hostname">]>'
                    + svg("<desc>&a;</desc>"))
    with pytest.raises(UserError, match="declares an XML entity"):
        read_drawing(path)


def test_the_doctype_of_svg_is_no_harm(tmp_path):
    path = tmp_path / "drawing.svg"
    path.write_text('<!DOCTYPE svg PUBLIC "-//W3C//DTD SVG 1.1//EN" '
                    '"http://www.w3.org/Graphics/SVG/1.1/DTD/svg11.dtd">' + svg(SEEN))
    assert len(read_drawing(path).shapes) == 1


def test_uses_that_grow_without_bounds_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "MOST_ELEMENTS", 5000)
    levels = "".join(f'<g id="a{n}">' + f'<use href="#a{n - 1}"/>' * 10 + "</g>"
                     for n in range(1, 12))
    with pytest.raises(UserError, match="more than 5000 elements"):
        read_drawing(write(tmp_path, f'<defs><rect id="a0" width="1" height="1"/>{levels}</defs>'
                                     '<use href="#a11"/>'))


def test_texts_are_nested_no_deeper(tmp_path):
    text = "<text>" + "<tspan>" * 200 + "a" + "</tspan>" * 200 + "</text>"
    with pytest.raises(UserError, match="has text"):
        read_drawing(write(tmp_path, text))
    groups = "<g>" * 100, "</g>" * 100
    with pytest.raises(UserError, match="nested deeper than 256"):
        read_drawing(write(tmp_path, f'<g display="none"><g id="a">{text}</g></g>'
                                     f'{groups[0]}<use href="#a"/>{groups[1]}'))


def test_compressed_files(tmp_path, monkeypatch):
    path = tmp_path / "drawing.svgz"
    path.write_bytes(data := gzip.compress(svg(SEEN).encode()))
    assert len(read_drawing(path).shapes) == 1
    for damaged in (data[:20], data[:20] + b"\xff" * 99, data[:10] + b"\xff" * 9):
        path.write_bytes(damaged)
        with pytest.raises(UserError, match="is compressed, and damaged"):
            read_drawing(path)
    monkeypatch.setattr(document, "MOST_BYTES", 1000)
    path.write_bytes(gzip.compress(bytes(100_000)))
    with pytest.raises(UserError, match="is longer than"):
        read_drawing(path)


def test_curves_survive_any_nesting_exactly(tmp_path):
    """A circle in a skewed group is the ellipse that its image is, not chords of it."""
    line, = lines(tmp_path, '<g transform="matrix(2 1 0 3 5 6)"><circle r="10"/></g>')
    t = np.linspace(0, 2 * pi, 1000)
    x, y = 10 * np.cos(t), 10 * np.sin(t)
    assert distances(5 + 2 * x + 1j * (6 + x + 3 * y), line).max() < 2e-3
