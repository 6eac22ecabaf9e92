"""Evolution strategies find a known optimum, repeat themselves, resume bit for bit, and leave policies for NumPy."""

import dataclasses
import json
from importlib import import_module

import numpy as np
import pytest

pytest.importorskip("torch")

from training import config, rollout, runs, seeds
from training.learners import evolution, ppo
from training.policies import Network, files, memory

SMALL = config.Config(
    env_id="SnakePerturbed-v0",
    env={"max_episode_steps": 10, "action_mode": "residual", "difficulty": 1.0},
    num_envs=16,
    num_threads=1,
    total_steps=640,
    checkpoint_seconds=0.0,
    policy=config.Policy(hidden=(8,), mirror=True),
    evolution=config.Evolution(fields=2),
)
"""Four generations of four pairs of candidates on two fields."""


def run(path, settings=SMALL):
    folder = runs.RunFolder(path, evolution.POLICY, ".npz")
    if not folder.exists:
        folder.create(settings)
    assert evolution.train(folder, settings, False) == 0
    return folder


def weights(folder):
    return files.read(folder.model)[0]


def same(first, second):
    return all(np.array_equal(first[name], second[name]) for name in first)


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    return run(tmp_path_factory.mktemp("evolution"))


def test_a_known_optimum_is_found():
    """Scores fall with the distance from a point: the mean comes within a hundredth of the way to it."""
    rng = np.random.default_rng(0)
    target, mean, optimiser = rng.normal(size=20), np.zeros(20), evolution.Adam(20)
    for generation in range(300):
        changes = rng.normal(size=(16, 20))
        candidates = mean + 0.1 * np.concatenate([changes, -changes])
        score = -np.square(candidates - target).sum(axis=1)
        mean += optimiser.step(evolution.slope(changes, score), 0.05 * (1.0 - generation / 300))
    assert np.linalg.norm(mean - target) < 0.01 * np.linalg.norm(target)


def test_ranks_alone_count():
    """Any rising function of the scores gives the same direction; equal candidates on both sides give none."""
    rng = np.random.default_rng(1)
    changes, score = rng.normal(size=(8, 5)), rng.normal(size=16)
    direction = evolution.slope(changes, score)
    np.testing.assert_array_equal(direction, evolution.slope(changes, np.exp(3.0 * score)))
    np.testing.assert_allclose(direction, -evolution.slope(changes, np.roll(score, 8)))


def test_learning_makes_way():
    """Where nothing is random but the candidates, the mean gets farther than with the gait that it begins as."""
    settings = dataclasses.replace(
        SMALL,
        env_id="SnakeFree-v0",
        env={"max_episode_steps": 40, "action_mode": "gait", "start_jitter": 0.0},
        num_envs=32,
        evolution=config.Evolution(fields=1, learning_rate=0.1),
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
    settings = dataclasses.replace(SMALL, evolution=config.Evolution(fields=2, senses=senses))
    folder = run(tmp_path, settings)
    names = memory.observed(rollout.layout_of(SMALL.env_id, SMALL.env), ())
    seen = np.random.default_rng(5).uniform(-1.0, 1.0, (3, len(names)))
    changed = np.random.default_rng(6).uniform(-1.0, 1.0, seen.shape)
    for name in ("heading: sin", "heading: cos", "wave: sin_phase"):
        changed[:, names.index(name)] = seen[:, names.index(name)]
    policy = Network(folder.model)
    assert np.array_equal(policy(seen.astype(np.float32)), policy(changed.astype(np.float32)))
    assert not np.array_equal(policy(seen.astype(np.float32)), policy(seen[::-1].astype(np.float32)))
    assert config.Config.from_mapping(settings.to_mapping()) == settings


def test_left_and_right_are_treated_alike(trained):
    policy = Network(trained.model)
    signs = ppo.mirror_of(SMALL)
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
        dataclasses.replace(SMALL, env=SMALL.env | {"reward_weights": weights}), 0, lambda *episode: None
    )
    played, steps = learner.play(np.repeat(learner.mean[None], 8, axis=0), [5, 6])
    assert steps == 160
    np.testing.assert_allclose(played["return"], played["distance"], rtol=1e-4, atol=1e-6)
    assert np.array_equal(played["return"], np.tile(played["return"][:2], 8))


def test_a_budget_of_steps_repeats_itself_bit_for_bit(trained, tmp_path):
    assert same(weights(trained), weights(run(tmp_path / "again")))
    other = run(tmp_path / "other", dataclasses.replace(SMALL, seed=1))
    assert not same(weights(trained), weights(other))


