"""What acts: gaits, scripted controllers, trained networks.

One direction of imports: ``files, memory, policy_card <- interface <- gaits, network <- scripted, sb3_zip, onnx_file <-
foreign <- loading``; ``wrappers`` and ``shipped`` import none of these.
"""

from snake_env.policies.gaits import DEGREE, ConstantAction, GaitParameters, GaitPolicy
from snake_env.policies.interface import INTERFACE, Policy, Stateless, interface, title
from snake_env.policies.loading import load_policy
from snake_env.policies.network import Network
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.shipped import NAMES

__all__ = [
    "DEGREE",
    "INTERFACE",
    "NAMES",
    "ConstantAction",
    "GaitParameters",
    "GaitPolicy",
    "Network",
    "Policy",
    "PolicyCard",
    "Stateless",
    "interface",
    "load_policy",
    "title",
]
