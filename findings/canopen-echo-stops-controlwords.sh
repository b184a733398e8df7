#!/usr/bin/env bash
# canopen: on a bus that returns sent frames, BaseNode402 sends two controlwords and then no more.
#
# Seen with canopen 2.4.1 and python-can 4.6.1. The bus `udp_multicast` of python-can gives each frame back to its sender. The
# library subscribes to the RPDO that it sends itself (`PdoMap.save` does it, here `subscribe`), measures the time between two of
# these echoes, and takes the RPDO for a periodic one. From then on `BaseNode402.controlword` only stores the value, because a
# periodic PDO is sent by a task; but there is no task. On the bus `virtual` all four controlwords are sent.
# Why it matters: the drive stays in the state of the second controlword, and the program ends with "Timeout when trying to
# change state", which looks like a fault of the drive. Unsubscribing from the RPDO (`network.unsubscribe(pdo.cob_id)`) helps.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check canopen==2.4.1 'python-can[multicast]==4.6.1' || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import logging
import time

import can
import canopen
from canopen import objectdictionary as od

logging.disable(logging.CRITICAL)


def variable(name, index, sub, kind):
    made = od.ODVariable(name, index, sub)
    made.data_type = kind
    return made


def dictionary():
    made = canopen.ObjectDictionary()
    for index in (0x1400, 0x1600):
        record = od.ODRecord(f"{index:04X}h", index)
        for sub in range(3):
            record.add_member(variable(f"sub {sub}", index, sub, od.UNSIGNED32))
        made.add_object(record)
    made.add_object(variable("Controlword", 0x6040, 0, od.UNSIGNED16))
    return made


def sent(unsubscribe=False, **bus):
    """Return the controlwords of four that another member of the bus receives."""
    network = canopen.Network()
    with can.Bus(**bus) as other:
        network.connect(**bus)
        node = network.add_node(canopen.BaseNode402(5, dictionary()))
        pdo = node.rpdo[1]
        pdo.cob_id, pdo.enabled = 0x205, True
        pdo.clear()
        pdo.add_variable(0x6040)
        pdo.subscribe()
        if unsubscribe:
            network.unsubscribe(pdo.cob_id)
        node.rpdo_pointers[0x6040] = pdo[0x6040]
        for word in (6, 7, 15, 31):
            node.controlword = word
            time.sleep(0.1)
        network.disconnect()
        words = []
        while (message := other.recv(0.2)) is not None:
            words.append(message.data[0])
    return ",".join(map(str, words))


udp = {"interface": "udp_multicast", "channel": "239.74.163.2", "port": 43199, "hop_limit": 0}
print(f"virtual:{sent(interface='virtual', channel='echo')}", f"udp:{sent(**udp)}", f"apart:{sent(True, **udp)}")
PY
)
echo "canopen 2.4.1: controlwords of 6, 7, 15 and 31 that reach the bus: $seen"
[ "$seen" = "virtual:6,7,15,31 udp:6,7 apart:6,7,15,31" ] || { echo "changed: it was virtual:6,7,15,31 udp:6,7 apart:6,7,15,31" >&2; exit 1; }
