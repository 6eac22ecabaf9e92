from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, SnakeVectorEnv, load_policy
from snake_env.evaluation import evaluate, tracks

MODELS = ("planar", "spatial")


@pytest.mark.parametrize("model", MODELS)
def test_the_widest_track_admits_every_block_that_is_not_privileged(model):
    layout = SnakeVectorEnv(1, model=model, perception="body", action_mode="joints", privileged=True).layout
    names = {*tracks.observed(layout), *layout["on_request"]}
    privileged = {name for name in names if name.startswith("privileged_")}
    assert privileged
    assert names - privileged <= set(tracks.blocks("map"))
    assert not privileged & set(tracks.blocks("map"))


def test_each_track_admits_more_than_the_one_before():
    admitted = [set(tracks.blocks(track)) for track in tracks.load()]
    assert all(narrow < wide for narrow, wide in pairwise(admitted))


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("track", ["proprioception", "touch"])
def test_pegs_out_of_reach_are_not_sensed(track, model):
    """A robot pushes itself along the pegs of Table 7.5; out of its reach a peg stands here or there."""

    def seen(peg, blocks):
        course = snake_env.Scene.preset("table-7.5")
        scene = snake_env.Scene(obstacles=[*course.obstacles, peg], friction=course.friction)
        start = snake_env.Start.on_course(course, model)
        env = SnakeVectorEnv(1, task="field", model=model, scene=scene, start=start, observation_blocks=blocks)
        observations = [env.reset(seed=3)[0]]
        for _ in range(40):
            observations.append(env.step(np.zeros((1, len(env.layout["action"])), np.float32))[0])
        assert (env.state().contact_force != 0.0).any()
        return np.array(observations)

    layout = SnakeVectorEnv(1, task="field", model=model).layout
    there = {*tracks.observed(layout), *layout["on_request"]}
    here, elsewhere = (0.15, 1.4, 0.75), (0.15, 1.4, -0.75)
    of_track = [name for name in tracks.blocks(track) if name in there]
    np.testing.assert_array_equal(seen(here, of_track), seen(elsewhere, of_track))
    assert (seen(here, ["pegs"]) != seen(elsewhere, ["pegs"])).any()
    assert (seen(here, ["range"]) != seen(elsewhere, ["range"])).any()


def still(observation):
    """Action zero."""
    return np.zeros((len(observation), 4), np.float32)


def test_a_block_that_a_track_does_not_admit_is_named():
    blocks = ["joint_angle", "touch", "range"]
    with pytest.raises(ConfigError, match=r"^observation_blocks = range: expected blocks of the track touch: "):
        evaluate(still, "course", track="touch", episodes=1, env_options={"observation_blocks": blocks})
    found = evaluate(still, "course", track="range", episodes=1, env_options={"observation_blocks": blocks})
    assert found.track == "range"
    assert evaluate("general", "course", episodes=1).track == "map"


def test_privileged_blocks_are_in_no_track():
    options = {"privileged": True}
    with pytest.raises(ConfigError, match=r"^observation_blocks = privileged_"):
        evaluate(still, "course", track="map", episodes=1, env_options=options)
    assert evaluate(still, "course", episodes=1, env_options=options).track is None


def test_a_gait_needs_no_more_than_the_blocks_that_it_is_given():
    gait = load_policy("gait", env_options={"observation_blocks": ["joint_angle"]})
    assert evaluate(gait, "course", track="proprioception", episodes=1).scores["success"].value == 1.0
    with pytest.raises(ConfigError, match=r"^env_options = "):
        load_policy("gait", env_options={"observation_blocks": ["joint_angle"], "perception": "body"})


def test_a_controller_names_the_block_that_it_misses():
    blind = load_policy("heading-control", env_options={"observation_blocks": ["joint_angle", "wave"]})
    with pytest.raises(ConfigError, match=r"^observation_blocks = .*: expected heading too"):
        evaluate(blind, "course", track="proprioception", episodes=1)


def test_a_controller_without_its_position_steers_by_its_compass():
    compass = load_policy("heading-control", env_options={"observation_blocks": ["joint_angle", "heading", "wave"]})
    assert evaluate(compass, "maze", track="proprioception", episodes=4).scores["success"].value == 1.0


def test_the_command_refuses_what_the_track_does_not_admit(capsys):
    from snake_env.__main__ import main

    arguments = ["evaluate", "--policy", "general", "--task", "course", "--episodes", "1"]
    assert main([*arguments, "--class", "aiko", "--track", "touch"]) == 2
    assert "observation_blocks = velocity: expected blocks of the track touch" in capsys.readouterr().err
