"""The ORB of this process, with its address, its objects, and its time limits for peers."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, Final

import omniORB
from omniORB import CORBA, PortableServer
from omniORB import any as omni_any

from tickrig.host.cli.engine_options import Endpoint
from tickrig.host.rtc.engines.openrtm.stubs import stubs
from tickrig.host.rtc.states import ReturnCode, RtcRefused
from tickrig.host.rtc.system.peer_thread import calls_run
from tickrig.host.text.log import log_of

Reference = Any
"""A reference to a CORBA object, in this process or another one."""

_CALL_TIMEOUT_MS: Final = 1_000
_CLOSE_S: Final = 2.0
_POLL_S: Final = 0.005

_LOG: Final = log_of(__name__)

_NOT_CARRIED: Final = re.compile("[\0\ud800-\udfff]")
"""Characters that CORBA cannot carry.

NUL ends a string, and half of a surrogate pair is no character.
"""

_REFUSALS: Final = {
    ReturnCode.BAD_PARAMETER: CORBA.BAD_PARAM,
    ReturnCode.UNSUPPORTED: CORBA.NO_IMPLEMENT,
    ReturnCode.OUT_OF_RESOURCES: CORBA.NO_RESOURCES,
}

_REASONS: Final = {
    "connectfailed": "not reachable",
    "timedout": f"no answer within {_CALL_TIMEOUT_MS / 1_000:g} s",
    "comm_failure": "the connection broke",
    "object_not_exist": "it has ended",
    "nousableprofile": "no such address",
}


class _OrbFailed(RuntimeError):  # noqa: N818 - what an ORB did
    """No ORB can be made in this process."""


class Orb:
    """The CORBA ORB of this process, which serves local objects and makes calls to other processes.

    A process can have only one ORB of omniORB at a time. A call without an answer ends after 1 s
    with `CORBA.TRANSIENT`.

    Args:
        endpoint: address at which the ORB listens.

    Attributes:
        endpoint: address at which the ORB listens.

    Raises:
        OrbFailed: the ORB cannot listen at this address.
    """

    def __init__(self, endpoint: Endpoint | None = None) -> None:
        self.endpoint = endpoint = endpoint or Endpoint()
        self._named: list[tuple[Any, bytes]] = []
        words = ["tickrig"]
        for option, value in _options(endpoint).items():
            words += [f"-ORB{option}", value]
        try:
            self._orb = CORBA.ORB_init(words, CORBA.ORB_ID)
            self._poa = self._orb.resolve_initial_references("RootPOA")
            self._poa._get_the_POAManager().activate()
        except CORBA.INITIALIZE:
            raise _OrbFailed(f"cannot listen at {endpoint}: no address or free port here") from None

    def serve(self, skeleton: type, *answers: object) -> Reference:
        """Make a local object callable by other processes, and return its CORBA reference.

        Args:
            skeleton: skeleton class of the object's interface, from a `..__POA` module.
            answers: objects whose methods, named as in the IDL, execute the operations. The first
                object that has the method is used. The methods are called in threads of the ORB.
                If no object has the method, the caller gets NO_IMPLEMENT. If the method raises an
                exception, the caller gets a CORBA exception: TIMEOUT instead of TimeoutError,
                BAD_PARAM or a similar one instead of RtcRefused, an unchanged CORBA exception, or
                INTERNAL instead of any other. The last one is also logged.

        Returns:
            The reference of the object. Calls through this reference within this process use no
            socket.
        """
        return self._poa.id_to_reference(self._poa.activate_object(_servant(skeleton, answers)))

    def serve_as(self, name: str, skeleton: type, *answers: object) -> Reference:
        """Let peers call an object under the name `corbaloc::HOST:PORT/NAME`; see `serve`."""
        poa = self._orb.resolve_initial_references("omniINSPOA")
        poa._get_the_POAManager().activate()
        self._named.append((poa, name.encode()))
        poa.activate_object_with_id(name.encode(), _servant(skeleton, answers))
        return poa.id_to_reference(name.encode())

    def key(self, reference: Reference) -> bytes:
        """Return a key that identifies an object of this ORB, or an empty key for a foreign one."""
        try:
            found: bytes = self._poa.reference_to_id(reference)
        except (PortableServer.POA.WrongAdapter, CORBA.SystemException):
            return b""
        return found

    def withdraw(self, reference: Reference) -> None:
        """Stop accepting calls of an object. Running calls end as usual."""
        self._poa.deactivate_object(self._poa.reference_to_id(reference))

    def reference(self, text: str) -> Reference:
        """Return the CORBA reference that a text describes, without a request to the object.

        Args:
            text: IOR, or corbaloc URL such as `corbaloc::localhost:2809/NameService`.

        Raises:
            ValueError: the text is neither an IOR nor a corbaloc URL.
        """
        try:
            return self._orb.string_to_object(text)
        except CORBA.SystemException as error:
            raise ValueError(f"{text[:80]!r} is no reference: {explain(error)}") from None

    def text(self, reference: Reference) -> str:
        """Return a reference as an IOR."""
        ior: str = self._orb.object_to_string(reference)
        return ior

    def close(self) -> None:
        """Shut the ORB down: answer the running calls, refuse other calls, and free the port.

        A call to another process may not end, for example if omniORB repeats it because the process
        has closed the connection instead of answering. If a call does not end, the ORB stays open,
        and a line is logged.
        """
        for poa, name in self._named:  # they would outlive this ORB
            poa.deactivate_object(name)
        ending = threading.Thread(target=self._orb.shutdown, args=(True,), daemon=True)
        ending.start()
        ending.join(_CLOSE_S)
        _wait_while(calls_run)
        if ending.is_alive() or calls_run():
            _LOG.warning("OpenRTM: a call into a peer does not end")
            return
        self._orb.destroy()
        _wait_while(_serves)


def _wait_while(is_busy: Callable[[], bool]) -> None:
    """Wait for threads that are about to end, because the process could abort during a call."""
    end_s = time.monotonic() + _CLOSE_S
    while is_busy() and time.monotonic() < end_s:
        time.sleep(_POLL_S)


def _serves() -> bool:
    """Return whether a thread of the ORB is about to end."""
    return any(isinstance(thread, omniORB.WorkerThread) for thread in threading.enumerate())


def nvlist(values: Mapping[str, str]) -> list[Any]:
    """Return properties as an NVList, the list of names and values that CORBA operations use.

    Characters that a CORBA string cannot contain are replaced by U+FFFD, and the text is logged.
    Without the replacement, the ORB would refuse the whole answer.
    """
    name_value = stubs().sdo.NameValue
    return [
        name_value(carried(name, name), omni_any.to_any(carried(name, value)))
        for name, value in values.items()
    ]


def carried(name: str, text: str) -> str:
    """Return a text in which characters that a CORBA string cannot contain are replaced by U+FFFD.

    If there are such characters, the text is logged.

    Args:
        name: name of the property, for the log.
        text: text to send.
    """
    sent = _NOT_CARRIED.sub("\N{REPLACEMENT CHARACTER}", text)
    if sent != text:
        _LOG.warning(
            "OpenRTM: %r: a CORBA string cannot carry %r, it is sent as %r", name, text, sent
        )
    return sent


def explain(error: Exception) -> str:
    """Explain in a few words why a call had no answer."""
    text = str(error)
    found = (words for mark, words in _REASONS.items() if mark in text.lower())
    return next(found, text or type(error).__name__)


def _options(endpoint: Endpoint) -> dict[str, str]:
    return {
        "endPoint": endpoint.uri,
        "clientCallTimeOutPeriod": str(_CALL_TIMEOUT_MS),
        "clientConnectTimeOutPeriod": str(_CALL_TIMEOUT_MS),
        "nativeCharCodeSet": "UTF-8",  # else only Latin-1 can be sent
        "traceLevel": "0",  # it would write to standard error
    }


def _servant(skeleton: type, answers: tuple[object, ...]) -> Any:
    servant: Any = skeleton()
    for name in servant._omni_op_d:  # its operations
        found = (getattr(one, name) for one in answers if hasattr(one, name))
        if (operation := next(found, None)) is not None:
            setattr(servant, name, _answering(operation))
    return servant


def _answering(operation: Callable[..., Any]) -> Callable[..., Any]:
    """Return an operation that always ends in an answer."""

    @wraps(operation)
    def answer(*args: Any) -> Any:
        try:
            return operation(*args)
        except CORBA.Exception:
            raise
        except TimeoutError as error:
            raise CORBA.TIMEOUT(0, CORBA.COMPLETED_NO) from error
        except RtcRefused as error:
            kind = _REFUSALS.get(error.code, CORBA.BAD_INV_ORDER)
            raise kind(0, CORBA.COMPLETED_NO) from error
        except Exception as error:
            _LOG.exception("OpenRTM: %s raised", operation.__name__)
            raise CORBA.INTERNAL(0, CORBA.COMPLETED_MAYBE) from error

    return answer
