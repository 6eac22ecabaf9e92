"""Sensors of real robots as blocks of the observation: accelerometer, gyroscope, touch, range, torque of the motors."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from snake_env import ConfigError, Integrator, Motor, Robot, Scene, SnakeEnv, SnakeVectorEnv, Start
from snake_env.obstacles import Box, Circle, Cylinder, Polygon, Segment

BLOCKS = ["accelerometer", "gyro", "motor_torque", "touch", "touch_side", "range"]
MODELS = ["planar", "spatial"]
GRAVITY = Robot().gravity
PERIOD = 0.05


def blocks(env, observation):
    """The unscaled values of each block (n, k)."""
    layout = env.unwrapped.layout["observation"]
    return {b["name"]: b["scale"] * observation[..., b["start"] : b["start"] + b["size"]] for b in layout}


def sensing(num_envs, names=BLOCKS, **options):
    return SnakeVectorEnv(num_envs, observation_blocks=names, **options)


def driven(env, steps, **reset):
    """Observations by block and states (steps + 1) under random actions."""
    rng = np.random.default_rng(5)
    seen = [(blocks(env, env.reset(seed=0, **reset)[0]), env.state(), {})]
    for _ in range(steps):
        actions = rng.uniform(-1.0, 1.0, (env.num_envs, env.single_action_space.shape[0])).astype(np.float32)
        observation, *_, infos = env.step(actions)
        seen.append((blocks(env, observation), env.state(), infos))
    return seen


def axes_of(state, link=0):
    """Unit vectors forward, left and up of a link, (n, 3, 3), or the first two of them in the plane."""
    if state.link_quaternion is None:
        ahead = -np.stack([np.cos(state.link_angle[:, link]), np.sin(state.link_angle[:, link])], axis=-1)
        return np.stack([ahead, np.stack([-ahead[:, 1], ahead[:, 0]], axis=-1)], axis=1)
    w, x, y, z = state.link_quaternion[:, link].T
    columns = [
        [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
        [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
        [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
    ]
    right, up, backward = (np.stack(column, axis=-1) for column in columns)
    return np.stack([-backward, -right, up], axis=1)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("task", ["field", "free"])
def test_no_observation_has_them_unless_they_are_named(model, task):
    layout = SnakeEnv(model=model, task=task, privileged=True).layout
    assert not set(layout["on_request"]) & {block["name"] for block in layout["observation"]}
    assert set(layout["on_request"]) >= {"accelerometer", "motor_torque"}


@pytest.mark.parametrize("roll", [0.0, 0.4])
def test_in_free_fall_an_accelerometer_reads_nothing(roll):
    env = sensing(1, ["accelerometer"], model="spatial", task="free", action_mode="torques")
    env.reset(seed=0, options={"start": Start(posture="straight", position=(0.0, 0.0, 9.0), roll=roll, pitch=0.3)})
    for _ in range(5):
        observation = env.step(np.zeros(env.action_space.shape))[0]
        np.testing.assert_allclose(blocks(env, observation)["accelerometer"], 0.0, atol=1e-5)


@pytest.mark.parametrize(
    ("model", "heading"), [("planar", math.pi), ("planar", 1.0), ("spatial", math.pi), ("spatial", 0.0)]
)
def test_at_rest_it_reads_what_carries_the_robot(model, heading):
    """Against gravity, whose pull along the inclined ground is what remains in the plane."""
    angle = 0.1
    env = sensing(
        1,
        ["accelerometer", "gyro"],
        model=model,
        task="free",
        action_mode="joints",
        slope=(angle, 0.0),
        friction=(1, 1),
    )
    env.reset(seed=0, options={"start": Start(posture="straight", heading=heading)})
    for _ in range(40):
        seen = blocks(env, env.step(np.zeros(env.action_space.shape))[0])
    uphill = GRAVITY * math.sin(angle)
    # With heading pi the leading link faces +x.
    expected = [-uphill * math.cos(heading), uphill * math.sin(heading), GRAVITY * math.cos(angle)]
    found = seen["accelerometer"][0]
    # The joints sag by some thousandths of a radian, and with them the axes of the link.
    np.testing.assert_allclose(found, expected[: len(found)], atol=0.02)
    np.testing.assert_allclose(seen["gyro"], 0.0, atol=1e-4)


def test_sliding_downhill_it_reads_friction_alone():
    """Gravity pulls sensor and robot alike: what is felt is Coulomb's friction, mu g cos(angle) uphill."""
    angle, mu = 0.4, 0.3
    env = sensing(1, ["accelerometer"], task="free", action_mode="joints", slope=(angle, 0.0), friction=(mu, mu))
    env.reset(seed=0, options={"start": Start(posture="straight", heading=math.pi)})
    for _ in range(8):
        seen = blocks(env, env.step(np.zeros(env.action_space.shape))[0])["accelerometer"]
        np.testing.assert_allclose(seen, [[mu * GRAVITY * math.cos(angle), 0.0]], atol=1e-4)


