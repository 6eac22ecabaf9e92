"""Compare the thesis's gait with the best of a grid over (A, omega, beta), all under the same torque limit.

    python -m training.search.compare_gaits
    python -m training.search.compare_gaits --env SnakeCourse-v0 --amplitudes 30,40,50 --omegas 80,120 --betas=-60,-50

The search runs in one batch of robots, on fields meant for choosing, in rounds that drop the worse gaits; the
winner and the thesis's gait are then judged on held-out fields. Writes a heat map and JSON.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from training import seeds
from training.cli import answer, help_format, json_mapping, numbers
from training.evaluation import figures, scores
from training.evaluation.evaluate import FIELDS, gait_policy, report
from training.policies.gaits import DEGREE, GaitParameters
from training.rollout import run_episodes
from training.runs import write_json
from training.search.gait_search import AMPLITUDES, BETAS, OMEGAS, ROUNDS, Round, Search, grid, search


def parser() -> argparse.ArgumentParser:
    """The command line."""
    cli = argparse.ArgumentParser("training.search.compare_gaits", description=__doc__, formatter_class=help_format)
    cli.add_argument("--env", default="SnakeField-v0", help="environment id")
    cli.add_argument("--options", type=json_mapping, default={}, help="keywords of the environment, as JSON")
    cli.add_argument("--amplitudes", type=numbers, default=list(AMPLITUDES), help="A [deg], comma separated")
    cli.add_argument("--omegas", type=numbers, default=list(OMEGAS), help="omega [deg/s], comma separated")
    cli.add_argument(
        "--betas",
        type=numbers,
        default=list(BETAS),
        help="beta [deg], comma separated; write --betas=-50,...",
    )
    cli.add_argument("--fields", type=int, default=FIELDS, help="held-out fields for the final comparison")
    cli.add_argument("--quick", action="store_true", help="a tenth of the fields in the search")
    cli.add_argument("--num-threads", type=int, help="threads of the simulator")
    cli.add_argument("--out", type=Path, default=Path("runs/gaits"), help="folder for picture and JSON")
    return cli


def main(arguments: list[str] | None = None) -> int:
    """Runs the command."""
    return answer(parser(), compare, arguments)


def compare(args: argparse.Namespace) -> int:
    """Searches the grid and judges the winner beside the thesis's gait."""
    gaits = grid(args.amplitudes, args.omegas, args.betas)
    rounds = [Round(max(1, part.fields // 10), part.keep) for part in ROUNDS] if args.quick else ROUNDS
    result = search(gaits, args.env, rounds, args.num_threads, show=True, **args.options)
    write(result, args.out)
    print(f"best of {len(gaits)} gaits: {result.best}")
    rows, played = {}, {}
    for gait in (GaitParameters(), result.best):
        policy = gait_policy(gait, args.env, **args.options)
        name = policy.name
        played[name] = run_episodes(policy, args.env, seeds.held_out(args.fields), args.num_threads, **args.options)
        rows[name] = scores.score(played[name])
    report(rows, played, args.out, {"env": args.env, "options": args.options, "fields": args.fields})
    return 0


def write(result: Search, out: Path) -> None:
    """Writes, for a grid of more than one gait, ``heat-map.png``; then ``gaits.json``, which says that all is done."""
    out.mkdir(parents=True, exist_ok=True)
    rows = [
        {**in_degrees(gait), "progress": float(progress), "success": float(success)}
        for gait, progress, success in zip(result.gaits, result.progress, result.success, strict=True)
    ]
    figures.heat_map(result, out / "heat-map.png")
    write_json(out / "gaits.json", {"best": in_degrees(result.best), "gaits": rows})


def in_degrees(gait: GaitParameters) -> dict[str, float]:
    """The wave's parameters [deg, deg/s, deg]."""
    values = {"amplitude": gait.amplitude, "omega": gait.omega, "beta": gait.beta}
    return {name: round(value / DEGREE, 6) for name, value in values.items()}


if __name__ == "__main__":
    sys.exit(main())
