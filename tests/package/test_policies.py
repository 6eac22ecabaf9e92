"""Policies from `load_policy`: cards, batches, memory, errors."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import run_python

import snake_env
from snake_env import ConfigError
from snake_env.evaluation import film, rollout, seeds, tasks
from snake_env.policies import NAMES, GaitParameters, GaitPolicy, files
from snake_env.policies.scripted import catalogue


@pytest.mark.parametrize("name", NAMES)
def test_shipped_policies_act_where_they_were_trained_and_have_cards(name):
    policy = snake_env.load_policy(name)
    envs = policy.make_vec(2)
    observation, _ = envs.reset(seed=0)
    action = policy(observation)
    assert action.shape == envs.action_space.shape
    assert envs.action_space.contains(np.clip(action, -1.0, 1.0))
    envs.close()
    card = policy.card
    assert (card.name, card.license, card.scenes) == (name, "MIT", 500)
    value, low, high = card.scores["speed"]
    assert low <= value <= high
    assert card.training.startswith("python -m training")
    for part in (name, card.env_id, "success", "speed", "Trained "):
        assert part in str(card)


@pytest.mark.parametrize("name", NAMES)
def test_an_action_does_not_depend_on_the_batch(name):
    policy = snake_env.load_policy(name)
    envs = policy.make_vec(67, num_threads=1)
    observation, _ = envs.reset(seed=5)
    whole = policy(observation)
    for rows in (slice(0, 1), slice(3, 5), slice(7, 40), slice(0, 67, 2)):
        np.testing.assert_array_equal(snake_env.load_policy(name)(observation[rows]), whole[rows])
    single = snake_env.load_policy(name)(observation[9])
    np.testing.assert_array_equal(single, whole[9])
    envs.close()


def test_in_3d_a_policy_rolls_faster_than_the_best_constant_gait():
    """Twice as fast as the gait of `python -m training gaits`, on the ground and without pressing on itself."""
    wave = GaitParameters(*np.radians([43.683, 129.36, -30.906, 0.682, -7.339, -27.545]))
    fields = seeds.held_out(3)
    gait = rollout.run_episodes(GaitPolicy(wave), "SnakeSpatial-v1", fields, 1)
    rolls = rollout.run_episodes(snake_env.load_policy("spatial"), "SnakeSpatial-v1", fields, 1)
    assert gait["is_success"].all()
    assert rolls["is_success"].all()
    assert gait["speed"].mean() == pytest.approx(0.344, abs=0.005)
    assert rolls["speed"].mean() > 1.3 * gait["speed"].mean()
    assert rolls["mean_self_contact_force"].max() == 0.0
    assert not (rolls["diverged"] | rolls["penetrated"]).any()


def test_in_3d_a_policy_passes_fields_faster_than_heading_control():
    """On forty scenes of the benchmark's task, without passing through anything: 0.96 pass, of 200."""
    task, fields = tasks.load()["spatial-field"], seeds.held_out(40)
    played = [
        rollout.run_episodes(policy, task.env_id, fields, 1, **task.options)
        for policy in (catalogue.tuned("heading control", "field-hard"), snake_env.load_policy("spatial-field"))
    ]
    control, learned = played
    # Networks round differently on other machines, and contacts amplify it: of 160 scenes 0.96 and 0.58 pass, at
    # 1.5 times the speed, and samples of 40 miss these bounds in 0.2 % of draws.
    assert learned["is_success"].mean() >= max(0.85, control["is_success"].mean() + 0.1)
    assert learned["speed"].mean() > 1.1 * control["speed"].mean()
    assert not (learned["diverged"] | learned["penetrated"]).any()


@pytest.mark.parametrize("name", ["spatial", "spatial-field"])
def test_in_3d_a_policy_does_not_throw_itself(name):
    policy = snake_env.load_policy(name)
    envs = policy.make_vec(32, num_threads=1)
    observation, _ = envs.reset(seed=seeds.held_out(32))
    carried, highest = [], 0.0
    for _ in range(100):
        observation, _, _, _, info = envs.step(policy(observation))
        carried.append(info["grounded"])
        highest = max(highest, envs.unwrapped.state().link_position[..., 2].max())
        assert not (info["diverged"] | info["penetrated"]).any()
    # About one moment in a hundred is a leap.
    assert np.mean(np.array(carried) > 0) > 0.985
    assert highest < 0.2
    envs.close()


