from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen
import pytest

from tests.interop.buses import MULTICAST, SLOWDOWN, SOCKETCAN, Bus, patience
from tests.interop.slave import EDS, Slave, running

FOLDER = Path(__file__).parent
NODE_ID = 5
TIMEOUT_S = 120


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """In a slow guest run the essential tests alone, and give each of them more time."""
    for item in items if SLOWDOWN > 1 else ():
        if item.path.is_relative_to(FOLDER):
            item.add_marker(pytest.mark.timeout(patience(TIMEOUT_S)))
            if item.get_closest_marker("essential") is None:
                item.add_marker(pytest.mark.skip(f"this guest is {SLOWDOWN} times slower"))


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
    node.sdo.RESPONSE_TIMEOUT = patience(5)
    booted = threading.Event()
    node.nmt.add_heartbeat_callback(lambda state: None if state else booted.set())
    node.nmt.send_command(0x81)
    assert booted.wait(patience(10))  # wait_for_bootup would miss one that comes before it waits
    return node


@pytest.fixture
def nodes(bus: Bus) -> Iterator[Slave]:
    with running(bus, "--node", "16=f-palette", "--node", "32=motor-core-unit") as child:
        yield child
