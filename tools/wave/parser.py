"""Conditions over signals, parsed: from text to an expression tree, never run as Python.

condition   = both { "or" both }
both        = negation { "and" negation }
negation    = "not" negation | comparison
comparison  = bits [ ( "==" | "!=" | "<" | "<=" | ">" | ">=" ) bits ]
bits        = unary { ( "&" | "|" | "^" ) unary }
unary       = ( "rise" | "fall" | "change" | "unknown" ) unary | part
part        = atom { "[" number [ ":" number ] "]" }
atom        = number | "-" number | text | signal | "(" condition ")"
"""

import re
from collections.abc import Callable
from dataclasses import dataclass

from ..console import UserError

__all__ = ["COMPARISONS", "EDGES", "Node", "parse"]

COMPARISONS = ("==", "!=", "<", "<=", ">", ">=")
BITWISE = ("&", "|", "^")
EDGES = ("rise", "fall", "change")
WORDS = (*EDGES, "unknown", "and", "or", "not")

LONGEST, DEEPEST = 2000, 40
"""Most characters and deepest nesting of an expression. Python's own stack allows hundreds."""

_TOKEN = re.compile(r"""
    (?P<number>0[xX][0-9a-fA-F_]+ | 0[bB][01_]+ | [0-9][0-9_]*(?:\.[0-9]+)?)(?![\w$])
  | (?P<text>"[^"]*" | '[^']*')
  | (?P<name>[A-Za-z_\\][\w.$\\]* | `[^`]+`)
  | (?P<sign>[=!<>]= | [<>()\[\]:&|^-])
""", re.VERBOSE)


@dataclass(frozen=True)
class Node:
    """A node of an expression tree: an operation, its operands, and a constant.

    `what` is ``number``, ``text`` or ``signal``, whose constant is `value`; an operator as it is
    written; or ``[]``, whose `value` is the highest and the lowest bit.
    """

    what: str
    parts: tuple["Node", ...] = ()
    value: int | float | str | tuple[int, int] = 0


def parse(text: str) -> Node:
    """Parse an expression.

    Raises
    ------
    UserError
        If it is not an expression; the message shows where parsing ended.
    """
    if len(text) > LONGEST:
        raise UserError(f"an expression has at most {LONGEST} characters, not {len(text)}")
    return _Parser(text).whole()


class _Parser:
    """Parser by recursive descent, without backtracking."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._tokens: list[tuple[str, str, int]] = []
        self._next = self._depth = 0
        place = 0
        while place < len(text):
            if text[place].isspace():
                place += 1
                continue
            read = _TOKEN.match(text, place)
            if read is None or read.lastgroup is None:
                raise self._error("unexpected character", place)
            self._tokens.append((read.lastgroup, read[0], place))
            place = read.end()
        self._tokens.append(("end", "", len(text)))

    def whole(self) -> Node:
        node = self._condition()
        if self._tokens[self._next][0] != "end":
            raise self._error("an operator is expected")
        return node

    def _error(self, what: str, place: int | None = None) -> UserError:
        if place is None:
            place = self._tokens[self._next][2]
        rest = self._text[place:place + 30]
        return UserError(f"{what}: {rest!r}" if rest else f"{what}, where {self._text!r} ends")

    def _take(self, *wanted: str) -> str | None:
        """Consume a word or a sign if it is one of these."""
        group, text, _ = self._tokens[self._next]
        if group in ("name", "sign") and text in wanted:
            self._next += 1
            return text
        return None

    def _chain(self, part: Callable[[], Node], *operators: str) -> Node:
        node = part()
        while operator := self._take(*operators):
            node = Node(operator, (node, part()))
        return node

    def _condition(self) -> Node:
        self._depth += 1
        if self._depth > DEEPEST:
            raise self._error(f"more than {DEEPEST} parts are nested")
        node = self._chain(lambda: self._chain(self._negation, "and"), "or")
        self._depth -= 1
        return node

    def _negation(self) -> Node:
        count = 0
        while self._take("not"):
            count += 1
        node = self._comparison()
        return Node("not", (node,)) if count % 2 else node

    def _comparison(self) -> Node:
        node = self._bits()
        if operator := self._take(*COMPARISONS):
            node = Node(operator, (node, self._bits()))
            if self._tokens[self._next][1] in COMPARISONS:
                raise self._error("two comparisons are joined by and")
        return node

    def _bits(self) -> Node:
        node = self._unary()
        if operator := self._take(*BITWISE):
            node = Node(operator, (node, self._unary()))
            while self._take(operator):
                node = Node(operator, (node, self._unary()))
            if self._tokens[self._next][1] in BITWISE:
                raise self._error("different operators on bits need parentheses")
        return node

    def _unary(self) -> Node:
        if operator := self._take(*EDGES, "unknown"):
            part = self._part()
            return Node(operator, (part,))
        return self._part()

    def _part(self) -> Node:
        node = self._atom()
        while self._take("["):
            high = low = self._whole_number()
            if self._take(":"):
                low = self._whole_number()
            if not self._take("]"):
                raise self._error("] is expected")
            if low > high:
                raise self._error(f"bits are written [high:low], not [{high}:{low}]")
            node = Node("[]", (node,), (high, low))
        return node

    def _whole_number(self) -> int:
        group, text, _ = self._tokens[self._next]
        if group != "number" or not text.isdecimal() or len(text) > 6:
            raise self._error("a bit number is expected")
        self._next += 1
        return int(text)

    def _atom(self) -> Node:
        group, text, _ = self._tokens[self._next]
        if self._take("("):
            node = self._condition()
            if not self._take(")"):
                raise self._error(") is expected")
            return node
        if self._take("-"):
            if self._tokens[self._next][0] != "number":
                raise self._error("a number is expected")
            number = self._atom()
            assert isinstance(number.value, int | float)
            return Node("number", value=-number.value)
        if group in ("end", "sign") or text in WORDS:
            raise self._error("a signal or a value is expected")
        self._next += 1
        if group == "number":
            return Node("number", value=float(text) if "." in text else self._integer(text))
        return Node("text", value=text[1:-1]) if group == "text" else Node(
            "signal", value=text.strip("`"))

    def _integer(self, text: str) -> int:
        try:
            return int(text, 0)
        except ValueError:
            raise self._error(f"{text} is not a number") from None
