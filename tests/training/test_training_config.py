"""Training configurations: what is wrong in one is named by field, value and range."""

import re

import pytest

from snake_env import ConfigError
from training import config


def test_configurations_name_what_is_wrong():
    with pytest.raises(ValueError, match=r"ppo\.gama = 0\.9: expected one of"):
        config.Config.from_mapping({"ppo": {"gama": 0.9}})
    with pytest.raises(ValueError, match="num_envs = 0"):
        config.Config(num_envs=0)
    with pytest.raises(ValueError, match="seed = -1"):
        config.Config(seed=-1)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"num_envs": 0}, "num_envs = 0: expected an integer >= 1"),
        ({"total_steps": 1e6}, "total_steps = 1000000.0: expected an integer >= 1"),
        ({"policy": {"hidden": [64, 0]}}, r"policy.hidden = (64, 0): expected integers >= 1"),
        ({"policy": {"mirror": "yes"}}, "policy.mirror = yes: expected true or false"),
        ({"ppo": {"batch_size": 0}}, "ppo.batch_size = 0: expected an integer >= 1"),
        ({"ppo": {"gamma": 1.1}}, "ppo.gamma = 1.1: expected a number in [0, 1]"),
        ({"ppo": {"learning_rate": float("nan")}}, "ppo.learning_rate = nan: expected a number > 0"),
        ({"ppo": {"target_kl": -1.0}}, "ppo.target_kl = -1.0: expected a number > 0"),
        ({"clone": {"policy": "a", "rounds": -1}}, "clone.rounds = -1: expected an integer >= 0"),
        ({"evolution": {"spread": "wide"}}, "evolution.spread = wide: expected a number > 0"),
        ({"env": 3}, "env = 3: expected a mapping of names to values"),
        ({"policy": None}, "policy = None: expected a mapping of names to values"),
        ({"ppo": 3}, "ppo = 3: expected a mapping of names to values"),
        ({"clone": "best gait"}, "clone = best gait: expected a mapping of names to values"),
        ({"evolution": [3]}, "evolution = [3]: expected a mapping of names to values"),
        ({"policy": {"hidden": 64}}, "policy.hidden = 64: expected integers >= 1"),
        ({"policy": {"traces": None}}, "policy.traces = None: expected times > 0"),
        ({"evolution": {"senses": 3}}, "evolution.senses = 3: expected names, or none"),
        ({"env_id": "SnakeRiver-v0"}, "env_id = SnakeRiver-v0: expected an id of one of this package's environments"),
        ({"env_id": "CartPole-v1"}, "env_id = CartPole-v1: expected an id of one of this package's environments"),
        ({"env_id": ["SnakeField-v0"]}, "env_id = ['SnakeField-v0']: expected an id of one of"),
    ],
)
def test_a_configuration_is_refused_by_field_value_and_range(values, message):
    with pytest.raises(ConfigError, match=re.escape(message)):
        config.Config.from_mapping(values)


@pytest.mark.parametrize(
    "path",
    sorted(path for path in config.CONFIGS.iterdir() if path.stem not in ("benchmark", "tasks")),
    ids=lambda path: path.stem,
)
def test_shipped_configurations_survive_a_round_trip(path, tmp_path):
    config.save(config.load(path), tmp_path / "copy.yaml")
    assert config.load(tmp_path / "copy.yaml") == config.load(path)
