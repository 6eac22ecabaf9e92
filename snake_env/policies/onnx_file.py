"""Policies as ONNX files: exported for other programs, and played with onnxruntime.

A file takes ``observation`` (n, o), or those of one robot at a time, and gives ``action`` (n, a), float32. One that
remembers also takes ``state`` (n, s) and ``begins`` (n, 1), bool, true where the observation is the first of an
episode, and gives ``next_state`` (n, s).
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from snake_env import _documents
from snake_env._extras import extras
from snake_env._files import replace
from snake_env.policies.interface import PolicyBase, title
from snake_env.policies.memory import MemoryTraces, remembered
from snake_env.policies.network import Network
from snake_env.policies.policy_card import PolicyCard

OPSET = 17


class OnnxPolicy(PolicyBase):
    """A network in an ONNX file, such as :func:`export` writes, on one thread.

    The metadata ``config``, JSON text, may name ``env_id`` and ``env`` of its training.

    Args:
        path: the file.
        name: shown in tables; by default the title of the path.

    Raises:
        ValueError: it is none, or has other inputs or outputs.
    """

    def __init__(self, path: Path, name: str | None = None) -> None:
        with extras():
            import onnxruntime
        _documents.require_size(path)
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads, options.log_severity_level = 1, 3
        try:
            self._session = onnxruntime.InferenceSession(path.read_bytes(), options, ["CPUExecutionProvider"])
        except Exception as error:  # its exceptions have no class in common
            raise ValueError(f"{path}: {error}") from None
        config = _documents.of_json(self._session.get_modelmeta().custom_metadata_map.get("config", "{}"))
        super().__init__(PolicyCard.of(name or title(path), config, path.with_suffix(".json")))
        inputs, outputs = self._session.get_inputs(), self._session.get_outputs()
        self._inputs = {one.name: one.shape for one in inputs}
        self._output = outputs[0].name
        self._takes = inputs[0].name
        remembers = len(inputs) > 1
        if remembers and set(self._inputs) != {"observation", "state", "begins"}:
            raise ValueError(f"inputs {', '.join(self._inputs)}, expected observation, or also state and begins")
        if remembers and not {"action", "next_state"} <= {one.name for one in outputs}:
            raise ValueError(f"outputs {', '.join(one.name for one in outputs)}, expected action and next_state")
        for one in (*inputs, *outputs):
            kind = "tensor(bool)" if one.name == "begins" else "tensor(float)"
            batch = one.shape[0] if len(one.shape) == 2 else 0
            sizes = (1,) if one.name == self._takes and not remembers else ()
            if one.type != kind or (one in inputs and isinstance(batch, int) and batch not in sizes):
                raise ValueError(f"{one.name} is {one.type} of shape {one.shape}, expected {kind} of shape (n, size)")
        if remembers and not isinstance(self._inputs["state"][1], int):
            raise ValueError(f"state has the shape {self._inputs['state']}, expected a number of columns")
        self._state: NDArray[np.float32] | None = None
        self._begins = np.ones(0, np.bool_)

    def begin(self, layout: dict[str, Any], num_envs: int) -> None:
        """Prepares a memory for a batch of new episodes."""
        sees, shown = self._inputs[self._takes][-1], sum(block["size"] for block in layout["observation"])
        if isinstance(sees, int):
            self.require_inputs(shown, sees)
        self._forget(num_envs)

    def _forget(self, num_envs: int) -> None:
        self._begins = np.ones(num_envs, np.bool_)
        if "state" in self._inputs:
            self._state = np.zeros((num_envs, self._inputs["state"][-1]), np.float32)

    def reset(self, rows: NDArray[np.bool_] | None = None) -> None:
        """Forgets what it remembers of the robots in ``rows`` (n,); None: of all."""
        self._begins |= True if rows is None else rows

    def __call__(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """The actions (n, a) for observations (n, o), or (a,) for (o,)."""
        batch = np.atleast_2d(np.asarray(observation, np.float32))
        if len(self._begins) != len(batch):
            self._forget(len(batch))
        if self._state is None:
            parts = batch[:, None] if self._inputs[self._takes][0] == 1 else [batch]
            action = np.concatenate([self._session.run([self._output], {self._takes: part})[0] for part in parts])
        else:
            given = {"observation": batch, "state": self._state, "begins": self._begins[:, None]}
            action, self._state = self._session.run(["action", "next_state"], given)
        self._begins[:] = False
        found: NDArray[np.float32] = np.asarray(action, np.float32).reshape(*np.shape(observation)[:-1], -1)
        return found


def export(network: Network, path: Path) -> None:
    """Writes a network of linear layers, with its memory, as an ONNX file.

    Raises:
        MissingExtra: onnx is missing.
    """
    with extras():
        import onnx
    build: Any = onnx.helper
    constants: list[Any] = []
    nodes: list[Any] = []

    def constant(name: str, value: Any, kind: Any = np.float32) -> str:
        constants.append(onnx.numpy_helper.from_array(np.asarray(value, kind), name))
        return name

    def apply(operator: str, *inputs: str, to: str | None = None, **attributes: Any) -> str:
        to = to or f"{operator}_{len(nodes)}"
        nodes.append(build.make_node(operator, list(inputs), [to], **attributes))
        return to

    def tensor(name: str, size: int, kind: int = onnx.TensorProto.FLOAT) -> Any:
        return build.make_tensor_value_info(name, kind, ["n", size])

    def activated(seen: str) -> str:
        if network.activation == "silu":
            return apply("Mul", seen, apply("Sigmoid", seen))
        names = {"tanh": "Tanh", "relu": "Relu", "elu": "Elu", "leakyrelu": "LeakyRelu"}
        return apply(names[network.activation], seen)

    def outputs(seen: str) -> str:
        for k in range(len(network.layers)):
            seen = apply("Gemm", activated(seen) if k else seen, f"weight_{k}", f"bias_{k}")
        return seen

    for k, (weight, bias) in enumerate(network.layers):
        constant(f"weight_{k}", weight)
        constant(f"bias_{k}", bias)
    size = network.layers[0][0].shape[0]
    taken, given, seen = [], [tensor("action", network.layers[-1][0].shape[1])], "observation"
    if network.times:
        env: Any = network.make_vec(1, num_threads=1)
        places = remembered(env.unwrapped.layout)
        traces = MemoryTraces(env.unwrapped.layout, network.times, 1)
        env.close()
        size -= traces.size
        times = len(network.times)
        now = apply("Gather", seen, constant("places", np.tile(places, times), np.int64), axis=1)
        before = apply("Where", "begins", now, "state")
        moved = apply("Mul", constant("keep", np.repeat(traces.keep, len(places))), apply("Sub", before, now))
        seen = apply("Concat", seen, apply("Add", now, moved, to="next_state"), axis=1)
        taken = [tensor("state", traces.size), tensor("begins", 1, onnx.TensorProto.BOOL)]
        given.append(tensor("next_state", traces.size))
    if network.scaling is not None:
        mean, deviation, clip = network.scaling
        scaled = apply("Div", apply("Sub", seen, constant("mean", mean)), constant("deviation", deviation))
        seen = apply("Clip", scaled, constant("low", -clip[0]), constant("high", clip[0]))
    action = outputs(seen)
    if network.mirror is not None:
        ordered = apply("Gather", seen, constant("order", network.mirror.order, np.int64), axis=1)
        reflected = outputs(apply("Mul", ordered, constant("observation_signs", network.mirror.observation)))
        both = apply("Add", action, apply("Mul", reflected, constant("action_signs", network.mirror.action)))
        action = apply("Mul", both, constant("half", 0.5))
    apply("Tanh" if network.squash else "Identity", action, to="action")
    graph = build.make_graph(nodes, network.name, [tensor("observation", size), *taken], given, constants)
    model = build.make_model(graph, opset_imports=[build.make_opsetid("", OPSET)], ir_version=9)
    config = {"env": network.card.env_options} | ({"env_id": network.card.env_id} if network.card.env_id else {})
    build.set_model_props(model, {"config": json.dumps(config)})
    onnx.checker.check_model(model)
    replace(path, lambda part: part.write_bytes(model.SerializeToString()))
