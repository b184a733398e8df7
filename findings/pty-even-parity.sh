#!/usr/bin/env bash
# A Linux pseudo-terminal can be opened once with even parity or 7 bits; the second time the C library reports EINVAL.
#
# Seen with pyserial 3.5 (and Linux 6.18, glibc 2.36). A pseudo-terminal drops PARENB and CS7 without an error. glibc reports EINVAL if nothing of
# what was asked for took effect: on a fresh pseudo-terminal other flags change too, later none does. What comes out of pyserial
# is termios.error, which is neither OSError nor SerialException. The same happens when a host sets `port.timeout` of an open port.
# Why it matters: hosts of 8E1 or 7E1 devices (the default of Modbus RTU) pass their first test on an emulated port and fail from the second on.
# A pseudo-terminal whose CLOCAL is cleared in between can be opened again.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
[ "$(uname)" = Linux ] || exit 77
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyserial==3.5 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import os
import termios
import tty

import serial

master, slave = os.openpty()
tty.setraw(slave)


def outcome():
    try:
        with serial.Serial(os.ttyname(slave), 9600, bytesize=7, parity="E"):
            return "opened"
    except (OSError, serial.SerialException) as error:
        return type(error).__name__
    except termios.error as error:
        return f"termios.error {error.args[0]}"


seen = [outcome(), outcome()]
attributes = termios.tcgetattr(slave)
attributes[2] &= ~termios.CLOCAL
termios.tcsetattr(slave, termios.TCSANOW, attributes)
print(*seen, outcome(), sep=", ")
PY
)
echo "pyserial 3.5, 7E1 on a pseudo-terminal: $seen"
[ "$seen" = "opened, termios.error 22, opened" ] ||
    { echo "changed: it was opened, termios.error 22, opened" >&2; exit 1; }
