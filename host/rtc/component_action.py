"""The callbacks of a component (OMG RTC 1.0, ComponentAction)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Final, ParamSpec

from tickrig.host.rtc.states import ReturnCode
from tickrig.host.text.log import log_of

if TYPE_CHECKING:
    from tickrig.host.rtc.execution import ExecutionContext

_OK: Final = ReturnCode.RTC_OK

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
        return failed(who, callback)


def failed(who: str, callback: Callable[..., ReturnCode]) -> ReturnCode:
    """Log the exception that a callback has raised; it counts as RTC_ERROR."""
    _LOG.exception("%s: %s raised", who, callback.__name__)
    return ReturnCode.RTC_ERROR


class ComponentAction:
    """What a component does, one method a callback; each does nothing until overridden.

    A callback returns RTC_OK or what went wrong: then Error comes next, but where its
    docstring says otherwise. An exception is logged and counts as RTC_ERROR. No callback
    waits: time passes between them. Its argument `ec` is the execution context that runs it;
    the time is `ec.now_us`.
    """

    def on_initialize(self) -> ReturnCode:
        """Begin; it stays Created if this returns another code than RTC_OK."""
        return _OK

    def on_finalize(self) -> ReturnCode:
        """End, whatever this returns."""
        return _OK

    def on_startup(self, ec: ExecutionContext) -> ReturnCode:
        """Take the start of the execution context `ec`."""
        return _OK

    def on_shutdown(self, ec: ExecutionContext) -> ReturnCode:
        """Take the stop of the execution context `ec`."""
        return _OK

    def on_rate_changed(self, ec: ExecutionContext) -> ReturnCode:
        """Take another rate of the execution context `ec`."""
        return _OK

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Become Active in `ec`."""
        return _OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Leave Active in `ec`, for Inactive or for Error."""
        return _OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Work, once a period of `ec` in Active: the first pass."""
        return _OK

    def on_state_update(self, ec: ExecutionContext) -> ReturnCode:
        """Work, once a period in Active, after on_execute of every component of `ec`."""
        return _OK

    def on_aborting(self, ec: ExecutionContext) -> ReturnCode:
        """Enter Error in `ec`; what this returns is ignored."""
        return _OK

    def on_error(self, ec: ExecutionContext) -> ReturnCode:
        """Work, once a period of `ec` in Error; what this returns is ignored."""
        return _OK

    def on_reset(self, ec: ExecutionContext) -> ReturnCode:
        """Leave Error in `ec`, if this returns RTC_OK: for Inactive."""
        return _OK
