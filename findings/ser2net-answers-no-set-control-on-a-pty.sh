#!/usr/bin/env bash
# pyserial's rfc2217:// cannot open a pseudo-terminal behind ser2net, unless ?ign_set_control is given.
#
# Seen with ser2net 4.3.11 of Debian 12 and pyserial 3.5. A pseudo-terminal has no modem lines, so the server cannot set DTR and RTS, and
# it sends no answer to SET-CONTROL, for which pyserial waits 3 s; bit rate and parity of the same open are answered.
# Why it matters: whoever puts ser2net before an emulated device takes the emulator to be at fault.
set -euo pipefail
dir=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check pyserial==3.5 || exit 77
(cd "$dir" && apt-get download -qq ser2net=4.3.11\* libgensio4 2>/dev/null &&
    for package in *.deb; do dpkg -x "$package" .; done) || exit 77
"$dir/venv/bin/python" - >"$dir/path" <<'PY' &
import os
import sys
import tty

master, slave = os.openpty()
tty.setraw(slave)
print(os.ttyname(slave), flush=True)
while True:
    os.read(master, 100)
PY
for _ in {1..100}; do [ -s "$dir/path" ] && break; sleep 0.1; done
port=$(python3 -c 'import socket; s = socket.create_server(("127.0.0.1", 0)); print(s.getsockname()[1])')
cat >"$dir/ser2net.yaml" <<YAML
connection: &con
  accepter: telnet(rfc2217),tcp,127.0.0.1,$port
  connector: serialdev,$(cat "$dir/path"),115200n81,local
YAML
lib=$(dirname "$(find "$dir/usr/lib" -name 'libgensio.so*' | head -n 1)")
LD_LIBRARY_PATH=$lib "$dir/usr/sbin/ser2net" -n -c "$dir/ser2net.yaml" >/dev/null 2>&1 &
for _ in {1..100}; do (: <"/dev/tcp/127.0.0.1/$port") 2>/dev/null && break; sleep 0.1; done
sleep 0.5
seen=$("$dir/venv/bin/python" - "$port" <<'PY'
import sys

import serial

for option in ("", "?ign_set_control"):
    try:
        with serial.serial_for_url(f"rfc2217://127.0.0.1:{sys.argv[1]}{option}"):
            print(option or "plain", "opens")
    except serial.SerialException as error:
        print(option or "plain", error)
PY
)
echo "pyserial 3.5 at ser2net 4.3.11 before a pseudo-terminal:"
echo "$seen"
[ "$seen" = "plain timeout while waiting for option 'control'
?ign_set_control opens" ] || { echo "changed" >&2; exit 1; }
