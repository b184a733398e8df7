"""The canopen library as LSS master of our slave."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import canopen
import pytest

from tests.interop.buses import Bus
from tests.interop.slave import EDS, running

pytestmark = pytest.mark.realtime

NODE_ID = 42
INQUIRE_VENDOR_ID = 0x5A


def identity() -> list[int]:
    dictionary: Any = canopen.import_od(str(EDS))
    return [dictionary[0x1018][sub].default for sub in range(1, 5)]


def test_fastscan_finds_it_and_gives_it_a_node_id_that_it_keeps(
    bus: Bus, network: canopen.Network, tmp_path: Path
) -> None:
    store = tmp_path / "store.json"
    options = ("--eds", str(EDS), "--node-id", "lss", "--store", str(store))
    lss: Any = network.lss
    with running(bus, *options) as slave:
        assert slave.get("node_id") == 255
        for timeout_s in (0.1, 0.4, 1.0):  # a bit whose answer is late counts as not answered
            lss.RESPONSE_TIMEOUT = timeout_s
            found, values = lss.fast_scan()
            if found:
                break
        assert found
        assert list(values) == identity()
        lss.RESPONSE_TIMEOUT = 1.0
        lss.configure_node_id(NODE_ID)
        lss.store_configuration()
        lss.send_switch_state_global(lss.WAITING_STATE)
        slave.wait_for("state", "Pre-operational")
        assert slave.get("node_id") == NODE_ID
        node = network.add_node(NODE_ID, str(EDS))
        node.sdo.RESPONSE_TIMEOUT = 5
        assert node.sdo[0x1018][2].raw == identity()[1]
    assert json.loads(store.read_bytes())["nodes"]["lss"]["node_id"] == NODE_ID
    with running(bus, *options) as slave:
        slave.wait_for("node_id", NODE_ID)


def test_an_unconfigured_slave_is_named_by_its_identity(bus: Bus, network: canopen.Network) -> None:
    lss: Any = network.lss
    lss.RESPONSE_TIMEOUT = 1.0
    with running(bus, "--eds", str(EDS), "--node-id", "lss") as slave:
        assert lss.send_switch_state_selective(*identity())
        assert lss.inquire_lss_address(INQUIRE_VENDOR_ID) == identity()[0]
        assert lss.inquire_node_id() == 255
        lss.configure_node_id(7)
        lss.send_switch_state_global(lss.WAITING_STATE)
        deadline = time.monotonic() + 10
        while slave.get("node_id") != 7:
            assert time.monotonic() < deadline
            time.sleep(0.01)
