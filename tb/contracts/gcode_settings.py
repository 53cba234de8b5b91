"""Contract of the store of settings: each reads as it was last written, and registers follow."""

from amaranth import Array, Mux

from fresa.protocol import GCodeSettingStore

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_SETTINGS"]

WHOLE = (1, 2, 3, 4, 5, 6, 10, 13, 20, 21, 22, 23, 26, 32, 200, 201, 202, 210, 211, 223)
DECIMAL = (0, 11, 12, 24, 25, 27, 30, 31, *(group + axis for group in (100, 110, 120, 130, 220)
                                     for axis in range(3)))
NUMBERS = sorted(WHOLE + DECIMAL)
"""Numbers of settings, in whole numbers and with decimals; their order is that of addresses."""

FLAGS = {"inverted": 3, "open": 5, "probe_open": 6, "shown": 10, "inches": 13, "soft": 20,
         "hard": 21, "homing": 22,
         "lower": 23, "laser": 32, "strict": 200, "others_open": 202, "servo_low": 210,
         "servo_high": 211, "backlash_rate": 223}
DRIVE = {"idle_delay": 1, "step_inverted": 2, "enable_inverted": 4}
SPINDLE = {"most": 30, "least": 31}
"""Settings in registers, by their fields."""


def describe(c: Contract, dut: GCodeSettingStore) -> None:
    """By any one setting, which is watched from power-up; registers by all that is written."""
    began, count = c.past(1), len(NUMBERS)
    watched = c.free(range(count), name="setting")
    c.assume((watched < count) & (~began | (watched == c.past(watched))))
    c.assume((dut.address < count) & (dut.write_address < count))
    to_it = dut.write & (dut.write_address == watched)
    written, last = c.keep(1, name="written"), c.keep(len(dut.data), name="last_written")
    with c.m.If(to_it):
        c.m.d.sync += [written.eq(1), last.eq(dut.data)]
    initial: Bits = Array(dut.values)[watched]
    present = Mux(written, last, initial)

    read = began & ~c.past(c.rst)
    of_it = read & c.past(dut.address == watched)
    tried = of_it & c.past(dut.write_address == watched) & dut.trial
    c.implication("reads-as-written", "A setting reads as it was last written, before the clock in "
                  "which it was read.", when=of_it & ~tried, then=dut.value == c.past(present))
    c.implication("tried", "One that is tried reads as what it would be.", when=tried,
                  then=dut.value == dut.data)
    known_at = c.past(c.past(dut.write_address))
    is_known = c.past(began)
    known = is_known & (known_at == watched)
    c.implication("initial", "Its first value is there for good.", when=known,
                  then=dut.initial == initial)
    c.implication("first-values", "Until it is written a setting has that.", when=of_it & ~tried
                  & ~written & known, then=dut.value == dut.initial)
    c.implication("numbers", "Settings are in the order of their numbers.", when=is_known,
                  then=dut.number == Array(NUMBERS)[known_at])
    c.implication("decimals", "Lengths, rates and speeds have decimals.", when=is_known,
                  then=dut.decimal == Array(each in DECIMAL for each in NUMBERS)[known_at])
    c.implication("range", "The first value is in its range.", when=is_known,
                  then=(dut.initial >= dut.least) & (dut.initial <= dut.most))
    for port, fields in ((dut.flags, FLAGS), (dut.drive, DRIVE), (dut.spindle, SPINDLE)):
        for field, number in fields.items():
            place = NUMBERS.index(number)
            kept = c.keep(len(port[field]), init=dut.values[place], name=f"last_of_{number}")
            with c.m.If(dut.write & (dut.write_address == place)):
                c.m.d.sync += kept.eq(dut.data)
            c.invariant(f"register-of-{number}", "A register is what was last written, through "
                        "every reset.", port[field] == kept, cover=kept != dut.values[place])
    c.invariant("memory", "So is the word of each setting.",
                Array(c.words("values"))[watched] == present, cover=written, lemma=True)


GCODE_SETTINGS = Component(make=GCodeSettingStore, describe=describe, depth=6,
                           cases=(Case({"values": {23: 5, 101: 80_123}}),))
