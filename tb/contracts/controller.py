"""Contract of the controller: both modes and the motors, without the display."""

from dataclasses import dataclass

from amaranth import Cat, Mux, Value

from fresa.drive import FULL_STEP
from fresa.motion import NumericalController

from .automatic import watch_counts
from .coil import is_neighbour, phase_of, watch_spacing
from .contract import Bits, Case, Component, Contract
from .manual import MANUAL
from .order_control import watch_order
from .sequencer import SEQUENCER

__all__ = ["CONTROLLER", "Pins", "watch_machine", "watch_parts"]


@dataclass(frozen=True)
class Pins:
    """Outputs of a machine, whatever the names of its pins."""

    mode: Bits
    stop: Bits
    jog: Bits
    ready: Bits
    error: Bits
    count: Bits
    select: Bits
    coils: tuple[Bits, Bits, Bits]


def describe(c: Contract, dut: NumericalController) -> None:
    """The machine on its own pins, and its state."""
    pins = Pins(mode=dut.mode, stop=dut.stop, jog=dut.jog, ready=dut.ready, error=dut.error,
                count=dut.count, select=dut.select, coils=(dut.axis_x, dut.axis_y, dut.axis_z))
    watch_machine(c, pins, period=dut.period, path="")
    hold = dut.stop | c.signal("stopped")
    c.implication("jogging-is-manual", "An axis is shown as jogged only in manual mode, unless "
                                       "stopped.",
                  when=dut.jogging.any(), then=~dut.mode & ~hold & dut.jog.any())
    watch_order(c, "automatic.orders", reset=c.rst | ~dut.mode)
    watch_counts(c, "automatic", reset=c.rst | ~dut.mode)
    watch_parts(c, "", mode=dut.mode)


def watch_parts(c: Contract, path: str, *, mode: Bits) -> None:
    """State the contracts of manual control and of the sequencer, if `parts`.

    `path` leads to the controller. In manual mode the sequencer is held in reset.
    """
    prefix = f"{path}." if path else ""
    if not c.parts:
        return
    c.keeps(f"{prefix}manual", MANUAL)
    c.keeps(f"{prefix}sequencer", SEQUENCER, reset=c.rst | ~mode)
    order = c.state(f"{prefix}automatic.orders.order_state")
    moves = c.part(f"{prefix}sequencer").moves
    c.invariant("moving-only-by-order", "Every movement was ordered.",
                c.kept[f"{prefix}sequencer:under_way"] | order("REST", "FAULT"),
                cover=order("MOVING"))
    c.invariant("taken-at-once", "A move is offered when it can be taken.",
                ~moves.valid | moves.ready | order("FAULT"), cover=moves.valid)


