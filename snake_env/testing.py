"""A checker for vector environments, for this package's and for others'.

Gymnasium's own ``check_env`` takes single environments only.
"""

from __future__ import annotations

import copy
import itertools
import pickle
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.envs.registration import EnvSpec
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from gymnasium.vector.utils import batch_space

MakeVector = Callable[..., VectorEnv]
MakeSingle = Callable[[], gym.Env]

NEXT_STEP, DISABLED = AutoresetMode.NEXT_STEP.value, AutoresetMode.DISABLED.value


def check_vector_env(
    make: MakeVector, single: MakeSingle | None = None, *, num_envs: int = 3, steps: int = 30, seed: int = 7
) -> None:
    """Checks a vector environment against Gymnasium's rules.

    Args:
        make: called as ``make(num_envs=n, autoreset_mode=mode)`` with a mode such as "NextStep" (an enum would keep
            the spec from being written as JSON); its episodes should end within ``steps`` steps.
        single: makes the single environment; with it, all three autoreset modes are compared, exactly, with
            ``SyncVectorEnv``.
        num_envs: size of the batch, >= 2.
        steps: steps of each run.
        seed: seed of the environments and of the actions.

    Raises:
        AssertionError: says which rule is broken, and where.
    """
    check_attributes(make, num_envs)
    check_results(make, num_envs, steps, seed)
    check_fresh_arrays(make, num_envs, seed)
    check_seeds(make, num_envs, seed)
    check_reset_mask(make, num_envs, seed)
    check_copies(make, num_envs, seed)
    check_close(make, num_envs)
    if single is not None:
        for mode in AutoresetMode:
            check_same_as_sync(make, single, mode, num_envs, steps, seed)


def check_attributes(make: MakeVector, num_envs: int) -> None:
    """Spaces, metadata and spec."""
    env = make(num_envs=num_envs, autoreset_mode=NEXT_STEP)
    _require(isinstance(env, VectorEnv), f"{type(env).__name__} is not a gymnasium.vector.VectorEnv")
    _require(env.num_envs == num_envs, f"num_envs is {env.num_envs}, not {num_envs}")
    for kind in ("observation", "action"):
        one, batch = getattr(env, f"single_{kind}_space"), getattr(env, f"{kind}_space")
        _require(
            batch == batch_space(one, num_envs),
            f"{kind}_space is not the batch of single_{kind}_space: {batch}",
        )
    mode = env.metadata.get("autoreset_mode")
    _require(isinstance(mode, AutoresetMode), f"metadata['autoreset_mode'] must be an AutoresetMode, is {mode!r}")
    _require(type(env).metadata is not env.metadata, "metadata must be copied for each instance")
    for key in ("render_modes", "render_fps"):
        _require(key in env.metadata, f"metadata lacks {key!r}")
    if env.unwrapped.spec is not None:
        spec = env.unwrapped.spec
        _require(EnvSpec.from_json(spec.to_json()) == spec, "spec does not survive to_json and from_json")
    env.close()


def check_results(make: MakeVector, num_envs: int, steps: int, seed: int) -> None:
    """Types and shapes of what reset and step return, and the rules of infos."""
    env = make(num_envs=num_envs, autoreset_mode=NEXT_STEP)
    observation, infos = env.reset(seed=seed)
    _require(observation in env.observation_space, "the observation of reset is not in observation_space")
    _check_infos(infos, num_envs, "reset")
    reset_keys = set(infos)
    for t, actions in enumerate(_actions(env, steps, seed)):
        observation, reward, terminated, truncated, infos = env.step(actions)
        where = f"step {t}"
        _require(observation in env.observation_space, f"the observation of {where} is not in observation_space")
        for name, array, dtype in (
            ("rewards", reward, np.float64),
            ("terminations", terminated, np.bool_),
            ("truncations", truncated, np.bool_),
        ):
            good = isinstance(array, np.ndarray) and array.shape == (num_envs,) and array.dtype == dtype
            _require(good, f"{name} of {where} must be an array ({num_envs},) of {dtype.__name__}, is {array!r}")
        _check_infos(infos, num_envs, where)
        _require(set(infos) == reset_keys, f"infos of {where} and of reset differ in {set(infos) ^ reset_keys}")
    env.close()


