"""Patches of the ground with other friction: slides against closed forms, robots half on ice, borders and files."""

import copy
import dataclasses
import functools
import pickle

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import snake_env
from snake_env import ConfigError, Gait, Integrator, Patch, Randomization, Robot, Scene, Start, Stribeck
from snake_env.obstacles import Box, HeightField

G = 9.81
STILL = Gait(amplitude=0.0)


def strip(low, high, factor):
    """A patch from x = low to high."""
    return Patch(vertices=[(low, -9.0), (high, -9.0), (high, 9.0), (low, 9.0)], factor=factor)


ICE = Scene(
    friction=(0.2, 0.5), patches=[Patch(vertices=[(-9.0, 0.0), (9.0, 0.0), (9.0, 9.0), (-9.0, 9.0)], factor=0.1)]
)
"""Everything with y > 0 is slippery."""


def flat_robot(links):
    """A robot that touches the ground at the CGs of its links in 3D too, nearly in their height."""
    return Robot(links=links, contact_half_length=1e-3, radius=1e-4)


def downhill(model, scene, duration, **keywords):
    """A straight robot that slides along x from rest."""
    start = Start(position=(0.0, 0.0), heading=np.pi, posture="straight")
    run = snake_env.simulate(
        model=model,
        scene=scene,
        gait=STILL,
        start=start,
        duration=duration,
        sample=duration,
        record="velocity",
        **keywords,
    )
    assert run.unconverged.sum() == 0
    return run


def slid(scene, places, duration):
    """How far rigid contacts at ``places`` slide down the slope along x within a time, and how fast they are then: the
    acceleration is constant until one of them crosses a border."""
    angle, mu = scene.slope[0], scene.friction[0]
    strips = [(patch.vertices[0][0], patch.vertices[1][0], patch.factor) for patch in scene.patches]
    borders = sorted({border - place for low, high, _ in strips for border in (low, high) for place in places})
    way = speed = 0.0
    while duration > 0.0:
        end = min((border for border in borders if border > way + 1e-12), default=np.inf)
        factor = np.ones(len(places))
        for low, high, own in strips:
            factor[(places + way + 1e-12 > low) & (places + way + 1e-12 < high)] = own
        a = G * (np.sin(angle) - mu * factor.mean() * np.cos(angle))
        squared = speed**2 + 2.0 * a * (end - way)
        time = (np.sqrt(squared) - speed) / a if np.isfinite(squared) and squared > 0.0 else np.inf
        if a < 0.0 and time > -speed / a:
            time = -speed / a
            if time < duration:
                return way + 0.5 * speed * time, 0.0
        time = min(time, duration)
        reaches = time < duration
        way, speed, duration = way + speed * time + 0.5 * a * time**2, speed + a * time, duration - time
        way = end if reaches else way
    return way, speed


HILL = Scene(
    friction=(0.5, 0.5),
    # Ice, a rug narrower than a part of a step is long, and rough ground that stops the robot.
    patches=[strip(-9.0, 0.3, 0.1), strip(0.1, 0.102, 8.0), strip(0.3, 9.0, 2.0)],
    slope=(0.3, np.pi),
)


@pytest.mark.parametrize("step", [0.025, 0.01, 0.004, 0.001])
@pytest.mark.parametrize("duration", [0.45, 3.0])
def test_a_robot_slides_from_ice_over_a_rug_onto_rough_ground(step, duration):
    robot = Robot(links=3)
    run = downhill("planar", HILL, duration, robot=robot, integrator=Integrator(step=step))
    way, speed = slid(HILL, run.position[0, :, 0], duration)
    # In motion to the micrometre of a crossing; a stop is as good as on even ground.
    assert_allclose(run.position[-1, :, 0] - run.position[0, :, 0], way, atol=1e-7 if speed > 0.0 else 1e-4)
    assert_allclose(run.velocity[-1, :, 0], speed, atol=5e-7)
    assert (speed > 0.3) == (duration < 1.0), "it slides at first and stops at last"


@pytest.mark.parametrize("step", [0.025, 0.005])
def test_pressed_flat_the_spatial_model_slides_as_the_planar_one(step):
    scene = dataclasses.replace(HILL, rolling_friction=0.0)
    run = downhill("spatial", scene, 0.45, robot=flat_robot(3), integrator=Integrator(step=step))
    way, speed = slid(HILL, run.position[0, :, 0], 0.45)
    assert_allclose(run.position[-1, :, 0] - run.position[0, :, 0], way, atol=2e-3)
    assert_allclose(run.velocity[-1, :, 0], speed, atol=1e-2)


def undulation(model, scene, **keywords):
    start = Start(position=(0.0, 0.0), heading=np.pi, posture="straight")
    return snake_env.simulate(
        model=model, scene=scene, gait=Gait(amplitude=0.5, omega=2.0), start=start, duration=3.0, sample=1.0, **keywords
    )


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_a_robot_half_on_ice_is_certified_and_does_not_depend_on_the_step(model):
    coarse, fine = (undulation(model, ICE, integrator=Integrator(step=step)) for step in (0.025, 0.0025))
    for run in (coarse, fine):
        assert run.unconverged.sum() == 0
        assert run.residual.max() < 1e-4
    # Not later: in 3D runs on the edge of a patch drift apart, whatever the step and the tolerance.
    assert_allclose(coarse.position[2], fine.position[2], atol=2e-3)
    without = undulation(model, dataclasses.replace(ICE, patches=()))
    assert np.abs(without.position[-1] - fine.position[-1]).max() > 0.02


