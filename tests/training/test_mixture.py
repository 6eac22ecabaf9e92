"""One policy for several tasks: their robots step in one batch, and each task has a teacher of its own."""

import numpy as np
import pytest

pytest.importorskip("torch")

from snake_env import ConfigError
from snake_env.evaluation import rollout
from snake_env.evaluation import tasks as benchmark_tasks
from snake_env.policies import files, load_policy
from training import config, progress, runs, train
from training.learners import behaviour_cloning, mixture

OPTIONS = {"action_mode": "residual", "nearest_pegs": 8, "perception": "body", "max_episode_steps": 30}
TEACHERS = {"corridor": "corridor", "perturbed": "perturbed"}


def settings(**changes):
    return config.PpoConfig(
        env=OPTIONS,
        num_envs=8,
        num_threads=1,
        tasks={"corridor": 3, "perturbed": 5},
        policy=config.PpoNetworks(hidden=(8,)),
        ppo=config.Ppo(n_steps=16, batch_size=64, n_epochs=1),
        **changes,
    )


def test_robots_of_a_mixture_are_those_of_their_tasks():
    """Byte for byte what two batches of their own give, with seeds in the order of the robots."""
    of = mixture.parts(settings())
    assert [(part.name, part.robots) for part in of] == [("corridor", slice(0, 3)), ("perturbed", slice(3, 8))]
    mixed = mixture.Mixture(of, 1)
    known = benchmark_tasks.load()
    alone = [
        rollout.make_env(known[part.name].env_id, count, 1, **(known[part.name].options | OPTIONS))
        for part, count in zip(of, (3, 5), strict=True)
    ]
    seen = mixed.reset(7)
    own = np.concatenate([alone[0].reset(seed=7)[0], alone[1].reset(seed=10)[0]])
    np.testing.assert_array_equal(seen, own)
    rng = np.random.default_rng(0)
    for step in range(30):
        action = rng.uniform(-1.0, 1.0, (8, len(mixed.layout["action"]))).astype(np.float32)
        seen, reward, _, truncated, infos = mixed.step(action)
        first, second = alone[0].step(action[:3]), alone[1].step(action[3:])
        np.testing.assert_array_equal(reward, np.concatenate([first[1], second[1]]))
        if step < 29:
            assert not infos
            np.testing.assert_array_equal(seen, np.concatenate([first[0], second[0]]))
    assert truncated.all()
    ended = infos["final_info"]
    np.testing.assert_array_equal(ended["distance"], np.concatenate([one[4]["distance"] for one in (first, second)]))
    assert list(ended["task"]) == ["corridor"] * 3 + ["perturbed"] * 5
    np.testing.assert_array_equal(np.stack(infos["final_obs"]), np.concatenate([first[0], second[0]]))


def test_each_robot_is_taught_by_the_policy_of_its_task():
    """Teachers act on the learner's observations as they would on their own, with their memory."""
    teachers = behaviour_cloning.Teachers(TEACHERS, mixture.parts(settings()))
    mixed = mixture.Mixture(mixture.parts(settings()), 1)
    corridor = load_policy("corridor")
    known = benchmark_tasks.load()["corridor"]
    env = rollout.make_env(known.env_id, 3, 1, **(known.options | corridor.env_options))
    corridor.begin(env.unwrapped.layout, 3)
    seen, own = mixed.reset(0), env.reset(seed=0)[0]
    assert seen.shape[1] > own.shape[1], "the learner sees more than this teacher"
    for _ in range(20):
        told, expected = teachers(seen), np.clip(corridor(own), -1.0, 1.0)
        np.testing.assert_array_equal(told[:3], expected)
        seen, own = mixed.step(told)[0], env.step(expected)[0]


def test_a_teacher_with_more_observations_than_the_learner_is_refused():
    blind = settings().with_changes(env=OPTIONS | {"perception": "blind"})
    with pytest.raises(ConfigError, match=r"behaviour_cloning\.teachers = corridor: expected"):
        behaviour_cloning.Teachers(TEACHERS, mixture.parts(blind))


def test_a_run_of_several_tasks_imitates_their_teachers_and_reports_each(tmp_path):
    cloning = config.BehaviourCloning(teachers=TEACHERS, rounds=2, critic_rounds=1, epochs=1)
    run = tmp_path / "mixed.json"
    config.save(settings(behaviour_cloning=cloning, total_steps=1024, evaluations=1, evaluation_fields=2), run)
    out = tmp_path / "run"
    assert train.main(["--config", str(run), "--no-bar", "--out", str(out)]) == 0
    folder = runs.RunFolder(out)
    last = folder.read_curve()[-1]
    assert {"is_success", "is_success/corridor", "is_success/perturbed"} <= set(last)
    assert last["distance"] == pytest.approx((last["distance/corridor"] + last["distance/perturbed"]) / 2, abs=1e-3)
    assert set(files.read(folder.policy)[1]["tasks"]) == set(TEACHERS)
    assert "speed/corridor" in (out / "evaluations.jsonl").read_text()


def test_scores_of_a_run_of_several_tasks_are_means_over_the_tasks(monkeypatch):
    perturbed = benchmark_tasks.load()["perturbed"]

    def episodes(policy, env_id, fields, num_threads, **options):
        speed = 2.0 if (env_id, options) == (perturbed.env_id, perturbed.options | OPTIONS) else 1.0
        return {"speed": speed * np.array([0.1, 0.3]), "is_success": np.ones(len(fields), bool)}

    monkeypatch.setattr(progress.rollout, "run_episodes", episodes)
    means, of_tasks = progress.means_over_tasks(None, settings(), [7, 8], ("speed", "is_success"))
    assert {task: found["speed"] for task, found in of_tasks.items()} == pytest.approx(
        {"corridor": 0.2, "perturbed": 0.4}
    )
    assert means == pytest.approx({"speed": 0.3, "is_success": 1.0})
    assert progress.merit(means) == pytest.approx(1.3)
    assert progress.merit({"steps": 256}) == 0.0, "no episode has ended"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"tasks": {"river": 64}}, "tasks = river: expected some of course"),
        ({"tasks": {"course": 8}}, "num_envs = 64: expected 8, the robots of all tasks"),
        ({"tasks": {"course": 64}, "curriculum": 0.5}, "curriculum = 0.5: expected 0 with several tasks"),
        (
            {"tasks": {"course": 64}, "behaviour_cloning": {"teachers": {"maze": "field-hard"}}},
            "behaviour_cloning.teachers = maze: expected one for each of the tasks course",
        ),
        ({"behaviour_cloning": {"policy": "a", "run": "b"}}, "behaviour_cloning = policy and run: expected controller"),
    ],
)
def test_tasks_and_teachers_that_do_not_fit_are_named(values, message):
    with pytest.raises(ConfigError, match=message):
        config.parse(config.PpoConfig, values)


def test_tasks_with_different_observations_are_refused():
    of = mixture.parts(settings())
    other = of[1]._replace(options=of[1].options | {"nearest_pegs": 3})
    with pytest.raises(ConfigError, match="tasks = perturbed: expected tasks with the observations"):
        mixture.Mixture([of[0], other], 1)
