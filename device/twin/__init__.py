"""Twins: independent copies of devices, wires and rigs while they run.

State is data: values, names and bound methods, never closures or lambdas. So all
that can be copied goes through pickle, `copy.deepcopy` too: the default one would
take bound methods of compiled classes for atoms, and such a copy would act on the
original.
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
