"""Presets of the real robot."""

import numpy as np
import pytest

import snake_env
from snake_env import PD, Robot


def test_the_real_robot_has_its_play_and_motors():
    assert Robot.aiko().backlash == pytest.approx(np.radians(4.0))
    assert Robot.aiko(links=5).links == 5
    run = snake_env.simulate(robot=Robot.aiko(), controller=PD.aiko(torque_limit=0.5), duration=0.5)
    assert np.abs(run.joint_torque).max() == pytest.approx(0.5), "the motors saturate"
    assert PD.aiko().kd == 0.0
