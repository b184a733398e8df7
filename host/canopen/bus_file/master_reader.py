"""The section of the master, and what it makes of the heartbeats of its slaves."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusOptions, Identity
from tickrig.host.canopen.bus_file.known_keys import MASTER, OPTIONS, check_keys
from tickrig.host.canopen.bus_file.notes import UNSIGNED8, UNSIGNED16, Section
from tickrig.host.canopen.bus_file.sheet import UNSET, Sheet
from tickrig.host.canopen.bus_file.slave_reader import read_extra
from tickrig.host.canopen.bus_file.writes import Writes
from tickrig.wire.canopen.eds.eds_device import HIGHEST_NODE_ID
from tickrig.wire.canopen.eds.object_table import BIT_RATES_KBIT

CONSUMER: Final = 0x1016
TIME: Final = 0x100
SHORTEST_SYNC_US: Final = 1_000
FLAGS: Final = {
    "start": True,
    "start_nodes": True,
    "start_all_nodes": False,
    "reset_all_nodes": False,
    "stop_all_nodes": False,
}
"""Those that dcfgen takes for numbers, with what they are if they are left out."""


def read_options(section: Section | None) -> BusOptions:
    """Read what holds for all nodes."""
    if section is None:
        return BusOptions()
    check_keys(section, OPTIONS, open_to_others=True)
    return BusOptions(
        dcf_path=section.text("dcf_path"),
        heartbeat_multiplier=section.real("heartbeat_multiplier", 3.0),
        retry_factor=section.whole("retry_factor", 3, 0, UNSIGNED8),
        extra=read_extra(section),
    )


def read_master(section: Section, options: BusOptions) -> BusMaster:
    """Read the section of the master."""
    check_keys(section, MASTER, open_to_others=True)
    whole = section.whole
    numbers = ("vendor_id", "product_code", "revision_number", "serial_number")
    node_id = whole("node_id", UNSET, 1, UNSET)
    if HIGHEST_NODE_ID < node_id < UNSET:
        section.note("node-id", "node_id", f"node_id: {node_id} is not in 1..127")
        node_id = UNSET
    return BusMaster(
        node_id,
        section.place,
        baudrate=_bit_rate(section),
        identity=Identity(0, *(whole(key) for key in numbers)),
        sync_period_us=_sync_period(section),
        sync_window_us=whole("sync_window"),
        sync_overflow=whole("sync_overflow", 0, 0, 240),
        heartbeat_producer_ms=whole("heartbeat_producer", 0, 0, UNSIGNED16),
        heartbeat_multiplier=section.real("heartbeat_multiplier", options.heartbeat_multiplier),
        emcy_inhibit_time_100us=whole("emcy_inhibit_time", 0, 0, UNSIGNED16),
        nmt_inhibit_time_100us=whole("nmt_inhibit_time", 0, 0, UNSIGNED16),
        error_behavior=_error_behavior(section),
        heartbeat_consumer=section.flag("heartbeat_consumer", default=True),
        time_cob_id=whole("time_cob_id", TIME),
        **{key: bool(whole(key, default, -UNSIGNED16)) for key, default in FLAGS.items()},
        boot_time_ms=whole("boot_time"),
        boot_timeout_ms=whole("boot_timeout") if "boot_timeout" in section else None,
        driver=section.text("driver"),
        package=section.text("package"),
        extra=read_extra(section),
    )


def _bit_rate(section: Section) -> int:
    rate = section.whole("baudrate", 1000, 1, 1000)
    if rate not in BIT_RATES_KBIT:
        allowed = ", ".join(map(str, BIT_RATES_KBIT))
        section.note("bit-rate", "baudrate", f"baudrate: {rate} kbit/s is none of {allowed}")
    return rate


def _sync_period(section: Section) -> int:
    period_us = section.whole("sync_period")
    if 0 < period_us < SHORTEST_SYNC_US:
        text = f"sync_period: a SYNC each {period_us} µs; {SHORTEST_SYNC_US} µs is short already"
        section.note("sync-period", "sync_period", text)
    return period_us


def _error_behavior(section: Section) -> dict[int, int]:
    behavior = {1: 0}
    if "error_behavior" in section:
        given = section.section("error_behavior")
        for sub in given.fields:
            if isinstance(sub, int):
                behavior[sub] = given.whole(sub, 0, 0, UNSIGNED8)
            else:
                given.note("kind", sub, f"{sub!r:.40}: a sub-index of 1029h is a number")
    return behavior


def watch_master(node: Section, sheet: Sheet, writes: Writes, master: BusMaster) -> None:
    """Write the time of the master's heartbeat that a slave shall watch, before all else."""
    time_ms = int(master.heartbeat_producer_ms * master.heartbeat_multiplier)
    entries = {sub: sheet.value(CONSUMER, sub) for sub in sheet.subs(CONSUMER) if sub}
    watched = node.flag("heartbeat_consumer", default=False) and time_ms > 0
    place = node.place_of("heartbeat_consumer")
    if not watched:
        for sub, value in entries.items():
            if value & UNSIGNED16 and _node_id(value) == master.node_id:
                writes.insert(CONSUMER, sub, master.node_id << 16, place)
        return
    if CONSUMER not in sheet:
        text = f"heartbeat_consumer: {sheet.path.name} has no 1016h"
        node.note("no-object", "heartbeat_consumer", text)
        return
    own = [sub for sub, value in entries.items() if _node_id(value) == master.node_id]
    free = [sub for sub, value in entries.items() if not value & UNSIGNED16 or _is_unused(value)]
    if sub := next(iter(own + free), 0):
        value = (master.node_id & UNSIGNED8) << 16 | time_ms & UNSIGNED16
        writes.insert(CONSUMER, sub, value, place)
    else:
        text = f"heartbeat_consumer: no entry of 1016h is free: {sheet.place(CONSUMER)}"
        node.note("no-entry", "heartbeat_consumer", text)


def _node_id(value: int) -> int:
    return value >> 16 & UNSIGNED8


def _is_unused(value: int) -> bool:
    return not 1 <= _node_id(value) <= HIGHEST_NODE_ID
