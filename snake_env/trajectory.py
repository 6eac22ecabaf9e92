"""What a scripted run returns."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import trajectory_file
from snake_env._extras import extras
from snake_env.config import Robot, Scene
from snake_env.errors import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Samples of a run of n links at T times; row 0 is t = 0. All arrays are C-contiguous float64.

    Attributes:
        time: (T,) [s].
        position: (T, n, 2) CGs of the links [m]; (T, n, 3) in the spatial model.
        angle: (T, n) absolute link angles [rad]; in the spatial model the yaw of each centre line, in (-pi, pi].
        joint_angle: (T, n - 1) [rad]; (T, n - 1, 2) in the spatial model, yaw and pitch. Pitch lowers the links behind
            its joint, other than that of a :class:`snake_env.Start`. (T, a) where the robot has ``axes`` of its own, as
            ``axes`` lists them. The same holds of ``joint_torque``, ``joint_rate`` and powers.
        joint_torque: (T, n - 1) actuator torques of the last step [N m]. Planar: tau_C of (T 3.51), which acts on the
            link before the joint. Minimal model: tau of (T 7.8), which drives the joint angle up. Spatial model:
            (T, n - 1, 2), tau_C of (T 4.89), yaw and pitch. Of a motor without what its rotor and gear take.
        contact_force: (T, n, 2) obstacle force on each link, mean over the sample interval (T 7.6) [N]. (T, n, 3) in
            the spatial model, with the normal force and friction of top faces.
        self_contact_force: (T, n, 2) force of the robot's other links on each link, likewise [N]; (T, n, 3) in the
            spatial model. None without self-contact.
        residual: (T,) worst certified residual since the last sample: violation of balance, joints and laws, as a
            velocity [m/s].
        iterations: (T,) solver iterations since the last sample.
        unconverged: (T,) solves since the last sample that ended before their tolerance.
        fallbacks: (T,) solves since the last sample that Newton's method left to the fallback.
        energy: (T,) kinetic and potential energy [J]. The latter is zero with every CG at the height of the origin, as
            in the plane on level ground.
        max_joint_gap: largest distance between the two ends that meet in a joint, at any step [m].
        max_penetration: deepest overlap of a link and an obstacle, in the spatial model also the ground, with
            self-contact also another link, at any step [m].
        passive_velocity: (T, 3) w of (T 6.41), velocity of O_2 in the first link's frame and yaw rate [m/s, rad/s];
            the minimal model only.
        quaternion: (T, n, 4) orientations of the links, w first, from their own frame to the inertial one (T 4.1); the
            spatial model only.
        obstacle_position: (T, k, 2) of the k obstacles of the scene that can be pushed, in its order [m]; None where
            all are fixed. ``energy`` has theirs, ``max_penetration`` their overlaps.
        obstacle_angle: (T, k) by which they have turned about the vertical [rad].
        obstacle_height: (T, k) of the centres of spheres above the plane, 0 of all else [m]; None without spheres.
        scene: obstacles and ground of the run.
        robot: of the run.

    Where ``record`` of :func:`snake_env.simulate` names them, otherwise None. Forces and power are means over the
    sample interval, zero in row 0 but for constant normal forces. A link touches the ground in c contacts: 1 in the
    planar model, under its CG; 2 in the others, in front and behind.

        velocity: (T, n, 2) of the links' CGs [m/s]; (T, n, 3) in the spatial model ("velocity").
        angular_velocity: (T, n) of the links [rad/s]; (T, n, 3), frame I, in the spatial model ("velocity").
        obstacle_velocity: (T, k, 2) of the obstacles that can be pushed, seen from above [m/s] ("velocity").
        joint_rate: (T, n - 1) [rad/s]; (T, n - 1, 2) in the spatial model, yaw and pitch ("velocity").
        ground_friction: (T, n, c, 2) friction of the ground on each link, x and y of the inertial frame [N] ("ground").
            It includes viscous friction, not the moment of rolling friction. While planar links stick, their forces are
            one of many solutions; their sum is unique.
        ground_normal: (T, n, c) normal force of the ground, zero at a contact on a top face [N] ("ground").
        obstacle_force: (T, m, 2|3) force of each of the m obstacles of the scene on the robot, at sides, edges and top
            faces [N] ("obstacles").
        pair_force: (T, n, n, 2) force of each other link on each link, ``[:, i, j]`` on link i [N]. (T, n, n, 3) in the
            spatial model ("self_contacts").
        actuator_power: (T, n - 1) power of each actuator [W]; (T, n - 1, 2) in the spatial model ("power").
        friction_power: (T,) power of all friction, that of rolling, obstacles and gears included, never positive [W]
            ("power").
        motor_power: (T, n - 1) mechanical power of each motor, mean since the last sample [W]; (T, n - 1, 2) in the
            spatial model. Of robots with a ``motor``.
        electrical_power: what each motor draws, heat included, never negative [W]; alike.
    """

    time: Array
    position: Array
    angle: Array
    joint_angle: Array
    joint_torque: Array
    contact_force: Array
    residual: Array
    iterations: Array
    unconverged: Array
    fallbacks: Array
    energy: Array
    max_joint_gap: float
    max_penetration: float
    scene: Scene
    robot: Robot
    self_contact_force: Array | None = None
    passive_velocity: Array | None = None
    quaternion: Array | None = None
    obstacle_position: Array | None = None
    obstacle_angle: Array | None = None
    obstacle_height: Array | None = None
    obstacle_velocity: Array | None = None
    velocity: Array | None = None
    angular_velocity: Array | None = None
    joint_rate: Array | None = None
    ground_friction: Array | None = None
    ground_normal: Array | None = None
    obstacle_force: Array | None = None
    pair_force: Array | None = None
    actuator_power: Array | None = None
    friction_power: Array | None = None
    motor_power: Array | None = None
    electrical_power: Array | None = None

    @property
    def axes(self) -> list[tuple[int, Any]]:
        """(joint, axis) of each joint angle, see :attr:`snake_env.Robot.joint_axes`; in the plane all are yaw."""
        in_plane = self.quaternion is None
        return [pair for pair in self.robot.joint_axes if not in_plane or pair[1] == "yaw"]

    @property
    def misses(self) -> Array:
        """Deprecated: ``unconverged``."""
        warnings.warn("misses is called unconverged now", DeprecationWarning, stacklevel=2)
        return self.unconverged

    def view(self, host: str = "127.0.0.1", port: int = 8080) -> Any:
        """Plays the run in the browser; needs the extra ``view``.

        Args:
            host: interface that serves the page; by default only this machine sees it.
            port: of the page; the next free one if it is taken.

        Returns:
            The page: ``.url``, ``.wait()`` until the process is interrupted, ``.stop()``.
        """
        frames = import_module("snake_env.viewer.frames").Frames.of_trajectory(self)
        return import_module("snake_env.viewer.player").Player(frames, host, port)

    def to_dataframe(self) -> Any:
        """The samples as a table of pandas, one column for each number; needs the extra ``data``.

        Columns are named ``position_3_x``, ``joint_angle_1``, links and joints numbered from 1; ``attrs`` holds robot
        and scene.
        """
        with extras():
            import pandas
        arrays, metadata = trajectory_file.parts(self)
        found = pandas.DataFrame(trajectory_file.columns(arrays))
        found.attrs.update(metadata)
        return found

    def save(self, path: str | Path) -> Path:
        """Writes the run as the ending of the name says.

        * ``.npz``, ``.csv``, ``.parquet`` (extra ``data``): the samples, which :func:`snake_env.load_trajectory` reads.
          A ``.csv`` has the columns of :meth:`to_dataframe`, and a ``.json`` beside it robot and scene.
        * ``.html`` (extra ``view``): a page that needs no server. ``.mp4`` (extra ``video``): a film.

        Returns:
            What was written: a film is a gif where no ffmpeg is found.

        Raises:
            ConfigError: another ending.
        """
        path = Path(path)
        if path.suffix in trajectory_file.KINDS:
            trajectory_file.write(self, path)
            return path
        if path.suffix == ".html":
            frames = import_module("snake_env.viewer.frames").Frames.of_trajectory(self)
            return Path(import_module("snake_env.viewer.export").page(frames, path))
        if path.suffix == ".mp4":
            return Path(import_module("snake_env.viewer.film").film(self, path))
        raise ConfigError("path", str(path), f"a name that ends in .html, .mp4, {', '.join(trajectory_file.KINDS)}")

    def _repr_html_(self) -> str | None:
        """In a notebook a player that needs no server; without the extra ``view`` only the text."""
        try:
            export = import_module("snake_env.viewer.export")
        except ImportError:
            return None
        frames = import_module("snake_env.viewer.frames").Frames.of_trajectory(self)
        return str(export.inline(frames))

    def __repr__(self) -> str:
        samples, links = self.angle.shape
        return f"Trajectory({samples} samples of {links} links, {self.time[0]:g} to {self.time[-1]:g} s)"


def load_trajectory(path: str | Path) -> Trajectory:
    """A run that :meth:`Trajectory.save` has written as ``.npz``, ``.csv`` or ``.parquet``; reading runs no code.

    Raises:
        ConfigError: the file is of another kind or not whole.
    """
    fields = trajectory_file.read(Path(path))
    try:
        return Trajectory(**fields)
    except TypeError as error:
        raise ConfigError("path", str(path), f"a file that Trajectory.save has written ({error})") from None
