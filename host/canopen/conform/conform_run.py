"""A run of the tester: which checks are judged, in which order, and what came of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final

from tickrig.host.canopen.conform.binding.binding import Binding, bind
from tickrig.host.canopen.conform.bus.exchange import Exchange
from tickrig.host.canopen.conform.bus.sdo_client import SdoClient
from tickrig.host.canopen.conform.bus.step_failed import NotAllowed, StepFailed
from tickrig.host.canopen.conform.bus.steps import Player
from tickrig.host.canopen.conform.bus.traffic import ASSUMED_BIT_RATE
from tickrig.host.canopen.conform.check import STIMULUS, Check, Level
from tickrig.host.canopen.conform.judge import Judge
from tickrig.host.canopen.conform.node_names import NodeNames
from tickrig.host.canopen.conform.notation.bound_check import BoundCheck, bind_check
from tickrig.host.canopen.conform.notation.names import Address, Unbound
from tickrig.host.canopen.conform.notation.suite import read_suite
from tickrig.host.canopen.conform.plan import Plan
from tickrig.host.canopen.conform.safety.node_care import NodeCare
from tickrig.host.canopen.conform.safety.permission import Permission
from tickrig.host.canopen.conform.verdict import Outcome, Report, Result, Verdict
from tickrig.host.canopen.errors import SdoFailed
from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.link import StampedLink
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
