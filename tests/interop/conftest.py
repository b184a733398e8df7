from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import canopen
import pytest

from tests.interop.buses import MULTICAST, SOCKETCAN, Bus
from tests.interop.slave import EDS, Slave, running

NODE_ID = 5


def usable(bus: Bus) -> Bus:
    if why := bus.why_not():
        pytest.skip(why)
    return bus


@pytest.fixture(scope="module", params=[SOCKETCAN, MULTICAST], ids=lambda bus: bus.interface)
def bus(request: pytest.FixtureRequest) -> Bus:
    return usable(request.param)


@pytest.fixture(scope="module")
def vcan() -> Bus:
    return usable(SOCKETCAN)


@pytest.fixture(scope="module")
def slave(bus: Bus) -> Iterator[Slave]:
    with running(bus, "--eds", str(EDS), "--node-id", str(NODE_ID)) as child:
        yield child


@pytest.fixture
def network(bus: Bus) -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.connect(**bus.keywords)
    yield network
    network.disconnect()


@pytest.fixture
def master(network: canopen.Network, slave: Slave) -> Any:
    """The slave as its master sees it, fresh from a reset."""
    node: Any = network.add_node(NODE_ID, str(EDS))
    node.sdo.RESPONSE_TIMEOUT = 5
    booted = threading.Event()
    node.nmt.add_heartbeat_callback(lambda state: None if state else booted.set())
    node.nmt.send_command(0x81)
    assert booted.wait(10)  # wait_for_bootup would miss one that comes before it waits
    return node