def _check_infos(infos: dict[str, Any], num_envs: int, where: str) -> None:
    """Every key has a mask, every array one row per environment, every masked row is zero or None."""
    for key, values in infos.items():
        if key.startswith("_"):
            continue
        mask: Any = infos.get(f"_{key}")
        good = isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (num_envs,)
        _require(good, f"infos[{key!r}] of {where} lacks the boolean mask infos['_{key}'] of shape ({num_envs},)")
        if isinstance(values, dict):
            _check_infos(values, num_envs, f"{where}, infos[{key!r}]")
            continue
        good = isinstance(values, np.ndarray) and len(values) == num_envs
        _require(good, f"infos[{key!r}] of {where} must be an array of {num_envs} rows, is {values!r}")
        for row in values[~mask]:
            blank = row is None or not np.any(row)
            _require(blank, f"infos[{key!r}] of {where} has {row!r} in a row that its mask excludes")


def check_fresh_arrays(make: MakeVector, num_envs: int, seed: int) -> None:
    """What one call returns is not overwritten by the next."""
    env = make(num_envs=num_envs, autoreset_mode=NEXT_STEP)
    results = [env.reset(seed=seed), *(env.step(actions) for actions in _actions(env, 3, seed))]
    for t, (one, other) in enumerate(itertools.pairwise(results)):
        for a in _arrays(one):
            for b in _arrays(other):
                _require(not np.shares_memory(a, b), f"calls {t} and {t + 1} return arrays that share memory")
    env.close()


def check_seeds(make: MakeVector, num_envs: int, seed: int) -> None:
    """A seed fixes the run; robot i depends only on its own seed, not on the size of the batch."""
    runs = []
    forms: list[Any] = [seed, np.int64(seed), [seed + i for i in range(num_envs)]]
    for seeds in forms:
        env = make(num_envs=num_envs, autoreset_mode=NEXT_STEP)
        try:
            runs.append((env.reset(seed=seeds), env.reset()))
        except TypeError as error:
            raise AssertionError(f"reset does not take the seed {seeds!r}: {error}") from error
        env.close()
    for run in runs[1:]:
        assert_identical(run, runs[0], "resets with the seed as int, as numpy integer and as list")
    last = num_envs - 1
    alone = make(num_envs=1, autoreset_mode=NEXT_STEP)
    for seeds, (observation, _) in zip((seed + last, None), runs[0], strict=True):
        row, _ = alone.reset(seed=seeds)
        assert_identical(
            _part(row, 0), _part(observation, last), f"environment {last} of {num_envs} and the same seed alone"
        )
    alone.close()


def check_reset_mask(make: MakeVector, num_envs: int, seed: int) -> None:
    """Partial resets start the chosen rows anew, keep the others, and leave the caller's options unchanged."""
    env = make(num_envs=num_envs, autoreset_mode=DISABLED)
    env.reset(seed=seed)
    observation = None
    for actions in _actions(env, 3, seed):
        observation = env.step(actions)[0]
    mask = np.arange(num_envs) == 0
    options = {"reset_mask": mask}
    after, infos = env.reset(seed=seed, options=options)
    _require(list(options) == ["reset_mask"], "reset removed the mask from the caller's options")
    others = slice(1, None)
    assert_identical(_part(after, others), _part(observation, others), "rows outside reset_mask")
    fresh = make(num_envs=1, autoreset_mode=DISABLED)
    assert_identical(
        _part(after, 0), _part(fresh.reset(seed=seed)[0], 0), "the row inside reset_mask and a fresh environment"
    )
    _check_infos(infos, num_envs, "a partial reset")
    for bad in (mask.astype(np.int8), mask[:-1], np.zeros(num_envs, np.bool_), mask.tolist()):
        try:
            env.reset(options={"reset_mask": bad})
        except (TypeError, ValueError):
            continue
        raise AssertionError(f"reset accepts the reset_mask {bad!r}")
    env.close()
    fresh.close()


def check_copies(make: MakeVector, num_envs: int, seed: int) -> None:
    """Pickled and deep copies taken in mid-episode continue exactly as the original does."""
    env = make(num_envs=num_envs, autoreset_mode=NEXT_STEP)
    env.reset(seed=seed)
    before, after = np.split(_actions(env, 6, seed), 2)
    for actions in before:
        env.step(actions)
    copies = {"a pickled copy": pickle.loads(pickle.dumps(env)), "a deep copy": copy.deepcopy(env)}
    expected = [env.step(actions) for actions in after] + [env.reset()]
    for name, other in copies.items():
        results = [other.step(actions) for actions in after] + [other.reset()]
        assert_identical(results, expected, f"{name} and the original")
        other.close()
    env.close()


