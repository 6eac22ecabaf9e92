"""Walls, boxes and polygons as obstacles: laws of contact, and scenes as files."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import snake_env
from snake_env import ConfigError, Gait, Robot, Scene, Start, Stribeck
from snake_env.obstacles import Box, Circle, Polygon, Segment

STILL = Gait(amplitude=0.0)
RADIUS, HALF = 0.0525, 0.0393
MODELS = ["planar", "spatial"]
NAN, INF = float("nan"), float("inf")


def sliding(obstacles, model="planar", friction=(0.0, 0.0), slope=(0.5, 0.0), heading=0.0, links=2, **changes):
    """A straight robot without ground friction that gravity pulls to -x."""
    scene = Scene(obstacles=obstacles, friction=friction, rolling_friction=0.0, slope=slope)
    start = Start(position=(0.0, 0.0), heading=heading, posture="straight")
    robot = Robot(links=links)
    return snake_env.simulate(
        model, robot=robot, scene=scene, gait=STILL, start=start, **({"duration": 3.0, "sample": 0.05} | changes)
    )


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    "wall",
    [
        Segment((-0.4, -1.0), (-0.4, 1.0)),
        Box((0.2, 2.0), -0.5, 0.0),
        Box((2.0, 0.2), -0.5, 0.0, angle=math.pi / 2),
        Polygon([(-0.4, -1.0), (-0.4, 1.0), (-0.9, 0.0)]),
        Polygon([(-0.9, 0.0), (-0.4, 1.0), (-0.4, -1.0)]),
    ],
)
def test_a_robot_that_slides_against_a_wall_rests_on_it(model, wall):
    run = sliding([wall], model)
    assert run.position[-1, 0, 0] == pytest.approx(-0.4 + RADIUS + HALF, abs=2e-5)
    weight = Robot(links=2).gravity * 2 * 7.5 / 11 * math.sin(0.5)
    assert run.contact_force[-1, 0, 0] == pytest.approx(weight, rel=1e-3)
    assert run.max_penetration < 1e-3


@pytest.mark.parametrize("model", MODELS)
def test_a_robot_that_lies_along_a_wall_is_carried_by_all_its_links(model):
    run = sliding([Segment((-0.3, -2.0), (-0.3, 2.0))], model, heading=math.pi / 2, links=4)
    np.testing.assert_allclose(run.position[-1, :, 0], -0.3 + RADIUS, atol=2e-5)
    force = run.contact_force[-1, :, 0]
    assert force.sum() == pytest.approx(4 * 7.5 / 11 * 9.81 * math.sin(0.5), rel=1e-3)
    assert (force > 0.0).all()


@pytest.mark.parametrize("model", MODELS)
def test_a_corner_presses_on_the_flank_of_a_link(model):
    """A chain across the way of a corner that meets the straight side of its first link."""
    corner = Polygon([(-0.2, 0.01), (-0.6, 0.4), (-0.6, -0.3)])
    run = sliding([corner], model, heading=math.pi / 2, duration=0.6)
    pressed = np.flatnonzero(np.abs(run.contact_force[:, 0]).max(axis=1) > 1.0)[0]
    angle, to_corner = run.angle[pressed, 0], np.array([-0.2, 0.01]) - run.position[pressed, 0, :2]
    along, across = to_corner @ [math.cos(angle), math.sin(angle)], to_corner @ [-math.sin(angle), math.cos(angle)]
    assert abs(along) < HALF
    assert abs(across) == pytest.approx(RADIUS, abs=1e-4)
    assert run.max_penetration < 1e-3


@pytest.mark.parametrize("model", MODELS)
def test_a_wall_of_a_fine_polygon_is_a_circle(model):
    angles = np.linspace(0.0, 2 * math.pi, 360, endpoint=False)
    circle = (0.15, -0.45, 0.02)
    fine = Polygon([(-0.45 + 0.15 * math.cos(a), 0.02 + 0.15 * math.sin(a)) for a in angles])
    runs = [sliding([one], model, friction=(0.05, 0.05), duration=0.5, links=5) for one in (circle, fine)]
    apart = np.linalg.norm(runs[0].position - runs[1].position, axis=-1)
    assert apart.max() < 3e-3
    assert np.abs(runs[0].contact_force).max() > 1.0


@pytest.mark.parametrize("model", MODELS)
def test_a_gait_among_walls_does_not_enter_them(model):
    """Undulation between two walls too close for its waves, with a corner on the way."""
    obstacles = [
        Segment((-2.5, -0.16), (2.0, -0.16)),
        Segment((-2.5, 0.16), (2.0, 0.16)),
        Box((0.1, 0.1), 0.8, 0.16, angle=0.6),
    ]
    start = Start(position=(0.0, 0.0), heading=math.pi, posture="straight")
    gait = Gait(soft_start=True)
    controller = snake_env.PD(torque_limit=10.0)
    scene = Scene(obstacles=obstacles, friction=(0.2, 0.2))
    run = snake_env.simulate(model, scene=scene, gait=gait, start=start, controller=controller, duration=10.0)
    assert run.max_penetration < 1e-3
    assert np.abs(run.contact_force).max() > 1.0
    assert run.unconverged.sum() == 0


@pytest.mark.parametrize("speed_up", [2.0, 20.0])
def test_no_link_passes_through_a_wall_however_fast_it_comes(speed_up):
    scene = Scene(obstacles=[Segment((-1.0, -3.0), (-1.0, 3.0))], friction=(0.0, 0.0), slope=(1.5, 0.0))
    robot = Robot(links=3, gravity=9.81 * speed_up)
    start = Start(posture="straight", heading=1.3)
    run = snake_env.simulate(robot=robot, scene=scene, gait=STILL, start=start, duration=2.0)
    assert (run.position[..., 0] > -1.0 + RADIUS - 0.01).all()


def test_obstacles_keep_their_order_whatever_their_shapes():
    wall = Segment((-0.4, -1.0), (-0.4, 1.0))
    far = (0.1, 5.0, 5.0)
    runs = [sliding(obstacles) for obstacles in ([wall], [far, wall], [wall, far], [Circle(*far), wall, far])]
    for run in runs[1:]:
        np.testing.assert_array_equal(run.position, runs[0].position)


def test_a_circle_and_its_triple_are_the_same():
    runs = [sliding([one], links=5) for one in ((0.1, -0.4, 0.03), Circle(0.1, -0.4, 0.03))]
    np.testing.assert_array_equal(runs[0].position, runs[1].position)


def test_what_lacks_walls_refuses_them_by_name():
    scene = Scene(obstacles=[(0.1, 3.0, 3.0), Segment((0.0, 3.0), (1.0, 3.0))])
    message = r"scene\.obstacles = 1 segments, boxes or polygons: expected circles only.*implicit"
    with pytest.raises(ConfigError, match=message):
        snake_env.simulate(scene=scene, integrator=snake_env.Integrator(method="thesis"))
    with pytest.raises(ConfigError, match=r"scene\.obstacles = 2 obstacles: expected no obstacles"):
        snake_env.simulate("minimal", scene=scene)


BAD = [
    (Circle, {"radius": 0.0, "x": 0.0, "y": 0.0}, "radius"),
    (Circle, {"radius": 0.1, "x": NAN, "y": 0.0}, "x"),
    (Circle, {"radius": 0.1, "x": 0.0, "y": 0.0, "friction": -0.1}, "friction"),
    (Circle, {"radius": 0.1, "x": 0.0, "y": 0.0, "mass": 0.0}, "mass"),
    (Segment, {"start": (0.0, 0.0), "end": (0.0, 0.0)}, "end"),
    (Segment, {"start": (0.0, INF), "end": (0.0, 0.0)}, "start"),
    (Segment, {"start": (0.0,), "end": (0.0, 0.0)}, "start"),
    (Box, {"size": (0.0, 1.0), "x": 0.0, "y": 0.0}, "size"),
    (Box, {"size": (1.0, 1.0), "x": 0.0, "y": 0.0, "angle": "x"}, "angle"),
    (Polygon, {"vertices": [(0.0, 0.0), (1.0, 0.0)]}, "vertices"),
    (Polygon, {"vertices": [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0)]}, "vertices"),
    (Polygon, {"vertices": [(0.0, 0.0), (2.0, 0.0), (0.5, 0.5), (0.0, 2.0)]}, "vertices"),
    (Polygon, {"vertices": [(0, 0), (2, 2), (2, 0), (0, 2)]}, "vertices"),
    (
        Polygon,
        {"vertices": [(math.cos(4 * k * math.pi / 5), math.sin(4 * k * math.pi / 5)) for k in range(5)]},
        "vertices",
    ),
]


@pytest.mark.parametrize(("kind", "fields", "wrong"), BAD)
def test_every_field_of_an_obstacle_is_checked_where_it_is_made(kind, fields, wrong):
    with pytest.raises(ConfigError) as caught:
        kind(**fields)
    assert caught.value.field.startswith(f"obstacle.{wrong}")
    assert caught.value.expected


@pytest.mark.parametrize(
    ("obstacle", "field"),
    [
        ({"shape": "circle", "radius": 0.1}, "scene.obstacles[1]"),
        ({"shape": "circle", "radius": 0.1, "x": 0.0, "y": 0.0, "start": (0.0, 0.0)}, "scene.obstacles[1]"),
        ({"shape": "ring"}, "scene.obstacles[1].shape"),
        ({"shape": "circle", "radius": -1.0, "x": 0.0, "y": 0.0}, "scene.obstacles[1].radius"),
        ({"shape": "circle", "radius": "big", "x": 0.0, "y": 0.0}, "scene.obstacles[1].radius"),
        ((0.1, 0.2), "scene.obstacles[1]"),
        ((0.1, 0.2, 0.3, 0.4), "scene.obstacles[1]"),
    ],
)
def test_an_obstacle_of_a_scene_that_is_not_admissible_is_named(obstacle, field):
    with pytest.raises(ConfigError) as caught:
        Scene(obstacles=[(0.1, 1.0, 1.0), obstacle])
    assert caught.value.field.startswith(field)


SCENE = Scene(
    obstacles=[
        (0.125, 0.6, 0.3),
        Circle(0.1, 1.0, 1.0),
        Segment((0.0, -0.5), (2.0, -0.5)),
        Box((0.3, 0.1), 1.0, 0.4, angle=0.5),
        Polygon([(0.0, 0.5), (0.2, 0.5), (0.1, 0.8)]),
    ],
    friction=(0.2, 0.5),
    slope=(0.1, 0.2),
    stribeck=Stribeck(drop=0.2),
)


@pytest.mark.parametrize("suffix", ["json", "yaml"])
def test_a_scene_is_read_as_it_was_written(tmp_path, suffix):
    if suffix == "yaml":
        pytest.importorskip("yaml")
    path = tmp_path / f"scene.{suffix}"
    SCENE.save(path)
    again = Scene.load(path)
    again.save(tmp_path / f"again.{suffix}")
    assert path.read_text() == (tmp_path / f"again.{suffix}").read_text()
    assert list(again.obstacles[2:4]) == list(SCENE.obstacles[2:4])
    assert (again.friction, again.slope, again.stribeck) == (SCENE.friction, SCENE.slope, SCENE.stribeck)
    assert Scene.load(path).moved(3, 1.0, 0.0).obstacles[2] == Segment((1.0, -0.5), (3.0, -0.5))


def test_a_course_is_still_one_when_read(tmp_path):
    course = Scene.preset("table-7.3")
    course.save(tmp_path / "course.json")
    assert Scene.load(tmp_path / "course.json") == course


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"friktion": 0.2}, "scene.friktion"),
        ({"friction": [0.2]}, "scene.friction"),
        ({"slope": [2.0, 0.0]}, "scene.slope[0]"),
        ({"obstacles": 3}, "scene.obstacles"),
        ({"obstacles": [[0.1, 0.2, 0.3], [0.1, 0.2]]}, "scene.obstacles[1]"),
        ({"obstacles": [{"shape": "ring"}]}, "scene.obstacles[0].shape"),
        ({"obstacles": [{"shape": "circle", "r": 1}]}, "scene.obstacles[0].r"),
        ({"obstacles": [{"shape": "circle", "radius": 1.0}]}, "scene.obstacles[0]"),
        ({"obstacles": [{"shape": "box", "size": [1, 0], "x": 0, "y": 0}]}, "scene.obstacles[0].size[1]"),
        ({"stribeck": {"drop": 2.0}}, "scene.stribeck.drop"),
        ({"stribeck": {"dropp": 0.1}}, "scene.stribeck.dropp"),
        ({"format": "other"}, "path"),
    ],
)
def test_a_file_that_is_not_admissible_is_refused_by_field(tmp_path, change, field):
    path = tmp_path / "scene.json"
    SCENE.save(path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(ConfigError) as caught:
        Scene.load(path)
    assert caught.value.field == field
    assert caught.value.expected


def test_a_file_that_is_no_scene_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="a file that can be read"):
        Scene.load(tmp_path / "none.json")
    (tmp_path / "text.json").write_text("{")
    with pytest.raises(ConfigError, match="a file in JSON"):
        Scene.load(tmp_path / "text.json")


def test_the_default_scene_is_itself_when_read(tmp_path):
    Scene().save(tmp_path / "scene.json")
    assert Scene.load(tmp_path / "scene.json") == Scene()


@pytest.mark.parametrize("fields", [None, 5, [], "scene"])
def test_fields_of_a_scene_are_a_mapping(fields):
    with pytest.raises(ConfigError, match=r"^scene = .*: expected a mapping"):
        Scene.from_fields(fields)
    assert Scene.from_fields({}) == Scene()


@pytest.mark.parametrize("j", [1.0, "a", True, None, 0, 3])
def test_an_obstacle_is_chosen_by_its_number(j):
    scene = Scene(obstacles=[(0.1, 1.0, 0.0), Circle(0.1, 2.0, 0.0)])
    for change in (scene.without, lambda number: scene.moved(number, 0.1, 0.1)):
        with pytest.raises(ConfigError, match=r"^obstacle = .*: expected an integer in \[1, 2\]"):
            change(j)


@pytest.mark.parametrize("obstacle", [(0.1, 1.0, 0.0), *SCENE.obstacles])
@pytest.mark.parametrize("wrong", ["a", None, True, math.nan])
def test_obstacles_are_moved_by_numbers(obstacle, wrong):
    scene = Scene(obstacles=[obstacle])
    with pytest.raises(ConfigError, match=r"^dx = "):
        scene.moved(1, wrong, 0.0)
    with pytest.raises(ConfigError, match=r"^dy = "):
        scene.moved(1, 0.0, wrong)


@pytest.mark.parametrize(
    ("make", "field"),
    [
        (lambda: Circle(None, 0.0, 0.0), r"obstacle\.radius"),
        (lambda: Segment(None, (0.0, 0.0)), r"obstacle\.start"),
        (lambda: Segment((0.0, 0.0), None), r"obstacle\.end"),
        (lambda: Box(None, 0.0, 0.0), r"obstacle\.size"),
        (lambda: Polygon(None), r"obstacle\.vertices"),
        (lambda: Scene(obstacles=[{"shape": "segment", "start": None, "end": ()}]), r"scene\.obstacles\[0\]\.start"),
    ],
)
def test_a_field_that_is_none_is_named(make, field):
    with pytest.raises(ConfigError, match=f"^{field} = None: expected a value"):
        make()


SQUARE = [(-0.4, -0.3), (-0.4, 0.3), (-1.0, 0.3), (-1.0, -0.3)]


def with_extra(vertices, dent=0.0, repeats=1):
    """The same outline with corners repeated, a vertex inside each edge that lies ``dent`` inside it, and closed."""
    corners = np.array(vertices)
    middle = corners.mean(axis=0)
    extra = []
    for at, after in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        on_edge = at + 0.3 * (after - at)
        inwards = (middle - on_edge) / np.linalg.norm(middle - on_edge)
        extra += [tuple(at)] * repeats + [tuple(on_edge + dent * inwards)]
    return [*extra, extra[0]]


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("vertices", [SQUARE, SQUARE[::-1]])
@pytest.mark.parametrize("dent", [0.0, 1e-13, 2e-10, -2e-10])
@pytest.mark.parametrize("repeats", [1, 3])
def test_polygons_of_maps_are_the_polygons_of_their_corners(model, vertices, dent, repeats):
    """Rings are closed, corners are repeated, vertices lie on edges within round-off."""
    options = {"duration": 0.6, "sample": 0.1, "friction": (0.05, 0.05)}
    told, clean = (sliding([Polygon(v)], model, **options) for v in (with_extra(vertices, dent, repeats), vertices))
    np.testing.assert_array_equal(told.position, clean.position)
    assert np.abs(told.contact_force).max() > 1.0


def test_an_outline_of_many_vertices_is_cleaned_soon():
    angle = np.linspace(0.0, 2.0 * math.pi, 200_001)
    Polygon([(5.0 + math.cos(a), math.sin(a)) for a in angle])
    on_a_line = [(x, 0.0) for x in np.linspace(0.0, 1.0, 50_000)]
    Polygon([*on_a_line, (0.5, 1.0)])


def test_maps_far_from_their_origin_have_the_round_off_of_their_coordinates():
    east, north = 5e5, 9e5
    Polygon([(east, north), (east + 0.1, north + 0.1 / 3), (east + 0.3, north + 0.1), (east, north + 0.4)])


@pytest.mark.parametrize(
    ("vertices", "field", "problem"),
    [
        ([(0, 0), (1, 0), (1, 1), (0.5, 0.5 + 1e-6), (0, 1)], "vertices\\[3\\]", "a dent"),
        ([(0, 0), (0, 0), (1, 0), (0.5, 1e-6), (1, 1), (0, 1)], "vertices\\[3\\]", "a dent"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "vertices\\[0\\]", "out of order"),
        (
            [(math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5)],
            "vertices",
            "goes round once",
        ),
        ([(0, 0), (1, 0), (2, 0), (1, 0)], "vertices", "enclose an area"),
        ([(0, 0), (1, 0), (0, 0)], "vertices", "enclose an area"),
        ([(0, 0), (1, 0), (1, 1e-12)], "vertices", "enclose an area"),
        ([(0, 0)] * 5, "vertices", "enclose an area"),
        ([], "vertices", "enclose an area"),
        ([(0, 0), (1, 0), (NAN, 1)], "vertices\\[2\\]\\[0\\]", "finite"),
    ],
)
def test_an_outline_that_is_none_is_refused_by_its_corner(vertices, field, problem):
    with pytest.raises(ConfigError, match=rf"^obstacle\.{field} = .*{problem}") as caught:
        Polygon([(float(x), float(y)) for x, y in vertices])
    assert len(str(caught.value)) < 300
