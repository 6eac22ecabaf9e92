"""From a log of a snake robot back to its model: friction, gains, motors, backlash and delay, with standard errors.

    python examples/identify.py --synthetic
    python examples/identify.py --log log.npz --plot residuals.png
    python examples/identify.py --log log.npz --guess kp=300 --hold "stall torque=inf" "no-load speed=inf"

A log is an .npz of arrays: ``time`` (T,) from zero [s]; ``reference`` (T, joints), sent to the joints, and
``joint_angle`` (T, joints), measured [rad]; ``marker`` (T, m, 2), positions of m markers in any frame [m], nan where
unseen; ``marker_link`` (m,), the links that carry them, from 0; and optionally ``marker_offset`` (m, 2), their places
from the CG of these links, the first number towards the next link [m]. The robot starts at rest at its first reference,
on level open ground.

The fit minimises the squares of all errors, each over the noise of its sensor, by the Levenberg-Marquardt method. On
open ground motion is the same in every frame: each simulation is first moved onto the markers as a whole. Logs among
obstacles do not serve: contacts amplify small differences, and the errors are no smooth function of the parameters. The
same holds of joints that rattle in their backlash, as they do in this model without kd; the fit warns of it. A log
shows friction backward only where links slide backward, and a motor only where it limits the torque. Links are those of
Aiko; ``simulated`` is the place for those of another robot.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import snake_env
from snake_env import PD, Integrator, JointTrajectory, Motor, Robot, Scene

Array = NDArray[np.float64]
Log = Mapping[str, Array]


class Parameter(NamedTuple):
    """First guess, the size below which a value counts as zero, a true value for synthetic logs, and the unit."""

    guess: float
    floor: float
    truth: float
    unit: str = ""


PARAMETERS = {
    "friction forward": Parameter(0.3, 0.05, 0.15),
    "friction backward": Parameter(0.3, 0.05, 0.25),
    "friction across": Parameter(0.3, 0.05, 0.35),
    "kp": Parameter(100.0, 10.0, 40.0, "N m/rad"),
    "kd": Parameter(1.0, 0.5, 1.5, "N m s/rad"),
    "backlash": Parameter(1.0, 0.5, 3.0, "deg"),
    "delay": Parameter(0.02, 0.02, 0.08, "s"),
    "stall torque": Parameter(1.0, 0.1, 1.5, "N m"),
    "no-load speed": Parameter(10.0, 1.0, 6.0, "rad/s"),
}
NAMES = list(PARAMETERS)
GUESS, FLOOR, TRUTH = (np.array([p[k] for p in PARAMETERS.values()]) for k in range(3))
POSE = 3
"""Unknowns of the pose in which the markers see the robot."""
STEP = 0.03
"""Half a finite difference, as a share of the value."""
INTEGRATION = 2e-3
"""Integration step [s]. With equal steps the errors change smoothly with the parameters; with parts of free length
(``precision="fine"``) their differences by kp and kd are rough."""
LEAST_DAMPING = 1e-3
"""Holds what cannot be told at its guess: with less weight than a measurement of it that errs by 30 times its value."""
LARGEST_CHANGE = 0.5
"""Of a parameter in an iteration, as a share of its value: far from the minimum linear steps lead astray. One that
cannot be told, and would run away, does not hold the others back."""
MOST_ITERATIONS = 60
NORMAL_95 = 1.96


class Noise(NamedTuple):
    """Standard deviations of markers [m] and encoders [rad]."""

    marker: float = 2e-3
    encoder: float = np.radians(0.5)


class Fit(NamedTuple):
    """Estimates (k,) of named parameters, covariance (k, k), the errors left (T, joints + 2 m) over their noise."""

    names: Sequence[str]
    values: Array
    covariance: Array
    residuals: Array
    warnings: list[str]

    @property
    def standard_errors(self) -> Array:
        """Of the estimates (k,)."""
        return np.sqrt(np.diag(self.covariance))


def simulated(values: Array, log: Log) -> tuple[Array, Array]:
    """Joint angles (T, joints) and markers (T, m), as complex numbers, of a robot with these parameters."""
    forward, backward, across, kp, kd, backlash, delay, stall, speed = (float(value) for value in values)
    time, links = log["time"], log["reference"].shape[1] + 1
    sample = float(np.median(np.diff(time)))
    run = snake_env.simulate(
        robot=Robot(links=links, backlash=np.radians(backlash), motor=Motor(max(stall, 1e-3), max(speed, 1e-3))),
        scene=Scene(friction=(forward, across), friction_backward=backward),
        gait=JointTrajectory(time + delay, log["reference"]),
        controller=PD(kp, kd),
        duration=time[-1] + sample,
        sample=sample,
        integrator=Integrator(step=INTEGRATION),
    )
    link = log["marker_link"].astype(int)
    offset = log.get("marker_offset", np.zeros((len(link), 2))) @ (1, 1j)
    marker = run.position[:, link] @ (1, 1j) + np.exp(1j * run.angle[:, link]) * offset

    def at_log_times(table: Array) -> Array:
        return np.stack([np.interp(time, run.time, column) for column in table.T], axis=1)

    return at_log_times(run.joint_angle), at_log_times(marker)


def residuals(values: Array, log: Log, noise: Noise) -> Array:
    """Simulated minus measured joint angles and markers (T, joints + 2 m), over their noise; zero where unseen."""
    angle, marker = simulated(values, log)
    measured = log["marker"] @ (1, 1j)
    seen = np.isfinite(measured)
    centre, target = marker[seen].mean(), measured[seen].mean()
    turn = np.sum((marker[seen] - centre).conj() * (measured[seen] - target))
    error = (marker - centre) * np.exp(1j * np.angle(turn)) + target - measured
    found = [(angle - log["joint_angle"]) / noise.encoder, error.real / noise.marker, error.imag / noise.marker]
    return np.nan_to_num(np.concatenate(found, axis=1), nan=0.0)


def fit(log: Log, noise: Noise, guess: Array = GUESS, names: Sequence[str] = NAMES) -> Fit:
    """Levenberg-Marquardt over central differences; the simulations of all columns run in threads.

    Parameters that are not among ``names`` keep their guess.
    """
    chosen = [NAMES.index(name) for name in names]

    def errors(part: Array) -> Array:
        values = guess.copy()
        values[chosen] = part
        return residuals(values, log, noise)

    values, floor, damping = guess[chosen], FLOOR[chosen], 1.0
    found = errors(values)
    with ThreadPoolExecutor() as pool:
        for _ in range(MOST_ITERATIONS):
            scale = np.maximum(values, floor)
            low, high = (np.maximum(values + half * np.diag(scale), 0.0) for half in (-STEP, STEP))
            runs = np.array(list(pool.map(lambda changed: errors(changed).ravel(), [*low, *high])))
            below, above = np.split(runs, 2)
            columns = (above - below).T * scale / np.diag(high - low)
            bend = np.linalg.norm(above + below - 2.0 * found.ravel(), axis=1)
            is_rough = (np.diag(low) > 0.0) & (bend > 0.5 * np.linalg.norm(above - below, axis=1))
            slope = columns.T @ found.ravel()
            free = (values > 0.0) | (slope < 0.0)  # the others would become negative
            normal = (columns.T @ columns)[np.ix_(free, free)]
            accepted, step = False, np.zeros(len(values))
            while not accepted and damping < 1e9:
                step[free] = -np.linalg.solve(normal + damping * np.eye(len(normal)), slope[free])
                step = np.clip(step, -LARGEST_CHANGE, LARGEST_CHANGE)
                trial = np.maximum(values + scale * step, 0.0)
                changed = errors(trial)
                accepted = bool(np.sum(changed**2) < np.sum(found**2))
                damping = max(damping / 10.0, LEAST_DAMPING) if accepted else damping * 5.0
            if accepted:
                values, found = trial, changed
            if not accepted or np.linalg.norm(columns @ step) < 0.01:  # of a standard error
                return judged(names, values, scale, columns, found, is_rough)
    raise RuntimeError(f"no minimum within {MOST_ITERATIONS} iterations: the errors are no smooth function")


def judged(
    names: Sequence[str], values: Array, scale: Array, columns: Array, found: Array, is_rough: NDArray[np.bool_]
) -> Fit:
    """Covariance by the scaled Jacobian, for independent errors of at least the noise, and where it fails."""
    variance = np.sum(found**2) / max(np.count_nonzero(found) - len(values) - POSE, 1)
    _, singular, directions = np.linalg.svd(columns, full_matrices=False)
    spread = np.sqrt(max(variance, 1.0)) / np.maximum(singular, 1e-9)
    messages = []
    for width, direction in zip(NORMAL_95 * spread, directions, strict=True):
        if width > 1.0:
            parts = [f"{name} ({part:+.2f})" for name, part in zip(names, direction, strict=True) if abs(part) > 0.2]
            messages.append(f"cannot be told within its own size: {', '.join(parts)}")
    correlation = np.sum(found[1:] * found[:-1]) / max(np.sum(found**2), 1e-300)
    if variance > 1.2 or (correlation > 0.2 and variance > 0.01):
        messages.append(
            f"errors are {np.sqrt(variance):.2f} times the noise and correlate by {correlation:.2f} between samples: "
            "wrong model, wrong noise or a local minimum; standard errors do not hold"
        )
    if is_rough.any():
        rough = ", ".join(np.array(names)[is_rough])
        messages.append(f"errors hardly depend on {rough}, or not smoothly: standard errors do not hold")
    factors = scale[:, None] * directions.T * spread
    return Fit(names, values, factors @ factors.T, found, messages)


def synthetic(
    truth: Array, noise: Noise, seed: int, links: int = 7, duration: float = 6.0, amplitude: float = 40.0
) -> Log:
    """A log of lateral undulation from a straight start, forward and backward at many rates, with three markers."""
    time = np.arange(0.0, duration + 1e-9, 0.05)
    phase = np.radians(500) * np.sin(2.0 * np.pi * time / duration)
    wave = np.sin(phase[:, None] + np.radians(-50) * np.arange(links - 1))
    reference = np.radians(amplitude) * np.minimum(time, 1.0)[:, None] * wave
    log: Log = {"time": time, "reference": reference, "marker_link": np.array([0, links // 2, links - 1])}
    angle, marker = simulated(truth, log)
    rng = np.random.default_rng(seed)
    clean = {"joint_angle": angle, "marker": np.stack([marker.real, marker.imag], axis=-1)}
    deviation = {"joint_angle": noise.encoder, "marker": noise.marker}
    noisy = {name: part + deviation[name] * rng.standard_normal(part.shape) for name, part in clean.items()}
    return {**log, **noisy}


def table(found: Fit, joints: int, noise: Noise, truth: Array | None) -> str:
    """What a fit has found."""
    errors = found.standard_errors
    correlations = np.abs(found.covariance / np.outer(errors, errors)) - np.eye(len(errors))
    lines = [f"{'':18}{'estimate':>9}{'std error':>11}{'truth':>9}  {'unit':11}correlates most with"]
    for k, name in enumerate(found.names):
        true = "" if truth is None else f"{truth[NAMES.index(name)]:.4g}"
        other = np.argmax(correlations[k])
        numbers = f"{found.values[k]:9.3f}{errors[k]:11.2g}{true:>9}"
        unit = PARAMETERS[name].unit
        lines.append(f"{name:18}{numbers}  {unit:11}{found.names[other]}, {correlations[k, other]:.2f}")
    encoder, marker = (np.sqrt(np.mean(part[part != 0.0] ** 2)) for part in np.split(found.residuals, [joints], axis=1))
    angle, distance = np.degrees(encoder * noise.encoder), 1e3 * marker * noise.marker
    lines.append(f"errors left, RMS: joint angles {angle:.2f} deg, markers {distance:.2f} mm")
    return "\n".join(lines + [f"warning: {text}" for text in found.warnings])


def plot(found: Fit, time: Array, joints: int, path: str) -> None:
    """Draws all errors over their noise; those of a model that is the robot's have no pattern."""
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(2, sharex=True)
    parts = np.split(found.residuals, [joints], axis=1)
    for axis, part, label in zip(axes, parts, ("joint angles", "markers"), strict=True):
        axis.plot(time, part, ".", markersize=3)
        axis.set_ylabel(f"{label}: error / noise")
    axes[1].set_xlabel("time [s]")
    figure.savefig(path)


