#!/usr/bin/env bash
# hokuyolx computes wrong angles for every scanner whose first measured step (AMIN) is not 0.
#
# Seen with hokuyolx 0.9.0; no sensor is needed, the angles are computed from its parameters. By the SCIP 2.0
# specification the angle of a step is (step - AFRT) * 360 / ARES. The table of hokuyolx begins at AMIN, and it is cut by step
# numbers, which begin at 0. With the parameters of a URG-04LX (AMIN 44, AMAX 725, AFRT 384, ARES 1024) the step
# to the front has 15.5 degrees instead of 0.
# Why it matters: with this host at an emulated or real URG-04LX distances are right and directions are not.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check hokuyolx==0.9.0 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
from math import degrees

from hokuyolx import HokuyoLX

laser = HokuyoLX.__new__(HokuyoLX)
laser.amin, laser.amax, laser.aforw, laser.ares = 44, 725, 384, 1024
print(f"{degrees(laser.get_angles(384, 385)[0]):.1f}")
PY
)
echo "hokuyolx 0.9.0: the step to the front of a URG-04LX has $seen degrees"
[ "$seen" = 15.5 ] || { echo "changed: it had 15.5 degrees" >&2; exit 1; }
