"""All services of a slave, in the order in which they act in a tick."""

from __future__ import annotations

from functools import partial
from typing import Final

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.errors import EmcyConsumer, EmcyProducer, ErrorBehaviour, ErrorStateEmcy
from tickrig.device.canopen.lss import LssSlave
from tickrig.device.canopen.nmt import HeartbeatConsumer, HeartbeatProducer, NmtSlave, NodeGuarding
from tickrig.device.canopen.parameter_store import ParameterStore
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.sdo import USUAL, SdoLimits, SdoServers
from tickrig.device.canopen.slave import Application, CanopenSlave, Nonvolatile, ServiceMaker
from tickrig.device.canopen.sync import Sync, TimeStamp

SERVICES: Final[tuple[ServiceMaker, ...]] = (
    # First of all at boot: the boot-up message and Pre-operational come before what others
    # do there.
    NmtSlave,
    # Listens in every state, also without a node-ID.
    LssSlave,
    TimeStamp,
    # The slave's own SYNC: RPDOs act on it at once; the application and TPDOs, which come later
    # in the order, act on it in the same tick. A SYNC from the bus is announced when its frame
    # arrives.
    Sync,
    PdoConsumer,
    # Requests act when they come; at this place a server only looks for silent clients.
    SdoServers,
    ParameterStore,
    # Between what comes in and what goes out: inputs of the tick are read, outputs are
    # worked out.
    Application,
    # Carries what the application has left, also in answer to a SYNC of this tick.
    PdoProducer,
    EmcyConsumer,
    # These three raise errors; the EMCY producer behind them sends the messages in this tick.
    HeartbeatConsumer,
    NodeGuarding,
    ErrorStateEmcy,
    EmcyProducer,
    # Behind the EMCY producer: the EMCY leaves before the node is Stopped, where it could
    # not.
    ErrorBehaviour,
    # Last: the heartbeat shows the state that the tick has led to.
    HeartbeatProducer,
)
"""Factories of the services in order: NMT, SYNC, RPDO, SDO, application, TPDO, EMCY, heartbeat."""


def make_slave(
    dictionary: Dictionary,
    node_id: int,
    nonvolatile: Nonvolatile | None = None,
    application: ServiceMaker = Application,
    sdo: SdoLimits = USUAL,
) -> CanopenSlave:
    """Make a CANopen slave with all services for which its dictionary has objects.

    Args:
        dictionary: the objects, with default values.
        node_id: node-ID 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: memory with parameters from an earlier run, or None for empty memory.
        application: factory of the application, such as a device profile. The default does nothing.
        sdo: limits of the SDO servers.

    Returns:
        A slave that boots in its first tick. To run the slave, make a `Station` from the slave and
        an end of a `CanWire`, and pass the station to a `Rig`.

    Raises:
        ValueError: the node-ID is invalid.
    """
    own: dict[ServiceMaker, ServiceMaker] = {
        Application: application,
        SdoServers: partial(SdoServers, limits=sdo),
    }
    services = tuple(own.get(make, make) for make in SERVICES)
    return CanopenSlave(dictionary, node_id, services, nonvolatile)
