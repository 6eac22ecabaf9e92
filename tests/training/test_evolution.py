"""Evolution finds a known optimum, repeats itself, resumes bit for bit, and leaves policies for NumPy."""

import json

import numpy as np
import pytest

pytest.importorskip("torch")

from snake_env.evaluation import rollout, seeds
from snake_env.policies import Network, files, memory
from training import config, runs, train
from training.learners import evolution
from training.learners.cma_es import CmaEs
from training.policies.symmetry import Reflection

SMALL = config.EvolutionConfig(
    env_id="SnakePerturbed-v1",
    env={"max_episode_steps": 10, "action_mode": "residual", "difficulty": 1.0},
    num_envs=16,
    num_threads=1,
    total_steps=640,
    checkpoint_steps=0,
    evaluations=0,
    policy=config.EvolutionNetworks(hidden=(8,), symmetric=True),
    evolution=config.Evolution(fields=2),
)
"""Four generations of eight candidates on two fields."""


def run(path, settings=SMALL):
    folder = runs.RunFolder(path)
    if not folder.exists:
        folder.create(settings)
    assert evolution.train(folder, settings, False) == 0
    return folder


def weights(folder):
    return files.read(folder.policy)[0]


def same(first, second):
    return all(np.array_equal(first[name], second[name]) for name in first)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    return run(tmp_path_factory.mktemp("evolution"))


def ellipsoid(search, power):
    """What a search finds in 150 generations where one direction matters a thousand times as much as another."""
    scales, target = np.logspace(0.0, 1.5, 8), np.linspace(-1.0, 1.0, 8)
    for generation in range(150):
        candidates = search.ask(generation)
        assert candidates.shape == (16, 8)
        search.tell(-(np.square(scales * (candidates - target)).sum(axis=1) ** power))
    return search.mean - target


def test_a_known_optimum_is_found():
    """Also by another seed, which gets there in another way."""
    missed, otherwise = (ellipsoid(CmaEs(np.zeros(8), 0.3, 16, seed), 1) for seed in (0, 1))
    assert 0.0 < np.linalg.norm(missed) < 1e-3
    assert 0.0 < np.linalg.norm(otherwise) < 1e-3
    assert not np.array_equal(missed, otherwise)


def test_ranks_alone_count():
    """Any rising function of the scores leads to the same mean."""
    linear, cubic = (ellipsoid(CmaEs(np.zeros(8), 0.3, 16, 0), power) for power in (1, 3))
    np.testing.assert_array_equal(linear, cubic)


def test_the_global_random_state_is_left_alone():
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    ellipsoid(CmaEs(np.zeros(8), 0.3, 16, 0), 1)
    assert np.array_equal(before, np.random.get_state()[1])  # noqa: NPY002


def test_learning_makes_way():
    """Where nothing is random but the candidates, the mean gets farther than with the gait that it begins as."""
    settings = SMALL.with_changes(
        env_id="SnakeFree-v1",
        env={"max_episode_steps": 40, "action_mode": "gait", "start_jitter": 0.0},
        num_envs=32,
        evolution=config.Evolution(fields=1),
    )
    learner = evolution.Learner(settings, 0, lambda *episode: None)

    def distance():
        return learner.play(np.repeat(learner.mean[None], 32, axis=0), [0])[0]["distance"][0]

    before = distance()
    for _ in range(15):
        learner.collect()
        learner.learn(0.0)
    assert distance() > 1.3 * before


def test_each_candidate_acts_by_its_own_network(trained):
    """Candidates in one batch act as policies of their own, played one at a time from their files."""
    learner = evolution.Learner(SMALL, 0, lambda *episode: None)
    rng = np.random.default_rng(2)
    vectors = rng.normal(size=(3, learner.networks.size))
    seen = rng.uniform(-1.0, 1.0, (6, len(learner.networks.arrays(vectors[0])["mirror.observation"])))
    together = learner.networks.act(learner.networks.layers(vectors), seen.astype(np.float32))
    for k, vector in enumerate(vectors):
        path = trained.path / f"{k}.safetensors"
        files.write(path, learner.networks.arrays(vector), {})
        alone = Network(path)(seen[2 * k : 2 * k + 2].astype(np.float32))
        np.testing.assert_allclose(alone, together[2 * k : 2 * k + 2], rtol=1e-4, atol=1e-5)


def test_what_is_not_sensed_does_not_matter(tmp_path):
    senses = ("heading", "wave: sin_phase")
    settings = SMALL.with_changes(evolution=config.Evolution(fields=2, inputs=senses))
    folder = run(tmp_path, settings)
    names = memory.network_inputs(rollout.layout_of(SMALL.env_id, SMALL.env), ())
    seen = np.random.default_rng(5).uniform(-1.0, 1.0, (3, len(names)))
    changed = np.random.default_rng(6).uniform(-1.0, 1.0, seen.shape)
    for name in ("heading: sin", "heading: cos", "wave: sin_phase"):
        changed[:, names.index(name)] = seen[:, names.index(name)]
    policy = Network(folder.policy)
    assert np.array_equal(policy(seen.astype(np.float32)), policy(changed.astype(np.float32)))
    assert not np.array_equal(policy(seen.astype(np.float32)), policy(seen[::-1].astype(np.float32)))
    assert config.parse(config.EvolutionConfig, settings.model_dump(mode="json")) == settings


