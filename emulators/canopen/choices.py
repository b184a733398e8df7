"""Names on command lines, for shell completion without importing devices."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

MODELS: Final = ("f-palette", "f-palette-boot", "motor-core-unit", "epos", "rtc-echo")
"""Names of the models in `models.MODELS`."""

AUTO: Final = "auto"
PROFILES: Final = (AUTO, "none", "401", "402")
"""`AUTO`, and the names of the profiles in `eds.PROFILES`."""

NODE_FAULTS: Final = (
    *("power_off", "unplugged", "sdo_abort", "sdo_busy", "sdo_mute", "sdo_slow", "sdo_twice"),
    *("sdo_wrong_index", "sdo_toggle", "sdo_crc", "heartbeat_mute", "heartbeat_state"),
    *("heartbeat_late", "boot_late", "boots_twice", "boots_again", "pdo_short", "pdo_long"),
    *("pdo_mute", "pdo_stale", "emcy_storm", "id_doubled", "sync_lost", "bus_off"),
)
"""Names of the faults of every node, without those of its bus."""

_DRIVE: Final = ("short_circuit", "encoder_unplugged", "shaft_blocked", "motor_phase_open")
MODEL_FAULTS: Final[Mapping[str, tuple[str, ...]]] = {
    "f-palette": ("internal_failure", "input_overcurrent", "output_overload"),
    "f-palette-boot": ("internal_failure", "input_overcurrent", "output_overload"),
    "motor-core-unit": _DRIVE,
    "epos": _DRIVE,
}
"""Physical faults by name of the model, in addition to the faults of every node."""

BODIES: Final = ("differential", "skid-steer")
"""Kinds of body, the keys of `device.body.SIDES`."""

LSS: Final = "lss"
"""In place of a node-ID: the node waits for LSS to assign one."""

_BUS_NODE: Final = re.compile(r".+\.ya?ml:.+", re.IGNORECASE)


def is_bus_node(text: str) -> bool:
    """Return whether a text names a node of a bus.yml.

    >>> is_bus_node("arm/bus.yml:joint_1"), is_bus_node("bus.yml")
    (True, False)
    """
    return _BUS_NODE.fullmatch(text) is not None
