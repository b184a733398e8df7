"""Nodes that are DeviceRTCs, of a user's file (`FILE.py:Class`)."""

from __future__ import annotations

from typing import Final

from tickrig.device.canopen.device_rtc.component import CanopenComponent
from tickrig.device.canopen.device_rtc.device import (
    application_of,
    make_device_rtc,
    make_dictionary,
)
from tickrig.emulators.canopen.eds.device_description import DeviceDescription
from tickrig.emulators.canopen.node.node import NODE_INPUTS
from tickrig.host.text.user_file import explain_error, find_class
from tickrig.wire.rtc_canopen.objects import device_info

ANY_ID: Final = 1


def describe_rtc(spec: str) -> DeviceDescription:
    """Describe the component that `FILE.py:Class` stands for.

    Raises:
        ValueError: its file cannot be run, or it cannot be a DeviceRTC.
    """
    kind: type[CanopenComponent] = find_class(spec, CanopenComponent)
    for item in kind.physical:
        if item.name in NODE_INPUTS:
            raise ValueError(f"{spec}: input {item.name!r} is one that every node has")
    try:
        make_device_rtc(kind, ANY_ID)
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {explain_error(error, spec.rpartition(':')[0])}") from None
    return DeviceDescription(
        spec,
        device_info(kind.profile()),
        make_dictionary(kind),
        application=application_of(kind),
    )
