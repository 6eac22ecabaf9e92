"""Which random fields are for training, for choosing and for judging.

Robot ``i`` of a batch with seed ``s`` draws its fields from stream ``s + i``. The ranges below never meet, so
that nothing is judged on a field it was trained or chosen on.
"""

from __future__ import annotations

TRAINING = range(2**31)
"""Seeds of training runs."""
SELECTION = range(2**32, 2**32 + 2**31)
"""Seeds on which gaits and hyper-parameters are chosen."""
HELD_OUT = range(2**33, 2**33 + 2**31)
"""Seeds on which results are reported."""


def held_out(count: int) -> list[int]:
    """The first ``count`` held-out seeds, one a field; always the same."""
    return list(HELD_OUT[:count])


def require_held_out(fields: list[int]) -> None:
    """Raises unless nothing can have been trained or chosen on any of these seeds.

    Raises:
        ValueError: names the first seed that is not held out.
    """
    for seed in fields:
        if seed not in HELD_OUT or seed in TRAINING or seed in SELECTION:
            raise ValueError(f"seed = {seed}: expected a held-out one, in [{HELD_OUT.start}, {HELD_OUT.stop})")


def selection(count: int, skip: int = 0) -> list[int]:
    """``count`` seeds for choosing, after the first ``skip``."""
    return list(SELECTION[skip : skip + count])


def training(seed: int, steps_taken: int, num_envs: int) -> int:
    """First seed of a batch that goes on with training: other fields after each resumption.

    Args:
        seed: seed of the run, >= 0.
        steps_taken: environment steps before the batch was made.
        num_envs: robots of the batch; each takes one seed.
    """
    return (seed * 1_000_003 + steps_taken * num_envs) % (len(TRAINING) - num_envs)
