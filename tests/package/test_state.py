"""State can be saved, restored, pickled, copied and carried into other processes."""

from __future__ import annotations

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from conftest import run_python

import snake_env
from snake_env import ConfigError, Motor, Patch, Randomization, Robot, Scene, SnakeEnv, SnakeVectorEnv
from snake_env.obstacles import Box, Polygon, Segment
from snake_env.testing import assert_identical


def run(env, steps, seed=0):
    """Results of random actions."""
    env.action_space.seed(seed)
    return [env.step(env.action_space.sample()) for _ in range(steps)]


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_restored_states_continue_bit_for_bit(env_id, mode):
    env = gym.make_vec(env_id, num_envs=3, autoreset_mode=mode, max_episode_steps=9)
    env.reset(seed=1)
    run(env, 9)
    states = env.get_state()
    expected = run(env, 12)
    run(env, 5, seed=7)
    env.set_state(states)
    assert_identical(run(env, 12), expected, "after set_state")


OFFSET = [0.05, -0.04, 0.0, 0.03, -0.02, 0.01, 0.04]
SENSORS = ["accelerometer", "gyro", "motor_torque", "touch", "touch_side", "range"]
WALLS = (
    Segment((1.0, -0.6), (1.1, 0.7)),
    Box((0.4, 0.1), 0.2, -0.8, angle=0.4),
    Polygon(((-1.3, 0.5), (-0.7, 0.6), (-1.0, 0.9))),
)
ICE = Patch(vertices=[(-9.0, 0.0), (9.0, 0.0), (9.0, 9.0), (-9.0, 9.0)], factor=0.1)
MODELS = ("planar", "spatial")
KEPT = {
    "motors": {"task": "field", "robot": Robot(motor=Motor(4.0, 3.0, rotor_inertia=1e-3, gear_friction=0.4))},
    "spin friction": {
        "task": "free",
        "scene": Scene(friction=(0.1, 0.4), spin_friction=0.05),
        "robot": Robot(links=7),
        "randomization": Randomization(friction=(0.5, 1.5)),
    },
    "play and ground": {
        "task": "course",
        "randomization": Randomization(backlash=(0.0, np.radians(5)), stribeck=(0.0, 0.4)),
    },
    "what is late": {
        "task": "free",
        "observation_delay": {"joint_angle": 0.2},
        "observation_noise": {"heading": 0.1},
    },
    "CGs": {"task": "field", "robot": Robot(links=7, cg_offset=OFFSET)},
    "CGs in 3D": {"model": "spatial", "task": "free", "robot": Robot(links=7, cg_offset=OFFSET)},
    **{
        f"{name}, {model}": {"model": model, **options}
        for model in MODELS
        for name, options in {
            "sensors": {"task": "course", "observation_blocks": SENSORS},
            "walls": {"task": "free", "scene": Scene(obstacles=WALLS, friction=(0.2, 0.5))},
            "patches": {
                "task": "free",
                "scene": Scene(friction=(0.2, 0.5), patches=[ICE]),
                "randomization": Randomization(friction=(0.5, 1.5)),
            },
        }.items()
    },
}


@pytest.mark.parametrize("options", KEPT.values(), ids=KEPT)
def test_a_state_has_all_that_a_robot_has(options):
    """Other environments of the same task, new or in an episode of their own, go on from it bit for bit."""
    env, new, used = (SnakeVectorEnv(3, **options) for _ in range(3))
    env.reset(seed=3)
    used.reset(seed=99)
    actions = np.random.default_rng(5).uniform(-1, 1, (6, *env.action_space.shape)).astype(np.float32).repeat(5, axis=0)
    before, after = actions[:20], actions[20:]
    last = [env.step(action) for action in before][-1][0]
    states, scenes = env.get_state(), [env.scene(k) for k in range(3)]
    expected, end = [env.step(action) for action in after], env.state().arrays()
    for other in (env, new, used):
        assert_identical(other.set_state(states), last, "the present observation")
        assert [other.scene(k) for k in range(3)] == scenes
        assert_identical([other.step(action) for action in after], expected, "after set_state")
        assert_identical(other.state().arrays(), end, "the state after that")
    single = SnakeEnv(**options)
    assert_identical(single.set_state(states[1]), last[1], "the present observation of the single environment")
    rows = [single.step(action[1])[0] for action in after]
    assert_identical(rows, [observation[1] for observation, *_ in expected], "the single environment")
    assert all((infos["unconverged"] == 0).all() for *_, infos in expected)


