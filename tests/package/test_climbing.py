"""Robots that hold and move themselves by friction: on a pole, in a pipe and over uneven ground."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from conftest import in_mujoco

import snake_env
from snake_env import PD, JointTrajectory, Robot, Scene, Start


def run(env_id, action, steps, **keywords):
    """Distances (steps, 2) of two robots whose every action is the given one, and the environment after that."""
    envs = gymnasium.make_vec(env_id, num_envs=2, **keywords)
    envs.reset(seed=0)
    distances = []
    for _ in range(steps):
        *_, info = envs.step(np.broadcast_to(action, envs.action_space.shape).astype(np.float32))
        assert not info["unconverged"].any()
        assert not info["penetrated"].any()
        distances.append(info["distance"])
    return np.array(distances), envs


def test_a_helix_that_rolls_climbs_a_pole():
    distances, envs = run("SnakeClimb-v1", 0.0, 120)
    assert (distances[-1] > 0.1).all()
    assert envs.unwrapped.scene(0).slope[0] == np.pi / 2, "gravity points along -x"


def test_a_helix_that_does_not_roll_stays_on_the_pole_at_rest():
    entries = gymnasium.make("SnakeClimb-v1").unwrapped.layout["action"]
    still = {entry["name"]: -(entry["high"] + entry["low"]) / (entry["high"] - entry["low"]) for entry in entries}
    action = np.array([still[entry["name"]] if entry["name"] == "frequency" else 0.0 for entry in entries])
    _, envs = run("SnakeClimb-v1", action, 80)
    speed = np.abs(envs.unwrapped.state().link_velocity[..., :3]).max()
    assert speed < 1e-6


def start_of(position, quaternion, angles):
    """A start at rest from the place of link 1 and the joint angles."""
    w, x, y, z = quaternion
    ahead = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    left, up = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)]), np.array([0.0, 0.0, 1.0])
    level = np.cross(up, ahead) / np.linalg.norm(np.cross(up, ahead))
    roll = np.arctan2(left @ np.cross(ahead, level), left @ level)
    heading, pitch = np.arctan2(ahead[1], ahead[0]), np.arcsin(ahead[2])
    return Start(position=tuple(position), heading=heading, pitch=pitch, roll=roll, posture=[*map(tuple, angles)])


def imbalance(model, data, contacts, torques, mu, edges):
    """Least largest component of force that is left over [N], [N m] with forces in pyramids of friction, by a linear
    programme: zero where the robot can be in equilibrium. Pyramids of ``edges`` edges are inside the cones of mu."""
    import mujoco
    from scipy.optimize import linprog

    columns = []
    for body, point, normal in contacts:
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, point, body)
        for turn in 2.0 * np.pi * np.arange(edges) / edges:
            across = np.cos(turn) * np.array([1.0, 0.0, 0.0]) + np.sin(turn) * np.cross(normal, [1.0, 0.0, 0.0])
            columns.append(jacobian.T @ (normal + mu * across))
    forces, one = np.array(columns).T, np.ones((model.nv, 1))
    rest = data.qfrc_bias - np.r_[np.zeros(6), torques]
    bounds = np.block([[forces, -one], [-forces, -one]]), np.r_[rest, -rest]
    return linprog(np.r_[np.zeros(forces.shape[1]), 1.0], *bounds, method="highs").fun


def bisected(holds, low, high, width):
    """Between two numbers of which the second holds and the first does not."""
    assert holds(high)
    assert not holds(low)
    while high - low > width:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if holds(middle) else (middle, high)
    return low, high


def test_the_least_friction_that_holds_a_helix_is_that_of_exact_statics():
    """A helix at rest on an upright pole stays at rest on one with less friction, down to what the balance of its 26
    degrees of freedom under the torques of its joints needs: 0.678."""
    pytest.importorskip("mujoco")
    pytest.importorskip("scipy")
    env = gymnasium.make("SnakeClimb-v1").unwrapped
    env.reset(seed=0)
    wound, pole = env.state(), env.scene().obstacles[0]
    controller, target = PD(kp=800.0, kd=2.0, torque_limit=80.0), 1.2 * wound.joint_angle
    robot, gait = Robot(), JointTrajectory([0.0, 1.0], [target, target])

    def run(friction, start, duration):
        scene = Scene(obstacles=[dataclasses.replace(pole, friction=friction)], slope=(np.pi / 2, 0.0))
        keywords = {"robot": robot, "scene": scene, "gait": gait, "controller": controller, "start": start}
        motion = snake_env.simulate("spatial", **keywords, duration=duration, sample=duration, record="velocity")
        return scene, motion

    scene, settled = run(1.0, start_of(wound.link_position[0], wound.link_quaternion[0], wound.joint_angle), 4.0)
    assert np.abs(settled.velocity[-1]).max() < 1e-12
    position, quaternion, angles = settled.position[-1], settled.quaternion[-1], settled.joint_angle[-1]
    start = start_of(position[0], quaternion[0], angles)

    def stays(friction):
        _, motion = run(friction, start, 0.3)
        return np.abs(motion.position[-1] - motion.position[0]).max() < 0.3e-6  # a creep of 1e-6 m/s

    model, data = in_mujoco(scene, robot=robot, controller=controller, start=start)
    contacts = []
    for i, (cg, (w, x, y, z)) in enumerate(zip(position, quaternion, strict=True), start=1):
        axis = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
        # From the pole's axis, along x, to the nearest point of the link's centre line.
        offset, across = (cg - pole.start) * [0, 1, 1], axis * [0, 1, 1]
        along = np.clip(-(offset @ across) / (across @ across), -robot.contact_half_length, robot.contact_half_length)
        distance = np.linalg.norm(offset + along * across)
        normal = (offset + along * across) / distance
        if distance - pole.radius - robot.radius < 1e-6:
            contacts.append((model.body(f"link_{i}").id, cg + along * axis - robot.radius * normal, normal))
    assert len(contacts) == 5
    torques = (controller.kp * (target - angles)).ravel()  # yaw and pitch of each joint in turn, as in the model
    edges = 48
    inside = bisected(lambda mu: imbalance(model, data, contacts, torques, mu, edges) < 1e-5, 0.6, 0.8, 1e-4)
    found = bisected(stays, 0.6, 0.8, 1e-4)
    assert inside[0] * np.cos(np.pi / edges) < found[1]
    assert found[0] < inside[1]
    assert found[1] == pytest.approx(0.6784, abs=2e-3)


def test_a_helix_that_rolls_moves_through_a_pipe():
    distances, _ = run("SnakePipe-v1", 0.0, 120)
    assert (distances[-1] > 0.05).all()


@pytest.mark.parametrize("terrain", ["rough", "blocks", "stairs", "ramps"])
def test_sidewinding_crosses_uneven_ground(terrain):
    distances, envs = run("SnakeTerrain-v1", 0.0, 100, terrain=terrain, difficulty=1.0)
    assert (distances[-1] > 0.1).all()
    (field,) = envs.unwrapped.scene(0).obstacles
    assert isinstance(field, snake_env.obstacles.HeightField)
    assert np.ptp(field.height) > 0.03


@pytest.mark.parametrize("task", ["climb", "pipe"])
def test_a_helix_needs_cardan_joints_and_enough_links(task):
    for robot in (snake_env.Robot(links=5), snake_env.Robot(axes="yaw")):
        with pytest.raises(snake_env.ConfigError, match=f'cardan joints for the task "{task}"'):
            gymnasium.make_vec("SnakeSpatial-v1", num_envs=1, task=task, robot=robot)
    with pytest.raises(snake_env.ConfigError, match="model"):
        gymnasium.make_vec("SnakeFree-v1", num_envs=1, task=task)
