"""Slaves that are DeviceRTCs."""

from __future__ import annotations

from functools import partial

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.nonvolatile import Nonvolatile
from tickrig.device.canopen.core.objects import dictionary_of
from tickrig.device.canopen.core.slave import CanopenSlave, ServiceMaker
from tickrig.device.canopen.device_rtc.component import Component
from tickrig.device.canopen.device_rtc.device import DeviceRtc
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.rtc_canopen.objects import object_table


def make_dictionary(kind: type[Component]) -> Dictionary:
    """Make the objects of a component; ValueError if its profile cannot be."""
    return dictionary_of(object_table(kind.profile()))


def application_of(kind: type[Component]) -> ServiceMaker:
    """Return what makes the application of a component."""
    return partial(DeviceRtc, kind=kind)


def make_device_rtc(
    kind: type[Component], node_id: int, nonvolatile: Nonvolatile | None = None
) -> CanopenSlave:
    """Make a slave that is a DeviceRTC.

    Args:
        kind: the component.
        node_id: 1..127, or 255 for a slave that waits for LSS.
        nonvolatile: what it kept from an earlier life.

    Raises:
        ValueError: a component or a node-ID that cannot be.
    """
    return make_slave(make_dictionary(kind), node_id, nonvolatile, application_of(kind))
