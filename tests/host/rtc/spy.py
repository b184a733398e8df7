"""A component that notes its callbacks, and returns or raises what a test wants."""

from __future__ import annotations

from tickrig.host.rtc import ExecutionContext, ModuleSpec, ReturnCode, RtComponent
from tickrig.host.rtc.component import ComponentAction

OK, ERROR = ReturnCode.RTC_OK, ReturnCode.RTC_ERROR
CALLBACKS = tuple(name for name in vars(ComponentAction) if name.startswith("on_"))


class BrokenError(Exception):
    """Raised by a callback that is told to raise."""


class Spy(RtComponent):
    """Notes each callback in `calls`; `results` says what it returns or raises."""

    spec = ModuleSpec("Spy")

    def __init__(self, instance_name: str = "Spy0", calls: list[str] | None = None) -> None:
        super().__init__(instance_name)
        self.calls: list[str] = [] if calls is None else calls
        self.prefix = "" if calls is None else f"{instance_name}."
        self.results: dict[str, ReturnCode | Exception] = {}

    def taken(self) -> list[str]:
        """Return the callbacks noted since the last call."""
        calls = self.calls[:]
        self.calls.clear()
        return calls

    def note(self, name: str) -> ReturnCode:
        self.calls.append(self.prefix + name)
        result = self.results.get(name, OK)
        if isinstance(result, Exception):
            raise result
        return result

    def on_initialize(self) -> ReturnCode:
        return self.note("on_initialize")

    def on_finalize(self) -> ReturnCode:
        return self.note("on_finalize")

    def on_startup(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_startup")

    def on_shutdown(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_shutdown")

    def on_rate_changed(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_rate_changed")

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_activated")

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_deactivated")

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_execute")

    def on_state_update(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_state_update")

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_aborting")

    def on_error(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_error")

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        return self.note("on_reset")


PERIOD_US = 1_000


class Bench:
    """A spy in an execution context, run period by period."""

    def __init__(self, **results: ReturnCode | Exception) -> None:
        self.spy, self.ec = Spy(), ExecutionContext()
        self.spy.own(self.ec)
        self.spy.initialize()
        self.spy.taken()
        self.spy.results.update(results)

    def period(self) -> list[str]:
        """Run a period and return the callbacks in it."""
        self.ec.tick(self.ec.due_us)
        return self.spy.taken()

    def bring(self, state: str) -> None:
        """Bring the spy into a state with callbacks that succeed, then let them be as wanted."""
        results, self.spy.results = self.spy.results, {}
        if state != "INACTIVE":
            assert self.ec.activate_component(self.spy) is OK
            self.period()
        if state == "ERROR":
            assert self.ec.abort_component(self.spy) is OK
            self.period()
        self.spy.results = results
        assert self.ec.state_of(self.spy).name == state
