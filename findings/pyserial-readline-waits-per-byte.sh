#!/usr/bin/env bash
# The time-out of pyserial's readline() begins again with each byte; that of read() and read_until() is for the whole call.
#
# Seen with pyserial 3.5 on a pseudo-terminal, time-out 1 s. The device sends "SLOW\n", one byte each 0.6 s, which takes 3 s. readline()
# returns the whole line after 3 s. read_until(b"\n") and read(5) return what came in the first second: the first bytes.
# Why it matters: a host that calls readline(timeout=1) is not done after a second. A device that sends a byte now and then keeps it
# for as long as it likes, so a test of a host's time-out that only silences the device does not see this.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyserial==3.5 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import os
import threading
import time
import tty

import serial

LINE = b"SLOW\n"


def send(master):
    for byte in LINE:
        time.sleep(0.6)
        os.write(master, bytes([byte]))


def call(name, *args):
    master, slave = os.openpty()
    tty.setraw(slave)
    with serial.Serial(os.ttyname(slave), timeout=1) as port:
        sender = threading.Thread(target=send, args=(master,))
        sender.start()
        begun = time.monotonic()
        got = getattr(port, name)(*args)
        took = time.monotonic() - begun
        sender.join()
    whole = "the whole line" if got == LINE else "a part"
    return f"{name}: {whole}, {'after more than twice the time-out' if took > 2 else 'in time'}"


print("; ".join((call("readline"), call("read_until", b"\n"), call("read", 5))))
PY
)
echo "pyserial 3.5, time-out 1 s: $seen"
[ "$seen" = "readline: the whole line, after more than twice the time-out; read_until: a part, in time; read: a part, in time" ] ||
    { echo "changed: see the comment of this script" >&2; exit 1; }
