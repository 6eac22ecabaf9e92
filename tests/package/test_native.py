"""No panic can be reached from Python: whatever goes in, an ordinary exception comes out."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snake_env import ConfigError, SnakeVectorEnv, _native
from snake_env._task import Task

TASK = Task({"task": "free", "robot": {"links": 3}}, None)
N, A, O = 3, 4, TASK.observation_space.shape[0]  # noqa: E741


def new_buffers(n=N):
    env = SnakeVectorEnv(n, task="free", robot={"links": 3})
    return env._robots._buffers.new().arrays


def new_batch():
    return _native.Batch(TASK.config, N, 1)


SHAPES = st.one_of(
    st.just((N, A)),
    st.lists(st.integers(0, 5), min_size=0, max_size=3).map(tuple),
    st.just((N, A + 1)),
    st.just((0, A)),
)
DTYPES = st.sampled_from([np.float32, np.float64, np.int32, np.bool_, np.complex64])


@settings(max_examples=150, deadline=None)
@given(
    shape=SHAPES,
    dtype=DTYPES,
    value=st.sampled_from([0.0, 1.0, np.nan, np.inf, -np.inf]),
    fortran=st.booleans(),
)
def test_any_array_as_actions(shape, dtype, value, fortran):
    with np.errstate(invalid="ignore"):
        actions = np.full(shape, value, order="F" if fortran else "C").astype(dtype)
    buffers = new_buffers()
    try:
        new_batch().step(actions, np.ones(N, np.bool_), buffers)
    except (TypeError, ValueError):
        return
    assert shape == (N, A)
    assert dtype == np.float32
    assert np.isfinite(value)


@pytest.mark.parametrize("index", range(7))
@pytest.mark.parametrize(
    "change",
    [
        lambda a: a[:, :-1] if a.ndim > 1 else a[:-1],
        lambda a: a[..., None],
        lambda a: a.astype(np.float16),
        np.asfortranarray,
        lambda a: None,
    ],
)
def test_any_array_as_a_step_buffer(index, change):
    buffers = list(new_buffers())
    buffers[index] = change(buffers[index])
    for call in (
        lambda batch: batch.step(np.zeros((N, A), np.float32), np.ones(N, np.bool_), tuple(buffers)),
        lambda batch: batch.reset(np.ones(N, np.bool_), None, tuple(buffers)),
    ):
        if isinstance(buffers[index], np.ndarray) and change is np.asfortranarray and buffers[index].flags.c_contiguous:
            continue
        with pytest.raises((TypeError, ValueError)):
            call(new_batch())


def test_one_array_twice_in_the_step_buffers_is_refused():
    buffers = new_buffers()
    with pytest.raises(TypeError, match=r"StepBuffers\.truncated"):
        new_batch().reset(np.ones(N, np.bool_), None, buffers._replace(truncated=buffers.terminated))


@pytest.mark.parametrize("row", [N, 10**9, -1])
def test_rows_that_do_not_exist(row):
    batch = new_batch()
    for call in (
        batch.get_state,
        batch.scene,
        lambda row: batch.state([row]),
        lambda row: batch.set_states([row], [b""]),
    ):
        with pytest.raises((ValueError, OverflowError)):
            call(row)


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_any_bytes_as_a_state(data):
    batch = new_batch()
    state = bytearray(batch.get_state(0))
    kind = data.draw(st.sampled_from(["cut", "flip", "random"]))
    if kind == "cut":
        state = state[: data.draw(st.integers(0, len(state) - 1))]
    elif kind == "flip":
        state[data.draw(st.integers(0, len(state) - 1))] ^= data.draw(st.integers(1, 255))
    else:
        state = bytearray(data.draw(st.binary(max_size=300)))
    # A panic would be an InternalError.
    with contextlib.suppress(ConfigError):
        batch.set_states([0], [bytes(state)])
        batch.step(np.zeros((N, A), np.float32), np.ones(N, np.bool_), new_buffers())


@settings(max_examples=100, deadline=None)
@given(
    st.text(max_size=60)
    | st.sampled_from([[], 3, None, {"task": 3}, {"robot": []}, {"friction": [[]]}, {3: 4}, {"robot": {"links": b""}}])
)
def test_any_object_as_a_configuration(config):
    calls = (
        _native.layout,
        _native.simulate,
        lambda c: _native.Batch(c, 1, 1),
        lambda c: _native.check("robot", c),
        lambda c: _native.check("controller", c),
    )
    for call in calls:
        with pytest.raises(ConfigError):
            call(config)


class Broken:
    """Fails whenever it is looked at."""

    def __getattr__(self, name):
        raise RuntimeError(name)

    def __repr__(self):
        raise RuntimeError("repr")


def test_objects_that_fail_and_lists_that_contain_themselves_are_refused():
    endless = []
    endless.append(endless)
    nested = {"links": 3}
    nested["robot"] = nested
    for value in (Broken(), endless, nested):
        for config in (value, {"robot": value}, {"randomization": {"noise": value}}, {"robot": {"mass": value}}):
            with pytest.raises(ConfigError):
                _native.layout(config)


def test_seeds_and_masks_of_the_wrong_length():
    with pytest.raises(ConfigError, match="seeds = "):
        new_batch().reset(np.ones(N, np.bool_), [1], new_buffers())
    with pytest.raises(ConfigError, match="mask = "):
        new_batch().reset(np.ones(N + 1, np.bool_), None, new_buffers())
    with pytest.raises(ConfigError, match="active = "):
        new_batch().step(np.zeros((N, A), np.float32), np.ones(0, np.bool_), new_buffers())


def test_an_empty_batch_is_refused():
    with pytest.raises(ConfigError, match="num_envs = 0"):
        _native.Batch(TASK.config, 0, 1)


def test_an_unknown_section_is_named():
    with pytest.raises(ConfigError, match="section = sky"):
        _native.check("sky", {})
    with pytest.raises(ConfigError, match="section = sky"):
        _native.defaults("sky")
