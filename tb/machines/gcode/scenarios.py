"""Scenarios of `gcode`: sessions on its line."""

from math import hypot

from ...bench import Run, bench
from ...engines import Engine
from ...scoreboard import monitor
from ...uart import FRAME, Decoder, encode
from . import MACHINE, SHORT_THESIS

GREETING = b"Grbl 1.1h ['$' for help]\r\n"
SESSION = [
    (b"G1 X0.05 Y-0.025 F9000\n", b"ok\r\n", (4, -2, 0)),
    (b"G91 X-0.0125\r\n", b"ok\r\n", (3, -2, 0)),
    (b"g0z0.1(up)\n", b"ok\r\n", (3, -2, 8)),
    (b"X1 X2\n", b"error:25\r\n", (3, -2, 8)),
    (b"G90 G1 F0 X9\n", b"error:22\r\n", (3, -2, 8)),
    (b"G90 G1 F9000 X0 Y0 Z0 M8\n", b"ok\r\n", (0, 0, 0)),
]


@bench
def gcode(run: Run) -> str:
    """Lines that move, lines that are refused, a report, and a limit switch."""
    dut = MACHINE.make(**MACHINE.bench_options)
    settings = dut.settings
    bit = settings.bit
    received, position, high = bytearray(), [0, 0, 0], [0]

    async def count(ctx):
        while True:
            step = ctx.get(dut.step)
            for axis in range(3):
                if (step & ~high[0]) >> axis & 1:
                    position[axis] += 1 if ctx.get(dut.direction) >> axis & 1 else -1
            high[0] = step
            await ctx.tick()

    async def send(ctx, text):
        for level in encode(text, bit):
            ctx.set(dut.rx, level)
            await ctx.tick()

    async def receive(ctx, text):
        for _ in range((len(text) + 40) * 10 * bit):
            if len(received) >= len(text):
                break
            await ctx.tick()
        run.expect("received", bytes(received), text)
        received.clear()

    async def test(ctx):
        ctx.set(dut.rx, 1)
        await receive(ctx, GREETING)
        for text, answer, end in SESSION:
            await send(ctx, text)
            await receive(ctx, answer)
            await run.until(ctx, dut, moving=0, within=40_000)
            run.expect("position", tuple(position), end)
        run.see(ctx, dut, flood=1, spindle=0, enable=1, alarm=0)
        await send(ctx, b"?")
        await receive(ctx, b"<Idle|MPos:0.000,0.000,0.000|Bf:63,128|FS:0,0|WCO:0.000,0.000,0.000>"
                           b"\r\n")
        await send(ctx, b"G0 X5\n")
        await receive(ctx, b"ok\r\n")
        await run.until(ctx, dut, moving=1)
        ctx.set(dut.limits, 1)
        await run.until(ctx, dut, alarm=1)
        ctx.set(dut.limits, 0)
        at = tuple(position)
        await receive(ctx, b"ALARM:1\r\n[MSG:Reset to continue]\r\n")
        run.expect("position", abs(position[0] - at[0]) <= 1, True)
        await send(ctx, b"\x18")
        await receive(ctx, GREETING + b"[MSG:'$H'|'$X' to unlock]\r\n")
        await send(ctx, b"G0 X0\n")
        await receive(ctx, b"error:9\r\n")
        await send(ctx, b"$X\nG0 X0\n")
        await receive(ctx, b"[MSG:Caution: Unlocked]\r\nok\r\nok\r\n")
        await run.until(ctx, dut, moving=0, within=40_000)
        run.expect("position", tuple(position), (0, 0, 0))
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, count, monitor(run, dut.tx, bit, received), deadline=400_000)
    return (f"{len(SESSION)} lines, each answered once, end where they say; a limit switch stopped "
            "a sixth, and after a reset the place was known")


