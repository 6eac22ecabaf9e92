"""A search for hyper-parameters by Ray Tune: trials of the SB3 learner, a configuration at the end."""

from pathlib import Path

import pytest

pytest.importorskip("stable_baselines3")
pytest.importorskip("ray.tune")

import ray

from experiments.distributed import tune
from training import config


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """A finished search of two trials."""
    ray.init(num_cpus=2, include_dashboard=False)
    out = tmp_path_factory.mktemp("search") / "search"
    arguments = ["--config", "smoke", "--total-steps", "1024", "--trials", "2", "--out", str(out)]
    assert tune.main(arguments) == 0
    yield out, arguments
    ray.shutdown()


def test_the_best_hyper_parameters_are_a_configuration_for_the_learners(found):
    best = config.load(found[0] / "best.json")
    assert best.env_id == "SnakeField-v1"
    assert best.ppo != config.load(Path("smoke")).ppo


def test_a_finished_search_is_not_run_again(found):
    out, arguments = found
    trials = sorted(path.name for path in out.glob("trial_*"))
    assert len(trials) == 2
    assert tune.main(arguments) == 0
    assert sorted(path.name for path in out.glob("trial_*")) == trials
