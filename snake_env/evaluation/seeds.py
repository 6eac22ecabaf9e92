"""Seeds of the fields for training, validation and test.

Robot ``i`` of a batch with seed ``s`` draws its fields from stream ``s + i``. The ranges below are disjoint, so
that nothing is tested on a field on which it was trained or selected.
"""

from __future__ import annotations

from snake_env._checks import integer

TRAINING = range(2**31)
"""Seeds of training runs."""
SELECTION = range(2**32, 2**32 + 2**31)
"""Seeds of the validation fields, on which gaits and hyper-parameters are selected."""
HELD_OUT = range(2**33, 2**33 + 2**31)
"""Seeds of the test fields, on which results are reported."""


def held_out(count: int, first: int = 0) -> list[int]:
    """``count`` test seeds, one per field, from number ``first`` on.

    Raises:
        ConfigError: ``first`` is not the number of a test seed, or ``count`` not that of those from it on.
    """
    first = integer("seed", first, 0, len(HELD_OUT) - 1)
    return list(HELD_OUT[first : first + integer("count", count, 1, len(HELD_OUT) - first)])


def require_held_out(fields: list[int]) -> None:
    """Raises unless all seeds are test seeds.

    Raises:
        ValueError: names the first seed that is not held out.
    """
    for seed in fields:
        if seed not in HELD_OUT:
            raise ValueError(f"seed = {seed}: expected a held-out one, in [{HELD_OUT.start}, {HELD_OUT.stop})")


def selection(count: int, skip: int = 0) -> list[int]:
    """``count`` validation seeds, after the first ``skip``.

    Raises:
        ConfigError: ``count`` is not an integer from one to the number of validation seeds that are left.
    """
    skip = integer("skip", skip, 0, len(SELECTION) - 1)
    return list(SELECTION[skip : skip + integer("count", count, 1, len(SELECTION) - skip)])


def training(seed: int, steps_taken: int, num_envs: int) -> int:
    """First seed of a batch for training; each resumption has other fields.

    Args:
        seed: seed of the run, >= 0.
        steps_taken: environment steps before the batch was made.
        num_envs: robots of the batch; each takes one seed.
    """
    return (seed * 1_000_003 + steps_taken * num_envs) % (len(TRAINING) - num_envs)
