"""What makes CANopen nodes, imported when the first node is made (PEP 562).

A bench of serial devices does not need these names. If slaves, EDS files and bus.yml are not
imported, `import Bench` takes half of the time. Write `late.describe(...)`; a `from` import
would load the module at once.
"""

from __future__ import annotations

from tickrig._lazy import lazy

TYPE_CHECKING = False
if TYPE_CHECKING:
    from tickrig.device.canopen.sdo import USUAL as USUAL
    from tickrig.device.canopen.sdo import SdoLimits as SdoLimits
    from tickrig.device.canopen.sdo import SdoServers as SdoServers
    from tickrig.device.canopen.slave import UNCONFIGURED as UNCONFIGURED
    from tickrig.device.canopen.stack import make_slave as make_slave
    from tickrig.emulators.can.wire import CanWire as CanWire
    from tickrig.emulators.canopen.build import ANY_ID as ANY_ID
    from tickrig.emulators.canopen.build import describe as describe
    from tickrig.emulators.canopen.build import store_keeper as store_keeper
    from tickrig.emulators.canopen.bus_file.bus_nodes import read_bus as read_bus
    from tickrig.emulators.canopen.bus_file.node_keys import BusMistakesError as BusMistakesError
    from tickrig.emulators.canopen.eds import EdsCache as EdsCache
    from tickrig.emulators.canopen.faults import NodeFaults as NodeFaults
    from tickrig.emulators.canopen.models import MODELS as MODELS
    from tickrig.emulators.canopen.node import Node as Node
    from tickrig.emulators.canopen.node import NodeSide as NodeSide
    from tickrig.emulators.canopen.store_file import StoreError as StoreError
    from tickrig.emulators.canopen.store_file import StoreFile as StoreFile
    from tickrig.emulators.canopen.store_file import drop_misfits as drop_misfits
    from tickrig.emulators.canopen.store_file import memory_values as memory_values
    from tickrig.emulators.canopen.store_file import parse_memory as parse_memory
    from tickrig.host.canopen.bus_file.bus_file import is_bus_file as is_bus_file
    from tickrig.wire.canopen.eds.eds_file import finding_lines as finding_lines
else:
    __all__, __getattr__, __dir__ = lazy(
        __name__,
        {
            "tickrig.device.canopen.sdo": ("USUAL", "SdoLimits", "SdoServers"),
            "tickrig.device.canopen.slave": ("UNCONFIGURED",),
            "tickrig.device.canopen.stack": ("make_slave",),
            "tickrig.emulators.can.wire": ("CanWire",),
            "tickrig.emulators.canopen.build": ("ANY_ID", "describe", "store_keeper"),
            "tickrig.emulators.canopen.bus_file.bus_nodes": ("read_bus",),
            "tickrig.emulators.canopen.bus_file.node_keys": ("BusMistakesError",),
            "tickrig.emulators.canopen.eds": ("EdsCache",),
            "tickrig.emulators.canopen.faults": ("NodeFaults",),
            "tickrig.emulators.canopen.models": ("MODELS",),
            "tickrig.emulators.canopen.node": ("Node", "NodeSide"),
            "tickrig.emulators.canopen.store_file": (
                "StoreError",
                "StoreFile",
                "drop_misfits",
                "memory_values",
                "parse_memory",
            ),
            "tickrig.host.canopen.bus_file.bus_file": ("is_bus_file",),
            "tickrig.wire.canopen.eds.eds_file": ("finding_lines",),
        },
    )
