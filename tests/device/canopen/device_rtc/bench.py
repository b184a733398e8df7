"""A DeviceRTC alone with the test, and a component that notes what is called."""

from __future__ import annotations

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.device_rtc import (
    CanopenComponent,
    CanopenInPort,
    CanopenOutPort,
    DeviceRtc,
    make_device_rtc,
)
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.component import ERROR, Result
from tickrig.wire.rtc_canopen import SHORT

COMMANDS = {
    "start": "000#0110",
    "stop": "000#0210",
    "enter pre-operational": "000#8010",
    "reset node": "000#8110",
    "reset communication": "000#8210",
}
CALLBACKS = (
    *("on_initialize", "on_finalize", "on_activated", "on_deactivated", "on_execute"),
    *("error_check", "on_aborting", "on_error", "on_reset"),
)


class Recorder(CanopenComponent):
    """Notes its callbacks; those in `failing` fail, in each new component too."""

    type_name = "Recorder"
    inlet = CanopenInPort("inlet", SHORT)
    outlet = CanopenOutPort("outlet", SHORT)
    called: list[str] = []  # noqa: RUF012 - a test gives each kind its own
    failing: set[str] = set()  # noqa: RUF012

    def _call(self, name: str) -> Result:
        self.called.append(name)
        return ERROR if name in self.failing else None

    def on_initialize(self) -> Result:
        return self._call("on_initialize")

    def on_finalize(self) -> Result:
        return self._call("on_finalize")

    def on_activated(self) -> Result:
        return self._call("on_activated")

    def on_deactivated(self) -> Result:
        return self._call("on_deactivated")

    def on_execute(self) -> Result:
        return self._call("on_execute")

    def error_check(self) -> Result:
        return self._call("error_check")

    def on_aborting(self) -> None:
        self._call("on_aborting")

    def on_error(self) -> None:
        self._call("on_error")

    def on_reset(self) -> Result:
        return self._call("on_reset")


class RtcBench(Bus):
    """Node 16, a Recorder.

    Attributes:
        called: callbacks since the state was entered.
        failing: callbacks that fail.
    """

    def __init__(self, *, strict: bool = False, kind: type[CanopenComponent] = Recorder) -> None:
        self.called: list[str] = []
        self.failing: set[str] = set()
        mine = {"called": self.called, "failing": self.failing, "strict_cia301": strict}
        super().__init__(make_device_rtc(type(kind.__name__, (kind,), mine), 16))
        self.rtc = DeviceRtc.of(self.slave)
        self.tpdos = PdoProducer.of(self.slave)

    @property
    def state(self) -> str:
        return str(self.rtc.read("rtc_state"))

    def enter(self, state: str) -> RtcBench:
        """Go from power-on to a state, and forget how."""
        if state == "Created":
            self.failing.add("on_initialize")
        self.step()
        if state in ("Active", "Error"):
            self.step({"Active": "000#0110", "Error": "000#0210"}[state])
        if state == "Finalized":
            self.act("shut down")
        self.failing.clear()
        self.called.clear()
        return self

    def act(self, stimulus: str) -> list[str]:
        """Give an NMT command, or press the button; return what was sent in that tick."""
        if stimulus == "shut down":
            self.rtc.inputs.set("shut_down", 1)
            return self.step()
        return self.step(COMMANDS[stimulus])

    def heartbeat(self) -> str:
        """Return the next message of the error control service, empty if none comes."""
        told = [text for text in self.run(200) if text.startswith("710#")]
        return told[0] if told else ""