def assignment(text: str) -> tuple[str, float]:
    """A parameter and its value, from the command line."""
    name, _, value = text.partition("=")
    if name not in PARAMETERS:
        raise argparse.ArgumentTypeError(f"{name!r}, expected NAME=VALUE with one of " + ", ".join(NAMES))
    return name, float(value)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--log", help="an .npz file")
    source.add_argument("--synthetic", action="store_true", help="a simulated log with noise")
    parser.add_argument("--repeats", type=int, default=1, help="fits so many synthetic logs, and counts the intervals")
    parser.add_argument("--seed", type=int, default=0, help="of the first synthetic log")
    parser.add_argument("--guess", nargs="+", type=assignment, default=[], help="NAME=VALUE: where the fit begins")
    parser.add_argument("--hold", nargs="+", type=assignment, default=[], help="NAME=VALUE: known, not fitted")
    parser.add_argument("--marker-noise", type=float, default=2.0, help="standard deviation [mm]")
    parser.add_argument("--encoder-noise", type=float, default=0.5, help="standard deviation [deg]")
    parser.add_argument("--plot", help="draws the errors that are left into this file; needs matplotlib")
    args = parser.parse_args()
    noise = Noise(1e-3 * args.marker_noise, np.radians(args.encoder_noise))
    if args.log:
        with np.load(args.log) as file:
            logs: list[Log] = [dict(file)]
    else:
        logs = [synthetic(TRUTH, noise, args.seed + k) for k in range(args.repeats)]
    guess = np.array(list({**dict(zip(NAMES, GUESS, strict=True)), **dict(args.guess + args.hold)}.values()))
    names = [name for name in NAMES if name not in dict(args.hold)]
    fits = [fit(log, noise, guess, names) for log in logs]
    joints = logs[0]["reference"].shape[1]
    print(table(fits[0], joints, noise, None if args.log else TRUTH))
    if len(fits) > 1:
        truth = TRUTH[[NAMES.index(name) for name in names]]
        inside = sum(np.abs(found.values - truth) < NORMAL_95 * found.standard_errors for found in fits)
        counts = ", ".join(f"{name} {count}" for name, count in zip(names, inside, strict=True))
        print(f"95 % intervals with the truth, of {len(fits)}: {counts}")
    if args.plot:
        plot(fits[0], logs[0]["time"], joints, args.plot)


if __name__ == "__main__":
    main()
