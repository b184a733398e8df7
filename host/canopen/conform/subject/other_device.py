"""Whether an EDS is of the device that answers, or of another one."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.wire.canopen.eds.eds_device import EdsDevice

TOLD: Final = {"device type": (0x1000, 0), "vendor": (0x1018, 1), "product": (0x1018, 2)}
"""What tells devices apart, as `Subject.about` names it."""


def other_device(device: EdsDevice | None, about: Mapping[str, str]) -> str:
    """Say in what an EDS differs from the node as no EDS of it would; empty if it does not.

    Args:
        device: what the EDS says, None without one; a value that it leaves at 0 says nothing.
        about: what the node says of itself.
    """
    entries = device.entries if device else ()
    values = {(one.index, one.sub): int.from_bytes(one.default, "little") for one in entries}
    said = {name: f"{values[at]:08X}h" for name, at in TOLD.items() if values.get(at)}
    differs = [
        f"{name} {text} there, {about[name]} here"
        for name, text in said.items()
        if about.get(name, text) != text
    ]
    return f"this EDS is of another device: {', '.join(differs)}" if differs else ""
