# amaranth: UnusedElaboratable=no

"""Square roots: exact, in as many clocks as there are digits."""

import re
from math import isqrt

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.motion import SquareRoot
from tb.boards import component
from tb.engines import AmaranthEngine

RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=25)


def extract(engine: AmaranthEngine, radicand: int, digits: int, *, halve: int = 0,
            eighth: int = 0) -> int:
    """Return the root, after so many clocks."""
    engine.set(radicand=radicand, halve=halve, eighth=eighth, start=1)
    engine.run(1)
    engine.set(radicand=~radicand & 1, halve=1 - halve, eighth=1 - eighth, start=0)
    for _ in range(digits):
        assert engine.get("busy")
        engine.run(1)
    assert not engine.get("busy")
    return engine.get("root")


class TestSquareRoot:
    @pytest.mark.parametrize(("integer", "fraction"), [(1, 0), (3, 0), (2, 3), (1, 4)])
    def test_every_radicand(self, integer, fraction):
        engine = AmaranthEngine(component("root", SquareRoot(integer_bits=integer,
                                                             fraction_bits=fraction)))
        for radicand in range(4**integer):
            for halve in (0, 1):
                digits, expected = integer + fraction, isqrt((radicand >> halve) * 4**fraction)
                assert extract(engine, radicand, digits, halve=halve) == expected
                assert extract(engine, radicand, max(0, digits - 3), halve=halve,
                               eighth=1) == expected >> 3
        engine.close()

    def test_full_width(self):
        engine = AmaranthEngine(component("root", SquareRoot(integer_bits=31, fraction_bits=16)))

        @RANDOM
        @given(st.one_of(st.integers(0, 2**62 - 1), st.integers(0, 2**12),
                         st.integers(1, 2**31 - 1).map(lambda root: root**2),
                         st.integers(1, 2**31).map(lambda root: root**2 - 1)), st.integers(0, 1),
               st.integers(0, 1))
        def run(radicand, halve, eighth):
            assert (extract(engine, radicand, 47 - 3 * eighth, halve=halve, eighth=eighth)
                    == isqrt((radicand >> halve) << 32) >> 3 * eighth)

        run()
        engine.close()

    def test_a_start_on_the_way_begins_anew(self):
        engine = AmaranthEngine(component("root", SquareRoot(integer_bits=4)))
        engine.set(radicand=255, start=1)
        engine.run(3)
        assert extract(engine, 81, 4) == 9
        engine.run(9)
        assert engine.get("root") == 9
        engine.close()

    @pytest.mark.parametrize(("changed", "message"), [
        ({"integer_bits": 0}, "integer_bits must be a whole number from 1 to 64, not 0"),
        ({"fraction_bits": -1}, "fraction_bits must be a whole number from 0 to 64, not -1"),
    ])
    def test_impossible(self, changed, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            SquareRoot(**{"integer_bits": 3, **changed})
