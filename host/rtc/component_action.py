"""The callbacks of a component (OMG RTC 1.0, ComponentAction)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, ParamSpec

from tickrig.host.rtc.states import ReturnCode
from tickrig.host.text.log import log_of

if TYPE_CHECKING:
    from tickrig.host.rtc.execution.execution_context import ExecutionContext

OK: Final = ReturnCode.RTC_OK

_LOG: Final = log_of(__name__)

P = ParamSpec("P")


def guarded(
    who: str, callback: Callable[P, ReturnCode], *args: P.args, **kwargs: P.kwargs
) -> ReturnCode:
    """Run a callback; what it raises is logged and counts as RTC_ERROR.

    Any exception is caught, here and from listeners of ports: what one
    component does must not end the others.
    """
    try:
        return callback(*args, **kwargs)
    except Exception:
        _LOG.exception("%s: %s raised", who, callback.__name__)
        return ReturnCode.RTC_ERROR


class ComponentAction:
    """What a component does, one method a callback; each does nothing until overridden.

    A callback returns RTC_OK or what went wrong. An exception is logged and
    counts as RTC_ERROR. No callback waits: time passes between them. It reads
    the time from its execution context.
    """

    def on_initialize(self) -> ReturnCode:
        """Created to alive; with another code than RTC_OK it stays Created."""
        return OK

    def on_finalize(self) -> ReturnCode:
        """The end, whatever is returned."""
        return OK

    def on_startup(self, ec: ExecutionContext) -> ReturnCode:
        """The execution context was started."""
        return OK

    def on_shutdown(self, ec: ExecutionContext) -> ReturnCode:
        """The execution context was stopped."""
        return OK

    def on_rate_changed(self, ec: ExecutionContext) -> ReturnCode:
        """The execution context has another rate."""
        return OK

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Inactive to Active."""
        return OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Active is left, for Inactive or for Error."""
        return OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Once a period in Active, the first pass."""
        return OK

    def on_state_update(self, ec: ExecutionContext) -> ReturnCode:
        """Once a period in Active, after on_execute of every component of the context."""
        return OK

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        """Error is entered."""
        return OK

    def on_error(self, ec: ExecutionContext) -> ReturnCode:
        """Once a period in Error."""
        return OK

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """A reset was asked for in Error; RTC_OK leads to Inactive."""
        return OK