def test_left_and_right_are_treated_alike(trained):
    policy = Network(trained.policy)
    signs = Reflection.of(rollout.layout_of(SMALL.env_id, SMALL.env))
    seen = np.random.default_rng(4).uniform(-1.0, 1.0, (7, len(signs.observation))).astype(np.float32)
    np.testing.assert_allclose(policy(seen * signs.observation), policy(seen) * signs.action, atol=1e-6)
    assert np.abs(policy(seen)).max() > 0.0


def test_the_first_mean_is_the_thesis_gait():
    learner = evolution.Learner(SMALL, 0, lambda *episode: None)
    layers = learner.networks.layers(learner.mean[None])
    seen = np.ones((2, len(learner.networks.arrays(learner.mean)["mirror.observation"])), np.float32)
    assert not learner.networks.act(layers, seen).any()


def test_a_score_is_the_sum_of_rewards():
    """Rewarded for nothing but the way made, a score is that way."""
    weights = {"progress": 1.0, "energy": 0.0, "smoothness": 0.0, "success": 0.0}
    learner = evolution.Learner(
        SMALL.with_changes(env=SMALL.env | {"reward_weights": weights}), 0, lambda *episode: None
    )
    played, steps = learner.play(np.repeat(learner.mean[None], 8, axis=0), [5, 6])
    assert steps == 160
    np.testing.assert_allclose(played["return"], played["distance"], rtol=1e-4, atol=1e-6)
    assert np.array_equal(played["return"], np.tile(played["return"][:2], 8))


def test_a_budget_of_steps_repeats_itself_bit_for_bit(trained, tmp_path):
    assert same(weights(trained), weights(run(tmp_path / "again")))
    other = run(tmp_path / "other", SMALL.with_changes(seed=1))
    assert not same(weights(trained), weights(other))


def test_a_run_that_was_stopped_and_resumed_is_the_same_run(trained, tmp_path):
    """Half of the generations, then the others in a new process's state."""
    folder = runs.RunFolder(tmp_path)
    folder.create(SMALL)
    learner = evolution.Learner(SMALL, 0, lambda *episode: None)
    for used in (0.25, 0.5):
        learner.collect()
        learner.learn(used)
    folder.save_checkpoint(lambda path: learner.save(path, {}), learner.steps, 0.0, learner.checkpoint)
    assert same(weights(trained), weights(run(tmp_path)))


def test_a_run_leaves_everything_needed_to_judge_it(trained):
    assert trained.finished
    assert [row["steps"] for row in trained.read_curve()] == [160, 320, 480, 640]
    assert {"return", "is_success", "distance", "speed"} <= set(trained.read_curve()[-1])
    played = rollout.run_episodes(Network(trained.policy), SMALL.env_id, seeds.selection(3), 1, **SMALL.env)
    assert np.isfinite(played["distance"]).all()


def test_the_command_begins_and_refuses(tmp_path, capsys):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL.model_dump(mode="json")))
    arguments = ["--config", str(path), "--out", str(tmp_path / "run"), "--no-bar"]
    assert train.main(arguments) == 0
    assert train.main(arguments) == 2
    assert "--resume" in capsys.readouterr().err


def test_a_configuration_that_is_refused_leaves_the_folder_free(tmp_path, capsys):
    wrong, right = tmp_path / "wrong.json", tmp_path / "right.json"
    wrong.write_text(json.dumps(SMALL.model_dump(mode="json") | {"curriculum": 0.5}))
    right.write_text(json.dumps(SMALL.model_dump(mode="json")))
    out = ["--out", str(tmp_path / "run"), "--no-bar"]
    assert train.main(["--config", str(wrong), *out]) == 2
    assert "curriculum = 0.5: expected one of learner, about, " in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    assert train.main(["--config", str(right), *out]) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"num_envs": 17}, "num_envs = 17: expected a multiple of evolution.fields, at least 4 times it"),
        ({"num_envs": 6}, "num_envs = 6: expected a multiple of evolution.fields, at least 4 times it"),
        (
            {"policy": config.EvolutionNetworks(hidden=(64, 64))},
            r"policy.hidden = \(64, 64\): expected fewer units or evolution.inputs: at most 2000 weights, not ",
        ),
        (
            {"evolution": config.Evolution(fields=2, inputs=("sight",))},
            "evolution.inputs = sight: expected some of joint_angle",
        ),
    ],
)
def test_what_it_cannot_do_is_named(change, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        run(tmp_path, SMALL.with_changes(**change))


@pytest.mark.parametrize(
    ("learner", "name", "refused"),
    [
        ("ppo", "isotropic-evolved", "policy.inputs|evolution = "),
        ("sb3", "isotropic-evolved", "policy.symmetric = True: expected one of hidden, log_std"),
        ("evolution", "corridor-cloned", "policy.log_std = -1.4: expected one of hidden, symmetric"),
    ],
)
def test_each_learner_refuses_the_options_of_others(learner, name, refused):
    with pytest.raises(ValueError, match=refused):
        config.load(name, learner)


def test_a_section_of_another_learner_is_refused():
    cloning = {"controller": "heading control", "task": "field-hard"}
    with pytest.raises(ValueError, match=r"behaviour_cloning = .*: expected one of learner"):
        config.parse(config.Sb3Config, {"behaviour_cloning": cloning})


@pytest.mark.parametrize(("name", "value"), [("fields", 0), ("spread", 0.0), ("spread", -1.0)])
def test_bad_numbers_are_named(name, value):
    with pytest.raises(ValueError, match=rf"evolution\.{name} = {value}: expected"):
        config.parse(config.EvolutionConfig, {"evolution": {name: value}})
