"""`[body]`: what the shafts of drives move."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.device.body.wheeled_body import SIDES
from tickrig.emulators.canopen.body.body_on_drives import SHAFTS
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.testing.rig_file.fields import shown
from tickrig.emulators.testing.rig_file.plan import BodyPlan
from tickrig.emulators.testing.rig_file.schema import BODY
from tickrig.emulators.testing.rig_file.section import Section, is_broken
from tickrig.emulators.testing.rig_file.unknown_device import UNKNOWN
from tickrig.host.text.names import near

PARAMETERS: Final = ("wheel_radius_m", "tread_m", "mass_kg", "friction")


def read_body(
    section: Section, devices: Mapping[str, HasSignals], node_ids: Mapping[int, str]
) -> BodyPlan | None:
    """Read the table.

    Args:
        section: the table.
        devices: by name; the drives are looked for among them.
        node_ids: names of nodes by their node-IDs, which may stand for them.

    Returns:
        The body, None if it cannot be.
    """
    kind = section.values.get("kind")
    sides = SIDES.get(kind) if isinstance(kind, str) else None
    wheels = [wheel for side in sides for wheel in side] if sides else []
    others = wheels or [wheel for both in SIDES.values() for side in both for wheel in side]
    values = section.read(BODY, *others)
    drives = {wheel: _drive(section, wheel, devices, node_ids) for wheel in wheels}
    for wheel, drive in drives.items():
        first = next(each for each in drives if drives[each] == drive)
        if drive and first != wheel:
            section.wrong(f"{drive!r} drives {first} already", wheel)
    mirrored = _mirrored(section, values.get("mirrored", ()), wheels)
    needed = [key for key, each in BODY.items() if not each.default]
    if not sides or not all(drives.values()) or not all(key in values for key in needed):
        return None
    return BodyPlan(
        kind=values["kind"],
        drives={wheel: drive for wheel, drive in drives.items() if drive},
        mirrored=mirrored,
        parameters={key: float(values[key]) for key in PARAMETERS if key in values},
    )


def _drive(
    section: Section, wheel: str, devices: Mapping[str, HasSignals], node_ids: Mapping[int, str]
) -> str | None:
    """Return the device of a wheel, None if it cannot be one."""
    value = section.values.get(wheel)
    if type(value) is int:
        value = node_ids.get(value, str(value))
    if value is None:
        section.wrong(f"no key {wheel!r}: the drive of this wheel, the name of a device")
    elif is_broken(value):
        return None
    elif not isinstance(value, str):
        section.wrong(f"it takes the name of a device, not {shown(value)}", wheel)
    elif value not in devices and UNKNOWN in devices.values() and value.isdecimal():
        return None  # it may be the node-ID of that one
    elif value not in devices:
        section.unknown(f"no device {value!r}; {near(value, list(devices))}", wheel)
    elif not any(angle in devices[value].outputs for angle, *_ in SHAFTS):
        section.wrong(f"{value!r} has no shaft: it is no CANopen drive", wheel)
    else:
        return value
    return None


def _mirrored(section: Section, names: tuple[str, ...], wheels: list[str]) -> tuple[str, ...]:
    if wheels:
        for name in names:
            if name not in wheels:
                section.wrong(f"no wheel {name!r}; {near(name, wheels)}", "mirrored")
    return names
