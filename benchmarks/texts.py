"""The texts of the page."""

from __future__ import annotations

from benchmarks.curves import TRUST
from benchmarks.results import COMPARED

EQUAL_ERROR = """## Cost at equal error under random actions

CPU milliseconds of one thread for a simulated second of one robot. *Error*: half the robots have their worst link at
most so far off after one control period of 50 ms. Robots start in mid-run of a fine run of ours, under a torque limit
of 10 N m. A new action is drawn in every period. *Work* is the bias of the positive work of the actuators against that
run. Ours is the whole step of the environment, MuJoCo's only its physics. Both are interpolated between the best of
their settings, which the benchmark searches. MuJoCo's planar model has its ground friction made exact
(`benchmarks/mujoco_model.py`). *Not reached*: at no setting, in steps down to 0.25 ms, in 3D to 0.1 ms."""

EQUAL_ERROR_SHORT = """**Cost at equal error under random actions**: MuJoCo's over ours. Then CPU milliseconds per
simulated second and the bias of the actuators' work, ours / MuJoCo. The error is that of the worst link after one
control period. Ours is the whole step of the environment, MuJoCo's only its physics."""

ELSEWHERE = """Costs by error: [speed and accuracy](accuracy.md#beside-mujoco). Steps of our default settings beside
MuJoCo's: [README](../README.md#speed)."""

STEPS = """### Environment steps with their errors

Environment steps per CPU second of one thread in the same runs, ours at the default settings, MuJoCo's physics at the
best of its settings in steps of 10 ms. The rates belong to different errors; the table above compares at equal ones."""

STEPS_SHORT = """**Environment steps** of 50 ms per CPU second of one thread, at our default settings; beside them
MuJoCo's physics in steps of 10 ms. *Work* is the bias of the actuators' work. Rates at different errors do not
compare."""

SPEEDS = f"""## Environment steps per second

Per CPU second of one thread in the fastest of several repetitions, {COMPARED} robots, control period 50 ms. *gait* is
the constant zero action, *random* draws a new action of the mode `gait` in every step, *random joints* one of the mode
`joints`."""

WIDTHS = """The same in registers of every width of this processor (`SNAKE_ENV_LANES`): 1 is scalar code, 4 are AVX2 or
NEON, 8 AVX-512 registers."""

PRECISION = f"""## Error against run time

One robot follows the gait (T 7.3), or sidewinds (T 7.5), for five seconds, three in the jam. The error is the largest
distance of any link from the converged run at any sample. That run is computed twice with fine steps; errors below
{TRUST:g} times their distance are shown as that bound. Speed is simulated seconds per CPU second of one thread: of
one robot, and of 64 robots in registers. A curve consists of the points that no other setting of the same method
beats in both error and speed. `benchmarks.json` holds every point with its settings."""

DEFAULT = """Errors at the default step. Between pegs they grow while a link is about to slip past one and decay behind
it."""

GROWTH = """A step is one of the default method, of one robot in a batch of 64. *Solves* are eliminations of the chain.
A step in which a peg contact closes anywhere along the body is divided, so longer bodies among pegs divide more steps.
A peg scan is one evaluation of the environment's peg sensor."""

PUBLISHED = """The page that each run leaves in `runs/bench` has more tables: speed at equal error, references, growth,
widths of registers, costs of features, certificates, the interface, targets."""

BATCH = """Environment steps per wall-clock second with one thread / with two threads in the fastest of five
repetitions, by number of robots. The control period is 50 ms; robots start in the middle of their episodes, and resets
are included. *Busy*: least share of time in which both threads work, 64 robots and more."""

SKIP = """## What a feature costs

A feature that *cannot act* leaves the motion unchanged, so its cost is what a scene pays for something it does not
need (target: at most 2 %). One that *acts* also changes the motion and the number of solves. Medians of ratios of
interleaved pairs. Contact forces and energies are always computed; rendering costs nothing until a picture is
requested."""

PRESSED = """Links pressed on each other: planar robots rock by 0.05 rad about coils that are more and more closed.
Pairs are means over robots and time; a solve includes its share of certificates and of the search for contacts."""

CERTIFICATE = """## Certificates

Percentiles 50 / 90 / 99 / 100 over steps (scenes) or control periods (environments). Residual and duality gap are the
worst of an interval's stages, computed by code that no solver uses. *Unconverged* counts stages that stopped before
their tolerance, *above tolerance* intervals whose verified residual exceeds the tolerance of the solver."""

INTERFACE = """## Interface

CPU time of one call of `step` without physics."""

LEARNING = """Wall time per environment step of Stable-Baselines3's PPO with the settings of the README's lines, in
the first updates from random weights. The simulator takes up to eight cores, the learner one."""

HOW = """## How to reproduce

    make bench                       # everything, about 25 minutes; runs/bench
    make bench BENCH=--quick         # within 2 minutes
    make bench BENCH="--parts precision peer --scenes free course-7.5"
    make bench BENCH=--write-docs    # everything, and this page
    make bench BENCH="--parts equal-error --write-docs"    # this part anew, in the blocks of other pages too

Ctrl-C stops cleanly and keeps the results so far. `cargo bench -p snake-core` times single kernels."""
