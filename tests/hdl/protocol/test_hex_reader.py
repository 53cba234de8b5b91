# amaranth: UnusedElaboratable=no

"""Lines of hexadecimal digits, against the CRC of zlib and a model that keeps a list."""

import random

import pytest

from fresa.protocol import HexReader
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.orders import checked, unchecked

GOOD, LONG, DAMAGED = 0x100, 0x101, 0x102
DIGITS = "0123456789ABCDEF"


def messages(items: list[int], digits: int, ready=None) -> list[tuple[int, int]]:
    """Feed items, a clock each; return each message that was taken: good, and value if it is."""
    taken, left, clock = [], list(items), 0
    with AmaranthEngine(component("reader", HexReader(digits=digits))) as engine:
        idle = 0
        while idle < 4:
            take = ready() if ready else 1
            engine.set(items_valid=bool(left), items_payload=left[0] if left else 0,
                       messages_ready=take)
            room, valid, payload = engine.get("items_ready", "messages_valid", "messages_payload")
            assert room == (not valid)
            if valid and take:
                good = payload >> 4 * digits
                taken.append((good, payload % (1 << 4 * digits) if good else 0))
            if left and room:
                left.pop(0)
            idle = 0 if left or valid else idle + 1
            engine.run(1)
            clock += 1
    return taken


def expected(line: str, end: int, digits: int) -> tuple[int, int]:
    body = unchecked(line, digits) if end == GOOD else None
    return (0, 0) if body is None else (1, int(body, 16))


class TestHexReader:
    @pytest.mark.parametrize("digits", [2, 4, 14])
    def test_lines_right_and_wrong(self, digits):
        """Right lines, lines with a digit changed, doubled or dropped, other bytes, bad ends."""
        rng = random.Random(digits)
        lines = []
        for _ in range(150):
            text = list(checked("".join(rng.choices(DIGITS, k=digits))))
            at = rng.randrange(len(text))
            match rng.randrange(9):
                case 0:
                    text[at] = rng.choice(DIGITS)
                case 1:
                    text.insert(at, text[at])
                case 2:
                    del text[at]
                case 3:
                    text[at] = rng.choice("g@/:G afxyz\x00\xff")
                case 4:
                    text = rng.choices(DIGITS, k=rng.randrange(3 * len(text)))
            lines.append(("".join(text), rng.choice([GOOD, GOOD, GOOD, LONG, DAMAGED])))
        items = [item for text, end in lines for item in [*map(ord, text), end]]
        seen = messages(items, digits, lambda: rng.random() < 0.5)
        assert seen == [expected(text, end, digits) for text, end in lines]
        assert 20 < sum(good for good, _ in seen) < 130