@pytest.mark.parametrize("link", [0, 4])
@pytest.mark.parametrize("model", MODELS)
def test_what_a_link_feels_is_consistent_with_the_state(model, link):
    """Differences of velocities, among impacts at pegs and on inclined ground, and angular velocities about the axes of
    the link; beyond the bound of the block they are clipped."""
    slope = (0.05, 0.7)
    names = ["accelerometer", "gyro", *["gravity"] * (model == "spatial")]
    env = sensing(4, names, model=model, task="field", slope=slope, max_episode_steps=99, imu_link=link)
    downhill = -GRAVITY * math.sin(slope[0])
    gravity = [downhill * math.cos(slope[1]), downhill * math.sin(slope[1]), -GRAVITY * math.cos(slope[0])]
    seen = driven(env, 40)
    for (_, before, _), (found, state, _) in itertools.pairwise(seen):
        axes = axes_of(state, link)
        change = (state.link_velocity[:, link] - before.link_velocity[:, link]) / PERIOD
        force = np.einsum("nij,nj->ni", axes, change - gravity[: change.shape[1]])
        np.testing.assert_allclose(found["accelerometer"], force.clip(-4 * 9.81, 4 * 9.81), atol=1e-4)
        turning = state.link_angular_velocity[:, [link]]
        turning = turning if model == "planar" else np.einsum("nij,nj->ni", axes, turning[:, 0])
        if model == "spatial":
            down = np.einsum("nij,j->ni", axes, np.divide(gravity, GRAVITY))
            np.testing.assert_allclose(found["gravity"], down, atol=1e-5)
        np.testing.assert_allclose(found["gyro"], turning.clip(-10.0, 10.0), atol=1e-5)
    forces = np.array([found["accelerometer"] for found, *_ in seen])
    assert np.ptp(forces[..., :2], axis=(0, 1)).min() > 5.0, "the links must be pushed about"


@pytest.mark.parametrize("model", MODELS)
def test_encoders_read_the_nearest_of_their_marks(model):
    resolution = 2.0 * math.pi / 500
    env = sensing(3, ["joint_angle"], model=model, task="free", encoder_resolution=resolution, action_mode="joints")
    angles = []
    for found, state, _ in driven(env, 20):
        angles.append(state.joint_angle.reshape(3, -1))
        marks = np.round(angles[-1] / resolution)
        np.testing.assert_allclose(found["joint_angle"], marks * resolution, atol=1e-6)
    assert np.ptp(np.round(np.array(angles) / resolution), axis=0).max() > 20


def test_links_that_the_ground_carries_are_those_with_a_normal_force():
    env = sensing(3, ["ground_touch", "normal_force"], model="spatial", task="free")
    carried = []
    for found, _, infos in driven(env, 30):
        carried.append(found["ground_touch"])
        np.testing.assert_array_equal(carried[-1], found["normal_force"] > 0.0)
        if infos:
            np.testing.assert_array_equal(carried[-1].sum(axis=1), infos["grounded"])
    assert 0.0 < np.mean(carried) < 1.0, "some links must be off the ground, others on it"


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"imu_link": 11}, r"imu_link = 11: expected .* \[0, 10\]"),
        ({"imu_link": -1}, "imu_link = -1"),
        ({"range_link": 11}, r"range_link = 11: expected .* \[0, 10\]"),
        ({"encoder_resolution": -0.1}, r"encoder_resolution = -0\.1"),
        ({"encoder_resolution": 1.0}, "encoder_resolution = 1"),
    ],
)
def test_sensors_that_cannot_be_are_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        SnakeEnv(**options)


@pytest.mark.parametrize("model", MODELS)
def test_touch_is_where_contact_forces_are_not_zero(model):
    env = sensing(4, ["touch", "touch_side"], model=model, task="course", max_episode_steps=99)
    sides = set()
    for found, state, infos in driven(env, 60):
        force = state.contact_force
        pressed = np.abs(force).max(axis=-1) > 0.0
        np.testing.assert_array_equal(found["touch"], pressed)
        ahead = -state.link_axis[..., :2]
        left = ahead[..., 0] * force[..., 1] - ahead[..., 1] * force[..., 0]
        np.testing.assert_array_equal(found["touch_side"], -np.sign(left))
        sides |= set(np.unique(found["touch_side"]))
        if infos:
            np.testing.assert_array_equal(found["touch"].sum(axis=1), infos["contacts"])
    assert sides == {-1.0, 0.0, 1.0}


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("motor", [None, Motor(stall_torque=3.0, no_load_speed=4.0, gear_friction=0.2)])
def test_motors_give_the_torques_of_the_state(model, motor):
    env = sensing(2, ["motor_torque"], model=model, task="free", robot=Robot(motor=motor), action_mode="joints")
    for found, state, _ in driven(env, 30):
        torque = -state.joint_torque.reshape(2, -1)
        np.testing.assert_allclose(found["motor_torque"], torque, atol=1e-5)
    assert 1.0 < np.abs(torque).max() <= (3.0 if motor else 10.0) + 1e-6


