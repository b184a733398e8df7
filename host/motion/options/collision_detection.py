"""CollisionDetection: stops the base by its service, whoever drives."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.motion.components.ref_hard import RefHard
from tickrig.host.motion.options.watched_distance import WatchedDistance
from tickrig.host.rtc import (
    Consumer,
    ExecutionContext,
    InPort,
    ModuleSpec,
    ReturnCode,
    RtComponent,
    ServicePort,
)
from tickrig.host.text.log import log_of
from tickrig.wire.rtc_types.basic import TimedDouble

_LOG: Final = log_of(__name__)


class CollisionDetection(RtComponent):
    """Calls Stop when something is nearer than `stop_distance`, Go when the way is free again.

    Without a distance for `timeout` it calls Stop: nobody looks. When it is deactivated it
    calls Go, if it had called Stop. Join `BumpRefHard` with RefHardRh3.BumpRefHard. The
    specification only names it; ports and parameters are ours.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("CollisionDetection", "Stops the base at once")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.stop_distance = bind("stop_distance", 0.15, "x>=0", unit="m")
        self.go_distance = bind("go_distance", 0.25, "x>=0", unit="m")
        self.timeout = bind("timeout", 0.5, "x>0", unit="s")
        self.distance = self.add_port(InPort("distance", TimedDouble))
        port = self.add_port(ServicePort("BumpRefHard"))
        self.ref_hard = port.require(Consumer[RefHard]("service", "RefHard"))
        self._watched = WatchedDistance(self.distance)
        self._stopped = False

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Begin with the way blocked."""
        self._watched.forget()
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Let the base run."""
        if self._stopped:
            self._call(stop=False)
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Look, and call."""
        free = self._watched.look(
            ec, self.stop_distance.value, self.go_distance.value, self.timeout.value
        )
        if free == self._stopped:
            self._call(stop=not free)
        return ReturnCode.RTC_OK

    def _call(self, *, stop: bool) -> None:
        if not self.ref_hard.connected:
            return
        if stop:
            self.ref_hard.service.Stop()
        else:
            self.ref_hard.service.Go()
        self._stopped = stop
        _LOG.info("%s: %s", self.instance_name, "Stop" if stop else "Go")
