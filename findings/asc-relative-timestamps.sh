#!/usr/bin/env bash
# python-can does not add up the times of a Vector ASC log whose header says `timestamps relative`.
#
# Seen with python-can 4.6.1. In such a log each time is counted from the event before it. Four heartbeats
# 100 ms apart are written as 0.100 each; the reader gives all four the same time, with
# relative_timestamp=True, and one later than the date by 0.1 s with False. asc2log of can-utils adds them up.
# Why it matters: the period of a heartbeat in such a log is 0, and a player sends all frames at once.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check python-can==4.6.1 || exit 77
cat >"$dir/log.asc" <<'LOG'
date Tue Jan 13 10:00:00.000 2026
base hex  timestamps relative
internal events logged
Begin Triggerblock Tue Jan 13 10:00:00.000 2026
   0.100000 1  705             Rx   d 1 05
   0.100000 1  705             Rx   d 1 05
   0.100000 1  705             Rx   d 1 05
   0.100000 1  705             Rx   d 1 05
End TriggerBlock
LOG
seen=$("$dir/venv/bin/python" - "$dir/log.asc" <<'PY'
import sys

import can

print(*(f"{frame.timestamp:.3f}" for frame in can.ASCReader(sys.argv[1], relative_timestamp=True)))
PY
)
echo "python-can 4.6.1: four heartbeats 100 ms apart come with the time stamps $seen"
[ "$seen" = "0.100 0.100 0.100 0.100" ] || { echo "changed: they were 0.100 0.100 0.100 0.100" >&2; exit 1; }
