"""The keys of a bus.yml, by section, and the allowed settings of drivers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from tickrig.host.canopen.bus_file.notes import BusFileSection
from tickrig.host.text.document import Item
from tickrig.host.text.names import closest
from tickrig.wire.canopen.eds.eds_file import shorten

EXTRA: Final = "tickrig"
"""Keys of each section that only this project reads."""

OPTIONS: Final = ("dcf_path", "heartbeat_multiplier", "retry_factor", EXTRA)
ROS: Final = ("driver", "package", "namespace", "remappings", "diagnostics", "non_transmit_timeout")
"""Keys of the master and of nodes that ros2_canopen reads."""
_BOTH: Final = (
    *("node_id", "dcf_path", "vendor_id", "product_code", "revision_number", "serial_number"),
    *("heartbeat_producer", "heartbeat_consumer", "heartbeat_multiplier", "error_behavior"),
    *("time_cob_id", EXTRA, *ROS),
)
MASTER: Final = (
    *(*_BOTH, "baudrate", "sync_period", "sync_window", "sync_overflow", "emcy_inhibit_time"),
    *("nmt_inhibit_time", "start", "start_nodes", "start_all_nodes", "reset_all_nodes"),
    *("stop_all_nodes", "boot_time", "boot_timeout"),
)
SCALES: Final = (
    *("scale_pos_to_dev", "scale_pos_from_dev", "scale_vel_to_dev", "scale_vel_from_dev"),
    *("scale_eff_to_dev", "scale_eff_from_dev", "offset_pos_to_dev", "offset_pos_from_dev"),
)
DRIVER: Final = (
    *("num_channels", "channel_names", "channels", *SCALES, "position_mode", "velocity_mode"),
    *("effort_mode", "torque_mode", "channel", "switching_state", "homing_timeout_seconds"),
    *("boot_timeout_ms", "sdo_timeout_ms", "enable_lazy_load", "polling", "period"),
)
"""Keys of a node that the drivers and hardware interfaces of ros2_canopen read."""
SLAVE: Final = (
    *(*_BOTH, "dcf", "guard_time", "life_time_factor", "retry_factor", "rpdo", "tpdo", "sdo"),
    *("boot", "mandatory", "reset_communication", "software_file", "software_version"),
    *("configuration_file", "restore_configuration", *DRIVER),
)
PDO: Final = (
    *("enabled", "cob_id", "transmission", "inhibit_time", "event_timer", "event_deadline"),
    *("sync_start", "mapping"),
)
_FLAGS: Final = {
    **dict.fromkeys(("true", "yes", "on", "y"), 1),
    **dict.fromkeys(("false", "no", "off", "n"), 0),
}
"""Words that yaml-cpp reads as a boolean."""


class _Allowed(NamedTuple):
    """Allowed values of a driver setting: whole numbers, or a boolean if no numbers are listed."""

    numbers: Sequence[int]
    said: str

    def value_of(self, item: Item) -> int | None:
        """Return the number that a driver reads from a YAML value, or None for a refused value.

        The driver uses yaml-cpp, which ignores quotes. A boolean is read as 1 or 0.
        """
        if not self.numbers:
            return _FLAGS.get(item.text.lower())
        try:
            number = None if isinstance(item.value, bool) else int(item.text, 0)
        except ValueError:
            return None
        return number if number in self.numbers else None


_TIME: Final = _Allowed(range(1, 1 << 31), "a whole number above 0")
_MODE: Final = _Allowed((1, 2, 3, 4, 6, 7, 8, 9, 10), "a mode of CiA 402: 1..4, 6..10")
SETTINGS: Final = {
    "polling": _Allowed((), "true or false"),
    "period": _TIME,
    "sdo_timeout_ms": _TIME,
    "homing_timeout_seconds": _TIME,
    "switching_state": _Allowed(range(2, 7), "a target state: 2..6, 5 is Operation enabled"),
    "position_mode": _MODE,
    "velocity_mode": _MODE,
    "effort_mode": _MODE,
}
"""Driver settings, by key of a node."""


def check_keys(
    section: BusFileSection, known: Iterable[str], *, open_to_others: bool = False
) -> None:
    """Report the unknown keys of a bus.yml section, with a suggestion for a misspelled key.

    Args:
        section: section of the bus.yml.
        known: all keys that tickrig knows in this section.
        open_to_others: whether a driver of the user may read further keys. If so, an unknown key is
            reported as a key for that driver, unless it looks like a misspelling.
    """
    known = tuple(known)
    for key in section.fields:
        if key in known:
            continue
        close = closest(shorten(str(key)), known)
        said = f"{shorten(str(key))!r} is not a known key"
        if close:
            section.note("unknown-key", key, f"{said}; did you mean {close[0]!r}?")
        elif open_to_others:
            section.note("own-key", key, said)
        else:
            section.note("unknown-key", key, f"{said}; known: {', '.join(known)}")
