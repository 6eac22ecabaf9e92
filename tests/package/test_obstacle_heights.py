"""Obstacles of finite height: what users write, what is refused, and what comes out in all directions."""

import gymnasium
import numpy as np
import pytest

import snake_env
from snake_env import Gait, Integrator, Scene, Start
from snake_env.obstacles import Box, Circle, Polygon, Segment, solids

PEGS = [
    Box((0.6, 1.0), 0.9, 0.0, height=0.1),
    Circle(0.05, -0.2, 0.3, height=0.02),
    Polygon(((-0.8, -0.4), (-0.4, -0.4), (-0.6, -0.1)), height=0.03),
    Segment((-1.0, 0.6), (1.0, 0.6), height=0.5),
]
FLAT = {"gait": Gait(amplitude=0.0), "start": Start(position=(0.9, 0.0), heading=np.pi, posture="straight")}


def simulate(scene, **options):
    return snake_env.simulate(model="spatial", scene=scene, **{**FLAT, "duration": 0.2, **options})


@pytest.mark.parametrize("height", [0.0, -1.0, float("nan"), float("inf")])
def test_a_height_that_is_none_is_refused(height):
    with pytest.raises(snake_env.ConfigError, match=r"obstacle\.height"):
        Circle(0.1, 1.0, 1.0, height=height)


@pytest.mark.parametrize(
    ("model", "integrator"), [("planar", Integrator()), ("spatial", Integrator(method="thesis", step=1e-3))]
)
def test_models_and_methods_without_heights_refuse_them(model, integrator):
    scene = Scene(obstacles=[(0.1, 3.0, 1.0), Circle(0.1, 3.0, 3.0, height=0.1)])
    with pytest.raises(snake_env.ConfigError, match=r'scene.obstacles\[1\].height = 0.1.*model="spatial"'):
        snake_env.simulate(model=model, scene=scene, integrator=integrator, duration=0.01)
    with pytest.raises(snake_env.ConfigError, match="height"):
        gymnasium.make_vec("SnakeField-v1", num_envs=1, scene=scene)


def test_a_start_without_a_third_coordinate_rests_on_what_is_under_it():
    run = simulate(Scene(obstacles=PEGS))
    assert run.position[0, 0, 2] == pytest.approx(0.1525, abs=1e-9)
    assert run.max_penetration < 1e-3
    low = simulate(Scene(obstacles=PEGS), start=Start(position=(-0.6, -0.8), heading=np.pi, posture="straight"))
    assert low.position[0, 0, 2] == pytest.approx(0.0525, abs=1e-9)


def test_edges_lift_links():
    """A robot across a block that carries no end sphere hangs on its edges, whose forces point up."""
    blocks = [Box((0.04, 0.5), 0.9 - 0.122 * k, 0.0, height=0.1) for k in range(3)]
    start = Start(position=(0.9, 0.0), heading=np.pi, posture="straight")
    robot = snake_env.Robot(links=3)
    run = simulate(Scene(obstacles=blocks), robot=robot, start=start, record=["obstacles", "ground"])
    lift, weight = run.contact_force[1:, :, 2].sum(axis=1), robot.links * 0.6818181818181818 * 9.81
    np.testing.assert_allclose(lift, weight, rtol=1e-6)
    np.testing.assert_allclose(run.obstacle_force[1:, :, 2].sum(axis=1), lift, rtol=1e-9)
    assert run.obstacle_force.shape[1:] == (3, 3)
    assert run.ground_normal.max() == 0.0


PLATEAU = Box((3.0, 2.0), 1.2, 0.0, height=0.1)
WEIGHT = 7.5 * 9.81


def test_a_top_face_is_part_of_its_obstacle():
    """It carries a robot that lies on it; on a slope it holds the robot by friction, too."""
    hill = Scene(obstacles=[(0.1, 9.0, 9.0), PLATEAU], friction=(0.5, 0.5), slope=(0.2, 0.0))
    run = simulate(hill, duration=1.0, record=["obstacles", "ground"])
    expected = WEIGHT * np.array([np.sin(0.2), 0.0, np.cos(0.2)])
    np.testing.assert_allclose(run.obstacle_force[-1], [np.zeros(3), expected], atol=1e-3)
    np.testing.assert_allclose(run.contact_force[-1].sum(axis=0), expected, atol=1e-3)
    assert not run.ground_normal.any()
    assert not run.ground_friction.any()


