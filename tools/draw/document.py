"""SVG as a tree, read so that no file can do harm, and the style of each of its elements."""

import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

import cssselect2
import defusedxml.ElementTree
import tinycss2
from defusedxml import DefusedXmlException, EntitiesForbidden

from ..console import UserError

__all__ = ["INKSCAPE", "MARKERS", "MOST_DEPTH", "SVG", "Styles", "href", "local_name", "read"]

SVG, XLINK, INKSCAPE = ("{http://www.w3.org/2000/svg}", "{http://www.w3.org/1999/xlink}",
                        "{http://www.inkscape.org/namespaces/inkscape}")

MOST_BYTES = 1 << 26
MOST_DEPTH = 256

MARKERS = ("marker-start", "marker-mid", "marker-end")
INHERITED = {"fill": "black", "stroke": "none", "stroke-width": "1", "visibility": "visible",
             "color": "black", "fill-opacity": "1", "stroke-opacity": "1",
             "stroke-dasharray": "none", "stroke-linecap": "butt",
             **dict.fromkeys(MARKERS, "none")}
OWN = {"display": "inline", "opacity": "1", "clip-path": "none", "mask": "none", "filter": "none",
       "overflow": "hidden", "transform": "none", "transform-origin": "0 0",
       "transform-box": "view-box"}
"""Properties that matter here, with their initial values: those that children inherit, and those
that they do not."""
CSS_ONLY = {"translate": "none", "rotate": "none", "scale": "none", "offset-path": "none",
            "d": "none"}
"""Properties that are none as an attribute, or another."""
GEOMETRY = {"x", "y", "width", "height", "cx", "cy", "r", "rx", "ry"}
"""Attributes that style sheets can set, by a value that has a unit."""
WITH_UNIT = re.compile(r"[-+]?0*\.?0*|.*[^\d.]")


def read(path: Path) -> Element:
    """Return the root of an SVG file, which may be compressed (.svgz).

    Entities of its own are refused: a few lines of them can stand for gigabytes, or another file.

    Raises
    ------
    UserError
        If it is no SVG, or not to be read.
    """
    data = _bytes(path)
    if not data.strip():
        raise UserError(f"{path} is empty")
    try:
        root = defusedxml.ElementTree.fromstring(data)
    except EntitiesForbidden as error:
        raise UserError(f"{path} declares an XML entity, {error.name}, and those are not read: "
                        "save it as plain SVG") from error
    except DefusedXmlException as error:
        raise UserError(f"{path} refers to another file from its XML, which is not read: save it "
                        "as plain SVG") from error
    except ParseError as error:
        raise UserError(f"{path} is no SVG: {error}") from error
    except (LookupError, ValueError) as error:  # of its encoding
        raise UserError(f"{path} is no SVG: its encoding is unknown") from error
    if local_name(root) != "svg":
        raise UserError(f"{path} is no SVG: its root is <{str(root.tag).rpartition('}')[2]}>")
    if _depth(root) > MOST_DEPTH:
        raise UserError(f"{path} has elements nested deeper than {MOST_DEPTH}: ungroup some")
    return root


def _bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if data.startswith(b"\x1f\x8b"):
        unpacker = zlib.decompressobj(wbits=31)
        try:
            data = unpacker.decompress(data, MOST_BYTES + 1)
        except zlib.error as error:
            raise UserError(f"{path} is compressed, and damaged: {error}") from error
        if not unpacker.eof and len(data) <= MOST_BYTES:
            raise UserError(f"{path} is compressed, and damaged: it is cut short")
    if len(data) > MOST_BYTES:
        raise UserError(f"{path} is longer than {MOST_BYTES >> 20} MB: split it")
    return data


def _depth(root: Element) -> int:
    """Return how deep elements are nested, without recursion."""
    deepest, level = 0, [root]
    while level:
        deepest += 1
        level = [child for element in level for child in element]
    return deepest


def local_name(element: Element) -> str:
    """Return the name of an SVG element; empty for one of another language."""
    tag = element.tag if isinstance(element.tag, str) else "{}"
    if tag.startswith(SVG):
        return tag[len(SVG):]
    return "" if tag.startswith("{") else tag  # without a namespace, as some programs write it


def href(element: Element) -> str | None:
    """Return what an element refers to."""
    return element.get("href", element.get(f"{XLINK}href"))


class Styles:
    """What presentation attributes, style sheets and ``style`` make of each element, by CSS.

    Parameters
    ----------
    root : Element
        Of the document, whose style sheets are read.

    Attributes
    ----------
    ignored : int
        Rules that are not understood, and those of media and fonts.
    """

    def __init__(self, root: Element) -> None:
        self.ignored = 0
        matcher = cssselect2.Matcher()
        sheets = [element for element in root.iter() if local_name(element) == "style"
                  and element.get("type", "text/css") == "text/css"]
        for sheet in sheets:
            self._add(matcher, "".join(sheet.itertext()))
        self._sheets: dict[int, list[Mapping[str, tuple[str, bool]]]] = {}
        if sheets:
            for wrapper in cssselect2.ElementWrapper.from_xml_root(root).iter_subtree():
                matches = [match[-1] for match in matcher.match(wrapper) if match[2] is None]
                self._sheets[id(wrapper.etree_element)] = matches

    def _add(self, matcher: cssselect2.Matcher, text: str) -> None:
        rules = tinycss2.parse_stylesheet(text, skip_comments=True, skip_whitespace=True)
        for rule in rules:
            try:
                if rule.type != "qualified-rule":
                    raise ValueError(rule.type)
                declared = {name: (value, important)
                            for name, value, important in _declarations(rule.content)}
                for selector in cssselect2.compile_selector_list(rule.prelude):
                    matcher.add_selector(selector, declared)
            except (cssselect2.SelectorError, ValueError):
                self.ignored += 1

    def of(self, element: Element, parent: Mapping[str, str]) -> dict[str, str]:
        """Return the properties of an element, given those of its parent.

        Of geometry only what style sets is among them.
        """
        found: dict[str, tuple[str, bool]] = {
            name: (value, False) for name in (*INHERITED, *OWN)
            if (value := element.get(name)) is not None}
        inline = {name: (value, important)
                  for name, value, important in _declarations(element.get("style", ""))}
        for declared in (*self._sheets.get(id(element), ()), inline):
            for name, (value, important) in declared.items():
                if important or not found.get(name, ("", False))[1]:
                    found[name] = value, important
        style = {}
        for known, inherits in ((INHERITED, True), (OWN, False), (CSS_ONLY, False)):
            for name, initial in known.items():
                value = found.get(name, ("unset", False))[0].strip()
                if value in ("inherit", "unset"):
                    inherited = inherits or value == "inherit"
                    value = parent.get(name, initial) if inherited else initial
                style[name] = initial if value == "initial" else value
        return style | {name: found[name][0] for name in GEOMETRY & found.keys()
                        if WITH_UNIT.fullmatch(found[name][0])}


def _declarations(css) -> Iterator[tuple[str, str, bool]]:
    """Yield name, value and importance of each declaration."""
    for each in tinycss2.parse_declaration_list(css, skip_comments=True, skip_whitespace=True):
        if each.type == "declaration":
            for name in MARKERS if each.lower_name == "marker" else (each.lower_name,):
                yield name, tinycss2.serialize(each.value).strip(), each.important
