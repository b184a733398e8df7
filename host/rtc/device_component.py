"""The base class of components that communicate with a device while they are Active."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Final, Generic, Protocol, TypeVar

from tickrig.host.links.link import DeviceRefused, LinkError
from tickrig.host.rtc.component import ExecutionContext, RtComponent
from tickrig.host.rtc.states import ReturnCode
from tickrig.host.text.log import log_of

_LOG: Final = log_of(__name__)


class _DeviceClient(Protocol):
    """A client that communicates with a device."""

    def close(self) -> None:
        """Release the line."""


C = TypeVar("C", bound=_DeviceClient)


class DeviceComponent(RtComponent, ABC, Generic[C]):
    """Base class of components that communicate with a device while they are Active.

    The component opens the client when it is activated, and closes it when it is deactivated. If
    the connection fails or the device refuses a request, the component logs the reason, closes the
    client and moves to Error. The next activation opens a new client.

    Attributes:
        client: client for the device, or None while the component is not Active.
    """

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.client: C | None = None

    @abstractmethod
    def open_client(self) -> C:
        """Return a new client for the device. Raise LinkError if the device cannot be reached."""

    @abstractmethod
    def exchange(self, ec: ExecutionContext, client: C) -> None:
        """Communicate with the device once in each period while Active.

        Raise LinkError or DeviceRefused if that fails.
        """

    def release(self, ec: ExecutionContext) -> None:
        """Do final work with the device before the client is closed. The default does nothing."""

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Open the client, also after Error."""
        try:
            self.client = self.open_client()
        except LinkError as error:
            return self._failed(ec, error)
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Close the client."""
        self._close(ec)
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Communicate with the device."""
        if self.client is None:
            return ReturnCode.RTC_ERROR
        try:
            self.exchange(ec, self.client)
        except (LinkError, DeviceRefused) as error:
            return self._failed(ec, error)
        return ReturnCode.RTC_OK

    def _failed(self, ec: ExecutionContext, error: Exception) -> ReturnCode:
        _LOG.error("%s: %s", self.instance_name, error)
        self._close(ec)
        return ReturnCode.RTC_ERROR

    def _close(self, ec: ExecutionContext) -> None:
        self.release(ec)
        client, self.client = self.client, None
        try:
            if client is not None:
                client.close()
        except LinkError as error:
            _LOG.warning("%s: %s", self.instance_name, error)
