"""Training configurations: what is wrong in one is named by field, value and range."""

import ast
import json
import re

import pytest

from snake_env import ConfigError
from training import config, train
from training.config_file import CONFIGS


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"num_envs": 0}, "num_envs = 0: expected greater than or equal to 1"),
        ({"total_steps": 1e6}, "total_steps = 1000000.0: expected a valid integer"),
        ({"num_envs": True}, "num_envs = True: expected a valid integer"),
        ({"policy": {"hidden": [64, 0]}}, "policy.hidden.1 = 0: expected greater than or equal to 1"),
        ({"policy": {"symmetric": "yes"}}, "policy.symmetric = yes: expected a valid boolean"),
        ({"policy": {"memory": None}}, "policy.memory = None: expected a valid array"),
        ({"ppo": {"gamma": 1.1}}, "ppo.gamma = 1.1: expected less than or equal to 1"),
        ({"ppo": {"learning_rate": float("nan")}}, "ppo.learning_rate = nan: expected a finite number"),
        ({"ppo": {"target_kl": -1.0}}, "ppo.target_kl = -1.0: expected greater than 0"),
        ({"ppo": {"gama": 0.9}}, "ppo.gama = 0.9: expected one of n_steps, batch_size"),
        (
            {"behaviour_cloning": {"policy": "a", "rounds": -1}},
            "behaviour_cloning.rounds = -1: expected greater",
        ),
        ({"env": 3}, "env = 3: expected a mapping of names to values"),
        ({"policy": None}, "policy = None: expected a mapping of names to values"),
        ({"ppo": 3}, "ppo = 3: expected a mapping of names to values"),
        ({"behaviour_cloning": "best gait"}, "behaviour_cloning = best gait: expected a mapping of names to values"),
        ({"env_id": "SnakeRiver-v1"}, "env_id = SnakeRiver-v1: expected an id of one of this package's environments"),
        ({"env_id": "CartPole-v1"}, "env_id = CartPole-v1: expected an id of one of this package's environments"),
        ({"env_id": ["SnakeField-v1"]}, "env_id = ['SnakeField-v1']: expected a valid string"),
        ({"colour": 1}, "colour = 1: expected one of learner, about, env_id"),
    ],
)
def test_a_configuration_is_refused_by_field_value_and_range(values, message):
    with pytest.raises(ConfigError, match=re.escape(message)):
        config.parse(config.PpoConfig, values)


def test_changes_are_checked():
    with pytest.raises(ValueError, match="greater than or equal to 1"):
        config.PpoConfig().with_changes(num_envs=0)


def test_an_unknown_learner_is_named(tmp_path):
    (tmp_path / "run.json").write_text('{"learner": "dqn"}')
    with pytest.raises(ConfigError, match="learner = dqn: expected one of sb3, ppo, evolution"):
        config.load(tmp_path / "run.json")


@pytest.mark.parametrize(
    "path",
    sorted(path for path in CONFIGS.iterdir() if path.stem != "tasks"),
    ids=lambda path: path.stem,
)
def test_shipped_configurations_survive_a_round_trip(path, tmp_path):
    config.save(config.load(path), tmp_path / "copy.yaml")
    assert config.load(tmp_path / "copy.yaml") == config.load(path)


@pytest.mark.parametrize("page", ["README.md", "docs/start.md", "docs/training.md", "snake_env/commands/train.py"])
def test_the_configuration_sb3_is_the_lines_on_the_pages(page):
    text = (config.ROOT / page).read_text(encoding="utf-8")
    found = config.load("sb3")
    (settings,) = set(re.findall(r'PPO\("MlpPolicy", venv, (.*?)(?:, seed=.*)?\)$', text, re.MULTILINE))
    given = {name: ast.literal_eval(value) for name, value in (one.split("=") for one in settings.split(", "))}
    standard = {"n_epochs": 10, "learning_rate": 3e-4, "final_learning_rate": 1.0}  # those of Stable-Baselines3
    assert found.ppo == config.Ppo(**standard, **given)
    assert found.policy == config.Networks(hidden=(64, 64), log_std=0.0)
    (robots,) = re.search(r'make\("SnakeField-v1", num_envs=(\d+), (?:seed=0, )?difficulty=0.5\)', text).groups()
    assert (found.num_envs, found.env_id, found.env) == (int(robots), "SnakeField-v1", {})


def test_keywords_of_the_environment_on_the_command_line_join_those_of_the_configuration(tmp_path):
    file = tmp_path / "run.json"
    weights = {"progress": 2.0, "energy": 0.5}
    file.write_text(json.dumps({"env": {"reward_weights": weights, "goal_distance": 1.0, "difficulty": 0.5}}))
    given = ["--config", str(file), "--env", '{"reward_weights": {"energy": 0.1}, "difficulty": null, "step": 0.01}']
    _, found = train._parse(given)
    assert found.env == {"reward_weights": {"progress": 2.0, "energy": 0.1}, "goal_distance": 1.0, "step": 0.01}
