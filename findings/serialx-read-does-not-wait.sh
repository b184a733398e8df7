#!/usr/bin/env bash
# serialx has the names of pyserial, and its read(n) returns what is there at once; pyserial's waits for n bytes.
#
# Seen with serialx 1.15.1 and pyserial 3.5 on a pseudo-terminal, time-out 1 s. The device sends "ab", and "cd" 50 ms later. read(4) of
# pyserial returns "abcd", read(4) of serialx returns "ab".
# Why it matters: a host that is moved from one to the other by its import line gets frames in pieces, and whether it does
# depends on the timing of the device or of its emulator.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check serialx==1.15.1 pyserial==3.5 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import os
import threading
import tty

import serial
import serialx


def read(package):
    master, slave = os.openpty()
    tty.setraw(slave)
    with package.serial_for_url(os.ttyname(slave), baudrate=9600, timeout=1) as port:
        os.write(master, b"ab")
        threading.Timer(0.05, os.write, (master, b"cd")).start()
        return bytes(port.read(4)).decode()


print(read(serial), read(serialx))
PY
)
echo "pyserial 3.5 and serialx 1.15.1 read: $seen"
[ "$seen" = "abcd ab" ] || { echo "changed: they read abcd and ab" >&2; exit 1; }
