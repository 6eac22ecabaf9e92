"""What a step has returned is never written again while anyone can see it."""

from __future__ import annotations

import gc
import weakref

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from snake_env import SnakeVectorEnv, _buffers
from snake_env._buffers import POOL_SIZE

KEEP = {
    "nothing": lambda result: None,
    "observation": lambda result: result[0],
    "row of the observation": lambda result: result[0][1],
    "slice of a slice": lambda result: result[0][:, 2:][:, :5],
    "memoryview": lambda result: memoryview(result[0]),
    "reward": lambda result: result[1],
    "truncated": lambda result: result[3],
    "infos": lambda result: result[4],
    "a signal": lambda result: result[4]["time"],
    "part of a signal": lambda result: result[4]["distance"][1:],
    "a flag": lambda result: result[4]["jam"],
    "a count": lambda result: result[4]["iterations"][:2],
    "a mask": lambda result: result[4]["_time"],
    "everything": lambda result: result,
}


def frozen(kept):
    """A copy that shares nothing."""
    if isinstance(kept, dict):
        return {name: frozen(item) for name, item in kept.items()}
    if isinstance(kept, tuple):
        return [frozen(item) for item in kept]
    return None if kept is None else np.array(kept)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(KEEP)), st.integers(1, 6)), min_size=6, max_size=25))
def test_whatever_a_caller_keeps_stays_as_it_was(plan):
    env = SnakeVectorEnv(3, task="free", max_episode_steps=4)
    env.reset(seed=0)
    held = []
    for step, (what, steps_held) in enumerate(plan):
        kept = KEEP[what](env.step(np.full((3, 4), np.sin(step))))
        held.append((step + steps_held, kept, frozen(kept)))
        kept = None
        for _, now, before in held:
            np.testing.assert_equal(frozen(now), before)
        held = [entry for entry in held if entry[0] > step]


def test_arrays_are_used_again_once_dropped():
    env = SnakeVectorEnv(3, task="free")
    env.reset(seed=0)
    addresses = set()
    for _ in range(50):
        result = env.step(np.zeros((3, 4)))
        addresses.add(result[0].__array_interface__["data"][0])
    assert len(addresses) <= POOL_SIZE


def test_changes_by_the_caller_do_not_come_back():
    env = SnakeVectorEnv(3, task="free")
    env.reset(seed=0)
    for _ in range(10):
        result = env.step(np.zeros((3, 4)))
        assert all(result[4][name].all() for name in result[4] if name.startswith("_"))
        assert "mine" not in result[4]
        result[4]["mine"] = 1
        result[4]["_time"][:] = False
        result[1][:] = 1e9
        assert (result[0] < 1e6).all()
        result[0][:] = 1e9


def test_without_reference_counts_every_step_has_arrays_of_its_own(monkeypatch):
    monkeypatch.setattr(_buffers, "counts_references", lambda: False)
    env = SnakeVectorEnv(3, task="free")
    env.reset(seed=0)
    results = [env.step(np.zeros((3, 4)))[0] for _ in range(5)]
    assert len({result.__array_interface__["data"][0] for result in results}) == 5


def test_free_threading_and_other_interpreters_do_not_count_references(monkeypatch):
    assert _buffers.counts_references()
    monkeypatch.setattr(_buffers.sys, "_is_gil_enabled", lambda: False, raising=False)
    assert not _buffers.counts_references()


def test_a_deleted_environment_is_freed_at_once():
    """Its core holds threads: it must not wait for the cyclic garbage collector."""
    env = SnakeVectorEnv(3, task="free")
    env.reset(seed=0)
    env.step(np.zeros((3, 4)))
    robots = weakref.ref(env._robots)
    env.close()
    gc.disable()
    try:
        del env
        assert robots() is None
    finally:
        gc.enable()