class _ThesisSession:
    """The machine of the thesis on an engine: its line, its end stops, and what its pins do.

    Attributes
    ----------
    position : list of int
        Of each axis in steps, from power-up.
    path : list of tuple
        Positions, from each step on.
    pulse : int
        Clocks of the last whole pulse of the servo.
    """

    stops = (-3, -2)
    """Of X and Y, in steps."""

    def __init__(self, run: Run, engine: Engine) -> None:
        self._run, self._engine = run, engine
        self._bit = SHORT_THESIS.bit
        self._decoder = Decoder(self._bit)
        self._received = b""
        self.position = [0, 0, 0]
        self.path: list[tuple[int, ...]] = []
        self.pulse = self._rose = self._step = self._servo = 0

    def run(self, clocks: int) -> None:
        """Let time pass; an end stop closes within 20 clocks."""
        end = self._engine.clock + clocks
        while self._engine.clock < end:
            self._engine.set(limits=sum((at <= stop) << axis for axis, (at, stop) in enumerate(
                zip(self.position, self.stops, strict=False))))
            near = min(map(int.__sub__, self.position, self.stops)) < 5
            seen = self._engine.run(min(20 if near else 1000, end - self._engine.clock),
                                    ("tx", "servo", "step", "direction"))
            for clock, tx, servo, step, direction in zip(
                    seen.clock.tolist(), *(values.tolist() for values in seen.values.values()),
                    strict=True):
                self._received += self._decoder.feed(clock, tx)
                self._count(clock, servo, step & ~self._step, direction)
                self._servo, self._step = servo, step

    def _count(self, clock: int, servo: int, rises: int, direction: int) -> None:
        for axis in range(3):
            if rises >> axis & 1:
                self.position[axis] += 1 if direction >> axis & 1 else -1
        if rises:
            self.path.append(tuple(self.position))
        if servo and not self._servo:
            self._rose = clock
        elif self._servo and not servo:
            self.pulse = clock - self._rose

    def send(self, text: bytes) -> None:
        """Send bytes, one after the other."""
        line = encode(text, self._bit)
        for place in range(0, len(line), self._bit):
            self._engine.set(rx=line[place])
            self.run(self._bit)

    def receive(self, text: bytes, within: int = 20_000) -> None:
        """Expect an answer."""
        end = self._engine.clock + within
        while len(self._received) < len(text) and self._engine.clock < end:
            self.run(self._bit * FRAME)
        self._run.expect("received", self._received, text)
        self._received = b""

    def until(self, within: int, name: str, level: int) -> None:
        """Let time pass until an output has a level."""
        end = self._engine.clock + within
        while self._engine.get(name) != level and self._engine.clock < end:
            self.run(20)
        self.see(**{name: level})

    def see(self, **levels: int) -> None:
        """Expect levels of outputs."""
        for name, level in levels.items():
            self._run.expect(name, self._engine.get(name), level)


def _from_circle(path: list[tuple[int, ...]], centre: tuple[float, float], radius: float) -> float:
    """Return how far positions are from a circle at most, in steps."""
    return max(abs(hypot(x - centre[0], y - centre[1]) - radius) for x, y, _ in path)


@bench
def gcode_thesis(run: Run) -> str:
    """A session of the thesis: home, a line ended by silence, an arc, motors off."""
    settings = SHORT_THESIS
    per_mm = int(settings.steps_per_mm[0])
    down, up = (settings.clock * dict(settings.others)[number] // 10**6 for number in (210, 211))
    with run.engine(MACHINE.design(settings=settings)) as engine:
        session = _ThesisSession(run, engine)
        engine.set(rx=1)
        session.receive(b"start\r\n")
        session.see(enable=0)

        session.send(b"G28\n")
        session.until(4000, "enable", 1)
        session.run(2 * settings.servo_us * settings.clock // 10**6)
        run.expect("pulse while it homes", session.pulse, up)
        session.receive(b"ok\r\n", within=60_000)
        home = tuple(session.position)
        run.expect("home", home, (*session.stops, 0))

        # The example of the thesis in 1/10000: G2 X60 Y30 I30 J10 F100, from X60 Y10.
        session.send(b"X.006 Y.001")  # ended by silence
        session.run(settings.silence - FRAME * settings.bit)
        run.expect("position", tuple(session.position), home)
        session.receive(b"ok\r\n")
        session.until(20_000, "moving", 0)
        run.expect("pulse after homing", session.pulse, down)
        begin = (home[0] + round(0.006 * per_mm), home[1] + round(0.001 * per_mm))
        run.expect("begin of the arc", tuple(session.position), (*begin, 0))
        session.path.clear()
        session.send(b"G2 X.006 Y.003 I.003 J.001 F100\n")
        session.receive(b"ok\r\n")
        session.until(20_000, "moving", 0)
        run.expect("end", tuple(session.position), (begin[0], home[1] + round(0.003 * per_mm), 0))
        centre = begin[0] + 0.003 * per_mm, begin[1] + 0.001 * per_mm
        off = _from_circle(session.path, centre, per_mm * hypot(0.003, 0.001))
        run.expect("positions less than a step off the circle", off < 1, True)
        session.run(settings.awake // 2)
        session.see(enable=1, fault=0)
        session.until(settings.awake, "enable", 0)
        session.send(b"M3\n")
        session.until(1000, "enable", 1)
        session.send(b"M5\n")
        session.until(1000, "enable", 0)
        session.receive(b"ok\r\nok\r\n")
    return (f"homed with the tool up, an arc off its circle by {off:.2f} steps at most, motors off "
            "when idle and by M5")


SCENARIOS = [gcode, gcode_thesis]
