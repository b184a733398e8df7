"""RT components after OMG RTC 1.0 and OpenRTM-aist 1.x, in one process, told the time."""

from tickrig.host.rtc.component import ComponentProfile, ModuleSpec, RtComponent
from tickrig.host.rtc.connect import connect
from tickrig.host.rtc.data_port import InPort, OutPort
from tickrig.host.rtc.errors import RtcRefused
from tickrig.host.rtc.execution_context import ExecutionContext
from tickrig.host.rtc.manager import Manager
from tickrig.host.rtc.parameter import Parameter
from tickrig.host.rtc.port_status import PortStatus
from tickrig.host.rtc.service_port import Consumer, Provider, ServicePort
from tickrig.host.rtc.states import ExecutionKind, LifeCycleState, ReturnCode

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
