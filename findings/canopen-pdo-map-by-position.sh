#!/usr/bin/env bash
# canopen takes pdo[n] for a position in the mapping up to n = 7 only: a ninth object cannot be reached so.
#
# Seen with canopen 2.4.1. CiA 301 lets a PDO have up to 64 objects, of one bit each. A map with 16 BOOLEANs is
# built and counts 16; map[7] is the eighth, and map[8] is looked up as an object index: KeyError. Iterating
# over the map reaches all.
# Why it matters: a test of a digital module that reads its inputs by position fails from the ninth on.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check canopen==2.4.1 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import canopen
from canopen import objectdictionary as od

objects = od.ObjectDictionary()
inputs = od.ODArray("inputs", 0x2100)
objects.add_object(inputs)
for number in range(17):
    one = od.ODVariable(f"input {number}", 0x2100, number)
    one.data_type = od.BOOLEAN if number else od.UNSIGNED8
    inputs.add_member(one)
for index in (0x1800, 0x1A00):
    record = od.ODRecord(f"{index:X}", index)
    for sub in range(3 if index == 0x1800 else 17):
        entry = od.ODVariable(f"{sub}", index, sub)
        entry.data_type = od.UNSIGNED32 if sub else od.UNSIGNED8
        record.add_member(entry)
    objects.add_object(record)
pdo = canopen.RemoteNode(1, objects).tpdo[1]
for number in range(1, 17):
    pdo.add_variable(0x2100, number, 1)
try:
    ninth = pdo[8].name
except KeyError as error:
    ninth = type(error).__name__
print(len(pdo), pdo[7].subindex, ninth, len(list(pdo)))
PY
)
echo "canopen 2.4.1: objects of the map, sub-index of map[7], map[8], objects by iteration: $seen"
[ "$seen" = "16 8 KeyError 16" ] || { echo "changed: they were 16 8 KeyError 16" >&2; exit 1; }
