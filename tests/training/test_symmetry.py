"""Left and right are alike: to the simulator, to the signs, to the networks and to the files that play them."""

import dataclasses

import numpy as np
import pytest

pytest.importorskip("torch")

import torch

from snake_env import ConfigError, Robot
from snake_env.evaluation import rollout, seeds
from snake_env.policies import GaitParameters, Network, files, memory
from training import config
from training.learners import agent
from training.policies import symmetry

MODES = ("gait", "residual", "joints")


def layout(mode):
    env = rollout.make_env("SnakeField-v1", 1, 1, action_mode=mode)
    found = env.unwrapped.layout
    env.close()
    return found


@pytest.mark.parametrize("mode", MODES)
def test_mirroring_twice_changes_nothing(mode):
    found = symmetry.Reflection.of(layout(mode))
    assert len(found.observation) == sum(block["size"] for block in layout(mode)["observation"])
    assert np.array_equal(np.abs(found.observation), np.ones_like(found.observation))
    assert np.array_equal(np.abs(found.action), np.ones_like(found.action))


def test_half_a_period_of_a_steady_wave_is_a_reflection():
    """Lateral undulation half a period later is its own mirror image: the simulator and the signs agree on it."""
    env = rollout.make_env("SnakeFree-v1", 1, 1, start_jitter=0.0, perception="blind")
    half = 36
    gait = GaitParameters(omega=np.pi / (half * env.unwrapped.control_period))
    env.reset(seed=[0])
    seen = [env.step(gait.action(env.unwrapped.layout["action"])[None])[0][0] for _ in range(160)]
    blocks = {block["name"]: np.arange(block["size"]) + block["start"] for block in env.unwrapped.layout["observation"]}
    steady = np.concatenate([blocks[name] for name in ("joint_angle", "joint_rate", "velocity", "yaw_rate", "wave")])
    signs = symmetry.Reflection.of(env.unwrapped.layout).observation[steady]
    assert np.abs(seen[-1][steady] - seen[-1 - half][steady]).max() > 0.5
    np.testing.assert_allclose(seen[-1][steady], seen[-1 - half][steady] * signs, atol=0.03)


RAYS = {"observation_blocks": ["joint_angle", "touch_side", "range"]}


def test_rays_trade_places():
    """In a corridor and the mirrored one a robot has the same distances to the other sides."""
    env = rollout.make_env("SnakeField-v1", 1, 1, start_jitter=0.0, **RAYS)
    mirror = symmetry.Reflection.of(env.unwrapped.layout)
    rays = env.unwrapped.layout["observation"][2]
    assert rays["name"] == "range"
    own, other = (mirror.observed(np.arange(len(mirror.order)))[k] for k in (rays["start"], rays["start"] + 4))
    assert (own, other) == (rays["start"] + rays["size"] - 1, rays["start"] + 4), "the middle one stays"
    assert mirror.observed(np.ones(len(mirror.order)))[rays["start"]] == 1.0


def test_a_policy_with_rays_treats_left_and_right_alike_in_every_file(tmp_path):
    policy = config.PpoNetworks(hidden=(16,), symmetric=True, memory=(0.5,), senses=("touch_side", "range"))
    settings = config.PpoConfig(env=RAYS, policy=policy)
    mirror = agent.reflection_of(settings)
    learned = agent.make_agent(settings, len(mirror.order), len(mirror.action))
    torch.nn.init.normal_(learned.actor[1].network[-1].weight)
    seen = np.random.default_rng(0).uniform(-1.0, 1.0, (7, len(mirror.order))).astype(np.float32)
    action = learned.actor(torch.from_numpy(seen))
    turned = learned.actor(torch.from_numpy(mirror.observed(seen)))
    torch.testing.assert_close(turned, action * torch.from_numpy(mirror.action))
    assert not np.array_equal(mirror.order, np.arange(len(mirror.order)))
    file = tmp_path / "rays.safetensors"
    files.write(file, learned.arrays(), settings.model_dump(mode="json") | {"env": settings.acting_env})
    player = Network(file)
    rollout_env = rollout.make_env(settings.env_id, 7, 1, **player.env_options)
    player.begin(rollout_env.unwrapped.layout, 7)
    observation, _ = rollout_env.reset(seed=0)
    played = player(observation)
    traced = np.concatenate([observation, observation[:, memory.remembered(rollout_env.unwrapped.layout)]], axis=1)
    own = learned.actor[1](torch.from_numpy(traced))
    np.testing.assert_allclose(played, own.detach().numpy(), atol=1e-5)


HINGES = ("yaw", (-1.0, 0.0, 0.0)) * 5


def in_space(mode, axes, mirrored, steps=16):
    """Blocks of the observation of a robot in space that from lying straight makes random movements, or those in the
    mirror, seen in the mirror."""
    env = rollout.make_env(
        "SnakeSpatial-v1",
        1,
        1,
        action_mode=mode,
        task="perturbed",
        perturbation={"course": "table-7.5", "removed": 0, "shifted": 0, "without": list(range(1, 8))},
        perception="blind",
        start_jitter=0.0,
        robot=Robot(axes=axes),
    )
    layout = env.unwrapped.layout
    signs = symmetry.Reflection.of(layout)
    still = np.zeros(len(layout["action"]), np.float32)
    # In the mirror the waves are half a period ahead.
    wait = 25
    if mode != "joints":
        still[0], wait = -1.0, wait + 45 * mirrored
    env.reset(seed=[0])
    for _ in range(wait):
        env.step(still[None])
    action = np.random.default_rng(2).uniform(-1.0, 1.0, still.shape).astype(np.float32)
    seen = np.array([env.step((signs.action * action if mirrored else action)[None])[0][0] for _ in range(steps)])
    env.close()
    seen = seen * signs.observation if mirrored else seen
    return {b["name"]: seen[:, b["start"] : b["start"] + b["size"]] for b in layout["observation"]}


