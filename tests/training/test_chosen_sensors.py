"""What is trained with chosen sensors is loaded and entered with them."""

from __future__ import annotations

import pytest

pytest.importorskip("stable_baselines3")

from snake_env import ConfigError, evaluate
from training import runs, train

TOUCH = '{"observation_blocks": ["joint_angle", "heading", "wave", "touch"], "robot_class": "aiko"}'


@pytest.mark.parametrize(
    ("learner", "more"),
    [("sb3", []), ("ppo", ["--policy.memory", "0.5", "--policy.symmetric"])],
)
def test_a_run_with_chosen_blocks_is_entered_with_them(learner, more, tmp_path):
    command = ["--config", "smoke", "--no-bar", "--learner", learner, "--total-steps", "256", "--env", TOUCH]
    assert train.main([*command, *more, "--out", str(tmp_path / "run")]) == 0
    policy = runs.RunFolder(tmp_path / "run").policy
    found = evaluate(policy, "field-hard", track="touch", robot_class="ideal", episodes=1)
    assert found.track == "touch"
    assert evaluate(policy, episodes=1).task.options["robot_class"] == "aiko"
    with pytest.raises(ConfigError, match=r"^observation_blocks = touch: expected blocks of the track proprioception"):
        evaluate(policy, "field-hard", track="proprioception", episodes=1)