def test_half_on_ice_and_pressed_flat_the_spatial_model_is_the_planar_one():
    planar = undulation("planar", ICE, robot=flat_robot(6))
    spatial = undulation("spatial", dataclasses.replace(ICE, rolling_friction=0.0), robot=flat_robot(6))
    assert_allclose(planar.position[-1], spatial.position[-1, :, :2], atol=3e-3)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_patches_multiply_the_coefficients_whatever_else_the_ground_has(model):
    everywhere, nowhere = strip(-9.0, 9.0, 0.5), strip(7.0, 8.0, 0.5)
    ground = Scene(friction=(0.1, 0.3), friction_backward=0.2, stribeck=Stribeck(drop=0.3), slope=(0.05, 1.0))
    twice = dataclasses.replace(ground, friction=(0.2, 0.6), friction_backward=0.4, patches=[everywhere])
    assert_allclose(undulation(model, twice).position, undulation(model, ground).position, atol=1e-12)
    apart = dataclasses.replace(ground, patches=[nowhere])
    assert_array_equal(undulation(model, apart).position, undulation(model, ground).position)


def test_the_last_of_overlapping_patches_counts():
    def end(patches):
        return undulation("planar", dataclasses.replace(ICE, patches=patches)).position[-1]

    below, above = strip(-9.0, 9.0, 0.1), strip(-9.0, 9.0, 3.0)
    assert_array_equal(end([below, above]), end([above]))
    assert_array_equal(end([above, below]), end([below]))


def test_a_top_face_has_the_friction_of_the_patch_that_it_stands_on():
    step = Box((2.0, 2.0), 0.0, 0.0, height=0.1)
    scene = Scene(obstacles=[step], friction=(0.5, 0.5), slope=(0.2, np.pi))
    start = Start(position=(0.0, 0.0), heading=np.pi, posture="straight")
    ways = []
    for patches in ([], [strip(-9.0, 9.0, 0.0)]):
        run = snake_env.simulate(
            model="spatial",
            robot=Robot(links=3),
            scene=dataclasses.replace(scene, patches=patches),
            gait=STILL,
            start=start,
            duration=0.4,
            sample=0.4,
        )
        ways.append(run.position[-1, 0, 0] - run.position[0, 0, 0])
    assert abs(ways[0]) < 1e-9
    assert ways[1] == pytest.approx(0.5 * G * np.sin(0.2) * 0.4**2, abs=1e-3)


@pytest.mark.parametrize("model", ["planar", "spatial"])
def test_an_environment_has_the_patches_of_its_scene(model):
    make = functools.partial(snake_env.SnakeVectorEnv, 2, task="free", model=model, scene=ICE)
    env = make(randomization=Randomization(friction=(0.5, 1.5)))
    env.reset(seed=3)
    assert env.scene(1).patches == ICE.patches
    with pytest.raises(ConfigError, match="another property of the ground"):
        make().reset(options={"scene": dataclasses.replace(ICE, patches=())})


@pytest.mark.parametrize("name", ["ice.json", "ice.yaml"])
def test_a_scene_keeps_its_patches(tmp_path, name):
    ICE.save(tmp_path / name)
    for again in (Scene.load(tmp_path / name), copy.deepcopy(ICE), pickle.loads(pickle.dumps(ICE))):
        assert again == ICE
        assert again.patches[0].factor == 0.1
    assert Scene(patches=[{"vertices": [(0, 0), (1, 0), (0, 1)], "factor": 2}]).patches[0].factor == 2


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"factor": -0.1}, r"patch\.factor = -0\.1"),
        ({"factor": np.nan}, r"patch\.factor = nan"),
        ({"factor": np.inf}, r"patch\.factor = inf"),
        ({"vertices": [(0.0, 0.0), (1.0, 0.0)]}, r"patch\.vertices = 2 corners"),
        ({"vertices": [(0, 0), (2, 0), (1, 0.5), (1, 2)]}, r"patch\.vertices\[2\]"),
        ({"vertices": [(0, 0), (1, 0), (np.nan, 1)]}, r"patch\.vertices\[2\]\[0\] = nan"),
    ],
)
def test_a_patch_is_a_convex_polygon_with_a_factor(fields, message):
    with pytest.raises(ConfigError, match=message):
        Patch(**{"vertices": [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], "factor": 1.0, **fields})


def test_what_has_no_patches_refuses_them(simple_ground):
    with pytest.raises(ConfigError, match=r"scene\.patches = 1 patches: expected \(\)"):
        snake_env.simulate(scene=ICE, duration=0.01, sample=0.01, **simple_ground)


def test_mujoco_and_fields_with_the_friction_of_the_ground_refuse_them():
    with pytest.raises(ConfigError, match=r"scene\.patches = 1 patches: expected \(\) for MuJoCo"):
        ICE.to_mjcf()
    field = HeightField(height=np.zeros((3, 3)), spacing=1.0)
    with pytest.raises(ConfigError, match=r"scene\.patches\[0\]"):
        dataclasses.replace(ICE, obstacles=[field])
    dataclasses.replace(ICE, obstacles=[dataclasses.replace(field, friction=0.2)])


def test_pictures_show_patches_faintly():
    env = snake_env.SnakeEnv(task="free", scene=ICE, render_mode="rgb_array")
    env.reset(seed=0)
    image = env.render().astype(int)
    blue, ground = (image[..., 2] - image[..., 0] > 20).mean(), (abs(image - (244, 245, 242)).max(axis=-1) < 3).mean()
    assert blue > 0.3
    assert ground > 0.2
