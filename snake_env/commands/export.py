"""Write a network as an ONNX file, which needs neither this package nor torch.

    snake-env export general general.onnx
    snake-env export model.zip model.onnx

The file takes ``observation`` (n, o) and gives ``action`` (n, a). One that remembers also takes ``state`` and
``begins``, true where an episode begins, and gives ``next_state``.
"""

from __future__ import annotations

from pathlib import Path

from snake_env._cli import parser
from snake_env.errors import ConfigError
from snake_env.policies.loading import load_policy
from snake_env.policies.network import Network
from snake_env.policies.onnx_file import export
from snake_env.policies.shipped import NAMES


def main(arguments: list[str]) -> int:
    """Runs the command."""
    cli = parser("export", __doc__)
    cli.add_argument("policy", help=f"{', '.join(NAMES)}, or the .safetensors or .zip of a network")
    cli.add_argument("out", type=Path, help="file to write, .onnx")
    cli.add_argument("--normalize", type=Path, metavar="FILE", help="of the VecNormalize of a zip")
    args = cli.parse_args(arguments)
    policy = load_policy(args.policy, normalize=args.normalize)
    if not isinstance(policy, Network):
        raise ConfigError(
            "policy", args.policy, f"one of {', '.join(NAMES)}, or the file of a network of linear layers"
        )
    if args.out.suffix != ".onnx":
        raise ConfigError("out", str(args.out), "a name that ends in .onnx")
    args.out.parent.mkdir(parents=True, exist_ok=True)
    export(policy, args.out)
    print(args.out)
    return 0
