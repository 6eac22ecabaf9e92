"""Learners that share robots and updates end where one learner ends; a signal or a lost process ends all of them."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("torch")

from experiments.distributed import learners
from snake_env.policies import files
from training import config, runs, train
from training.learners import ppo

SMOKE = ["--config", "smoke", "--no-bar"]


@pytest.fixture(scope="module")
def everything(tmp_path_factory):
    """Options of a run in which all that is shared takes part; its learning rate does not depend on the budget.

    Robots of two tasks that begin as clones of a controller, symmetric networks with memory, and a bounded divergence.
    """
    smoke = config.load("smoke", "ppo")
    shared = smoke.with_changes(
        tasks={"course": 3, "corridor": 5},
        # Equal steps, whose lengths do not depend on round-off.
        env=smoke.env | {"integrator": {"order": 1}},
        behaviour_cloning=config.BehaviourCloning(
            controller="heading control", task="course", rounds=1, critic_rounds=1, epochs=1
        ),
        policy=smoke.policy.with_changes(symmetric=True, memory=(0.2,)),
        ppo=smoke.ppo.with_changes(target_kl=0.5, final_learning_rate=1.0),
        evaluations=0,
    )
    path = tmp_path_factory.mktemp("config") / "everything.json"
    config.save(shared, path)
    return ["--config", str(path), "--no-bar"]


def weights(path):
    return files.read(path / files.NAME)[0]


def alone(path, steps, arguments):
    """A run of one learner."""
    assert train.main([*arguments, "--learner", "ppo", "--out", str(path), "--total-steps", str(steps)]) == 0
    return path


def assert_equal_within_round_off(first, second):
    """Gradients are sums in another order, which differ by some 1e-8.

    Adam divides by the gradient's size plus 1e-5: with the learning rate 5e-4 a weight whose gradient vanishes differs
    by 5e-7 per gradient step; the runs take sixteen and more.
    """
    for name in first:
        np.testing.assert_allclose(first[name], second[name], rtol=0.0, atol=1e-5)


def test_two_learners_are_one_within_round_off(everything, tmp_path):
    one, two = alone(tmp_path / "one", 1536, everything), tmp_path / "two"
    assert learners.main([*everything, "--total-steps", "1536", "--learners", "2", "--out", str(two)]) == 0
    first, second = weights(one), weights(two)
    assert_equal_within_round_off(first, second)
    learner = ppo.Learner(runs.RunFolder(one).config(), 0, lambda *episode: None)
    begun = learner.arrays()
    learner.close()
    assert max(np.abs(first[name] - begun[name]).max() for name in first) > 1e-3, "they have learned"
    rows = [runs.RunFolder(path).read_curve() for path in (one, two)]
    for row, other in zip(*rows, strict=True):
        assert other["steps"] == row["steps"]
        assert other.get("return") == pytest.approx(row.get("return"), abs=2e-4)


def started(path, *more):
    """The command in a process of its own, after its second update."""
    command = [sys.executable, "-m", "experiments.distributed.learners", "--learners", "2", "--out", str(path), *more]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    before, deadline = lines(path / "curve.jsonl"), time.monotonic() + 120.0
    while lines(path / "curve.jsonl") < before + 2:
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.05)
    return process


def lines(path):
    """How many a file has so far."""
    return path.read_text().count("\n") if path.exists() else 0


def of_session(process):
    """The learners of a command: children that multiprocessing has spawned, those of torch's and its own."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            if int((entry / "stat").read_text().rpartition(")")[2].split()[3]) == process.pid:
                found.append((int(entry.name), (entry / "cmdline").read_text()))
        except OSError:  # it has ended
            continue
    return [pid for pid, command in found if "spawn_main" in command]


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="finds the processes as Linux lists them")
def test_signals_and_losses_end_all_and_one_learner_continues(everything, tmp_path):
    """A killed learner ends the run with a line; Ctrl-C saves it; what continues it is one learner."""
    path = tmp_path / "run"
    process = started(path, *everything, "--total-steps", "1000000")
    victim = of_session(process)[1]
    os.kill(victim, signal.SIGKILL)
    _, error = process.communicate(timeout=60)
    assert process.returncode == 1
    assert "a learner ended" in error.splitlines()[-1]
    assert of_session(process) == []

    process = started(path, "--resume", "--no-bar")
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    _, error = process.communicate(timeout=60)
    assert process.returncode == 130, error
    folder = runs.RunFolder(path)
    steps = int(folder.latest().stem)
    assert folder.read_curve()[-1]["steps"] == steps

    continued = alone(path, steps + 256, ["--resume", "--no-bar"])
    assert_equal_within_round_off(weights(continued), weights(alone(tmp_path / "alone", steps + 256, everything)))


def test_robots_are_shared_evenly(tmp_path, capsys):
    assert learners.main([*SMOKE, "--learners", "3", "--out", str(tmp_path / "run")]) == 2
    assert "learners = 3: expected a divisor of num_envs = 8" in capsys.readouterr().err
    assert not (tmp_path / "run").exists()
    path = tmp_path / "next.json"
    cloning = config.BehaviourCloning(run="smoke")
    config.save(config.load("smoke", "ppo").with_changes(behaviour_cloning=cloning), path)
    assert learners.main(["--config", str(path), "--out", str(tmp_path / "run")]) == 2
    assert "behaviour_cloning.run = smoke: expected none" in capsys.readouterr().err
