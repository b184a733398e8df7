"""The canopen library's own profile for drives, unchanged, at an EPOS-like drive on vcan.

Not on UDP multicast, which gives a sender its own frames back: the library takes its
RPDO for a periodic one then, and does not send the third controlword.
"""

from __future__ import annotations

import io
import time
from collections.abc import Iterator
from typing import Any

import canopen
import pytest
from canopen.profiles.p402 import BaseNode402

from tests.interop.buses import Bus
from tests.interop.slave import Slave, running
from tickrig.device.canopen.models import epos
from tickrig.wire.canopen.eds.eds_writer import write_eds

pytestmark = pytest.mark.realtime

LEFT_WHEEL = 1
PATIENCE_S = 10.0


@pytest.fixture(scope="module")
def drive(vcan: Bus) -> Iterator[Slave]:
    with running(vcan, "--model", "epos", "--node-id", str(LEFT_WHEEL)) as child:
        yield child


@pytest.fixture
def node(vcan: Bus, drive: Slave) -> Iterator[Any]:
    network = canopen.Network()
    network.connect(**vcan.keywords)
    file = io.StringIO(write_eds(epos.dictionary().description))
    file.name = "epos.eds"
    kind: Any = BaseNode402
    node: Any = network.add_node(kind(LEFT_WHEEL, file))
    node.sdo.RESPONSE_TIMEOUT = 5
    node.TIMEOUT_CHECK_TPDO = node.TIMEOUT_SWITCH_STATE_FINAL = PATIENCE_S
    node.tpdo[1].read()
    node.tpdo[1].event_timer = 20
    node.tpdo[1].save()
    node.nmt.state = "PRE-OPERATIONAL"
    node.setup_402_state_machine()
    node.nmt.state = "OPERATIONAL"
    yield node
    network.disconnect()


def test_the_library_turns_a_wheel_and_stops_it(node: Any, drive: Slave) -> None:
    node.op_mode = "PROFILED VELOCITY"
    node.state = "OPERATION ENABLED"
    target = node.rpdo_pointers[0x60FF]
    target.raw = 600
    target.pdo_parent.transmit()
    _wait(lambda: abs(node.sdo[0x606C].raw - 600) <= 2)
    node.state = "SWITCHED ON"
    assert node.state == "SWITCHED ON"
    node.state = "SWITCH ON DISABLED"
    _wait(lambda: node.sdo[0x606C].raw == 0)


def _wait(done: Any) -> None:
    deadline = time.monotonic() + PATIENCE_S
    while not done():
        assert time.monotonic() < deadline
        time.sleep(0.01)
