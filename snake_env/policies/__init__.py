"""What acts: gaits, scripted controllers, trained networks.

One direction of imports: ``files, memory, policy_card <- interface <- gaits, network <- shipped, scripted``.
"""

from snake_env.policies.gaits import DEGREE, ConstantAction, GaitParameters, scripted
from snake_env.policies.interface import INTERFACE, Policy, Stateless, interface, title
from snake_env.policies.network import Network
from snake_env.policies.policy_card import PolicyCard
from snake_env.policies.shipped import NAMES, load_policy

__all__ = [
    "DEGREE",
    "INTERFACE",
    "NAMES",
    "ConstantAction",
    "GaitParameters",
    "Network",
    "Policy",
    "PolicyCard",
    "Stateless",
    "interface",
    "load_policy",
    "scripted",
    "title",
]
