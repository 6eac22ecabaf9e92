from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import snake_env
from snake_env import PD, ConfigError, Motor, Robot, SnakeEnv, SnakeVectorEnv, load_policy, robot_classes
from snake_env.evaluation import evaluate, tasks


def test_the_class_aiko_is_the_robot_of_the_presets():
    config = SnakeVectorEnv(1, robot_class="aiko").layout["config"]
    written = SnakeVectorEnv(1, robot=Robot.aiko(motor=Motor.aiko()), controller=PD.aiko()).layout["config"]
    assert config["robot"]["motor"] == written["robot"]["motor"]
    assert config["controller"] == written["controller"]
    rest = {"reference_rate": 10.0, "mass": (0.9, 1.1), "friction": (0.75, 1.25), "reference_delay": (0.05, 0.15)}
    assert {name: config["randomization"][name] for name in rest} == rest


def test_the_class_ideal_changes_nothing():
    assert SnakeVectorEnv(1, robot_class="ideal").layout == SnakeVectorEnv(1).layout


def test_keywords_lie_over_those_of_the_class_field_by_field():
    config = SnakeVectorEnv(1, robot_class="aiko", robot={"links": 7}, controller=PD()).layout["config"]
    assert config["robot"]["links"] == 7
    assert config["robot"]["backlash"] > 0.0
    assert config["controller"]["kp"] == PD().kp


def test_a_class_has_noise_on_the_blocks_that_are_observed_only():
    seen = SnakeVectorEnv(1, robot_class="aiko", observation_blocks=["gyro", "joint_angle"]).layout["config"]
    assert seen["observation_noise"] == {"gyro": 0.02}
    own = SnakeVectorEnv(1, robot_class="aiko", observation_blocks=["gyro"], observation_noise={"gyro": 0.5})
    assert own.layout["config"]["observation_noise"] == {"gyro": 0.5}


def test_an_unknown_class_is_named():
    with pytest.raises(ConfigError, match=r"^robot_class = 'aico': expected one of 'ideal', 'aiko'"):
        SnakeVectorEnv(1, robot_class="aico")


@pytest.mark.parametrize("model", ["planar", "spatial"])
@pytest.mark.parametrize("task", ["field", "course", "perturbed", "maze", "corridor"])
def test_rough_pegs_leave_scene_start_and_goal_as_they_are_drawn(model, task):
    options = {"task": task, "model": model, "difficulty": 1.0}
    smooth, rough = (
        SnakeVectorEnv(3, **options, start_jitter=0.0),
        SnakeVectorEnv(3, **options, peg_friction=(0.1, 0.4)),
    )
    seen = [env.reset(seed=5)[0] for env in (smooth, rough)]
    before, after = smooth.state(), rough.state()
    np.testing.assert_allclose(after.link_position, before.link_position, atol=1e-12)
    np.testing.assert_allclose(after.goal, before.goal, atol=1e-12)
    np.testing.assert_array_equal(after.obstacles, before.obstacles)
    np.testing.assert_allclose(*seen, atol=1e-6)


def friction(env, i):
    """The coefficients at the pegs of a robot."""
    return {getattr(peg, "friction", 0.0) for peg in env.scene(i).obstacles}


def test_each_episode_has_its_own_friction_at_pegs():
    env = SnakeVectorEnv(4, peg_friction=(0.1, 0.4), max_episode_steps=2, autoreset_mode="SameStep")
    env.reset(seed=5)
    first = [friction(env, i) for i in range(4)]
    for _ in range(2):
        env.step(np.zeros((4, 4), np.float32))
    second = [friction(env, i) for i in range(4)]
    found = [mu for of_episode in first + second for mu in of_episode]
    assert len(found) == len(set(found)) == 8
    assert all(0.1 <= mu <= 0.4 for mu in found)
    env.reset(seed=5)
    assert [friction(env, i) for i in range(4)] == first


def test_rough_pegs_cost_work():
    """The scripted gait makes its way all the same; what its links lose along rough pegs the motors add."""

    def work(peg_friction):
        env = SnakeVectorEnv(8, task="course", start_jitter=0.0, peg_friction=peg_friction)
        env.reset(seed=5)
        for _ in range(100):
            infos = env.step(np.zeros((8, 4), np.float32))[-1]
        return infos["energy"].mean()

    assert work((0.4, 0.4)) > 1.1 * work((0.0, 0.0))
    assert work((0.0, 0.0)) == pytest.approx(work(None), rel=0.01)


