"""Uneven ground, convex bodies, poles and pipes of the spatial model: configuration, files, laws and pictures."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from snake_env import ConfigError, Gait, Integrator, Robot, Scene, SnakeEnv, Start, simulate
from snake_env.obstacles import Cylinder, HeightField, Polyhedron
from snake_env.surfaces import field_height, ground_height, mesh, section

GRAVITY, RADIUS = 9.81, 0.0525
STILL = Gait(amplitude=0.0)
CUBE = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
FIELD = HeightField(height=[[0.0, 0.1, 0.0], [0.0, -0.2, 0.3]], spacing=0.5, origin=(1.0, -2.0))
POLE = Cylinder(start=(0.0, 2.0, 0.0), end=(0.2, 2.0, 1.0), radius=0.1, friction=0.4)
PIPE = Cylinder(start=(-1.0, -2.0, 0.3), end=(1.0, -2.0, 0.3), radius=0.3, inside=True)
ALL = [(0.1, 5.0, 5.0), FIELD, dataclasses.replace(FIELD, friction=[[0.1, 0.2]]), Polyhedron(CUBE, 0.2), POLE, PIPE]


def field(**changes):
    return dataclasses.replace(FIELD, **changes)


def plane(function, size=3.0, spacing=0.1, friction=None):
    """A field around the origin, of the heights ``function(x, y)``."""
    at = np.arange(-size, size + 0.5 * spacing, spacing)
    height = np.broadcast_to(function(*np.meshgrid(at, at, indexing="ij")), (len(at), len(at)))
    return HeightField(height=height.tolist(), spacing=spacing, origin=(-size, -size), friction=friction)


def run(scene, seconds, gait=None, **options):
    gait = Gait.lateral_undulation() if gait is None else gait
    return simulate(model="spatial", scene=scene, gait=gait, duration=seconds, sample=0.1, **options)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"height": [[0.0]]}, r"height = 1 rows: expected two or more rows"),
        ({"height": []}, r"height = 0 rows"),
        ({"height": [[0.0, 0.0], [0.0]]}, r"height = 2 rows: .* each of the same two or more heights"),
        ({"height": [0.0, 1.0]}, r"height = \(0.0, 1.0\): expected .* array of rows"),
        ({"height": np.zeros((2, 2, 2))}, r"height = .* array of rows"),
        ({"height": None}, r"height = None: expected a value"),
        ({"height": [[0.0, 0.0], [0.0, np.nan]]}, r"height\[1\]\[1\] = nan: expected a finite number"),
        ({"height": np.full((2, 2), np.inf)}, r"height\[0\]\[0\] = inf"),
        ({"spacing": 0.0}, r"spacing = 0: expected a finite number > 0"),
        ({"spacing": -1.0}, r"spacing = -1"),
        ({"origin": (np.nan, 0.0)}, r"origin\[0\] = nan"),
        ({"origin": (0.0, 0.0, 0.0)}, r"origin = .* expected 2 numbers"),
        ({"friction": -0.1}, r"friction = -0.1: expected a finite number >= 0"),
        ({"friction": [[0.1], [0.2]]}, r"friction = 2 rows: expected .* shape \[1, 2\]"),
        ({"friction": [[0.1, -0.2]]}, r"friction = -0.2"),
        ({"mass": 1.0}, r"mass = 1: expected None"),
    ],
)
def test_a_height_field_names_what_it_cannot_be(changes, message):
    with pytest.raises(ConfigError, match=r"obstacle\." + message):
        field(**changes)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Polyhedron(CUBE[:3]), r"vertices = 3 points: expected 4 to 64"),
        (lambda: Polyhedron(np.ones((65, 3)) * np.arange(65)[:, None]), r"vertices = 65 points"),
        (lambda: Polyhedron([(x, y, 0.0) for x, y, _ in CUBE]), r"vertices = points in one plane"),
        (lambda: Polyhedron([(0.0, 0.0, 0.0)] * 5), r"vertices = points in one plane"),
        (lambda: Polyhedron([*CUBE[:3], (0.0, 0.0, np.nan)]), r"vertices\[3\]\[2\] = nan"),
        (lambda: Polyhedron([(0.0, 0.0)] * 4), "expected a polyhedron with vertices"),
        (lambda: dataclasses.replace(POLE, radius=0.0), r"radius = 0: expected a finite number > 0"),
        (lambda: dataclasses.replace(POLE, end=POLE.start), r"end = .* another point than the start"),
        (lambda: dataclasses.replace(POLE, start=(0.0, 1.0)), "expected a cylinder with start, end, radius"),
        (lambda: dataclasses.replace(POLE, inside=2), r"inside = 2: expected True or False"),
    ],
)
def test_bodies_name_what_they_cannot_be(make, message):
    with pytest.raises(ConfigError, match=message):
        make()


@pytest.mark.parametrize("one", [FIELD, Polyhedron(CUBE), POLE])
def test_only_the_spatial_model_has_them(one):
    scene = Scene(obstacles=[one])
    for make in (lambda: simulate("planar", scene=scene), lambda: SnakeEnv(task="free", scene=scene)):
        with pytest.raises(ConfigError, match=r'scene\.obstacles\[0\] = .*model="spatial"'):
            make()


def test_friction_that_differs_backward_needs_a_level_ground():
    options = {"friction": (0.1, 0.5), "friction_backward": 0.3}
    with pytest.raises(ConfigError, match=r"scene\.friction_backward = 0.3: expected None with a height field"):
        run(Scene(obstacles=[FIELD], **options), 0.1)
    run(Scene(obstacles=[field(friction=0.2)], **options), 0.1)


@pytest.mark.parametrize("name", ["scene.json", "scene.yaml"])
def test_files_keep_them(tmp_path, name):
    if name.endswith("yaml"):
        pytest.importorskip("yaml")
    path = tmp_path / name
    Scene(obstacles=ALL).save(path)
    read = Scene.load(path)
    assert [type(one) for one in read.obstacles] == [type(one) for one in ALL]
    again = tmp_path / f"again-{name}"
    read.save(again)
    assert again.read_text(encoding="utf-8") == path.read_text(encoding="utf-8")
    for before, after in zip(ALL[1:], read.obstacles[1:], strict=True):
        for one in dataclasses.fields(before):
            value, written = getattr(before, one.name), getattr(after, one.name)
            assert np.array_equal(value, written) if np.ndim(value) else value == written


def test_errors_of_files_name_the_obstacle():
    for fields, message in (
        ({"shape": "height_field", "height": [[0, 0], [0, 0]], "spacing": 0}, r"obstacles\[1\]\.spacing = 0"),
        ({"shape": "cylinder", "start": [0, 0, 0], "end": [0, 0, 1]}, r"obstacles\[1\] = .* a cylinder with start"),
        ({"shape": "polyhedron", "vertices": CUBE, "height": 1.0}, r"obstacles\[1\]\.height = .* a field of a poly"),
    ):
        with pytest.raises(ConfigError, match=r"scene\." + message):
            Scene.from_fields({"obstacles": [[0.1, 5.0, 5.0], fields]})


@pytest.mark.parametrize("j", range(2, 7))
def test_moved_ones_are_where_they_were_but_for_the_shift(j):
    before, after = (
        mesh(scene.obstacles[j - 1])[0] for scene in (Scene(obstacles=ALL), Scene(obstacles=ALL).moved(j, 1.5, -2.0))
    )
    np.testing.assert_allclose(after - before, np.broadcast_to([1.5, -2.0, 0.0], before.shape), atol=1e-12)


def test_a_level_field_is_the_ground_to_the_last_bit():
    level, scene = plane(lambda x, y: 0.0 * x), Scene(friction=(0.1, 0.5))
    there = run(dataclasses.replace(scene, obstacles=[level]), 1.0)
    np.testing.assert_array_equal(there.position, run(scene, 1.0).position)


def test_a_tilted_field_is_a_slope():
    """By the same law of friction, along and across links, in another code."""
    angle, friction = 0.1, (0.3, 0.6)
    tilted = plane(lambda x, y: np.tan(angle) * x)
    still = {"friction": friction, "rolling_friction": 0.0}
    start, fine = Start(position=(0.0, 0.0), heading=0.0), Integrator(precision="fine", step=1e-3)
    slope = run(Scene(slope=(angle, 0.0), **still), 0.5, start=start, integrator=fine).position
    pitched = dataclasses.replace(start, pitch=angle)
    field = run(Scene(obstacles=[tilted], **still), 0.5, start=pitched, integrator=fine).position
    cos, sin = np.cos(angle), np.sin(angle)
    field = field @ np.array([[cos, 0.0, sin], [0.0, 1.0, 0.0], [-sin, 0.0, cos]]).T
    np.testing.assert_allclose(field - field[0, 0], slope - slope[0, 0], atol=2e-6)
    assert np.abs(slope[-1] - slope[0]).max() > 0.05


def test_faces_of_a_valley_share_the_weight():
    """Without friction the forces of faces of slopes a and b are W sin(b) / sin(a + b) and W sin(a) / sin(a + b)."""
    a, b = 0.4, 0.7
    left, right = (
        Polyhedron([(x, side * y, z) for x in (-2.0, 2.0) for y, z in ((0, 0), (1, 0), (1, np.tan(slope)))])
        for side, slope in ((-1.0, a), (1.0, b))
    )
    normals = np.array([[0.0, np.sin(a), np.cos(a)], [0.0, -np.sin(b), np.cos(b)]])
    y, z = np.linalg.solve(normals[:, 1:], [RADIUS, RADIUS])
    start = Start(position=(0.0, y), heading=0.0, posture="straight")
    found = run(Scene(obstacles=[left, right]), 0.2, STILL, robot=Robot(links=2), start=start, record=["obstacles"])
    np.testing.assert_allclose(found.position[:, :, 1:], np.broadcast_to([y, z], (3, 2, 2)), atol=1e-6)
    weight = GRAVITY * 2.0 * Robot().mass
    expected = weight / np.sin(a + b) * np.array([[np.sin(b)], [np.sin(a)]]) * normals
    # The robot acts on no other obstacle; the force of an obstacle on the robot points away from it.
    np.testing.assert_allclose(found.obstacle_force[-1], expected, atol=1e-3)


@pytest.mark.parametrize("share", [0.98, 1.05])
def test_a_ramp_holds_a_robot_up_to_the_angle_of_friction(share):
    """Above it the robot slides with g (sin - mu cos)."""
    angle = 0.3
    mu, rise = np.tan(angle) / share, 6.0 * np.tan(angle)
    ramp = Polyhedron([(x, y, z) for x, z in ((-3, 0), (3, 0), (3, rise)) for y in (-1, 1)], friction=mu)
    start = Start(position=(0.0, 0.0), heading=0.0, pitch=angle, posture="straight")
    found = run(Scene(obstacles=[ramp]), 0.5, STILL, robot=Robot(links=2), start=start).position
    slid = np.linalg.norm(found[-1] - found[0], axis=-1)
    acceleration = max(0.0, GRAVITY * (np.sin(angle) - mu * np.cos(angle)))
    np.testing.assert_allclose(slid, 0.5 * acceleration * 0.25, atol=2e-6)


def test_surfaces_are_closed_and_have_their_volumes():
    """By the divergence theorem, with triangles anticlockwise seen from outside; a cylinder is a prism of 32 sides."""
    rng = np.random.default_rng(0)
    tetrahedron = np.array([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)])
    inner = rng.dirichlet(np.ones(4), 20) @ tetrahedron
    round_one = 16.0 * np.sin(np.pi / 16.0) * 0.1**2 * np.sqrt(1.04)
    bodies = [(Polyhedron(CUBE), 1.0), (Polyhedron([*tetrahedron, *inner]), 1.0), (POLE.moved(3.0, 0.0), round_one)]
    for body, volume in bodies:
        vertices, triangles = mesh(body)
        a, b, c = (vertices[triangles[:, k]] for k in range(3))
        assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0 == pytest.approx(volume)
    a, b, c = (mesh(FIELD)[0][mesh(FIELD)[1][:, k]] for k in range(3))
    assert np.cross(b - a, c - a)[:, 2].min() >= -1e-12, "no face of a field looks down"


def test_ground_between_points_is_that_of_the_triangles():
    height, slopes = field_height(FIELD, np.array([[1.25, -1.9], [1.1, -1.75], [1.6, -1.9]]))
    np.testing.assert_allclose(height, [0.0 * 0.5 - 0.2 * 0.2, 0.1 * 0.5 - 0.3 * 0.2, np.nan], atol=1e-12)
    np.testing.assert_allclose(slopes[0], [0.0, -0.4], atol=1e-12)
    np.testing.assert_allclose(ground_height([FIELD, (0.1, 0.0, 0.0)], [[1.5, -1.0], [9.0, 9.0]]), [0.3, 0.0])


def test_sections_are_cut_upright():
    outline = section(Polyhedron(CUBE), np.array([0.5, 0.25]), np.array([1.0, 0.0]))
    assert np.ptp(outline, axis=0) == pytest.approx([1.0, 1.0])
    assert outline.min(axis=0) == pytest.approx([-0.5, 0.0])
    assert len(section(Polyhedron(CUBE), np.array([0.5, 1.25]), np.array([1.0, 0.0]))) == 0


def shown(scene, **picture):
    """A picture of a straight robot with its CG over the origin, from above and from the side (height, width, 3)."""
    pytest.importorskip("pygame")
    from snake_env._views import Views
    from snake_env.picture import Picture
    from snake_env.viewer.film import _state

    start = Start(position=(Robot().length, 0.0), heading=np.pi, posture="straight")
    still = {"robot": Robot(links=3), "gait": STILL, "start": start, "duration": 1e-3, "sample": 1e-3}
    found = simulate(model="spatial", scene=scene, **still)
    layers = ("obstacles", "links")
    return Views(Picture(layers=layers, **picture)).image(0, _state(found, 0), scene).astype(int)


def test_pictures_shade_the_ground_by_its_height():
    """From above; the strip below shows where the ground begins to rise ahead of the robot."""
    step = plane(lambda x, y: 0.2 * (x > 0.45), size=1.0)
    options = {"camera": "fixed", "centre": (0.0, 0.0)}
    level, uneven = (shown(Scene(obstacles=obstacles), **options) for obstacles in ([], [step]))
    scale = 800 / 2.8
    near, far, beside = (400 + round(scale * x) for x in (0.3, 0.7, 1.2))
    assert np.abs(uneven - level)[60, near].max() < 3
    assert (level - uneven)[60, far].min() > 20
    ground = {x: (uneven[480:, x] == uneven[-1, 5]).all(axis=1).sum() for x in (near, far, beside)}
    assert ground[near] == ground[beside] == 22
    assert ground[far] == pytest.approx(22 + 0.2 * scale, abs=3)


def test_the_strip_follows_a_robot_up():
    """On the upper side of a pole 2 m above the ground the robot is as large as on the ground."""
    pole = Cylinder(start=(-3.0, 0.0, 2.0), end=(3.0, 0.0, 2.0), radius=0.1)
    above, below = (shown(Scene(obstacles=one)) for one in ([pole], []))

    def width(image):
        return np.ptp(np.flatnonzero((image[480:, :, 1] - image[480:, :, 0] > 30).any(axis=0)))

    assert width(below) > 60
    assert width(above) == pytest.approx(width(below), abs=2)


@pytest.mark.parametrize("slope", [0.1, 0.35])
def test_a_robot_starts_on_raised_ground_and_not_inside_it(slope):
    heights = np.tan(slope) * 0.1 * np.arange(61)[:, np.newaxis] * np.ones(61)
    scene = Scene(obstacles=[HeightField(height=heights, spacing=0.1, origin=(-3.0, -3.0))])
    trajectory = simulate(model="spatial", scene=scene, duration=0.01, sample=0.01)
    assert trajectory.max_penetration < 1e-3
