"""Where a serial line is served: `rfc2217://[HOST:]PORT` or `socket://[HOST:]PORT`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from tickrig.host.text.values import MOST_PORT, parse_port

SCHEMES: Final = ("rfc2217", "socket")
LOOPBACK: Final = "127.0.0.1"


@dataclass(frozen=True, slots=True)
class ServeUrl:
    """An address to listen at, and what is spoken there.

    Attributes:
        scheme: `rfc2217`, or `socket` for the bytes of the line and nothing else.
        host: name or address of this machine, an IPv6 address without brackets.
        port: TCP port; 0 lets the system pick one.
    """

    scheme: str
    host: str = LOOPBACK
    port: int = 0

    def __str__(self) -> str:
        """Return the URL as pyserial opens it."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.scheme}://{host}:{self.port}"


def parse_serve_url(text: str) -> ServeUrl:
    """Read where a line is to be served.

    Args:
        text: `SCHEME://[HOST:]PORT`; without a host only this machine can connect.

    Raises:
        ValueError: it is none; the text says what came and what is allowed.

    >>> str(parse_serve_url("rfc2217://7000")), str(parse_serve_url("socket://[::1]:0"))
    ('rfc2217://127.0.0.1:7000', 'socket://[::1]:0')
    """
    scheme, found, place = text.partition("://")
    if not found or scheme not in SCHEMES:
        allowed = " or ".join(f"{name}://[HOST:]PORT" for name in SCHEMES)
        raise ValueError(f"{text!r} is not {allowed}")
    host, colon, port = place.rpartition(":")
    bare = host[1:-1] if host[:1] + host[-1:] == "[]" else host
    if colon and not bare:
        raise ValueError(f"{text!r}: no host before the colon; 0.0.0.0 is every address")
    number = parse_port(port)
    if number is None:
        raise ValueError(f"{text!r}: port {port!r} is not in 0..{MOST_PORT}")
    if ":" in bare and bare == host:
        raise ValueError(f"{text!r}: an IPv6 address stands in brackets, as [::1]")
    return ServeUrl(scheme, bare or LOOPBACK, number)
