"""Contract of the guard: no alarm without an upset, and none that is missed."""

from amaranth import Cat, Fragment, Value

from fresa.motion import GuardedController, NumericalController

from .coil import phase_of
from .contract import Bits, Case, Component, Contract

__all__ = ["GUARD"]

FAULT = "(Cat(differ).any() | fault) & ~(ResetSignal() & seen)"


def describe(c: Contract, dut: GuardedController) -> None:
    """Outputs as without the guard, at any time; from any upset on, an error or no difference."""
    never_alarms(c, dut)
    misses_nothing(c, dut)


def never_alarms(c: Contract, dut: GuardedController) -> None:
    """Where nothing is upset the machine is the one without a guard, beside which it runs."""
    plain = NumericalController(period=dut.main.period, z_travel=dut.main.z_travel,
                                jog_period=dut.main.jog_period)
    c.m.submodules.plain = alone = Fragment.get(plain, None)
    outputs = []
    for path, member, value in dut.signature.flatten(dut):
        name = "_".join(map(str, path))
        same = getattr(plain, name)
        if member.flow.name == "In":
            c.m.d.comb += same.eq(value)
        else:
            outputs.append((name, Value.cast(value) == Value.cast(same)))

    moved = c.part("main.drivers").moved
    c.invariant("no-false-alarm", "Where nothing is upset the fault is never raised.",
                ~c.signal("fault") & ~c.signal("seen"), cover=moved.any())
    c.invariant("coil-words-agree", "Where nothing is upset both controllers have the same coil "
                "words.",
                _all(c.signal(f"apart_{name}{when}") == 0
                     for name in "xyz" for when in ("", "_before")),
                cover=c.past(moved.any()))
    main, shadow = _registers(c._inside("main")), _registers(c._inside("shadow"))
    c.invariant("all-registers-agree", "Where nothing is upset all registers of both controllers "
                "agree.",
                _all(main[name] == shadow[name] for name in main), cover=c.past(moved.any()))
    other = _registers(alone)
    c.invariant("registers-as-unguarded", "A controller without a guard has the same registers.",
                _all(main[name] == other[name] for name in main), cover=c.past(moved.any()))
    for name, same in outputs:
        c.invariant(f"{name.replace('_', '-')}-as-unguarded",
                    f"`{name}` is what it would be without a guard.",
                    same, cover=c.past(moved.any()))


def misses_nothing(c: Contract, dut: GuardedController) -> None:
    """From any state of all registers on: a difference shows, stays, and stops the motors."""
    fault, main, shadow = c.signal("fault"), dut.main, dut.shadow
    known = c.past(c.past(1))
    was_seen = c.past(c.rst & c.past(dut.error & fault & ~c.rst))

    def shows(name: str, what: str, differ: Bits) -> None:
        c.implication(name,
                      f"{what} shows with the next clock, unless a reset ends an older fault.",
                      when=known & c.past(differ) & ~was_seen, then=fault & dut.error,
                      upset=True)

    for axis in "xyz":
        here, there = (getattr(one.automatic, f"at_{axis}") for one in (main, shadow))
        shows(f"position-{axis}", f"Another position of {axis} in the second controller",
              here != there)
        turns = []
        for one in (main, shadow):
            phase, _ = phase_of(c, getattr(one, f"axis_{axis}"))
            turns.append((phase - c.past(phase))[:2])
        shows(f"step-{axis}", f"A step of {axis} that the second controller does not make",
              turns[0] != turns[1])
    for name in ("ready", "error"):
        shows(name, f"`{name}` that is not that of the second controller",
              getattr(main, name) != getattr(shadow, name))

    c.implication("fault-stops", "With a fault no step is made and no order taken.", when=fault,
                  then=(c.part("main.drivers").moved == 0) & ~dut.ready & (dut.jogging == 0),
                  upset=True)
    c.implication("fault-shows", "A fault is an error.", when=fault, then=dut.error,
                  upset=True)
    c.implication("fault-stays", "A fault stays until reset, in every mode.",
                  when=known & c.past(fault & ~c.rst), then=fault, upset=True)
    c.implication("reset-ends-it", "A reset ends a fault that was seen before it.",
                  when=known & was_seen, then=~fault, upset=True)
    c.implication("reset-hides-nothing", "A fault that comes up during a reset outlives it.",
                  when=known & c.past(fault & c.rst & c.past(c.rst)), then=fault, upset=True)
    main_registers, shadow_registers = _registers(c._inside("main")), _registers(
        c._inside("shadow"))
    c.implication("reset-makes-them-equal", "After a reset all that a reset sets agrees.",
                  when=known & c.past(c.rst),
                  then=_all(value == shadow_registers[name] for name,
                            value in main_registers.items()
                            if not value.reset_less), upset=True)


def _registers(fragment: Fragment, path: str = "") -> dict[str, Bits]:
    """Find the registers in a part of the gateware by their paths."""
    found = {}
    for domain, statements in fragment.statements.items():
        if domain != "comb":
            found.update((f"{path}{signal.name}", signal) for signal in statements._lhs_signals())
    for inside, name, _ in fragment.subfragments:
        found.update(_registers(inside, f"{path}{name}."))
    return found


def _all(values) -> Bits:
    return Cat(values).all()


GUARD = Component(
    make=GuardedController, describe=describe, depth=10,
    cases=(Case({"period": 3, "z_travel": 2}), Case({"period": 1, "z_travel": 1}),
           Case({"period": 2, "z_travel": 2, "jog_period": 2}),
           Case({"period": 493_214, "z_travel": 1152}, real=True),
           Case({"period": 3, "z_travel": 2}, upset=True)))
