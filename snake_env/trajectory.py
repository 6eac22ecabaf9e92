"""What a scripted run returns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Samples of a run of n links at T times; row 0 is t = 0. All arrays are C-contiguous float64.

    Attributes:
        time: (T,) [s].
        position: (T, n, 2) CGs of the links [m]; (T, n, 3) in the spatial model.
        angle: (T, n) absolute link angles [rad]; in the spatial model the yaw of each centre line, in (-pi, pi].
        joint_angle: (T, n - 1) [rad]; (T, n - 1, 2) in the spatial model, yaw and pitch.
        joint_torque: (T, n - 1) actuator torques of the last step [N m]: planar tau_C of (T 3.51), which acts on the
            link before the joint; minimal model tau of (T 7.8), which drives the joint angle up. Spatial model:
            (T, n - 1, 2), tau_C of (T 4.89), yaw and pitch.
        contact_force: (T, n, 2) obstacle force on each link, averaged over the sample interval (T 7.6) [N]; (T, n, 3)
            in the spatial model.
        self_contact_force: (T, n, 2) force of the robot's other links on each link, averaged over the sample interval
            [N]; None without self-contact.
        residual: (T,) worst contact-solver residual since the last sample [m/s].
        iterations: (T,) solver iterations since the last sample.
        unconverged: (T,) solves since the last sample that ended before their tolerance; also as ``misses``.
        fallbacks: (T,) solves since the last sample that Newton's method left to the fallback.
        energy: (T,) kinetic energy, in the spatial model also potential energy over the ground plane [J].
        max_joint_gap: largest distance between the two ends that meet in a joint, at any step [m].
        max_penetration: deepest overlap of a link and a peg, in the spatial model also the ground, with self-contact
            also another link, at any step [m].
        passive_velocity: (T, 3) w of (T 6.41), velocity of O_2 in the first link's frame and yaw rate [m/s, rad/s];
            the minimal model only.
        quaternion: (T, n, 4) orientations of the links, w first, from their own frame to the inertial one (T 4.1); the
            spatial model only.
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
    self_contact_force: Array | None = None
    passive_velocity: Array | None = None
    quaternion: Array | None = None

    @property
    def misses(self) -> Array:
        """The same as ``unconverged``."""
        return self.unconverged

    def __repr__(self) -> str:
        samples, links = self.angle.shape
        return f"Trajectory({samples} samples of {links} links, {self.time[0]:g} to {self.time[-1]:g} s)"