def watch_machine(c: Contract, pins: Pins, *, period: int, path: str) -> None:
    """State the requirements of users, by the pins alone where possible.

    `path` leads to the controller.
    """
    def inside(name: str) -> Bits:
        return c.signal(f"{path}.{name}")

    drivers, automatic = c.part(f"{path}.drivers"), c.part(f"{path}.automatic")
    moved, refused, requested = drivers.moved, drivers.refused, drivers.step
    by_hand, by_order = c.part(f"{path}.manual").step, automatic.step
    order = c.any_code(f"{path}.automatic.orders.order_state")
    motion = c.any_code(f"{path}.sequencer.motion_state")
    was_reset, was_mode = c.past(c.rst), c.past(pins.mode)
    to_origin = c.past(c.rst | ~pins.mode)

    words = [c.past(word, init=FULL_STEP[0]) for word in pins.coils]
    for index, (name, word) in enumerate(zip("xyz", pins.coils, strict=True)):
        phase, legal = phase_of(c, word)
        before, up = c.past(phase), c.past(drivers.direction[index])
        change = phase - before
        rested = watch_spacing(c, word != words[index], period, f"rested_{name}")
        at = getattr(automatic, f"at_{name}")
        c.invariant(f"{name}-word-legal", f"The coils of {name} are a row of the table.",
                    legal,
                    cover=phase == 2)
        c.implication(f"{name}-only-on-a-step",
                      f"The coils of {name} change only on a step, to a neighbour.",
                      when=word != words[index],
                      then=c.past(moved[index]) & is_neighbour(words[index], word)
                      & (change[:2] == Mux(up, 1, -1)[:2]))
        c.implication(f"{name}-every-step", f"A step of {name} changes its coils with the next "
                                            "clock.",
                      when=c.past(moved[index]), then=word != words[index])
        if period > 1:
            c.implication(f"{name}-spacing",
                          f"The coils of {name} never change twice within `period` clocks.",
                          when=word != words[index], then=rested >= period - 1)
            rest, due = inside(f"drivers.{name}.rest"), c.past(moved[index])
            c.invariant(f"{name}-rest-is-time-left",
                        f"{name} is ready for a step when its time is over.",
                        (rest <= 0) & Mux(due, rest == 1 - period,
                                          (rest == 0) | (rest + period - 2 == rested))
                        & ((rest < 0) | (rested >= period - 2)), cover=rest < 0)
            c.invariant(f"{name}-ready-before-due", f"{name} is ready before the next step is "
                                                       "due.",
                        rest >= inside("automatic.orders.divider.count"), cover=rest < 0)
        # What an observer of the coils alone counts
        travel = c.keep(16, name=f"observed_{name}")
        now = Mux(to_origin, 0, (travel + change[:2].as_signed())[:16])
        c.m.d.sync += travel.eq(now)
        c.invariant(f"{name}-no-lost-step",
                    f"The position of {name} equals the steps of its coils, at any time.",
                    at == now, cover=at != 0)
        origin = c.keep(2, name=f"origin_{name}")
        here = Mux(to_origin, phase, origin)
        c.m.d.sync += origin.eq(here)
        c.invariant(f"{name}-phase-is-position",
                    f"Coils and position of {name} agree since the origin.",
                    (phase - here)[:2] == at[:2], cover=at != 0)
        c.implication(f"shows-{name}", f"The shown count equals the steps of the coils of {name}.",
                      when=(pins.select == index + 1) & (now != 0), then=pins.count == now)

    main = inside("automatic.main.count")
    c.implication("shows-main", "The main count is shown by choice 0.",
                  when=(pins.select == 0) & (main != 0), then=pins.count == main)

    c.implication("reset-moves-nothing", "A reset changes no coil.", when=was_reset,
                  then=_all(now == before for now, before in zip(pins.coils, words, strict=True)))
    c.implication("mode-change-moves-nothing", "In the clock of a change of mode no step is made.",
                  when=c.past(1) & (pins.mode != was_mode), then=moved == 0)
    c.implication("jog-excludes-automatic", "Jog and automatic never request a step in the same "
                  "clock.",
                  when=by_order.any(), then=by_hand == 0)
    c.implication("automatic-steps-by-order", "In automatic mode only orders make steps.",
                  when=pins.mode & moved.any(), then=(moved & ~by_order) == 0)
    c.implication("manual-steps-by-switch", "In manual mode only switches make steps.",
                  when=~pins.mode & moved.any(), then=((moved & ~by_hand) == 0) & pins.jog.any())
    c.implication("switches-on-at-entry-ignored", "No switch counts that was on when manual mode "
                  "was entered.",
                  when=was_mode, then=inside("manual.seen_off") == 0)
    c.implication("automatic-idle-in-manual", "In manual mode nothing of the automatic part is "
                                            "under way.",
                  when=to_origin, then=order("REST") & motion("REST"))
    c.implication("automatic-step-not-refused", "In automatic mode no step is refused, but by "
                  "reset.",
                  when=pins.mode & requested.any() & ~c.rst,
                  then=(refused == 0) & (moved == requested))
    c.implication("not-made-not-counted", "A step of an order that is not made is not counted.",
                  when=c.past(by_order.any() & (moved == 0)),
                  then=_counts(c, path) == Mux(to_origin, 0, c.past(_counts(c, path))))

    # Stop
    stopped = c.keep(1, name="stop_seen")
    c.m.d.sync += stopped.eq((stopped | pins.stop) & ~c.rst)
    c.invariant("stop-latched", "A stop is kept until reset.", inside("stopped") == stopped,
                cover=stopped)
    c.implication("stop-at-once", "From the clock of a stop on no step is made.",
                  when=stopped | pins.stop, then=moved == 0)
    c.implication("stopped-coils-stable", "Nothing moves while stopped: the coils keep their "
                  "words.",
                  when=c.past(stopped | pins.stop),
                  then=_all(now == before for now, before in zip(pins.coils, words, strict=True)))
    c.implication("stopped-not-ready", "A machine that is stopped is not ready.",
                  when=stopped | pins.stop, then=~pins.ready)
    c.implication("ready-at-rest", "Ready means automatic mode, at rest, no step requested, not "
                                   "stopped.",
                  when=pins.ready, then=pins.mode & motion("REST") & order("REST")
                  & (requested == 0)
                  & ~stopped & ~pins.stop)


    # A state register that is upset
    for what, upset in [("moves", order("FAULT")), ("orders", motion.is_unused()
                                                    | motion("FAULT"))]:
        c.implication(f"upset-{what}-stop", f"Where the register of the {what} is upset no step "
                                            "is made.",
                      when=upset, then=moved == 0, upset=True)
        c.implication(f"upset-{what}-show", f"Where the register of the {what} is upset an error "
                                            "shows.",
                      when=upset, then=pins.error & ~pins.ready, upset=True)


def _counts(c: Contract, path: str) -> Bits:
    return Cat(c.signal(f"{path}.automatic.{name}.count") for name in ("main", "x", "y", "z"))


def _all(values) -> Bits:
    result = Value.cast(1)
    for value in values:
        result = result & value
    return result


CONTROLLER = Component(
    make=NumericalController, describe=describe, depth=10,
    cases=(Case({"period": 3, "z_travel": 2}), Case({"period": 1, "z_travel": 1}),
           Case({"period": 2, "z_travel": 2, "jog_period": 2}),
           Case({"period": 493_214, "z_travel": 1152}, real=True),
           Case({"period": 3, "z_travel": 2}, upset=True)))
