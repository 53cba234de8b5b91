"""Settings of a G-code machine that can be changed while it is at rest: `$n=value`."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from amaranth import Module, Mux, Signal
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_FILTER", "MAX_WIDTH", "NEVER_IDLE", "SETTINGS", "SETTING_BITS",
           "DriveSettings", "GCodeFlags", "GCodeSetting", "GCodeSettingStore", "SpindleRange",
           "setting_index", "setting_values"]

SETTING_BITS = 27
"""Bits of a setting: a whole number, or a length or rate in thousandths."""

MAX_FILTER = 5000
"""Longest time of the filters of contacts, in us."""

MAX_LOST_MOTION = 5000
"""Most backlash, in um: with the most steps per mm below `MAX_BACKLASH` of them."""

_MOST = (1 << SETTING_BITS) - 1


class GCodeSetting(NamedTuple):
    """A setting.

    Attributes
    ----------
    number : int
        As GRBL 1.1 has it; those from 200 on are of this machine.
    about : str
        What it is, with its unit.
    least, most : int
        Lowest and highest value, in thousandths if `decimal`.
    decimal : bool
        It has three decimals; others are whole numbers.
    default : int
        What it is if nothing else is said, in thousandths if `decimal`.
    """

    number: int
    about: str
    least: int
    most: int
    decimal: bool
    default: int


def _axes(first: int, about: str, most: int, default: int, least: int = 1) -> list[GCodeSetting]:
    return [GCodeSetting(first + axis, f"{about} of {name}", least, most, True, default)
            for axis, name in enumerate("XYZ")]


NEVER_IDLE = 255
"""The value of $1 with which motors stay on."""

MAX_WIDTH = 255_000
"""Longest STEP pulse, in ns."""

INVERTED = 3
"""Number of the setting of inverted directions."""

SETTINGS = (
    GCodeSetting(0, "time of a STEP pulse, us, rounded up to clocks", 1, MAX_WIDTH, True, 1_000),
    GCodeSetting(1, "time after a motion until the motors are off, ms; 255 is never", 0, NEVER_IDLE,
                 False, NEVER_IDLE),
    GCodeSetting(2, "STEP pins that are low for a step, a bit for each axis", 0, 7, False, 0),
    GCodeSetting(INVERTED, "directions that are inverted, a bit for each axis", 0, 7, False, 0),
    GCodeSetting(4, "ENABLE is inverted", 0, 1, False, 0),
    GCodeSetting(5, "limit switches are on while their contact is open", 0, 1, False, 0),
    GCodeSetting(6, "the probe is on while its contact is open", 0, 1, False, 0),
    GCodeSetting(10, "what reports show: 1 position of the machine, not of work, 2 free blocks and "
                 "bytes", 0, 255, False, 3),
    GCodeSetting(11, "junction deviation, mm", 1, 268_435, True, 10),
    GCodeSetting(12, "tolerance of arcs, mm: kept, of no effect, as arcs have no chords", 0, _MOST,
                 True, 2),
    GCodeSetting(13, "reports are in inches", 0, 1, False, 0),
    GCodeSetting(20, "soft limits: motions stay within the travel", 0, 1, False, 0),
    GCodeSetting(21, "hard limits: a limit switch stops the machine", 0, 1, False, 1),
    GCodeSetting(22, "homing: $H, and locked after power-up until then", 0, 1, False, 0),
    GCodeSetting(23, "axes that home to their lower end, a bit for each", 0, 7, False, 0),
    GCodeSetting(24, "speed at which switches are located, mm/min", 1, _MOST, True, 25_000),
    GCodeSetting(25, "speed at which switches are sought, mm/min", 1, _MOST, True, 500_000),
    GCodeSetting(26, "time for which homing waits behind each of its motions, ms", 0, 65_535, False,
                 0),
    GCodeSetting(27, "distance from the switches after homing, mm", 1, 6_000_000, True, 1_000),
    GCodeSetting(30, "speed of the spindle at full power, rev/min", 0, _MOST, True, 1_000_000),
    GCodeSetting(31, "speed of the spindle at least power, rev/min", 0, _MOST, True, 0),
    GCodeSetting(32, "the spindle is a laser: off in G0, and with M4 it follows the speed", 0, 1,
                 False, 0),
    *_axes(100, "steps per mm", _MOST, 250_000),
    *_axes(110, "highest speed, mm/min,", 128_849_018, 500_000),
    *_axes(120, "acceleration, mm/s²,", 17_179_869, 10_000),
    *_axes(130, "travel, mm,", 13_600_000, 200_000),
    GCodeSetting(200, "a reset stops at once, and the position is lost", 0, 1, False, 0),
    GCodeSetting(201, "least time for which limit switches, probe, door and others are on, us", 1,
                 MAX_FILTER, False, 10),
    GCodeSetting(202, "contacts that are on while open: 1 stop, 2 door, 4 fault of a driver", 0, 7,
                 False, 0),
    GCodeSetting(210, "pulse of the servo while the spindle is off, us", 1, 4000, False, 500),
    GCodeSetting(211, "pulse of the servo at full power, us", 1, 4000, False, 2500),
    *_axes(220, "backlash, mm,", MAX_LOST_MOTION, 0, least=0),
    GCodeSetting(223, "steps/s at which backlash is taken up", 1, 100_000, False, 500),
)
"""All settings in the order of their numbers, which is that of their addresses in the store."""


def setting_index(number: int) -> int:
    """Return the address of a setting."""
    return [each.number for each in SETTINGS].index(number)


def _settings(*, second_motor: bool) -> tuple[GCodeSetting, ...]:
    """Return all settings; with a second motor on one axis, $3 has a bit for that, too."""
    return tuple(each._replace(most=15) if second_motor and each.number == INVERTED else each
                 for each in SETTINGS)


def setting_values(values: Mapping[int, int], *, second_motor: bool = False) -> list[int]:
    """Return the values of all settings by their addresses, from some by their numbers.

    Parameters
    ----------
    values : mapping of int to int
        Some values by number, in thousandths of those with decimals.
    second_motor : bool
        One axis has a second motor.

    Raises
    ------
    ValueError
        If there is no setting of a number, or a value is out of range.
    """
    unknown = set(values) - {each.number for each in SETTINGS}
    if unknown:
        raise ValueError(f"there is no setting ${min(unknown)}")
    return [in_range(f"${each.number}{', in thousandths,' if each.decimal else ''}",
                     values.get(each.number, each.default), each.least, each.most)
            for each in _settings(second_motor=second_motor)]


class GCodeFlags(data.Struct):
    """Settings that are in registers of their own; `_REGISTERS` has their numbers."""

    inverted: 3
    open: 1
    probe_open: 1
    shown: 2
    inches: 1
    soft: 1
    hard: 1
    homing: 1
    lower: 3
    strict: 1
    others_open: 3
    laser: 1
    servo_low: 12
    servo_high: 12
    backlash_rate: 17


class DriveSettings(data.Struct):
    """Settings of the driver modules, which are registers, too."""

    idle_delay: 8
    step_inverted: 3
    enable_inverted: 1


class SpindleRange(data.Struct):
    """Speeds of the spindle at full and at least power, which are registers, too."""

    most: SETTING_BITS
    least: SETTING_BITS


_REGISTERS = {
    "flags": {"inverted": INVERTED, "open": 5, "probe_open": 6, "shown": 10, "inches": 13,
              "soft": 20, "hard": 21, "homing": 22, "lower": 23, "laser": 32, "strict": 200,
              "others_open": 202, "servo_low": 210, "servo_high": 211, "backlash_rate": 223},
    "drive": {"idle_delay": 1, "step_inverted": 2, "enable_inverted": 4},
    "spindle": {"most": 30, "least": 31}}


class GCodeSettingStore(wiring.Component):
    """Holds all settings, and what is known of each.

    They keep their values through resets, to the power-down. While ``trial`` is 1 the setting at
    ``write_address`` reads as ``data``, without being that.

    Parameters
    ----------
    values : mapping of int to int
        Values at power-up by number, in thousandths of those with decimals. Others have their
        defaults.
    second_motor : bool
        One axis has a second motor: bit 3 of $3 inverts its direction.
    bounds : mapping of int to int
        Highest values to be written, by number, of those for which it is not that of `SETTINGS`; 0
        for one that stays what it is.

    Members
    -------
    address : In(range(len(SETTINGS)))
        A setting, by its place in `SETTINGS`.
    value : Out(27)
        Its value, a clock later.
    number, decimal, least, most : Out(8), Out(1), Out(1), Out(27)
        What is known of the setting at ``write_address``, two clocks later. ``least`` is 0 or 1.
    initial : Out(27)
        Its value at power-up, likewise.
    trial : In(1)
        Let ``data`` be read.
    write : In(1)
        Write ``data``.
    write_address, data : In(range(len(SETTINGS))), In(27)
        What is written or tried.
    flags, drive, spindle : Out(GCodeFlags), Out(DriveSettings), Out(SpindleRange)
        Values of those that are in registers.
    second_inverted : Out(1)
        The direction of the second motor is inverted. Only with `second_motor`.

    Raises
    ------
    ValueError
        If there is no setting of a number, or a value is out of range.
    """

    def __init__(self, *, values: Mapping[int, int] = MappingProxyType({}),
                 second_motor: bool = False,
                 bounds: Mapping[int, int] = MappingProxyType({})) -> None:
        self.second_motor, self.bounds = second_motor, dict(bounds)
        self.values = setting_values(values, second_motor=second_motor)
        super().__init__({
            "address": In(range(len(SETTINGS))), "value": Out(SETTING_BITS),
            "number": Out(8), "decimal": Out(1), "least": Out(1), "most": Out(SETTING_BITS),
            "initial": Out(SETTING_BITS), "trial": In(1), "write": In(1),
            "write_address": In(range(len(SETTINGS))), "data": In(SETTING_BITS),
            "flags": Out(GCodeFlags), "drive": Out(DriveSettings), "spindle": Out(SpindleRange),
            **({"second_inverted": Out(1)} if second_motor else {}),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.values = values = memory.Memory(
            shape=SETTING_BITS, depth=len(SETTINGS), init=self.values)
        layout = data.StructLayout({"number": 8, "decimal": 1, "least": 1, "most": SETTING_BITS,
                                    "initial": SETTING_BITS})
        m.submodules.known = known = memory.Memory(
            shape=layout, depth=len(SETTINGS), attrs={"ram_style": "block"}, init=[
                {"number": each.number, "decimal": each.decimal,
                 "least": each.least or self.bounds.get(each.number) == 0,
                 "most": self.bounds.get(each.number, each.most), "initial": value}
                for each, value in zip(_settings(second_motor=self.second_motor), self.values,
                                       strict=True)])
        write = values.write_port()
        read, fact = values.read_port(), known.read_port()
        tried = Signal()  # what is read
        facts = Signal(layout, reset_less=True)  # a register behind the memory
        m.d.sync += [tried.eq(self.address == self.write_address), facts.eq(fact.data)]
        m.d.comb += [
            read.addr.eq(self.address), fact.addr.eq(self.write_address),
            self.value.eq(Mux(tried & self.trial, self.data, read.data)),
            self.number.eq(facts.number), self.decimal.eq(facts.decimal),
            self.least.eq(facts.least), self.most.eq(facts.most), self.initial.eq(facts.initial),
            write.addr.eq(self.write_address), write.data.eq(self.data), write.en.eq(self.write),
        ]
        for port, name, number in ((getattr(self, port), name, number)
                                   for port, fields in _REGISTERS.items()
                                   for name, number in fields.items()):
            index = setting_index(number)
            # A reset of the machine leaves it, as it leaves the memory.
            init = self.values[index] % (1 << len(port[name]))
            register = Signal.like(port[name], init=init, reset_less=True,
                                   name=f"setting_{number}")
            with m.If(self.write & (self.write_address == index)):
                m.d.sync += register.eq(self.data)
            m.d.comb += port[name].eq(register)
        if self.second_motor:
            index, bit = setting_index(INVERTED), len(self.flags.inverted)
            register = Signal(init=self.values[index] >> bit, reset_less=True,
                              name="setting_second_inverted")
            with m.If(self.write & (self.write_address == index)):
                m.d.sync += register.eq(self.data[bit])
            m.d.comb += self.second_inverted.eq(register)
        return m
