"""A bus of python-can's udp_multicast, kept to its group.

python-can binds its socket to a port alone. Linux then gives it what comes on that port for
any group that any program of this machine has joined (ip(7), IP_MULTICAST_ALL).
"""

from __future__ import annotations

import os
import socket
import sys
from contextlib import suppress
from typing import Final

import can

INTERFACE: Final = "udp_multicast"
IP_MULTICAST_ALL: Final = 49
IPV6_MULTICAST_ALL: Final = 29


def keep_to_group(bus: can.BusABC, interface: str) -> None:
    """Let a bus hear its own group alone, from now on; other interfaces are left as they are.

    Elsewhere than on Linux there is no such option, and no need.
    """
    if interface != INTERFACE or sys.platform != "linux":
        return
    with socket.socket(fileno=os.dup(bus.fileno())) as sock:
        with suppress(OSError):  # IPv6 before Linux 4.20
            if sock.family == socket.AF_INET6:
                sock.setsockopt(socket.IPPROTO_IPV6, IPV6_MULTICAST_ALL, 0)
            else:
                sock.setsockopt(socket.IPPROTO_IP, IP_MULTICAST_ALL, 0)
        with suppress(BlockingIOError):
            while True:  # what came before
                sock.recv(1, socket.MSG_DONTWAIT)