def test_a_robot_of_a_batch_is_the_single_robot_and_its_state_has_the_friction():
    single, batch = SnakeEnv(robot_class="aiko"), SnakeVectorEnv(2, robot_class="aiko")
    one, many = single.reset(seed=5)[0], batch.reset(seed=5)[0]
    np.testing.assert_array_equal(one, many[0])
    for _ in range(5):
        action = np.full((2, 4), 0.5, np.float32)
        np.testing.assert_array_equal(single.step(action[0])[0], batch.step(action)[0][0])
    other = SnakeEnv(robot_class="aiko")
    other.set_state(single.get_state())
    assert other.scene().obstacles == single.scene().obstacles


def test_scenes_of_ones_own_have_friction_of_their_own():
    scene = snake_env.Scene.preset("table-7.5")
    with pytest.raises(ConfigError, match=r"^peg_friction = "):
        SnakeVectorEnv(1, scene=scene, peg_friction=(0.1, 0.4))
    SnakeVectorEnv(1, scene=scene, robot_class="aiko", peg_friction=None)
    with pytest.raises(ConfigError, match=r"^options = scene: "):
        SnakeVectorEnv(1, peg_friction=(0.1, 0.4)).reset(options={"scene": scene})


@pytest.mark.parametrize("value", [(0.4, 0.1), (-0.1, 0.2), (0.0, 11.0), 0.2, "rough"])
def test_friction_at_pegs_is_an_interval(value):
    with pytest.raises(ConfigError, match=r"^peg_friction = "):
        SnakeVectorEnv(1, peg_friction=value)


def test_the_class_is_a_keyword_of_registered_environments_and_of_evaluations():
    assert gym.make("SnakeField-v1", robot_class="aiko").spec.to_json()
    found = evaluate("gait", "course", robot_class="aiko", episodes=1)
    assert found.task.options == {"robot_class": "aiko", "precision": "fine"}
    assert tasks.judged(found.task, "ideal").options["robot_class"] == "ideal"
    fast = evaluate("gait", "course", robot_class="aiko", precision="fast", episodes=1)
    assert fast.task.options["precision"] == "fast"


def test_every_part_of_a_class_has_a_source_and_known_keywords():
    for name, one in robot_classes.load().items():
        assert all(part["what"] and part["source"] for part in one["parts"]), name
        assert set(robot_classes.keywords(name)) <= set(snake_env.options.TaskOptions.__annotations__)


def physical(layout, action):
    """Values of the elements of actions (n, a)."""
    low, high = (np.array([entry[end] for entry in layout["action"]]) for end in ("low", "high"))
    return low + 0.5 * (np.clip(action, -1.0, 1.0) + 1.0) * (high - low)


def test_actions_reach_as_far_as_the_motors():
    """At the middle of a joint's swing the fastest wave of the default amplitude has the motor's no-load speed."""
    names = {"amplitude": 0, "frequency": 1}
    ideal, aiko = (SnakeVectorEnv(1, robot_class=one).layout["action"] for one in ("ideal", "aiko"))
    middle = 0.5 * (aiko[names["amplitude"]]["low"] + aiko[names["amplitude"]]["high"])
    assert middle * aiko[names["frequency"]]["high"] == pytest.approx(Motor.aiko().no_load_speed)
    assert ideal[names["frequency"]]["high"] == pytest.approx(np.radians(200.0))
    centres = [0.5 * (one[1]["low"] + one[1]["high"]) for one in (ideal, aiko)]
    assert centres[0] == pytest.approx(centres[1]), "action zero is the thesis's gait for both"


def test_a_policy_commands_the_same_with_other_motors():
    """One that was trained with ideal motors means its own frequencies, not those of the motors."""
    policy = load_policy("general")
    layouts = [SnakeVectorEnv(2, robot_class=one, **policy.env_options).layout for one in ("ideal", "aiko")]
    seen = np.random.default_rng(0).uniform(-0.5, 0.5, (2, sum(b["size"] for b in layouts[0]["observation"])))
    blocks = {block["name"]: block["start"] for block in layouts[0]["observation"]}
    commanded = []
    for layout in layouts:
        observed = seen.astype(np.float32)
        entry = layout["action"][1]
        elements = next(block["elements"] for block in layout["observation"] if block["name"] == "wave")
        wave = blocks["wave"] + elements.index("frequency")
        for place in (wave, blocks["previous_action"] + 1):  # 2.5 rad/s in both
            observed[:, place] = (2.0 * 2.5 - entry["low"] - entry["high"]) / (entry["high"] - entry["low"])
        policy.begin(layout, 2)
        commanded.append(physical(layout, policy(observed)))
    np.testing.assert_allclose(commanded[1], commanded[0], atol=1e-5)