def test_forces_of_sides_edges_faces_and_ground_change_the_momentum():
    """A robot in motion, half of it on a plateau."""
    scene = Scene(obstacles=[PLATEAU, Circle(0.05, -0.7, 0.2, friction=0.3)], friction=(0.3, 0.3))
    start = Start(position=(0.0, 0.0), heading=np.pi, posture="gait")
    step = Integrator(step=2.5e-3)
    record = ["velocity", "obstacles", "ground"]
    run = simulate(
        scene, gait=Gait(vertical_amplitude=0.1), start=start, integrator=step, duration=1.5, sample=0.05, record=record
    )
    np.testing.assert_allclose(run.obstacle_force.sum(axis=1), run.contact_force.sum(axis=1), atol=1e-9)
    ground = np.concatenate([run.ground_friction.sum(axis=(1, 2)), run.ground_normal.sum(axis=(1, 2))[:, None]], axis=1)
    force = run.obstacle_force.sum(axis=1) + ground - [0.0, 0.0, WEIGHT]
    change = 7.5 / 11 * np.diff(run.velocity.sum(axis=1), axis=0)
    np.testing.assert_allclose(change, 0.05 * force[1:], atol=1e-4)
    settled = slice(10, None)
    assert run.obstacle_force[settled, 0, 2].min() > 0.1 * WEIGHT
    assert ground[settled, 2].min() > 0.1 * WEIGHT
    assert np.abs(run.obstacle_force[settled, 1]).max() > 1.0


def test_an_environment_distinguishes_a_top_face_from_the_ground():
    """What lies under a link presses on its sensor either way."""
    scene = Scene(obstacles=[Box((5.0, 2.0), 0.9, 0.0, height=0.1)], friction=(0.2, 0.2))
    env = gymnasium.make("SnakeSpatial-v1", scene=scene, start=FLAT["start"], action_mode="joints").unwrapped
    env.reset(seed=0)
    for _ in range(20):
        observation, *_, info = env.step(np.zeros(20))
    state = env.state()
    np.testing.assert_allclose(state.obstacle_force[:, 2], [WEIGHT], rtol=1e-3)
    np.testing.assert_allclose(state.contact_force[:, 2].sum(), WEIGHT, rtol=1e-3)
    assert not state.normal_force.any()
    block = next(block for block in env.layout["observation"] if block["name"] == "normal_force")
    felt = observation[block["start"] : block["start"] + block["size"]] * block["scale"]
    np.testing.assert_allclose(felt, state.contact_force[:, 2], rtol=1e-5)
    assert info["grounded"] == 11


def test_scene_files_keep_heights(tmp_path):
    scene = Scene(obstacles=[*PEGS, (0.1, 4.0, 4.0)])
    scene.save(tmp_path / "steps.json")
    assert Scene.load(tmp_path / "steps.json") == scene
    assert [one.height for one in Scene.load(tmp_path / "steps.json").obstacles[:4]] == [0.1, 0.02, 0.03, 0.5]


def make(**options):
    scene = Scene(obstacles=PEGS, friction=(0.2, 0.2))
    start = Start(position=(0.9, 0.0), heading=np.pi)
    return gymnasium.make_vec("SnakeSpatial-v1", num_envs=4, scene=scene, start=start, **options)


def test_environments_have_steps():
    envs = make()
    envs.reset(seed=0)
    assert envs.unwrapped.state().link_position[:, :, 2] == pytest.approx(0.1525, abs=1e-6)
    assert [one.height for one in envs.unwrapped.scene(2).obstacles] == [0.1, 0.02, 0.03, 0.5]
    kept = envs.unwrapped.get_state()
    rng = np.random.default_rng(1)
    actions = [rng.uniform(-1.0, 1.0, envs.action_space.shape) for _ in range(60)]
    first = [envs.step(action)[0] for action in actions]
    envs.unwrapped.set_state(kept)
    again = [envs.step(action)[0] for action in actions]
    np.testing.assert_array_equal(first, again)


