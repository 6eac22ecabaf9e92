"""What the page says about its tables."""

from __future__ import annotations

from benchmarks.curves import LOST, TRUST
from benchmarks.targets import AHEAD, AHEAD_IN_SPACE

PRECISION = f"""## Error against run time

One robot follows the gait (T 7.3) for five seconds, three in the jam. The error is the distance of link 6 from the
converged solution, which the bench computes itself with two fine runs; their distance bounds what the reference is
worth, and errors below {TRUST:g} times it are shown there. Speed is simulated seconds per CPU second of one thread, a
median of repetitions taken in turn: of one robot alone, and of 64 robots in eight lanes, staggered over five seconds so
that no lane does what its neighbour does. A curve is made of the points that no other setting of the same method beats
in both; runs that end more than {1e3 * LOST:g} mm off are left out. The aim against each peer is {AHEAD:g}x, in
space {AHEAD_IN_SPACE:g}x. Tables
compare at equal error, interpolated between logarithms."""

GROWTH = """A step is one of the default method, of one robot in a fleet of 64. *Solves* are eliminations of the chain;
a step in which a peg contact closes anywhere along the body is retaken in small ones, so longer bodies among pegs
retake more of them. A peg scan is one look of the environment's peg sensor."""

BATCH = """Control period 50 ms; robots start in the middle of their episodes, and episodes that end are started anew
within the time measured."""

PEER_BATCH = "The same robot and course in `mujoco.batch`, control period 50 ms, steps of 10 ms, nothing but physics:"

SKIP = """## What a feature costs

A feature that *cannot act* leaves the motion as it is without it, so its cost is what a scene pays for something it
does not need (aim: at most 2 %). One that *acts* also changes the motion and the number of solves. Median of ratios of
pairs timed in turn. Contact forces and works are always kept, there is no switch to compare; rendering costs nothing
until a picture is asked for."""

CERTIFICATE = """## Certificates

Percentiles 50 / 90 / 99 / 100 over steps (scenes) or control periods (environments). Residual and duality gap are the
worst of an interval's stages, judged by code that no solver uses; a miss is a stage given up before its tolerance, and
*above tolerance* counts intervals whose residual the judge finds larger than what the solver was asked for."""

INTERFACE = """## Interface

CPU time of one call of `step` around physics that does nothing."""

HOW = """## How to reproduce

    make bench                       # everything, within 20 minutes; runs/bench
    make bench BENCH=--quick         # within 2 minutes
    make bench BENCH="--parts precision,peer --scenes free,course-7.5"
    make bench BENCH=--write-docs    # everything, and this page

Ctrl-C stops cleanly and keeps what was measured. `cargo bench -p snake-core` times single kernels."""
