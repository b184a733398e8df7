#!/usr/bin/env bash
# modbus-serial (Node.js): connectRTU takes each piece of an answer for the whole, connectRTUBuffered waits for all of it.
#
# Seen with modbus-serial 8.0.25 and a slave on a pseudo-terminal that sends a valid answer of 29 bytes in three pieces, 5 ms apart, as a line of
# 9600 bit/s delivers it. connectRTU rejects the first piece ("CRC error"; "Data length error, expected 29 got 1" if it is one byte),
# connectRTUBuffered returns 12 registers.
# Why it matters: connectRTU is the call of the first example that most people read; it works with adapters that
# collect a whole answer and on emulated ports that pass it on at once, and fails on others.
set -euo pipefail
command -v node npm >/dev/null || exit 77
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
(cd "$dir" && npm install --silent --no-audit --no-fund modbus-serial@8.0.25 >/dev/null) || exit 77
cat >"$dir/host.js" <<'JS'
const Modbus = require("modbus-serial");
const [, , how, path] = process.argv;
const host = new Modbus();
host[how](path, { baudRate: 9600 }).then(async () => {
  host.setID(1);
  host.setTimeout(1000);
  try {
    const answer = await host.readHoldingRegisters(0, 12);
    console.log(`${how}: ${answer.data.length} registers`);
  } catch (error) {
    console.log(`${how}: ${error.message}`);
  }
  process.exit();
});
JS
seen=$(cd "$dir" && python3 - <<'PY'
import os
import subprocess
import threading
import time
import tty


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0xA001 if value & 1 else 0)
    return value.to_bytes(2, "little")


def serve(master):
    request = b""
    while len(request) < 8:
        request += os.read(master, 8)
    answer = bytes([1, 3, 24, *range(24)])
    answer += crc(answer)
    for start in range(0, len(answer), 10):
        os.write(master, answer[start : start + 10])
        time.sleep(0.005)


for how in ("connectRTU", "connectRTUBuffered"):
    master, slave = os.openpty()
    tty.setraw(slave)
    threading.Thread(target=serve, args=(master,), daemon=True).start()
    words = ["node", "host.js", how, os.ttyname(slave)]
    print(subprocess.run(words, capture_output=True, text=True, timeout=20).stdout.strip())
PY
)
echo "modbus-serial 8.0.25:"
echo "$seen"
[ "$seen" = "connectRTU: CRC error
connectRTUBuffered: 12 registers" ] || { echo "changed: connectRTU ended in a CRC error" >&2; exit 1; }
