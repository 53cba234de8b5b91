"""Strings by whole arrays, compared with the plant that the machine's benches have."""

import numpy as np
import pytest

from fresa.drive import HALF_STEP
from tb.wall_plant import StringPlant, hanging
from tools.draw.strings import MotorString, step_mm

WIDTH, STEP = 1000.0, 1 / 25.4648


def test_a_motor_follows_words_as_the_plant_does():
    random = np.random.default_rng(1)
    phases = random.integers(-1, 2, 3000).cumsum() % 8
    words = np.array(HALF_STEP)[phases]
    words[random.random(3000) < 0.1] = 0  # released, and powered again where it may be
    words[1000] = HALF_STEP[(phases[999] + 4) % 8]
    motor, plant = MotorString(500), StringPlant(500)
    lengths = np.concatenate([motor.feel(part) for part in np.split(words, [0, 5, 6, 1700])])
    expected = []
    for clock, word in enumerate(words.tolist()):
        plant.feel(clock, word)
        expected.append(plant.length)
    assert lengths.tolist() == expected and motor.length == plant.length
    assert (motor.steps, motor.jumps) == (plant.steps, plant.jumps)
    assert motor.steps > 1000 and motor.jumps > 0


def test_a_word_that_is_none_is_a_jump():
    motor = MotorString(5)
    assert motor.feel(np.array([HALF_STEP[0], 15, HALF_STEP[1]])).tolist() == [5, 5, 6]
    assert motor.jumps == 1


def test_a_step_moves_a_pen_farther_near_to_the_pulleys_line():
    places = np.array([500 + 500j, 500 + 100j, 500 + 20j, 30 + 900j])
    worth = step_mm(places, WIDTH, STEP)
    assert worth[0] == pytest.approx(STEP * 2**0.5)
    assert (np.diff(worth[:3]) > 0).all()
    left, right = np.abs(places), np.abs(places - WIDTH)
    for signs in (1, 1), (1, -1), (-1, 1), (-1, -1):
        moved = hanging(left + signs[0] * STEP, right + signs[1] * STEP, WIDTH) - places
        assert (np.abs(moved) < worth * 1.1).all()