def test_a_run_that_was_stopped_and_resumed_is_the_same_run(trained, tmp_path):
    """Half of the generations, then the others in a new process's state."""
    folder = runs.RunFolder(tmp_path, evolution.POLICY, ".npz")
    folder.create(SMALL)
    learner = evolution.Learner(SMALL, 0, lambda *episode: None)
    for used in (0.25, 0.5):
        learner.collect()
        learner.learn(used)
    folder.save_checkpoint(learner.save, learner.steps, 0.0)
    assert same(weights(trained), weights(run(tmp_path)))


def test_a_run_leaves_everything_needed_to_judge_it(trained):
    assert trained.finished
    assert [row["steps"] for row in trained.read_curve()] == [160, 320, 480, 640]
    assert {"return", "is_success", "distance", "speed"} <= set(trained.read_curve()[-1])
    played = rollout.run_episodes(Network(trained.model), SMALL.env_id, seeds.selection(3), 1, **SMALL.env)
    assert np.isfinite(played["distance"]).all()


def test_the_command_begins_and_refuses(tmp_path, capsys):
    path = tmp_path / "small.json"
    path.write_text(json.dumps(SMALL.to_mapping()))
    arguments = ["--config", str(path), "--out", str(tmp_path / "run"), "--no-bar"]
    assert evolution.main(arguments) == 0
    assert evolution.main(arguments) == 2
    assert "--resume" in capsys.readouterr().err


def test_a_configuration_that_is_refused_leaves_the_folder_free(tmp_path, capsys):
    wrong, right = tmp_path / "wrong.json", tmp_path / "right.json"
    wrong.write_text(json.dumps(dataclasses.replace(SMALL, curriculum=0.5).to_mapping()))
    right.write_text(json.dumps(SMALL.to_mapping()))
    out = ["--out", str(tmp_path / "run"), "--no-bar"]
    assert evolution.main(["--config", str(wrong), *out]) == 2
    assert "curriculum = 0.5: expected 0.0" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    assert evolution.main(["--config", str(right), *out]) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"num_envs": 18}, "num_envs = 18: expected a multiple of twice evolution.fields"),
        (
            {"evolution": config.Evolution(2, senses=("sight",))},
            "evolution.senses = sight: expected some of joint_angle",
        ),
        (
            {"clone": config.Clone("best gait", "perturbed")},
            "clone = .*: expected None, training.learners.evolution has",
        ),
        ({"curriculum": 0.5}, "curriculum = 0.5: expected 0.0, training.learners.evolution has"),
        (
            {"evolution": None},
            "evolution = None: expected a section of this name, as in the configuration isotropic-evolved",
        ),
    ],
)
def test_what_it_cannot_do_is_named(change, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        run(tmp_path, dataclasses.replace(SMALL, **change))


def test_a_configuration_of_another_learner_is_refused(tmp_path, capsys):
    assert evolution.main(["--config", "field-hard", "--out", str(tmp_path / "run"), "--no-bar"]) == 2
    assert "evolution = None: expected a section of this name" in capsys.readouterr().err
    assert not runs.RunFolder(tmp_path / "run").exists


@pytest.mark.parametrize("learner", ["learners.ppo", "learners.sb3", "pipeline", "search.sweep"])
def test_other_learners_refuse_a_configuration_of_evolution(learner, tmp_path, capsys):
    if learner in ("learners.sb3", "pipeline"):
        pytest.importorskip("stable_baselines3")
    given = "--configs" if learner == "search.sweep" else "--config"
    command = import_module(f"training.{learner}").main
    try:
        status = command([given, "isotropic-evolved", "--out", str(tmp_path / "run")])
    except SystemExit as end:
        status = end.code
    assert status == 2
    told = f"expected none: this configuration is for training.evolution, not for training.{learner}"
    assert told in capsys.readouterr().err
    assert not list(tmp_path.rglob("*.json"))


def test_a_run_that_noted_a_section_it_did_not_heed_goes_on(tmp_path):
    """Runs of PPO that began before the section was asked for have one."""
    folder = ["--out", str(tmp_path / "run"), "--no-bar"]
    assert ppo.main([*folder, "--config", "smoke", "--total-steps", "256"]) == 0
    noted = tmp_path / "run" / "config.json"
    noted.write_text(json.dumps(json.loads(noted.read_text()) | {"evolution": config.Evolution().__dict__}))
    assert ppo.main([*folder, "--resume", "--total-steps", "512"]) == 0


@pytest.mark.parametrize(("name", "value"), [("fields", 0), ("spread", 0.0), ("spread", -1.0)])
def test_bad_numbers_are_named(name, value):
    with pytest.raises(ValueError, match=rf"evolution\.{name} = {value}: expected"):
        config.Config.from_mapping({"evolution": {name: value}})