def test_torques_that_actions_set_are_those_of_the_motors():
    """Positive in the direction of the angle, like the actions, less the damping of the actuators."""
    env = sensing(1, ["motor_torque", "joint_rate"], task="free", action_mode="torques")
    env.reset(seed=0)
    seen = blocks(env, env.step(np.full(env.action_space.shape, 0.1))[0])
    damping = env.layout["config"]["controller"]["kd"]
    np.testing.assert_allclose(seen["motor_torque"], 1.0 - damping * seen["joint_rate"], atol=0.05)


def outline(obstacle):
    """Corners (k, 2) of whatever is not a circle."""
    match obstacle:
        case Segment():
            return np.array([obstacle.start, obstacle.end])
        case Polygon():
            return np.array(obstacle.vertices)
        case _:
            (length, width), (sin, cos) = obstacle.size, (math.sin(obstacle.angle), math.cos(obstacle.angle))
            corners = 0.5 * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * (length, width)
            return corners @ [[cos, sin], [-sin, cos]] + (obstacle.x, obstacle.y)


def distance(points, obstacle):
    """Distances (n) of points (n, 2) outside of an obstacle."""
    if isinstance(obstacle, Circle):
        return np.linalg.norm(points - (obstacle.x, obstacle.y), axis=1) - obstacle.radius
    starts = outline(obstacle)
    along = np.roll(starts, -1, axis=0) - starts
    offset = points[:, None] - starts
    share = ((offset * along).sum(axis=-1) / np.square(along).sum(axis=-1)).clip(0.0, 1.0)
    return np.linalg.norm(offset - share[..., None] * along, axis=-1).min(axis=1)


def traced(origin, forward, obstacles, reach):
    """Distances along the rays by steps as long as the distance from all obstacles, which none of them can enter."""
    angles = math.atan2(forward[1], forward[0]) + np.linspace(-0.5, 0.5, 9) * math.pi
    rays, way = np.stack([np.cos(angles), np.sin(angles)], axis=1), np.zeros(9)
    for _ in range(1000):
        points = origin + way[:, None] * rays
        nearest = np.min([distance(points, obstacle) for obstacle in obstacles], axis=0)
        if ((nearest < 1e-9) | (way >= reach)).all():
            break
        way = np.minimum(way + np.where(nearest < 1e-9, 0.0, nearest), reach)
    return way


def around(rng):
    """Obstacles of all shapes beside and ahead of a straight robot that starts at the origin and looks along x."""
    found = []
    while len(found) < 12:
        x, y = rng.uniform(-1.0, 1.5), rng.uniform(-1.5, 1.5)
        if abs(y) < 0.7 and x < 0.5:
            continue
        turn, size = rng.uniform(0.0, math.pi), rng.uniform(0.05, 0.25, 2)
        step = 0.5 * size[0] * np.array([math.cos(turn), math.sin(turn)])
        corners = [(x + size[1] * math.cos(a), y + size[1] * math.sin(a)) for a in turn + np.array([0.0, 2.0, 4.0])]
        found += [
            [
                Circle(size[0], x, y),
                Segment((x - step[0], y - step[1]), (x + step[0], y + step[1])),
                Box(tuple(size), x, y, turn),
                Polygon(corners),
            ][len(found) % 4]
        ]
    return found


@pytest.mark.parametrize("link", [0, 7])
@pytest.mark.parametrize("model", MODELS)
def test_ranges_are_those_of_an_independent_geometry(model, link):
    rng = np.random.default_rng(3)
    env = sensing(6, ["range"], model=model, task="field", range_link=link)
    reach = env.layout["observation"][0]["scale"]
    scenes = [around(rng) for _ in range(6)]
    start = Start(position=(0.0, 0.0), heading=math.pi, posture="straight")
    hits = 0
    seen = driven(env, 12, options={"scene": [Scene(obstacles=s) for s in scenes], "start": start})
    for found, state, _ in seen[::3]:
        ahead, eye = axes_of(state, link)[:, 0, :2], state.link_position[:, link, :2]
        expected = [traced(eye[k], ahead[k], scenes[k], reach) for k in range(6)]
        # A ray that grazes an obstacle ends the trace early, by less than sqrt(2 r 1e-9).
        np.testing.assert_allclose(found["range"], expected, atol=3e-5)
        hits += (np.array(expected) < reach - 1e-3).sum()
    assert hits > (60 if link == 0 else 25), "more obstacles are ahead than beside"


