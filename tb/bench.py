"""What every bench uses: a clock, a deadline, checks with their messages, and a waveform."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from amaranth import ClockDomain, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.sim import Simulator

from .design import Design
from .engines import AmaranthEngine, Engine
from .waves import BITS, PERIOD, Layout, save_file, staged

__all__ = ["Bench", "CheckFailed", "Run", "bench", "port", "put", "scoreboard"]


class CheckFailed(Exception):
    """A check that failed; the message describes it, and `clock` is its clock."""

    def __init__(self, clock: int, message: str) -> None:
        super().__init__(clock, message)  # as it is made again in another process
        self.clock, self.message = clock, message

    def __str__(self) -> str:
        return f"clock {self.clock} ({clock_ns(self.clock)} ns): {self.message}"


def clock_ns(clock: int) -> int:
    """Return the time of a rising edge in ns; the first is clock 1, and clock 0 is at 0 ns."""
    return max(0, clock * PERIOD - PERIOD // 2)


class Run:
    """One run of one bench, passed to it as its argument.

    A bench of a component calls :meth:`simulate`, a bench of a board :meth:`engine`.

    Parameters
    ----------
    vcd : Path, optional
        Path of the waveform.

    Attributes
    ----------
    clock : int
        Rising edges so far.
    rst : Signal
        Reset of the component simulated.
    layout : Layout
        Signals to show of the waveform.
    """

    def __init__(self, vcd: Path | None = None) -> None:
        self._vcd = vcd
        self._clock: Callable[[], int] = lambda: 0
        self.rst = Signal(name="rst")
        self.layout: Layout | None = None

    @property
    def clock(self) -> int:
        return self._clock()

    def simulate(
        self, dut: wiring.Component, test: Callable, *runners: Callable, inside: Sequence[str] = (),
        deadline: int = 10_000,
    ) -> None:
        """Run a component until `test` returns.

        Parameters
        ----------
        dut : Component
            The component.
        test : async function of one argument
            Testbench.
        runners : async functions of one argument
            Run concurrently: the surroundings of the component.
        inside : sequence of str
            Signals of its submodules to show in the waveform.
        deadline : int
            Clocks within which `test` must return.

        Raises
        ------
        CheckFailed
            If a check of `test` fails, or it does not return by the deadline.
        """
        m = Module()
        m.domains.sync = sync = ClockDomain()
        sync.rst = self.rst
        m.submodules.dut = dut
        ports = {wiring.In: [], wiring.Out: []}
        for path, member, each in dut.signature.flatten(dut):
            # At the inner scope a port may share its name with one of a submodule.
            name = "_".join(map(str, path))
            m.d.comb += Signal(member.shape, name=name).eq(each)
            ports[member.flow].append(name)
        self.layout = Layout("dut", ports[wiring.In], ports[wiring.Out], inside)

        clocks = 0
        self._clock = lambda: clocks

        async def count(ctx):
            nonlocal clocks
            async for _ in ctx.tick():
                clocks += 1

        sim = Simulator(m)
        sim.add_clock(PERIOD * 1e-9)
        sim.add_testbench(count, background=True)
        sim.add_testbench(test)
        for runner in runners:
            sim.add_testbench(runner, background=True)
        with sim.write_vcd(str(self._vcd)) if self._vcd else nullcontext():
            while sim.advance():
                if clocks > deadline:
                    self.expect("the bench", "still waiting", "over")

    @contextmanager
    def engine(self, design: Design, *, inside: Sequence[str] = ()) -> Iterator[Engine]:
        """Run a design by its pins, on Amaranth's own simulator: it shows states by name."""
        inputs = [name for name in design.inputs if name != "rst"]  # which is shown with the clock
        self.layout = Layout(design.name, inputs, list(design.outputs), inside)
        with AmaranthEngine(design, vcd=self._vcd) as engine:
            self._clock = lambda: engine.clock
            yield engine

    def see(self, ctx, dut, **expected: int) -> None:
        """Check members of `dut` in this clock."""
        for name, value in expected.items():
            bits = port(dut, name)
            self.expect(name, ctx.get(bits), value, bits=len(bits) if name in BITS else None)

    async def until(self, ctx, dut, *, within: int = 1000, **expected: int) -> None:
        """Wait until members of `dut` have these values, `within` so many clocks."""
        for _ in range(within):
            if all(ctx.get(port(dut, name)) == value for name, value in expected.items()):
                return
            await ctx.tick()
        self.see(ctx, dut, **expected)

    def expect(self, what: str, seen: object, expected: object, *, bits: int | None = None) -> None:
        """Check that a value is as expected.

        With `bits` both are shown in binary; of two lists, the first items that differ.
        """
        if seen == expected:
            return
        if bits is not None:
            seen, expected = f"{seen:0{bits}b}", f"{expected:0{bits}b}"
        elif isinstance(seen, list) and isinstance(expected, list):
            pairs = enumerate(zip_longest(seen, expected, fillvalue="nothing"), start=1)
            number, (seen, expected) = next(pair for pair in pairs if pair[1][0] != pair[1][1])
            what = f"{what}, number {number}"
        raise CheckFailed(self.clock, f"{what}: {expected} expected, {seen} seen")


