"""What acts: gaits, scripted controllers, trained networks.

One direction of imports: ``files, memory, symmetry <- interface <- gaits, network, sb3_model <- scripted``.
"""

from training.policies.gaits import DEGREE, ConstantAction, GaitParameters, scripted
from training.policies.interface import INTERFACE, Policy, Stateless, interface, title
from training.policies.network import Network

__all__ = [
    "DEGREE",
    "INTERFACE",
    "ConstantAction",
    "GaitParameters",
    "Network",
    "Policy",
    "Stateless",
    "interface",
    "scripted",
    "title",
]
