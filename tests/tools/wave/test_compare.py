"""Two waves: which signals are the same, where they differ."""

import json

import pytest

from tools.wave.pairing import paired
from tools.wave.reader import Wave


def changes(*more: str) -> str:
    """Give a clock of 2 ticks, and changes at times: `TIME change`."""
    at: dict[int, list[str]] = {n: [f"{n % 2}k"] for n in range(41)}
    for item in more:
        time, _, change = item.partition(" ")
        at[int(time)].append(change)
    return "|".join(f"#{time}|" + "|".join(some) for time, some in at.items())


COUNT = "wire 1 k clk\nwire 8 c count"


class TestDiff:
    def test_no_difference(self, mill, wave):
        status, out, err = wave("diff", mill, mill)
        assert status == 0 and out.startswith("no difference in ") and not err

    def test_first_difference_and_how_many(self, vcd, wave):
        a = vcd(COUNT, changes("0 b0 c", "10 b1 c", "20 b10 c", "30 b11 c"))
        b = vcd(COUNT, changes("0 b0 c", "10 b1 c", "13 b111 c", "16 b1 c", "20 b11 c", "25 b10 c",
                               "30 b11 c"), name="b.vcd", scope="other.top")
        status, out, _ = wave("diff", a, b)
        assert status == 1
        assert out.splitlines()[0] == "1 of 2 signals differ"
        assert out.splitlines()[1].split(None, 2) == [
            "13ns", "(7clk)", "top.count, other.top.count: 0x01, 0x07; 2 times, 8ns in all"]
        facts = json.loads(wave("diff", a, b, "--json")[1])
        assert facts["compared"] == 2 and facts["different"] == 1
        assert facts["differences"][0]["values"] == [1, 7]
        assert (facts["differences"][0]["clock"], facts["differences"][0]["intervals"]) == (7, 2)

    def test_other_timescale_and_other_end(self, vcd, wave):
        a = vcd(COUNT, changes("0 b0 c", "10 b1 c", "39 b111 c"))
        b = vcd("wire 8 c count", "#0|b0 c|#1000|b1 c|#3800|b1 c|#3801|b10 c", name="b.vcd",
                timescale="10 ps")
        status, out, _ = wave("diff", a, b)
        # In common they have until 38.01 ns, and it is there that they begin to differ.
        assert status == 1 and "38.01ns" in out
        assert wave("diff", a, b, "--to", "38ns")[0] == 0

    def test_until_the_end(self, vcd, wave):
        a, b = vcd(COUNT, changes("0 b0 c")), vcd(COUNT, changes("0 b0 c", "30 b1 c"), name="b.vcd")
        assert "once, 10ns in all" in wave("diff", a, b)[1]

    def test_unknown_in_one_only_is_a_difference(self, vcd, wave):
        a = vcd(COUNT, changes("0 bx c", "10 b1 c"))
        b = vcd(COUNT, changes("10 b1 c"), name="b.vcd")
        c = vcd(COUNT, changes("0 b1 c"), name="c.vcd")
        assert wave("diff", a, b)[0] == 0  # written or not, it is unknown
        status, out, _ = wave("diff", a, c)
        assert status == 1 and "top.count: xxxxxxxx, 0x01; once, 10ns" in out

    def test_map_and_names(self, vcd, wave):
        a = vcd(COUNT, changes("0 b0 c", "10 b1 c"))
        b = vcd("wire 8 c counter_q\nwire 1 k clk", changes("0 b0 c", "11 b1 c"), name="b.vcd")
        assert wave("diff", a, b)[0] == 0  # only the clock is in both
        status, out, _ = wave("diff", a, b, "--map", "count=counter_q")
        assert status == 1 and "top.count, top.counter_q: 0x01, 0x00; once, 1ns in all" in out
        assert wave("diff", a, b, "clk")[0] == 0
        assert wave("diff", a, b, "count")[0] == 2

    def test_nothing_in_common(self, vcd, wave):
        a, b = vcd("wire 1 a a", "#0|0a"), vcd("wire 1 a b", "#0|0a", name="b.vcd")
        assert wave("diff", a, b)[2].count("no signals in common") == 1

    def test_names_are_not_compared_with_codes(self, vcd, wave):
        a = vcd("string 1 s state\nwire 1 k k", "#0|sREST s|1k|#5|0k")
        b = vcd("wire 2 s state\nwire 1 k k", "#0|b1 s|1k|#5|0k", name="b.vcd")
        status, _, err = wave("diff", a, b)
        assert status == 0 and "1 pairs are not compared" in err

    def test_scales_that_do_not_fit_together(self, vcd, wave):
        a = vcd("wire 1 a a", "#0|0a|#1000000|1a", timescale="1 s")
        b = vcd("wire 1 a a", "#0|0a|#10|1a", name="b.vcd", timescale="1 fs")
        assert wave("diff", a, b)[2].count("too far apart in scale") == 1


@pytest.mark.parametrize(("one", "two", "pairs"), [
    ("wire 1 a q", "wire 1 a q", {("top.q", "top.q")}),
    # Two counters there, one here: the end of the path does not say which.
    ("wire 1 a count",
     "$scope module x $end\nwire 1 a count\n$upscope $end\n$scope module y $end\nwire 1 b count\n"
     "$upscope $end", set()),
    ("$scope module x $end\nwire 1 a count\n$upscope $end",
     "$scope module x $end\nwire 1 a count\n$upscope $end\n$scope module y $end\nwire 1 b count\n"
     "$upscope $end", {("top.x.count", "top.x.count")}),
    # The same signal by two names in both is compared once.
    ("wire 1 a q\n$scope module d $end\nwire 1 a q\n$upscope $end",
     "wire 1 a q\n$scope module d $end\nwire 1 a q\n$upscope $end", {("top.q", "top.q")}),
    # Of another width it is another signal.
    ("wire 2 a q", "wire 1 a q", set()),
    # The longer end first; what is left is then clear.
    ("wire 1 a q\n$scope module d $end\nwire 1 b q\n$upscope $end",
     "wire 1 a q\n$scope module d $end\nwire 1 b q\n$upscope $end",
     {("top.q", "top.q"), ("top.d.q", "top.d.q")}),
])
def test_pairs(vcd, one, two, pairs):
    here, there = Wave(vcd(one, "#0|0a")), Wave(vcd(two, "#0|0a", name="b.vcd"))
    assert {(a.path, b.path) for a, b in paired(here, there)} == pairs