@dataclass(frozen=True)
class Bench:
    """A bench.

    Attributes
    ----------
    name : str
        Its name on the command line.
    shows : str
        What it demonstrates, in one line.
    function : callable
        Runs it with a `Run`, and returns one or two lines on the result.
    """

    name: str
    shows: str
    function: Callable[[Run], str]

    def run(self, vcd: Path | None = None) -> str:
        """Run it, and return its result.

        Parameters
        ----------
        vcd : Path, optional
            Path of the waveform; a save file for GTKWave is written next to it.

        Raises
        ------
        CheckFailed
            If a check fails. The waveform is complete up to then, with the marker at that clock.
        OSError
            If the waveform cannot be written.
        """
        if vcd is None:
            return self.function(Run())
        failure = None
        result = ""
        with staged(vcd) as (wave, save):
            run = Run(wave)
            try:
                result = self.function(run)
            except CheckFailed as error:
                failure = error
            assert run.layout is not None
            save_file(save, wave, run.layout, home=vcd.absolute(), clocks=run.clock,
                      mark=failure.clock if failure else None)
        if failure:
            raise failure
        return result


def bench(function: Callable[[Run], str]) -> Bench:
    """Make a bench of a function, with its name and the first line of its docstring."""
    shows = (function.__doc__ or "").partition("\n")[0]
    return Bench(function.__name__.replace("_", "-"), shows, function)


async def put(ctx, stream, payload) -> None:
    """Offer `payload` until it is taken."""
    ctx.set(stream.payload, payload)
    ctx.set(stream.valid, 1)
    await ctx.tick().until(stream.ready)
    ctx.set(stream.valid, 0)


async def scoreboard(run: Run, ctx, dut, model: Callable[..., Mapping[str, int | None]],
                 columns: Mapping[str, Sequence[int]]) -> None:
    """Compare every output of a component with its model in every clock.

    Parameters
    ----------
    run, ctx, dut
        The run, its simulator, and the component, which is reset before.
    model : callable
        Is called once a clock with the inputs by name, and returns outputs; None may be anything.
    columns : mapping of str to sequence of int
        Levels of the inputs, and of ``rst``, by their names.
    """
    ports = {name: run.rst if name == "rst" else port(dut, name) for name in columns}
    ctx.set(run.rst, 1)
    await ctx.tick()
    for levels in zip(*columns.values(), strict=True):
        for each, level in zip(ports.values(), levels, strict=True):
            ctx.set(each, level)
        outputs = model(**dict(zip(columns, levels, strict=True)))
        run.see(ctx, dut, **{name: value for name, value in outputs.items() if value is not None})
        await ctx.tick()


def port(dut, name: str) -> Value:
    """Return a port of a component, or of one of its members, such as ``alarms_valid``."""
    if hasattr(dut, name):
        return Value.cast(getattr(dut, name))
    member, _, name = name.partition("_")
    return port(getattr(dut, member), name)
