# amaranth: UnusedElaboratable=no

"""Words of a line, against a table in Python."""

import random
import re

import pytest

from fresa.protocol import WordReader
from tb.boards import component
from tb.engines import AmaranthEngine

END = 0x100
STOPS = b" 0123456789+-"
OUTPUTS = ("items_ready", "words_valid", "words_payload")
TABLES = {
    "frames": ((b"X?", b"X", b"V", b"V?"), True),
    "letters": ((b"a", b"A", b"ab"), False),
    "long": ((b"CONNECT", b"DISCONNECT", b"CC", b"C", b"ABCDEFGHIJKLMNOP"), True),
    "one": ((b"?",), True),
}


def meaning(text: bytes, words, fold: bool) -> int | None:
    """Return where a word is in the table."""
    text = bytes(byte - 32 if fold and byte in b"abcdefghijklmnopqrstuvwxyz" else byte
                 for byte in text)
    return words.index(text) if text in words else None


def check(table, offered, ready, rst=None):
    """Compare every clock; `offered` has an item or None for each. Return what was taken."""
    words, fold = table
    rst = rst or [0] * len(offered)
    with AmaranthEngine(component("words", WordReader(words, fold=fold))) as engine:
        seen = engine.apply({
            "items_valid": [int(item is not None) for item in offered],
            "items_payload": [item or 0 for item in offered],
            "words_ready": ready, "rst": rst,
        }, list(OUTPUTS))
    bits = max(1, (len(words) - 1).bit_length())
    text, waits, taken = b"", False, []
    for clock, (item, take, reset) in enumerate(zip(offered, ready, rst, strict=True)):
        room, valid, word = (int(seen[name][clock]) for name in OUTPUTS)
        assert valid == waits, clock
        stops = item is not None and (item >= END or item in STOPS)
        if item is not None:
            assert room == (not waits and not stops), clock
        if waits:
            index = meaning(text, words, fold)
            assert word >> bits == (index is not None), clock
            assert index is None or word % 2**bits == index, clock
            if take:
                taken.append(index)
                text, waits = b"", False
        elif item is not None and stops:
            waits = True
        elif item is not None:
            text += bytes([item])
        if reset:
            text, waits = b"", False
    return taken


class TestEveryClock:
    @pytest.mark.parametrize("name", TABLES)
    def test_items_of_any_kind(self, name):
        rng = random.Random(name)
        words, fold = TABLES[name]
        offered = []
        for _ in range(400):
            text = rng.choice([*words, *words, b"", b"A?", bytes([rng.randrange(256)])])
            text = rng.choice([text, text.lower(), text.upper(), text + b"C" * rng.randrange(20)])
            offered += [*text, rng.choice([END, END | ord("C"), *STOPS]), None]
        taken = check(TABLES[name], offered, [int(rng.random() < 0.7) for _ in offered],
                      [int(rng.random() < 0.01) for _ in offered])
        assert set(taken) == {None, *range(len(words))}


class TestWordReader:
    def test_words(self):
        places = {b"x?": 0, b"X": 1, b"v?": 3, **dict.fromkeys(
            [b"", b"x??", b"y", b"xv", b"?", b"x" * 200, b"\x98", b"X\xbf"])}
        items = [item for text in places for item in (*text, END, END)]
        assert check(TABLES["frames"], items, [1] * len(items)) == list(places.values())

    def test_signs_beside_the_letters_are_no_letters(self):
        """Only letters have a capital: @ is not `, and [ not {."""
        table = ((b"@", b"["), True)
        for text, index in [(b"@", 0), (b"`", None), (b"[", 1), (b"{", None)]:
            assert check(table, [*text, END, END], [1] * 3) == [index]

    @pytest.mark.parametrize(("words", "fold", "message"), [
        ([], True, "a table has 1 to 64 words, each once, not []"),
        ([b"A", b"A"], True, "a table has 1 to 64 words, each once, not [b'A', b'A']"),
        ([b"a"], True, "with fold the words of a table are in capitals, not [b'a']"),
        ([b""], True, "a word of a table has 1 to 16 bytes, not b''"),
        ([b"A" * 17], True, "a word of a table has 1 to 16 bytes, not b'AAAAAAAAAAAAAAAAA'"),
        (["A"], True, "a word of a table has 1 to 16 bytes, not 'A'"),
        ([b"G1"], True, "a word of a table has no space, digit or sign, not b'G1'"),
        ([b"A B"], True, "a word of a table has no space, digit or sign, not b'A B'"),
    ])
    def test_impossible_tables(self, words, fold, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            WordReader(words, fold=fold)

    def test_too_many(self):
        with pytest.raises(ValueError, match="a table has 1 to 64 words"):
            WordReader([bytes([65 + n % 26, 65 + n // 26]) for n in range(65)])
