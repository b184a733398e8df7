#!/usr/bin/env bash
# canopen reads a mapped text by the length of its data type, and not by the length of the mapping.
#
# Seen with canopen 2.4.1. A UNICODE_STRING is mapped with 16 bits, one character, as the node's mapping entry
# says. What the PDO holds is right, and the variable's `length` is 16; but its value is read from one byte,
# which is no character of UTF-16, and comes out empty. Three such objects in one PDO are all empty.
# Why it matters: a master's test sees no text though the frame on the bus is right. Take the PDO's `data`.
set -euo pipefail
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
python3 -m venv "$dir/venv"
"$dir/venv/bin/pip" install --quiet --disable-pip-version-check canopen==2.4.1 || exit 77
seen=$("$dir/venv/bin/python" - <<'PY'
import canopen
from canopen import objectdictionary as od

objects = od.ObjectDictionary()
for index in (0x1800, 0x1A00):
    record = od.ODRecord(f"{index:X}", index)
    for sub in range(4):
        entry = od.ODVariable(f"{sub}", index, sub)
        entry.data_type = od.UNSIGNED32 if sub else od.UNSIGNED8
        record.add_member(entry)
    objects.add_object(record)
for number in range(3):
    text = od.ODVariable(f"text {number}", 0x2101 + number)
    text.data_type = od.UNICODE_STRING
    objects.add_object(text)
pdo = canopen.RemoteNode(1, objects).tpdo[1]
for number in range(3):
    pdo.add_variable(0x2101 + number, 0, 16)
pdo.data = bytearray("abc".encode("utf-16-le"))
print(pdo[0].length, [text.raw for text in pdo], bytes(pdo.data).hex())
PY
)
echo "canopen 2.4.1: length, values, data of a PDO of three characters: $seen"
[ "$seen" = "16 ['', '', ''] 610062006300" ] || { echo "changed: 16 ['', '', ''] 610062006300" >&2; exit 1; }