def test_a_film_shows_the_episode_that_was_scored():
    policy, options = snake_env.load_policy("field-hard"), {"difficulty": 1.0, "max_episode_steps": 60}
    chosen = seeds.held_out(12)
    scored = rollout.run_episodes(policy, "SnakeField-v1", chosen, 1, **options)
    for k in (0, 7):
        alone = rollout.run_episodes(policy, "SnakeField-v1", [chosen[k]], 1, **options)
        assert {name: values[0] for name, values in alone.items()} == {name: v[k] for name, v in scored.items()}
    episode = film.play(policy, "SnakeField-v1", chosen[7], **options)
    assert episode.success == scored["is_success"][7]


def test_a_reset_clears_the_memory_of_a_policy():
    policy = snake_env.load_policy("field-hard")
    envs = policy.make_vec(2)
    first, _ = envs.reset(seed=0)
    fresh = policy(first)
    second, *_ = envs.step(fresh)
    later = policy(second)
    policy.reset(np.array([True, False]))
    again = policy(second)
    assert not np.array_equal(later[0], again[0])
    np.testing.assert_array_equal(again[0], snake_env.load_policy("field-hard")(second[:1])[0])
    policy.reset()
    np.testing.assert_array_equal(policy(first), fresh)
    envs.close()


def test_bad_input_is_refused():
    with pytest.raises(
        ConfigError, match=r"policy = nix: expected one of gait, .* heading-control, .* corridor, field-hard"
    ):
        snake_env.load_policy("nix")
    with pytest.raises(ConfigError, match="safetensors"):
        snake_env.load_policy(__file__)
    for name in ("field-hard", "corridor"):
        policy = snake_env.load_policy(name)
        with pytest.raises(ConfigError, match=r"observation = shape \(2, 3\): expected \(n, \d+\)"):
            policy(np.zeros((2, 3), np.float32))


def tensors(**changes):
    """A symmetric network of two layers; None leaves a tensor out."""
    found = {
        "actor.0.weight": np.zeros((3, 4)),
        "actor.0.bias": np.zeros(3),
        "actor.1.weight": np.zeros((2, 3)),
        "actor.1.bias": np.zeros(2),
        "mirror.observation": np.ones(4),
        "mirror.action": np.ones(2),
    } | {name.replace("_", "."): array for name, array in changes.items()}
    return {name: array for name, array in found.items() if array is not None}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"actor_0_bias": None}, r"actor\.0\.bias is missing"),
        ({"actor_0_weight": None}, r"actor\.0\.weight is missing"),
        ({"actor_1_weight": np.zeros((2, 4))}, r"actor\.1\.weight has the shape \(2, 4\), expected \(any, 3\)"),
        ({"actor_0_bias": np.zeros(2)}, r"actor\.0\.bias has the shape \(2,\), expected \(3\)"),
        ({"actor_0_weight": np.zeros(3)}, r"actor\.0\.weight has the shape \(3,\), expected \(any, any\)"),
        ({"actor_1_bias": np.array([0.0, np.nan])}, r"actor\.1\.bias has numbers that are not finite"),
        ({"mirror_observation": np.ones(3)}, r"mirror\.observation has the shape \(3,\), expected \(4\)"),
        ({"mirror_observation": None}, r"mirror\.observation is missing"),
        ({"mirror_action": None}, r"mirror\.action is missing"),
        ({"mirror_order": np.array([0, 1, 1, 3])}, r"mirror\.order is no order of 4 inputs"),
    ],
)
def test_a_file_without_a_whole_network_is_refused_by_tensor(tmp_path, changes, message):
    path = tmp_path / "policy.safetensors"
    files.write(path, tensors(), {})
    assert snake_env.load_policy(path)(np.zeros(4, np.float32)).shape == (2,)
    files.write(path, tensors(**changes), {})
    with pytest.raises(ConfigError, match=rf"policy\.safetensors: {message}"):
        snake_env.load_policy(path)


def test_the_default_gait_is_that_of_the_core():
    wave, degree = GaitParameters(), np.pi / 180.0
    assert (wave.amplitude, wave.omega, wave.beta, wave.gamma) == (40 * degree, 80 * degree, -50 * degree, 0.0)


def test_policies_need_no_torch():
    code = """
        import sys
        import snake_env
        snake_env.load_policy("field-hard")
        print(sorted({"torch", "scipy", "matplotlib", "pygame"} & set(sys.modules)))
    """
    assert run_python(code) == "[]"
