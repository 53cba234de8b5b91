"""Names as people say them, times as people write them."""

from fractions import Fraction

import pytest

from tools.console import UserError
from tools.wave import names
from tools.wave.reader import Wave
from tools.wave.times import Timeline

SCOPES = """$scope module x $end
wire 1 b count
wire 1 b apart
$upscope $end
$scope module y $end
wire 1 c count
wire 1 d ready
wire 1 d same
$scope module deep $end
wire 1 c apart
$upscope $end
$upscope $end
$scope module z $end
wire 1 d same
wire 1 e mem[0]
$upscope $end"""


@pytest.fixture
def scopes(vcd) -> Wave:
    """Give signals of the same name in several scopes."""
    return Wave(vcd("wire 1 a ready\n" + SCOPES, "#0|0a|0b|0c|0d|0e|#1|1a"))


class TestNames:
    @pytest.mark.parametrize(("name", "path"), [
        ("x.count", "top.x.count"), ("top.x.count", "top.x.count"),
        ("ready", "top.ready"),  # the port, whose scope holds the other
        ("y.ready", "top.y.ready"), ("same", "top.y.same"),  # one signal by two names
    ])
    def test_the_end_is_enough(self, scopes, name, path):
        assert names.one(scopes, name).path == path

    @pytest.mark.parametrize(("name", "message"), [
        ("count", "'count' matches top.x.count, top.y.count: give more"),
        ("apart", "matches top.x.apart, top.y.deep.apart"),  # neither scope contains the other
        ("redy", "no signal 'redy'; is it top.ready"),
        ("qqqqq", "python -m tools.wave list"), ("ount", "is it top.x.count"), ("", "no signal ''"),
        ("x.", "no signal"), ("ready.x", "no signal"),
    ])
    def test_an_ambiguous_name_is_refused(self, scopes, name, message):
        with pytest.raises(UserError, match=message):
            names.one(scopes, name)

    def test_patterns(self, scopes):
        assert [s.path for s in names.several(scopes, ["*.count", "top.x.count"])] == [
            "top.x.count", "top.y.count"]
        assert [s.path for s in names.several(scopes, ["[xy].count"])] == [
            "top.x.count", "top.y.count"]
        with pytest.raises(UserError, match="no signal like 'q\\*'"):
            names.several(scopes, ["q*"])

    def test_heads_are_as_short_as_they_can_be(self, scopes):
        chosen = [names.one(scopes, name) for name in ("x.count", "y.count", "top.ready")]
        assert names.heads(chosen) == ["x.count", "y.count", "ready"]


class TestTimes:
    @pytest.mark.parametrize(("text", "ticks"), [
        ("12ns", 12), ("0.012us", 12), ("1.5ms", 1_500_000), ("12 ns", 12),
        ("500ps", Fraction(1, 2)),
        ("1s", 10**9), ("0", 0), ("1µs", 1000), ("1clk", 5), ("20clk", 195), ("0clk", 0),
    ])
    def test_read(self, clocked, text, ticks):
        assert Timeline(Wave(clocked)).ticks(text) == ticks

    @pytest.mark.parametrize(("text", "message"), [
        ("12", "written 12us"), ("", "written 12us"), ("-3ns", "written 12us"),
        ("1e9s", "written 12us"), ("3 weeks", "written 12us"), ("21clk", "rises 20 times"),
        ("1.5clk", "whole"), ("9" * 31 + "s", "written 12us"), ("1KB", "written 12us"),
    ])
    def test_refused(self, clocked, text, message):
        with pytest.raises(UserError, match=message):
            Timeline(Wave(clocked)).ticks(text)

    @pytest.mark.parametrize(("ticks", "text"), [
        (0, "0"), (1, "1ns"), (999, "999ns"), (1000, "1us"), (1234, "1.234us"),
        (Fraction(1, 2), "500ps"), (2_500_000, "2.5ms"), (1.23456, "1.235ns"), (10**12, "1000s"),
    ])
    def test_told(self, clocked, ticks, text):
        assert Timeline(Wave(clocked)).text(ticks) == text

    def test_clock_by_name_by_wish_or_by_its_edges(self, vcd):
        busy = "|".join(f"#{n}|{n % 2}b" for n in range(9))
        wave = Wave(vcd("wire 1 a clk\nwire 1 b strobe", f"{busy}|#20|0a|#21|1a"))
        for name, path in ((None, "top.clk"), ("strobe", "top.strobe")):
            clock = Timeline(wave, name).clock
            assert clock is not None and clock.path == path
        unnamed = Timeline(Wave(vcd("wire 1 a slow\nwire 1 b tick", f"{busy}|#20|0a|#21|1a")))
        assert unnamed.clock is not None and unnamed.clock.path == "top.tick"
        with pytest.raises(UserError, match="a clock has one"):
            Timeline(Wave(vcd("wire 2 a clk", "#0|b1 a")), "clk").ticks("1clk")

    def test_no_clock(self, vcd):
        timeline = Timeline(Wave(vcd("wire 4 a a", "#0|b1 a|#9|b10 a")))
        assert timeline.clock is None and timeline.period is None
        assert timeline.text_with_clock(3) == "3ns"
        with pytest.raises(UserError, match="there is no clock"):
            timeline.ticks("3clk")

    def test_window(self, clocked):
        timeline = Timeline(Wave(clocked))
        assert timeline.window(None, None) == (0, 200)
        assert timeline.window("2clk", "900s") == (15, 200)
        # Between two ticks: nothing that is before the start, nothing after the end.
        assert timeline.window("500ps", "2500ps") == (1, 2)
        for start, end, message in (("9ns", "8ns", "nothing is between"),
                                    ("201ns", None, "after the end of .*, which is 200ns")):
            with pytest.raises(UserError, match=message):
                timeline.window(start, end)
