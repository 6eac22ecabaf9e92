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


def test_robots_of_modules_have_the_data_of_their_sources():
    robot = Robot.sea_snake()
    assert (np.sum(robot.length), np.sum(robot.mass)) == pytest.approx((1.174, 3.657))
    assert [axis for _, axis in robot.joint_axes] == ["yaw", "pitch"] * 8
    assert Robot.sea_snake(backlash=0.01).backlash == 0.01
    robot = Robot.dgist()
    assert (np.sum(robot.length[1:-1]), 21 * robot.mass) == pytest.approx((10 * 0.0675 + 9 * 0.0695, 4.2))
    assert [axis for _, axis in robot.joint_axes] == ["pitch", "yaw"] * 10
    assert Robot.dgist(motor=None).motor is None


@pytest.mark.parametrize(
    ("robot", "controller", "farthest"),
    [
        # A cylinder would roll by radius times angle, in the last four seconds; the arc is bent.
        (Robot.sea_snake(), PD(40.0, 0.5, torque_limit=7.0), 0.32),
        (Robot.dgist(), PD(40.0, 0.5, torque_limit=7.0), 0.41),
    ],
    ids=["sea_snake", "dgist"],
)
def test_robots_of_modules_roll_and_wind_sideways(robot, controller, farthest):
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
            controller=controller,
            scene=Scene(friction=(0.5, 0.5)),
            duration=6.0,
        )
        centre = run.position.mean(axis=1)
        moved[name] = centre[-1, :2] - centre[20, :2]
        assert np.all(centre[20:, 2] < 0.1)
    assert 0.1 < np.hypot(*moved["rolling"]) < farthest
    assert abs(moved["sidewinding"][1]) > abs(moved["sidewinding"][0]) > 0.0
