"""Presets of the real robot."""

import numpy as np
import pytest

import snake_env
from snake_env import PD, Gait, Robot, Scene


def test_the_real_robot_has_its_play_and_motors():
    assert Robot.aiko().backlash == pytest.approx(np.radians(4.0))
    assert Robot.aiko(links=5).links == 5
    run = snake_env.simulate(robot=Robot.aiko(), controller=PD.aiko(torque_limit=0.5), duration=0.5)
    assert np.abs(run.joint_torque).max() == pytest.approx(0.5), "the motors saturate"
    assert PD.aiko().kd == 0.0


def test_a_robot_of_modules_rolls_and_winds_sideways():
    robot = Robot.sea_snake()
    assert (np.sum(robot.length), np.sum(robot.mass)) == pytest.approx((1.174, 3.657))
    assert [axis for _, axis in robot.joint_axes] == ["yaw", "pitch"] * 8
    assert Robot.sea_snake(backlash=0.01).backlash == 0.01
    moved = {}
    gaits = {
        "rolling": Gait.lateral_rolling(amplitude=np.radians(20), omega=np.pi),
        "sidewinding": Gait.sidewinding(
            amplitude=np.radians(60), vertical_amplitude=np.radians(20), omega=np.pi, beta=-np.pi / 4
        ),
    }
    for name, gait in gaits.items():
        run = snake_env.simulate(
            model="spatial",
            robot=robot,
            gait=gait,
            controller=PD(40.0, 0.5, torque_limit=7.0),
            scene=Scene(friction=(0.5, 0.5)),
            duration=6.0,
        )
        centre = run.position.mean(axis=1)
        moved[name] = centre[-1, :2] - centre[20, :2]
        assert np.all(centre[:, 2] < 0.1)
    # A cylinder would roll by radius times angle, 0.32 m in the last four seconds; the arc is bent.
    assert 0.1 < np.hypot(*moved["rolling"]) < 0.32
    assert abs(moved["sidewinding"][1]) > 2.0 * abs(moved["sidewinding"][0])
