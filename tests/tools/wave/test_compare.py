"""Two waves: which signals are the same, where they differ."""

import json
import tracemalloc

import numpy as np
import pytest

from tools.wave import trace
from tools.wave.difference import compared
from tools.wave.pairing import paired
from tools.wave.reader import Signal, Wave
from tools.wave.trace import collect


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
        status, out, _ = wave("diff", a, b, "count")
        assert status == 1 and out == f"only in {a}: top.count\n"

    def test_what_is_in_one_only_is_told_and_counts_if_named(self, vcd, wave):
        a = vcd(COUNT + "\nwire 1 e extra\nevent 1 v happens", changes("0 b0 c"))
        b = vcd(COUNT + "\nwire 1 m more\nwire 1 n more_so", changes("0 b0 c"), name="b.vcd")
        status, out, _ = wave("diff", a, b)
        assert (status, out.splitlines()) == (0, [
            "no difference in 2 signals", f"only in {a}: top.extra",
            f"only in {b}: top.more, top.more_so"])
        facts = json.loads(wave("diff", a, b, "--json")[1])
        assert (facts["only_in_a"], facts["only_in_b"]) == (
            ["top.extra"], ["top.more", "top.more_so"])
        for names, status in ((["extra"], 1), (["more"], 1), (["mor*"], 1), (["[cm]o*"], 1),
                              (["c*", "extra"], 1), (["c*"], 0), (["nobody"], 2),
                              (["--map", "extra=more"], 0)):
            assert wave("diff", a, b, *names)[0] == status, names

    def test_another_width_is_a_difference(self, vcd, wave):
        a = vcd(COUNT + "\nwire 8 d data", changes("0 b0 c", "0 b0 d"))
        b = vcd(COUNT + "\nwire 4 d data", changes("0 b0 c", "0 b0 d"), name="b.vcd")
        status, out, _ = wave("diff", a, b)
        assert (status, out.splitlines()) == (1, [
            "no difference in 2 signals", "of another width: top.data, 8 bits and 4"])
        status, out, _ = wave("diff", a, b, "data", "--json")
        facts = json.loads(out)
        assert status == 1 and (facts["compared"], facts["only_in_a"]) == (0, [])
        assert facts["other_width"] == [{"signals": ["top.data", "top.data"], "bits": [8, 4]}]
        assert wave("diff", a, b, "count")[0] == 0
        assert wave("diff", a, b, "--map", "data=data")[0] == 0  # as numbers they are the same

    def test_a_name_more_of_one_signal_is_not_missing(self, vcd, wave):
        a = vcd("wire 1 k clk\n$scope module t $end\nwire 1 k clk\n$upscope $end", changes())
        b = vcd("wire 1 k clk", changes(), name="b.vcd")
        for names in ((), ("t.clk",)):
            assert wave("diff", a, b, *names) == (0, "no difference in 1 signals\n", "")

    def test_a_signal_that_has_its_like_is_no_other_ones(self, vcd, wave):
        """A signal called x.ready here is not ready there, whose like is ready."""
        x = "\n$scope module x $end\nwire 1 c ready\n$upscope $end"
        a = vcd("wire 1 k ready" + x, changes("0 1c"))
        b = vcd("wire 1 k ready", changes(), name="b.vcd")
        status, out, _ = wave("diff", a, b, "x.ready")
        assert (status, out) == (1, f"only in {a}: top.x.ready\n")

    def test_an_ambiguous_name_is_refused(self, vcd, wave):
        a = vcd("wire 1 k count", changes())
        b = vcd("$scope module x $end\nwire 1 k count\n$upscope $end\n"
                "$scope module y $end\nwire 1 c count\n$upscope $end", changes("0 0c"),
                name="b.vcd")
        status, _, err = wave("diff", a, b, "count")
        assert status == 2 and "matches top.x.count, top.y.count: --map A=B" in err

    def test_nan_is_nan(self, vcd, wave):
        a = vcd("real 64 r r", "#0|rnan r|#5|r1 r|#7|rnan r|#9|r1 r")
        b = vcd("real 64 r r", "#0|r0 r|#5|r1 r|#9|r2 r", name="b.vcd")
        assert wave("diff", a, a)[0] == 0
        assert "nan, 0; 2 times, 7ns in all" in wave("diff", a, b)[1]

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
        assert wave("diff", a, b)[2].count("differ too much in scale") == 1


class TestCompared:
    """The arithmetic, which goes block by block."""

    @pytest.mark.parametrize("seed", range(6))
    def test_as_tick_by_tick(self, seed, monkeypatch):
        monkeypatch.setattr(trace, "BLOCK", 3)
        rng = np.random.default_rng(seed)
        traces, scale = (made(rng), made(rng)), (int(rng.integers(1, 4)), int(rng.integers(1, 4)))
        low, high = 5, 140
        rows = [[one.at(tick // factor) for one, factor in zip(traces, scale, strict=True)]
                for tick in range(low, high + 1)]
        rows = [["x" if value == "xxxx" else value for value in row] for row in rows]
        wrong = [one != two for one, two in rows]
        pair: tuple[Signal, Signal] = (SIGNAL, SIGNAL)
        found = compared(pair, traces, scale, low, high)
        if not any(wrong):
            assert found is None
            return
        assert found is not None and found.first == low + wrong.index(True)
        assert found.ticks == sum(wrong[:-1])  # the last is the end
        assert found.intervals == sum(now and not before for before, now in zip(
            [False, *wrong], wrong, strict=False))

    def test_memory_does_not_grow_with_the_wave(self):
        count = 200_000
        long = collect([(range(count), [n & 1 for n in range(count)])], count, kind="bits", bits=1)
        tracemalloc.start()
        try:
            assert compared((SIGNAL, SIGNAL), (long, long), (1, 1), 0, count) is None
            assert tracemalloc.get_traced_memory()[1] < long.times.nbytes // 2
        finally:
            tracemalloc.stop()


SIGNAL = Signal(("t", "a"), 4, "bits", "a", None)


def made(rng: np.random.Generator) -> trace.Trace:
    """Give a trace of few values, now and then unknown."""
    times = np.unique(rng.integers(0, 100, 60)).tolist()
    values = [["xxxx", "x001", 1, 2][n] for n in rng.integers(0, 4, len(times)).tolist()]
    return collect([(times, values)], len(times), kind="bits", bits=4)


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
    assert {(a.path, b.path) for a, b in paired(here, there).same} == pairs
