# amaranth: UnusedElaboratable=no

"""The store of settings."""

import random
import re

import pytest

from fresa.protocol import SETTINGS, GCodeFlags, GCodeSettingStore, setting_index, setting_values
from fresa.protocol.gcode_settings import DriveSettings, SpindleRange
from tb.boards import component
from tb.engines import AmaranthEngine
from tests.tools.process import ROOT


def test_settings_are_in_order_and_their_defaults_fit():
    numbers = [each.number for each in SETTINGS]
    assert numbers == sorted(set(numbers))
    assert setting_values({}) == [each.default for each in SETTINGS]
    assert [setting_index(each) for each in numbers] == [*range(len(SETTINGS))]


@pytest.mark.parametrize("axis", range(3))
def test_rates_and_accelerations_have_a_place_in_the_planner(axis):
    """In nm/s and nm/s² they are below 2**31 and 2**34, and a thousandth more would not be."""
    rate, acceleration = (SETTINGS[setting_index(first + axis)] for first in (110, 120))
    assert rate.most * 1000 // 60 < 1 << 31 <= (rate.most + 1) * 1000 // 60
    assert acceleration.most * 1000 < 1 << 34 <= (acceleration.most + 1) * 1000
    page = (ROOT / "docs" / "gcode.md").read_text(encoding="utf-8")
    for each in rate, acceleration:
        assert each.least == 1
        assert f" {each.most / 1000:.3f} mm/" in page


def test_the_page_says_what_their_highest_values_are():
    page = (ROOT / "docs" / "gcode.md").read_text(encoding="utf-8")
    said = re.split(r"highest values.*?: |\. GRBL has none", page)[1]
    most = {}
    for part in said.split(";"):
        *names, highest = re.findall(r"[\d.]+", part)
        numbers = [*map(int, names)]
        if " to " in part:
            numbers += range(numbers[-2] + 1, numbers[-1])
        most.update(dict.fromkeys(numbers, float(highest)))
    assert most == {
        each.number: each.most / 1000 if each.decimal else each.most for each in SETTINGS
        if each.number < 200 and not (each.most == 1 or each.number == 10)}


@pytest.mark.parametrize(("values", "says"), [
    ({14: 1}, "no setting \\$14"), ({100: 0}, "\\$100"), ({3: 8}, "\\$3"),
    ({110: 1 << 27}, "\\$110, in thousandths,")])
def test_values_that_cannot_be_are_refused(values, says):
    with pytest.raises(ValueError, match=says):
        GCodeSettingStore(values=values)


FLAGS = {"inverted": 3, "open": 5, "probe_open": 6, "soft": 20, "hard": 21, "homing": 22,
         "lower": 23, "laser": 32, "strict": 200, "others_open": 202, "servo_low": 210,
         "servo_high": 211}
DRIVE = {"idle_delay": 1, "step_inverted": 2, "enable_inverted": 4}


def test_what_is_written_is_read_and_survives_a_reset():
    rng = random.Random(1)
    values = {23: 5, 101: 80_123}
    with AmaranthEngine(component("store", GCodeSettingStore(values=values))) as engine:
        model = setting_values(values)
        read = None  # of which it is known what is known a clock later
        for _ in range(400):
            at, to = rng.randrange(len(SETTINGS)), rng.randrange(len(SETTINGS))
            trial, write = rng.getrandbits(1), rng.random() < 0.2
            data = rng.randint(SETTINGS[to].least, SETTINGS[to].most)
            reset = rng.random() < 0.05
            engine.set(address=at, write_address=to, data=data, trial=trial, write=write,
                       rst=reset)
            before = model[at]
            engine.run(1)
            if write:
                model[to] = data
            known, read = read, to
            if known is not None:
                assert engine.get("number", "decimal", "least", "most", "initial") == (
                    SETTINGS[known].number, SETTINGS[known].decimal, SETTINGS[known].least,
                    SETTINGS[known].most, setting_values(values)[known])
            engine.set(write=0, rst=0)
            assert engine.get("value") == (
                data if trial and at == to and not reset else before)
            flags = GCodeFlags.from_bits(engine.get("flags"))
            assert {number: flags[name] for name, number in FLAGS.items()} == {
                number: model[setting_index(number)] for number in FLAGS.values()}
            drive = DriveSettings.from_bits(engine.get("drive"))
            assert {number: drive[name] for name, number in DRIVE.items()} == {
                number: model[setting_index(number)] for number in DRIVE.values()}
            spindle = SpindleRange.from_bits(engine.get("spindle"))
            assert (spindle.most, spindle.least) == (
                model[setting_index(30)], model[setting_index(31)])


def test_a_second_motor_has_a_bit_of_the_inverted_directions():
    values = {3: 0b1101}
    with pytest.raises(ValueError, match="\\$3"):
        GCodeSettingStore(values=values)
    store = GCodeSettingStore(values=values, second_motor=True)
    with AmaranthEngine(component("store", store)) as engine:
        at = setting_index(3)
        engine.set(address=at, write_address=at)
        for written, second, first in ((None, 1, 0b101), (0b0111, 0, 0b111), (0b1000, 1, 0)):
            if written is not None:
                engine.set(data=written, write=1)
                engine.run(1)
                engine.set(write=0)
            assert engine.get("second_inverted") == second
            assert GCodeFlags.from_bits(engine.get("flags")).inverted == first
        engine.run(1)
        assert engine.get("value", "most", "initial") == (0b1000, 15, 0b1101)