def test_rays_in_a_pipe_end_at_its_wall():
    pipe = Cylinder((-1.0, 0.1, 0.0), (2.0, 0.1, 0.0), radius=0.4, inside=True)
    env = sensing(1, ["range"], model="spatial", task="field", scene=Scene(obstacles=[pipe]), start_jitter=0.0)
    found, state, _ = driven(
        env, 0, options={"start": Start(position=(0.0, 0.0), heading=math.pi, posture="straight")}
    )[0]
    across = math.sqrt(0.4**2 - state.link_position[0, 0, 2] ** 2)
    np.testing.assert_allclose(found["range"][0, [0, 8]], [across - 0.1, across + 0.1], atol=1e-6)
    np.testing.assert_allclose(found["range"][0, 2], (across - 0.1) * math.sqrt(2.0), atol=1e-6)


def test_rays_pass_above_lower_obstacles():
    env = sensing(2, ["range"], model="spatial", task="field")
    scenes = [Scene(obstacles=[Box((0.1, 1.0), 1.0, 0.0, height=height)]) for height in (0.02, 0.3)]
    start = Start(position=(0.0, 0.0), heading=math.pi, posture="straight")
    seen = blocks(env, env.reset(seed=0, options={"scene": scenes, "start": start})[0])["range"]
    head = env.state().link_position[:, 0, 0]
    np.testing.assert_allclose(seen[:, 4], [env.layout["observation"][0]["scale"], 0.95 - head[1]], atol=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_nothing_shows_obstacles_that_are_out_of_range_or_sight_and_touch_none_without_contact(model):
    env = sensing(3, BLOCKS, model=model, task="field", randomization={"peg_error": 0.1})
    wall = Box((0.1, 3.0), 0.8, 0.0)
    scenes = [Scene(obstacles=[wall, Circle(0.1, x, y)]) for x, y in ((1.1, 0.2), (1.2, -0.3), (-3.5, 3.0))]
    start = Start(position=(0.0, 0.0), heading=math.pi, posture="straight")
    env.reset(seed=0, options={"scene": scenes, "start": start})
    actions = np.tile(np.random.default_rng(1).uniform(-1.0, 1.0, env.single_action_space.shape), (3, 1))
    nearest = []
    for _ in range(20):
        observation = env.step(actions)[0]
        np.testing.assert_array_equal(observation, observation[[0, 0, 0]])
        nearest.append(blocks(env, observation)["range"].min())
    assert min(nearest) < 0.8, "the wall must be seen"
    near = [Scene(obstacles=[Circle(0.1, 0.0, y)]) for y in (0.3, 0.4, 5.0)]
    env.reset(seed=0, options={"scene": near, "start": start})
    seen = blocks(env, env.step(0.0 * actions)[0])
    assert not seen["touch"].any()
    assert not seen["touch_side"].any()


@pytest.mark.parametrize("model", MODELS)
def test_in_a_mirrored_scene_they_change_as_their_parities_say(model):
    # Tighter than by default: a scene of pegs can magnify the errors of the solver by orders of magnitude.
    solved = Integrator(tolerance=1e-8)
    env = sensing(2, BLOCKS, model=model, task="field", action_mode="joints", integrator=solved)
    actions = np.random.default_rng(2).uniform(-1.0, 1.0, (20, *env.single_action_space.shape))
    of_action = np.array([entry["mirror"] for entry in env.layout["action"]])
    pegs = [(0.1, -0.5, 0.21), (0.1, 0.3, -0.22), (0.15, 1.3, 0.3), (0.1, 1.5, -0.4)]
    scenes = [Scene(obstacles=[(r, x, y * side) for r, x, y in pegs]) for side in (1, -1)]
    start = Start(position=(0.0, 0.0), heading=math.pi, posture="straight")
    env.reset(seed=0, options={"scene": scenes, "start": start})
    touched = 0.0
    for action in actions:
        one, other = env.step(np.stack([action, of_action * action]))[0]
        for block in env.layout["observation"]:
            signs = np.array(block["mirror"])
            found, mirrored = (seen[block["start"] : block["start"] + block["size"]] for seen in (one, other))
            expected = signs * found if signs.all() else found[::-1]
            np.testing.assert_allclose(mirrored, expected, atol=1e-3, err_msg=block["name"])
        touched += np.abs(one).sum()
    assert touched > 0.0


def test_without_obstacles_there_is_nothing_to_touch():
    with pytest.raises(ConfigError, match=r"observation_blocks\[0\]"):
        SnakeEnv(task="free", observation_blocks=["touch"])
