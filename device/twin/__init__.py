"""Twins: independent copies of devices, wires and rigs while they run.

A twin's state is data: values, names and bound methods, never closures or lambdas. All copies are
made with pickle, also those of `copy.deepcopy`. By default `copy.deepcopy` would treat bound
methods of compiled classes as atoms, and such a copy would act on the original.
"""

from tickrig.device.twin.copyable import Copyable, Immutable, NonCopyable, Part, itself
from tickrig.device.twin.listeners import Cache, Listeners
from tickrig.device.twin.pickler import restore, state_of, twin

__all__ = [
    "Cache",
    "Copyable",
    "Immutable",
    "Listeners",
    "NonCopyable",
    "Part",
    "itself",
    "restore",
    "state_of",
    "twin",
]
