"""The texts of the page."""

from __future__ import annotations

from benchmarks.curves import LOST, TRUST
from benchmarks.targets import COMPARED

SPEEDS = f"""## Environment steps per second

Per CPU second of one thread in the fastest of several repetitions, {COMPARED} robots, control period 50 ms. *gait* is
the constant zero action, *random* draws a new action of the mode `gait` in every step, *random joints* one of the mode
`joints`. MuJoCo's batch computes only the physics of the same robot in steps of 10 ms under the same joint set-points,
without a torque limit, with which it is unstable at this step; the last two columns are the ratios."""

WIDTHS = """The same in registers of every width of this processor (`SNAKE_ENV_LANES`): 1 is scalar code, 4 are AVX2 or
NEON, 8 AVX-512 registers."""

TARGETS = (
    "What bounds the missed ones, and what was tried, is in `docs/notes/method-planar.md` and `method-spatial.md`."
)
PRECISION = f"""## Error against run time

One robot follows the gait (T 7.3) for five seconds, three in the jam. The error is the largest distance of any link
from the converged run at any sample, every 0.1 s, in 3D every 0.2 s. The benchmark computes that run twice with fine
steps; their distance bounds the accuracy of the reference, and errors below {TRUST:g} times it are shown as that
bound. Speed is simulated seconds per CPU second of one thread, median of interleaved repetitions: of one robot, and of
64 robots in registers, with starting times staggered over five seconds. A curve consists of the points that no other
setting of the same method beats in both error and speed; runs with errors above {1e3 * LOST:g} mm are left out. The
tables compare at equal error, interpolated between logarithms. Beyond the right end of a curve its fastest point
counts. `benchmarks.json` holds every point with its settings."""

DEFAULT = """Errors at the default step. Between pegs they grow while a link is about to slip past one and decay behind
it: the robot does the same somewhat earlier or later."""

GROWTH = """A step is one of the default method, of one robot in a batch of 64. *Solves* are eliminations of the chain.
A step in which a peg contact closes anywhere along the body is divided, so longer bodies among pegs divide more steps.
A peg scan is one evaluation of the environment's peg sensor."""

BATCH = """Environment steps per wall-clock second with one thread / with two threads in the fastest of five
repetitions, by number of robots. The control period is 50 ms; robots start in the middle of their episodes, and resets
are included. *Busy*: least share of time in which both threads work, 64 robots and more."""

PEER_BATCH = "`mujoco.batch` on the same robots and scenes (physics only), control period 50 ms, steps of 10 ms:"

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

HOW = """## How to reproduce

    make bench                       # everything, within 20 minutes; runs/bench
    make bench BENCH=--quick         # within 2 minutes
    make bench BENCH="--parts precision peer --scenes free course-7.5"
    make bench BENCH=--write-docs    # everything, and this page

Ctrl-C stops cleanly and keeps the results so far. `cargo bench -p snake-core` times single kernels."""
