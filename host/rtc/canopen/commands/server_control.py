"""What can be asked of a running RTC-CANopen server (docs/reference/rtc/rtc-canopen.md)."""

from __future__ import annotations

from typing import Final

from tickrig.host.control.requests import Object, whole
from tickrig.host.rtc.canopen.serve import ServerRunner
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.canopen.view import NOT_HEARD, NodeView, ServerView
from tickrig.host.rtc.commands.system_control import SystemControl

_NOT_HERE: Final = ("create", "delete", "save")
"""Requests of a system that the server decides itself: its nodes come and go on the bus."""


class ServerControl(SystemControl):
    """Answers requests about one server: those of a system, and of its nodes by node-ID.

    Args:
        server: what is controlled. It must not be ticking meanwhile.
        runner: who runs it.
        bus: how the bus is called.
    """

    def __init__(self, server: RtcCanopenServer, runner: ServerRunner, bus: str) -> None:
        super().__init__(server.manager, runner)
        self._server, self._bus = server, bus
        self._verbs = {
            **{name: verb for name, verb in self._verbs.items() if name not in _NOT_HERE},
            "restart": (self._restart, ("node",)),
            "start": (self._start, ()),
        }

    def _status(self, request: Object) -> Object:
        nodes = [_describe_node(node) for node in ServerView(self._server).nodes]
        return {"link": self._bus, **super()._status(request), "nodes": nodes}

    def _restart(self, request: Object) -> Object:
        ServerView(self._server).restart(whole(request.get("node"), "node", 1, 127))
        return {}

    def _start(self, request: Object) -> Object:
        self._server.start()
        return {}


def _describe_node(node: NodeView) -> Object:
    age_us = node.heartbeat_age_us
    return {
        "node": node.node_id,
        "name": node.name,
        "phase": node.phase.value,
        "nmt_state": node.nmt_state,
        "proxy_state": node.proxy_state,
        "heartbeat_age_us": None if age_us == NOT_HEARD else age_us,
        "problem": node.problem,
    }
