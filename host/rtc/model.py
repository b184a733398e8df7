"""The names of the component model, in one place."""

from tickrig.host.rtc.component import ComponentProfile, ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.configuration import Parameter
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.ports.service_port import Consumer, Provider, ServicePort
from tickrig.host.rtc.states import (
    ExecutionKind,
    LifeCycleState,
    PortStatus,
    ReturnCode,
    RtcRefused,
)
from tickrig.host.rtc.system.manager import Manager

__all__ = [
    "ComponentProfile",
    "Consumer",
    "ExecutionContext",
    "ExecutionKind",
    "InPort",
    "LifeCycleState",
    "Manager",
    "ModuleSpec",
    "OutPort",
    "Parameter",
    "PortStatus",
    "Provider",
    "ReturnCode",
    "RtComponent",
    "RtcRefused",
    "ServicePort",
    "connect",
]
