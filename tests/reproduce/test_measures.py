"""Numbers read off a trajectory, on trajectories whose numbers are known."""

import dataclasses

import numpy as np
import pytest

import snake_env
from snake_env.reproduce.measures import MIDDLE, collisions, roughness, torque_beyond
from snake_env.reproduce.measures_spatial import body_turn

SAMPLE = 0.01
BLANK = snake_env.simulate(duration=10.0, sample=SAMPLE)


def along_x(y):
    """A run whose link 6 moves along x at 0.1 m/s with the lateral positions y(x)."""
    position = BLANK.position.copy()
    position[:, MIDDLE, 0] = 0.1 * BLANK.time
    position[:, MIDDLE, 1] = y(0.1 * BLANK.time)
    return dataclasses.replace(BLANK, position=position)


def test_a_straight_path_is_smooth_and_short_waves_are_rough():
    assert roughness(along_x(lambda x: 0.3 * x)) < 1e-12
    wave, amplitude = 0.1, 2e-3
    kept = 1.0 - hann_response(0.03 / wave)
    expected = amplitude / np.sqrt(2.0) * kept
    assert roughness(along_x(lambda x: amplitude * np.sin(2.0 * np.pi * x / wave))) == pytest.approx(expected, rel=0.1)


def hann_response(ratio):
    """Of a Hann window of ``ratio`` wavelengths."""
    return np.sinc(ratio) / (1.0 - ratio**2)


def test_spikes_are_distinguished_from_collisions():
    force = np.zeros_like(BLANK.contact_force)
    force[100:300, 2, 1] = 5.0  # pushed for 2 s
    force[100, 2, 1] = 50.0  # a spike when it is touched
    force[200, 2, 1] = 50.0  # one without a collision
    share, chance = collisions(dataclasses.replace(BLANK, contact_force=force))
    assert share == 0.5
    assert chance == pytest.approx(3.0 / len(force))  # the collision and 20 ms after it


def test_torques_of_pegs_are_those_beyond_the_run_without():
    run = dataclasses.replace(BLANK, joint_torque=np.full_like(BLANK.joint_torque, 5.0))
    other = dataclasses.replace(BLANK, joint_torque=np.full_like(BLANK.joint_torque, -3.0))
    assert torque_beyond(run, other, 0.0, 5.0) == pytest.approx(4.0)


def test_a_body_that_turns_to_the_left_turns_positively():
    angle = np.radians(2.0) * BLANK.time[:, None]
    along = np.linspace(1.0, 0.0, BLANK.angle.shape[1])
    position = np.stack([along * np.cos(angle), along * np.sin(angle), np.zeros_like(along * angle)], axis=-1)
    assert body_turn(dataclasses.replace(BLANK, position=position), 2.0, 7.0) == pytest.approx(10.0)
