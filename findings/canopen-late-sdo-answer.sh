#!/usr/bin/env bash
# canopen: after one late answer each read of that object returns the value of the read before.
#
# Seen with canopen 2.4.1 and python-can 4.6.1 on the interface `virtual`. The client waits for 0.05 s and makes no second try.
# The node here counts its uploads of 2000h; it works on the first one for 0.07 s and on each later one for 0.02 s. The first
# read ends in a time-out, and its answer is then taken for that to the second read, the second answer for that to the
# third read, and so on, without an error: CiA 301 gives an expedited upload no number by which to tell them apart,
# and the client empties its queue only before it sends.
# Why it matters: after one time-out a test that polls an object passes or fails on old values.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check canopen==2.4.1 python-can==4.6.1 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import logging
import threading
import time

import can
import canopen

logging.disable(logging.CRITICAL)
server = can.Bus(interface="virtual", channel="late")


def serve():
    uploads = 0
    while (request := server.recv(2)) is not None:
        if request.arbitration_id == 0x605 and request.data[0] == 0x40:
            uploads += 1
            data = [0x4F, 0x00, 0x20, 0x00, uploads, 0, 0, 0]
            answer = can.Message(arbitration_id=0x585, is_extended_id=False, data=data)
            time.sleep(0.07 if uploads == 1 else 0.02)
            server.send(answer)


threading.Thread(target=serve, daemon=True).start()
network = canopen.Network()
network.connect(interface="virtual", channel="late")
node = network.add_node(5, canopen.ObjectDictionary())
node.sdo.RESPONSE_TIMEOUT, node.sdo.MAX_RETRIES = 0.05, 1
seen = []
for read in range(1, 5):
    try:
        seen.append(f"{read}:{node.sdo.upload(0x2000, 0)[0]}")
    except canopen.SdoCommunicationError:
        seen.append(f"{read}:time-out")
network.disconnect()
print(*seen)
PY
)
echo "canopen 2.4.1: number of the read and the value that came: $seen"
[ "$seen" = "1:time-out 2:1 3:2 4:3" ] || { echo "changed: it was 1:time-out 2:1 3:2 4:3" >&2; exit 1; }
