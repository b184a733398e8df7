"""All rules for a bus.yml: name, who says so, what breaks, what to do."""

from __future__ import annotations

from typing import Final

from tickrig.host.canopen.data_sheet.rule import rules_of

YAML: Final = "YAML 1.1"
DCFGEN: Final = "dcfgen"
COGEN: Final = "cogen"
READERS: Final = "dcfgen, ros2_canopen"
CONTAINER: Final = "device container of ros2_canopen"
DRIVERS: Final = "drivers of ros2_canopen"

_ERRORS: Final = (
    ("yaml", YAML, "nothing of it can be read", "mend this line, or the one before"),
    ("yaml-twice", YAML, "dcfgen takes the last, the container the first", "keep one"),
    ("yaml-key", YAML, "readers refuse the file", "give a text or a number"),
    ("yaml-value", YAML, "readers refuse the file", "write what the tag says, or leave it out"),
    ("yaml-merge", YAML, "readers refuse the file", "merge a mapping: <<: *name"),
    ("yaml-loop", YAML, "readers do not end", "write it out"),
    (
        "kind",
        READERS,
        "dcfgen or a driver refuses it",
        "write it as docs/reference/canopen/bus-file.md has it",
    ),
    ("no-number", READERS, "dcfgen or a driver refuses it", "write a number, as 10 or 0xA"),
    ("number-range", DCFGEN, "dcfgen refuses it, or the value is cut off", "give one of its range"),
    ("no-dcf", DCFGEN, "dcfgen refuses the file", "dcf: the name of its EDS or DCF"),
    ("no-file", DCFGEN, "dcfgen refuses the file", "put the EDS beside bus.yml"),
    ("eds", "CiA 306", "the dictionary is another one, or none", "canmon eds check tells more"),
    ("no-identity", DCFGEN, "dcfgen refuses the EDS", "describe 1000h and 1018h:01"),
    ("object-missing", DCFGEN, "dcfgen refuses the file", "write to what is there"),
    ("value-range", DCFGEN, "dcfgen refuses the file", "give a value of its data type"),
    ("value-type", DCFGEN, "dcfgen cannot write such a type", "write it by the driver"),
    ("odd-size", DCFGEN, "all writes behind it are lost", "write it by the driver"),
    ("pdo-missing", DCFGEN, "dcfgen refuses the file", "configure a PDO that is there"),
    ("cob-id-none", DCFGEN, "dcfgen refuses the file", "give COB-IDs of your own"),
    ("event-deadline", DCFGEN, "dcfgen fails, or writes the event timer", "write 14xxh:05 as sdo"),
    ("no-master", CONTAINER, "dcfgen and the container refuse the file", "master: node_id: 1"),
    ("no-node-id", CONTAINER, "the container refuses the node", "node_id: 1 to 127"),
    ("node-id", "CiA 301 7.2", "no node has it", "node_id: 1 to 127"),
    ("node-id-twice", "CiA 301 7.2", "two nodes answer to one master", "give each its own"),
    ("no-driver", CONTAINER, "the container refuses the node", "driver: a class, package: where"),
    (
        "hidden",
        CONTAINER,
        "the container stops here",
        "<<: &name in the first node: docs/reference/canopen/bus-file.md",
    ),
    ("node-name", CONTAINER, "the container does not load it", "give it another name"),
    ("no-nodes", COGEN, "cogen writes nothing", "nodes: NAME: ..."),
    (
        "tickrig",
        "canopen-slave-emu",
        "no slave is made of it",
        "docs/howto/ros2-canopen.md has all keys",
    ),
)
_WARNINGS: Final = (
    (
        "yaml-number",
        READERS,
        "dcfgen and the drivers have two numbers",
        "write 10, 0xA, 1.5 or 1.5e+3",
    ),
    (
        "eds-check",
        "canmon eds check",
        "dcfgen stops, or misreads it",
        "canmon eds fix mends a part",
    ),
    ("slaves-only", DCFGEN, "dcfgen refuses the file", "master: node_id: 1"),
    ("file-elsewhere", DCFGEN, "dcfgen, which runs beside bus.yml, fails", "put the EDS there"),
    ("sync-period", DCFGEN, "nothing else has time on the bus", "give µs: 10 ms are 10000"),
    ("bit-rate", "CiA 301", "devices have no such bit rate", "baudrate: 125, 250, 500 or 1000"),
    ("no-value", DCFGEN, "dcfgen writes 0", "value: what is meant"),
    ("driver-class", CONTAINER, "the container finds no such driver", "a class and its package"),
    ("driver-value", DRIVERS, "the driver takes another one, or fails", "give what it takes"),
    ("scale", DRIVERS, "the joint is not where ROS has it", "from_dev: 1 divided by to_dev"),
    (
        "bus-load",
        DRIVERS,
        "periods are left out, heartbeats are late",
        "map what is polled into PDOs, or a longer period",
    ),
    ("not-whole", DCFGEN, "dcfgen cuts it off", "write a whole number"),
    ("flag-text", DCFGEN, "dcfgen takes any text for true", "true or false, without quotes"),
    (
        "pdo-key",
        DCFGEN,
        "dcfgen drops it",
        "a TPDO has event_timer, inhibit_time, sync_start; write 14xxh:05 of an RPDO as sdo",
    ),
    ("unknown-key", DCFGEN, "nobody reads it", "write the key that is meant"),
    ("section-lost", COGEN, "cogen drops it", "put it under nodes:"),
    (
        "defaults-win",
        COGEN,
        "cogen overwrites what the node says",
        "an anchor, not defaults: docs/reference/canopen/bus-file.md",
    ),
    (
        "defaults-other",
        COGEN,
        "they are written to it, too",
        "an anchor: docs/reference/canopen/bus-file.md",
    ),
    ("identity-key", DCFGEN, "the master checks what the EDS says", "write it into the EDS"),
    ("identity", DCFGEN, "the master refuses the node", "give bus.yml and EDS one number"),
    ("no-object", DCFGEN, "dcfgen leaves it out", "leave the key out"),
    ("read-only", DCFGEN, "the node refuses it at boot-up", "leave it out, or mend the EDS"),
    (
        "value-limits",
        "CiA 306",
        "the node refuses it at boot-up",
        "give a value between the limits",
    ),
    ("not-mappable", DCFGEN, "the node refuses it at boot-up", "map what can be mapped"),
    ("direction", "CiA 306", "the node refuses it at boot-up", "map it the other way"),
    ("pdo-length", DCFGEN, "the node refuses it at boot-up", "map at most 64 bits"),
    ("mapped-length", DCFGEN, "dcfgen takes the length of the EDS", "leave bits out"),
    ("not-enabled", DCFGEN, "the PDO is never sent", "cob_id: auto"),
    ("cob-id-twice", "CiA 301", "one CAN-ID means two things", "cob_id: auto, or another one"),
    ("cob-id-restricted", "CiA 301", "it clashes with a service", "cob_id: auto, or another one"),
    ("error-control", DCFGEN, "dcfgen drops guarding", "keep heartbeat or guarding"),
    ("no-entry", DCFGEN, "the node does not watch the master", "free an entry of 1016h"),
    ("joint", "canopen-slave-emu", "the slave is not what is meant", "let the files agree"),
)
_NOTES: Final = (
    ("own-key", CONTAINER, "nothing", "leave it, if a driver of your own reads it"),
    ("not-disabled", DCFGEN, "the master has a PDO that never comes", "mapping: []"),
)

RULES: Final = rules_of(_ERRORS, _WARNINGS, _NOTES)
"""By name, errors first."""