def test_a_state_fits_any_row_of_any_batch_of_the_same_task():
    env = SnakeVectorEnv(3, task="field")
    env.reset(seed=1)
    run(env, 7)
    other = SnakeVectorEnv(5, task="field")
    other.reset(seed=99)
    mask = np.array([False, False, True, False, True])
    before = other.get_state()
    observation = other.set_state(env.get_state(np.array([True, False, True])), mask)
    actions = np.full((5, 4), 0.3)
    expected = env.step(actions[:3])[0]
    after = other.step(actions)[0]
    np.testing.assert_array_equal(after[[2, 4]], expected[[0, 2]])
    other.set_state(before)
    np.testing.assert_array_equal(other.step(actions)[0][[0, 1, 3]], after[[0, 1, 3]])
    assert observation.shape == other.observation_space.shape


def test_set_state_returns_the_present_observation():
    env = SnakeVectorEnv(2, task="course")
    env.reset(seed=0)
    last = run(env, 5)[-1][0].copy()
    states = env.get_state()
    run(env, 5)
    np.testing.assert_array_equal(env.set_state(states), last)


def test_the_single_environment_exchanges_states_with_the_batch():
    env, batch = SnakeEnv(task="field"), SnakeVectorEnv(2, task="field")
    env.reset(seed=3)
    for _ in range(5):
        env.step(np.zeros(4))
    batch.set_state([env.get_state()] * 2)
    rows = batch.step(np.ones((2, 4)))
    row = env.step(np.ones(4))
    np.testing.assert_array_equal(rows[0], [row[0]] * 2)
    np.testing.assert_array_equal(env.set_state(batch.get_state()[1]), row[0])


def test_bad_states_are_named():
    env = SnakeVectorEnv(2, task="field")
    env.reset(seed=0)
    states = env.get_state()
    with pytest.raises(ConfigError, match=r"states = 1 states: expected 2"):
        env.set_state(states[:1])
    with pytest.raises(ConfigError, match=r"^states = NoneType: expected 2"):
        env.set_state(None)
    with pytest.raises(ConfigError, match=r"^state = "):
        env.set_state([states[0]._replace(core=b"nonsense")] * 2)
    for bad in (None, "state", states[0]._replace(previous_action=np.zeros(3)), states[0]._replace(config=None)):
        before = env.state().arrays()
        with pytest.raises(ConfigError, match=r"^states\[1\]"):
            env.set_state([states[0], bad])
        assert_identical(env.state().arrays(), before, "after a refused call")
    with pytest.raises(ConfigError, match=r"^mask = "):
        env.get_state(np.array([1, 0]))


OTHERS = [
    ("control_period", {"control_period": 0.1}),
    ("robot.mass", {"robot": {"mass": 0.7}}),
    ("robot.links", {"robot": {"links": 9}}),
    ("robot.joint_limit", {"robot": {"joint_limit": np.inf}}),
    ("friction", {"friction": (0.3, 0.3)}),
    ("task", {"task": "maze"}),
    ("controller.kp", {"controller": snake_env.PD(kp=700.0, torque_limit=10.0)}),
    ("controller.torque_limit", {"controller": snake_env.PD(torque_limit=9.0)}),
    ("observation_delay", {"observation_delay": {"joint_angle": 0.1}}),
    ("randomization.reference_delay", {"randomization": {"reference_delay": (0.0, 0.1)}}),
    ("integrator.step", {"integrator": {"step": 0.01}}),
    ("slope", {"slope": (0.1, 0.0)}),
    ("reward_weights.energy", {"reward_weights": {"energy": 0.1}}),
    ("scene", {"scene": snake_env.Scene()}),
    ("model", {"model": "spatial"}),
    ("action_mode", {"action_mode": "joints"}),
]


@pytest.mark.parametrize(("path", "options"), OTHERS)
def test_a_state_of_another_environment_is_refused_with_what_differs(path, options):
    states = SnakeVectorEnv(2, task="field").get_state()
    env = SnakeVectorEnv(2, **{"task": "field"} | options)
    env.reset(seed=0)
    before = env.state().arrays()
    with pytest.raises(ConfigError) as refused:
        env.set_state(states)
    assert refused.value.field.startswith(f"states[0].{path.split('.')[0]}")
    assert refused.value.field.endswith(path.split(".")[-1])
    assert refused.value.value != refused.value.expected
    assert_identical(env.state().arrays(), before, "after a refused state")


def test_time_limit_difficulty_and_scenes_may_differ():
    """The state has the last two itself."""
    scenes = [snake_env.Scene(obstacles=[(0.1, x, 0.5)], friction=(0.2, 0.2)) for x in (1.0, 2.0)]
    envs = [
        SnakeVectorEnv(2, task="field", scene=scene, max_episode_steps=limit, difficulty=difficulty)
        for scene, limit, difficulty in zip(scenes, (9, 90), (0.2, 0.8), strict=True)
    ]
    first, second = envs
    first.reset(seed=1)
    second.reset(seed=2)
    run(first, 3)
    second.set_state(pickle.loads(pickle.dumps(first.get_state())))
    assert_identical(run(second, 4), run(first, 4), "in another scene's environment")


