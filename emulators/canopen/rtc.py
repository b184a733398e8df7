"""Nodes that are DeviceRTCs, of a user's file (`FILE.py:Class`)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.device_rtc.component import Component
from tickrig.device.canopen.device_rtc.make import application_of, make_device_rtc
from tickrig.device.canopen.device_rtc.nmt import RtcNmt
from tickrig.device.canopen.device_rtc.objects import dictionary_of
from tickrig.emulators.canopen.device_description import DeviceDescription, DeviceInfo
from tickrig.emulators.canopen.eds import BIT_RATES_KBIT
from tickrig.emulators.user_file import find_class, told

ANY_ID: Final = 1


def describe_component(name: str, kind: type[Component], node_id: int | None) -> DeviceDescription:
    """Return what an EDS says about a component, and what none can."""
    profile = kind.profile()
    rates = frozenset(1_000 * kbit for kbit in BIT_RATES_KBIT)
    return DeviceDescription(
        name,
        DeviceInfo(profile.vendor, profile.type_name, bit_rates=rates),
        dictionary_of(profile),
        node_id,
        application=application_of(kind),
        nmt=RtcNmt,
    )


def describe_rtc(spec: str) -> DeviceDescription:
    """Describe the component that `FILE.py:Class` stands for.

    Raises:
        ValueError: its file cannot be run, or it cannot be a DeviceRTC.
    """
    kind: type[Component] = find_class(spec, Component)
    try:
        make_device_rtc(kind, ANY_ID)
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {told(error, spec.rpartition(':')[0])}") from None
    return describe_component(spec, kind, None)