@pytest.mark.parametrize(("mode", "axes"), [*((mode, "both") for mode in MODES), ("joints", HINGES)])
def test_in_space_a_mirrored_robot_moves_as_the_mirror_image(mode, axes):
    plain, mirrored = in_space(mode, axes, False), in_space(mode, axes, True)
    # Where the robot has come to lie before matters to what is seen of the way.
    for name in set(plain) - {"heading", "velocity", "lateral_offset", "goal"}:
        one, other = plain[name], mirrored[name]
        same, opposite = np.abs(one - other).max(axis=0), np.abs(one + other).max(axis=0)
        moves = np.abs(one).max(axis=0) > 0.05
        assert np.all(same[moves] < 0.5 * opposite[moves]), name
        assert moves.any() or name == "contact_force"


def test_a_wave_that_lifts_one_side_first_has_no_mirror():
    settings = config.PpoConfig(env_id="SnakeSpatial-v1", policy=config.PpoNetworks(hidden=(16,), symmetric=True))
    with pytest.raises(ConfigError, match="symmetric"):
        agent.reflection_of(settings)
    assert agent.reflection_of(settings.with_changes(env={"action_mode": "joints"})) is not None


@pytest.mark.parametrize(
    "robot",
    [
        Robot(links=4, axes=["yaw", (1.0, 1.0, 0.0), "pitch"]),
        Robot(links=4, axes=["yaw", "pitch", "both"], joint_limit=[1.0, (-0.5, 1.0), (-0.5, 1.0)]),
    ],
)
def test_robots_without_a_mirror_image_are_refused(robot):
    policy = config.PpoNetworks(hidden=(16,), symmetric=True)
    env = {"action_mode": "joints", "robot": robot}
    with pytest.raises(ConfigError, match=r"policy\.symmetric = True: expected false: joint [12] "):
        agent.reflection_of(config.PpoConfig(env_id="SnakeSpatial-v1", policy=policy, env=env))
    bends_down = dataclasses.replace(robot, axes="pitch")
    agent.reflection_of(config.PpoConfig(env_id="SnakeSpatial-v1", policy=policy, env=env | {"robot": bends_down}))


@pytest.mark.parametrize("mode", MODES)
def test_an_agent_with_a_mirror_treats_left_and_right_alike(mode):
    settings = config.PpoConfig(env={"action_mode": mode}, policy=config.PpoNetworks(hidden=(16,), symmetric=True))
    signs = agent.reflection_of(settings)
    actor_critic = agent.make_agent(settings, len(signs.observation), len(signs.action))
    torch.nn.init.normal_(actor_critic.actor.network[-1].bias)
    seen = torch.rand(7, len(signs.observation)) - 0.5
    turned = seen * torch.from_numpy(signs.observation)
    torch.testing.assert_close(actor_critic.actor(turned), actor_critic.actor(seen) * torch.from_numpy(signs.action))
    torch.testing.assert_close(actor_critic.value(turned), actor_critic.value(seen))
    plain = agent.make_agent(
        settings.with_changes(policy=config.PpoNetworks(hidden=(16,))), seen.shape[1], len(signs.action)
    )
    torch.nn.init.ones_(plain.actor[-1].bias)
    assert not torch.allclose(plain.actor(turned), plain.actor(seen) * torch.from_numpy(signs.action), atol=0.1)


def test_files_carry_the_mirror_along(tmp_path):
    settings = config.PpoConfig(policy=config.PpoNetworks(hidden=(16,), symmetric=True))
    actor_critic = agent.make_agent(settings, 63, 4)
    torch.nn.init.normal_(actor_critic.actor.network[-1].bias)
    files.write(tmp_path / "policy.safetensors", actor_critic.arrays(), {})
    seen = torch.rand(5, 63)
    with torch.no_grad():
        expected = actor_critic.actor(seen).numpy()
    played = Network(tmp_path / "policy.safetensors")(seen.numpy())
    np.testing.assert_allclose(played, expected, rtol=1e-5, atol=1e-6)


def test_left_and_right_policies_do_equally_well():
    """Mirrored heading control, field by field another robot, makes the same way on the whole: the fields have no side.

    A wrong sign anywhere would break its steering.
    """
    from snake_env.policies.scripted import catalogue

    class InTheMirror:
        name = "mirrored"

        def __init__(self, policy):
            self._policy, self.env_options = policy, policy.env_options

        def begin(self, layout, num_envs):
            self._signs = symmetry.Reflection.of(layout)
            self._policy.begin(layout, num_envs)

        def __call__(self, observation):
            return self._signs.action * self._policy(observation * self._signs.observation)

    def way(policy):
        return rollout.run_episodes(policy, "SnakeMaze-v1", seeds.selection(24), 1, difficulty=0.0)["distance"].mean()

    plain = catalogue.tuned("heading control", "maze")
    assert way(InTheMirror(plain)) == pytest.approx(way(plain), rel=0.1)
