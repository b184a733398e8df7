"""Where the wires of real devices are."""

from __future__ import annotations

from collections.abc import Mapping

from tickrig.emulators.testing.bench.modes.real.doors import LinePlace
from tickrig.emulators.testing.bench.mounts import LineMount, Mount
from tickrig.emulators.testing.rig_file.plan import BusPlan, HardwarePlan, RigPlan


def places_of(
    plan: RigPlan, hardware: HardwarePlan, mounts: Mapping[str, Mount]
) -> dict[str, LinePlace | BusPlan]:
    """Return where the wires are, by name; those that nobody has told are left out.

    Args:
        plan: the rig file.
        hardware: what it says of real devices.
        mounts: such wires, which know the rate of their devices.
    """
    places: dict[str, LinePlace | BusPlan] = dict(hardware.buses)
    for wire, port in hardware.ports.items():
        mount = mounts[wire]
        assert isinstance(mount, LineMount)
        baud = port.baud or mount.settings.baud
        places[wire] = LinePlace(port.port, baud, plan.wires[wire].framing)
    return places
