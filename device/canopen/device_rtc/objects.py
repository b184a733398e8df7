"""The dictionary of a DeviceRTC, made of its profile (DECISION K2, K3, K17)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.communication_profile import (
    CommunicationProfile,
    Pdo,
    add_communication,
)
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.objects import ROT, RWW, Objects
from tickrig.wire.rtc_canopen.profile import (
    HEARTBEAT_MS,
    Direction,
    PlacedPort,
    RtcProfile,
)

NO_PROFILE: Final = 0
"""Device type of a device without a standardised profile (CiA 301, object 1000h)."""


def dictionary_of(profile: RtcProfile) -> Dictionary:
    """Make the objects: those of CiA 301, then one for each port from 2100h on."""
    objects = Objects()
    add_communication(
        objects,
        CommunicationProfile(
            device_type=NO_PROFILE,
            name=profile.type_name,
            hardware="DeviceRTC",
            software=profile.version,
            product_code=profile.code,
            revision=profile.revision,
            heartbeat_ms=HEARTBEAT_MS,
            rpdos=_pdos(profile, Direction.IN),
            tpdos=_pdos(profile, Direction.OUT),
        ),
    )
    for port in profile.placed():
        _add_port(objects, port)
    return objects.dictionary()


def _pdos(profile: RtcProfile, direction: Direction) -> list[Pdo]:
    return [Pdo(port.cob_id, port.mapping) for port in profile.placed(direction)]


def _add_port(objects: Objects, port: PlacedPort) -> None:
    kind = port.profile.port_type
    access = RWW if port.profile.direction is Direction.IN else ROT
    if kind.length == 1:
        objects.variable(port.index, port.profile.name, kind.data_type, access)
    else:
        objects.array(port.index, port.profile.name, kind.length, kind.data_type, access)