def check_close(make: MakeVector, num_envs: int) -> None:
    """Closing twice does no harm; a closed environment says so."""
    env = make(num_envs=num_envs, autoreset_mode=NEXT_STEP)
    env.reset(seed=0)
    env.close()
    env.close()
    try:
        env.reset()
    except Exception:
        return
    raise AssertionError("reset works after close")


def check_same_as_sync(
    make: MakeVector, single: MakeSingle, mode: AutoresetMode, num_envs: int, steps: int, seed: int
) -> None:
    """Every array and info equals that of ``SyncVectorEnv`` over single environments, bit for bit."""
    native = make(num_envs=num_envs, autoreset_mode=mode.value)
    sync = SyncVectorEnv([single] * num_envs, autoreset_mode=mode)
    assert_identical(native.reset(seed=seed), sync.reset(seed=seed), f"{mode.name}, reset")
    for t, actions in enumerate(_actions(native, steps, seed)):
        ours, theirs = native.step(actions), sync.step(actions)
        assert_identical(ours, theirs, f"{mode.name}, step {t}")
        finished = ours[2] | ours[3]
        if mode is AutoresetMode.DISABLED and finished.any():
            ours_reset = native.reset(options={"reset_mask": finished})
            assert_identical(ours_reset, sync.reset(options={"reset_mask": finished}), f"{mode.name}, reset at {t}")
    native.close()
    sync.close()


def assert_identical(a: Any, b: Any, what: str) -> None:
    """Nested tuples, lists, dicts and arrays are equal in structure, type and every bit.

    Raises:
        AssertionError: says where they first differ.
    """
    _require(type(a) is type(b), f"{what}: {type(a).__name__} against {type(b).__name__}")
    if isinstance(a, dict):
        _require(a.keys() == b.keys(), f"{what}: keys differ in {set(a) ^ set(b)}")
        for key in a:
            assert_identical(a[key], b[key], f"{what}[{key!r}]")
    elif isinstance(a, tuple | list):
        _require(len(a) == len(b), f"{what}: {len(a)} against {len(b)} items")
        for k, (one, other) in enumerate(zip(a, b, strict=True)):
            assert_identical(one, other, f"{what}[{k}]")
    elif isinstance(a, np.ndarray):
        _require(
            a.shape == b.shape and a.dtype == b.dtype,
            f"{what}: {a.dtype} {a.shape} against {b.dtype} {b.shape}",
        )
        if a.dtype == object:
            assert_identical(list(a), list(b), what)
            return
        different = np.argwhere((a != b) & ~((a != a) & (b != b)))
        if len(different):
            raise AssertionError(f"{what}: differs first at {different[0].tolist()}: {a!r} against {b!r}")
    else:
        _require(a == b, f"{what}: {a!r} against {b!r}")


def _actions(env: VectorEnv, steps: int, seed: int) -> np.ndarray:
    """Random actions (steps, num_envs, a)."""
    env.action_space.seed(seed)
    return np.array([env.action_space.sample() for _ in range(steps)])


def _part(observation: Any, rows: int | slice) -> Any:
    """Rows of an observation, an array or a mapping of arrays."""
    if isinstance(observation, dict):
        return {name: _part(values, rows) for name, values in observation.items()}
    return observation[rows]


def _arrays(result: Any) -> list[np.ndarray]:
    """All arrays of numbers in what a call returned."""
    if isinstance(result, np.ndarray):
        return [] if result.dtype == object else [result]
    if isinstance(result, dict):
        result = tuple(result.values())
    if isinstance(result, tuple):
        return [array for item in result for array in _arrays(item)]
    return []


def _require(ok: bool, complaint: str) -> None:
    if not ok:
        raise AssertionError(complaint)


def remove_physics(env: Any) -> None:
    """Makes every later ``step`` of a batch take no time and change nothing, to measure what surrounds the physics.

    Args:
        env: A :class:`snake_env.SnakeVectorEnv`.
    """
    env._robots.native = _NoPhysics()


class _NoPhysics:
    """Stands in for the native batch."""

    is_interrupted = False

    def step(self, *arguments: Any) -> int:
        """Ends no episode."""
        return 0