def test_the_previous_action_of_a_reward_function_is_part_of_the_state():
    env = SnakeVectorEnv(2, task="free", reward_fn=effort)
    env.reset(seed=0)
    env.step(np.full((2, 4), 0.5))
    states = env.get_state()
    expected = env.step(np.full((2, 4), 0.75))[1].copy()
    env.set_state(states)
    np.testing.assert_array_equal(env.step(np.full((2, 4), 0.75))[1], expected)
    assert expected[0] == 4 * 0.25**2


def effort(signals, action, previous_action):
    return np.square(action - previous_action).sum(axis=1)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_copies_in_mid_episode_live_on_their_own(env_id, duplicate):
    env = gym.make(env_id, max_episode_steps=30)
    env.reset(seed=2)
    run(env, 5)
    twin = duplicate(env)
    expected = run(env, 8)
    assert_identical(run(twin, 8), expected, "twin and original")
    assert_identical(twin.reset()[0], env.reset()[0], "the next episode of both")


def test_a_copy_of_a_rendered_environment_has_no_window():
    env = SnakeVectorEnv(1, task="free", render_mode="rgb_array")
    env.reset(seed=0)
    frame = env.render()[0]
    twin = copy.deepcopy(env)
    np.testing.assert_array_equal(twin.render()[0].shape, frame.shape)


def test_the_spec_survives_json_and_makes_the_same_environment(env_id):
    env = gym.make_vec(env_id, num_envs=2, autoreset_mode="SameStep", robot={"links": 11}, difficulty=0.25)
    spec = gym.envs.registration.EnvSpec.from_json(env.spec.to_json())
    assert spec == env.spec
    twin = gym.make_vec(spec)
    assert twin.metadata["autoreset_mode"] is env.metadata["autoreset_mode"]
    assert_identical(twin.reset(seed=0), env.reset(seed=0), "environment made from the spec")
    single = gym.make(env_id, action_mode="joints")
    spec = gym.envs.registration.EnvSpec.from_json(single.spec.to_json())
    assert gym.make(spec).action_space == single.action_space


def test_numpy_values_as_keywords_survive_the_spec(env_id):
    options = {
        "robot": {"links": np.int64(9), "mass": np.full(9, 0.6)},
        "difficulty": np.float32(0.25),
        "speed": (np.float64(0.1), np.float64(0.2)),
        "privileged": np.True_,
    }
    for env in (gym.make(env_id, **options), gym.make_vec(env_id, num_envs=np.int64(2), **options)):
        spec = gym.envs.registration.EnvSpec.from_json(env.spec.to_json())
        twin = gym.make_vec(spec) if isinstance(env, SnakeVectorEnv) else gym.make(spec)
        assert_identical(twin.reset(seed=0), env.reset(seed=0), "environment made from the spec")


def test_the_prefixed_id_works_in_a_fresh_process():
    code = """
        import gymnasium
        env = gymnasium.make("snake_env:SnakeCourse-v1")
        batch = gymnasium.make_vec("snake_env:SnakeField-v1", num_envs=2)
        print(type(env.unwrapped).__name__, type(batch).__name__, batch.reset(seed=0)[0].shape[0])
    """
    assert run_python(code) == "SnakeEnv SnakeVectorEnv 2"


FORK = """
    import multiprocessing, sys
    import numpy as np
    import snake_env

    def child(env, queue):
        queue.put(env.step(np.zeros((16, 4)))[0].sum())

    if __name__ == "__main__":
        context = multiprocessing.get_context("{method}")
        env = snake_env.SnakeVectorEnv(16, task="free", num_threads=2)
        env.reset(seed=0)
        env.step(np.zeros((16, 4)))
        queue = context.Queue()
        process = context.Process(target=child, args=(env, queue))
        process.start()
        ours = env.step(np.zeros((16, 4)))[0].sum()
        theirs = queue.get(timeout=40)
        process.join(timeout=10)
        print(ours == theirs, process.exitcode)
"""


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_a_stepped_batch_works_in_a_child_process(method, tmp_path):
    script = tmp_path / "script.py"
    script.write_text(__import__("textwrap").dedent(FORK.format(method=method)))
    assert run_python(f"import runpy; runpy.run_path({str(script)!r}, run_name='__main__')", timeout=60) == "True 0"


def test_async_vector_env_runs_the_single_environment():
    env = gym.make_vec("SnakeFree-v1", num_envs=2, vectorization_mode="async")
    sync = gym.make_vec("SnakeFree-v1", num_envs=2)
    np.testing.assert_array_equal(env.reset(seed=0)[0], sync.reset(seed=0)[0])
    np.testing.assert_array_equal(env.step(np.ones((2, 4), np.float32))[0], sync.step(np.ones((2, 4)))[0])
    env.close()


def test_version_is_that_of_the_core():
    assert snake_env.__version__ == snake_env._native.__version__