@pytest.mark.parametrize("mode", ["gait", "joints"])
def test_random_actions_leave_no_link_inside_an_obstacle_without_a_flag(mode):
    """Deepest points of the links' end spheres and centres against brute force over the bodies."""
    envs = make(action_mode=mode)
    envs.reset(seed=3)
    rng, bodies = np.random.default_rng(2), solids(PEGS)
    along, worst = np.linspace(-1.0, 1.0, 9), 0.0
    for _ in range(150):
        *_, truncated, info = envs.step(rng.uniform(-1.0, 1.0, envs.action_space.shape))
        state = envs.unwrapped.state()
        half = state.link_half_length[:, None] * np.ones(3)
        axis = state.link_axis
        points = state.link_position[:, :, None] + along[:, None] * (half * axis)[:, :, None]
        depth = 0.0525 - np.stack([distance(points, *body) for body in bodies]).min(axis=(0, 2, 3))
        flagged = info.get("penetrated", np.zeros(4, bool)) | truncated
        worst = max(worst, float(np.where(flagged, 0.0, depth).max()))
    assert worst < 1e-3 + 1e-4, worst  # round bodies are polygons here


def distance(points, height, corners):
    """Distance of points (..., 3) from a body of the outline (k, 2)."""
    following = np.roll(corners, -1, axis=0)
    edge = following - corners
    offset = points[..., None, :2] - corners
    share = np.clip((offset * edge).sum(-1) / (edge * edge).sum(-1), 0.0, 1.0)
    beside = np.linalg.norm(offset - share[..., None] * edge, axis=-1).min(-1)
    turn = np.sign(edge[..., 0] * offset[..., 1] - edge[..., 1] * offset[..., 0])
    inside = (turn >= 0).all(-1) | (turn <= 0).all(-1)
    beside = np.where(inside & (len(corners) > 2), 0.0, beside)
    return np.hypot(beside, np.maximum(points[..., 2] - height, 0.0))


def test_pictures_show_steps():
    env = gymnasium.make("SnakeSpatial-v1", scene=Scene(obstacles=PEGS, friction=(0.2, 0.2)), render_mode="rgb_array")
    env.reset(seed=0)
    with_steps = env.render()
    bare = gymnasium.make("SnakeSpatial-v1", render_mode="rgb_array")
    bare.reset(seed=0)
    assert with_steps.shape == bare.render().shape
    assert (with_steps != bare.render()).any(axis=2).sum() > 500


def test_the_viewer_draws_heights():
    drawing = pytest.importorskip("snake_env.viewer.drawing")
    assert drawing._prism([(0, 0), (1, 0), (0, 1)], 0.3).bounds[1, 2] == pytest.approx(0.3)


def test_mujoco_models_end_at_the_heights():
    document = Scene(obstacles=PEGS).to_mjcf(start=Start(position=(0.9, 0.0, 0.1525), heading=np.pi))
    assert 'name="obstacle_2_top"' in document
    assert "0.9 0.0 0.1525" in document
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(document)
    low = model.geom("obstacle_2_top")
    assert low.pos[2] + low.size[1] == pytest.approx(0.02)
    side = model.geom("obstacle_2")
    assert side.pos[2] + side.size[1] == pytest.approx(0.015)


def test_discrepancies_are_randomised_in_3d():
    ranges = {"friction": (0.5, 1.5), "mass": (0.8, 1.2), "torque_limit": (0.5, 1.0), "backlash": (0.02, 0.06)}
    late = {"stribeck": (0.1, 0.3), "reference_rate": 10.0, "reference_delay": (0.0, 0.1)}
    envs = gymnasium.make_vec("SnakeSpatial-v1", num_envs=6, randomization={**ranges, **late})
    plain = gymnasium.make_vec("SnakeSpatial-v1", num_envs=6)
    for one in (envs, plain):
        one.reset(seed=5)
    for _ in range(40):
        action = np.zeros(envs.action_space.shape)
        state, same = (one.step(action) and one.unwrapped.state() for one in (envs, plain))
    apart = np.linalg.norm(state.position - same.position, axis=1)
    assert (apart > 1e-4).all()
    assert len(np.unique(apart.round(6))) == 6
