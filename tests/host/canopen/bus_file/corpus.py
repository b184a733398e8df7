"""Each mistake that a bus.yml can have: the file, the rule that tells it, where, in which words."""

from __future__ import annotations

from typing import Final, NamedTuple

from tests.host.canopen.bus_file.bench import MASTER, NODE


class Case(NamedTuple):
    """A file with a mistake.

    Attributes:
        rule: that tells it.
        text: of the bus.yml.
        line: where.
        said: a part of the finding.
        alone: whether nothing else is found.
    """

    rule: str
    text: str
    line: int
    said: str
    alone: bool = True


SLEEPY: Final = MASTER + "lamp:\n  node_id: 9\n  dcf: lamp.eds\n"
BEATING: Final = SLEEPY.replace("1}", "1, heartbeat_producer: 100}")
MANY: Final = f"{MASTER}.a: &a {{dcf: lamp.eds, tpdo: {{5: {{cob_id: auto, mapping: []}}}}}}\n"
ROS: Final = "driver: D\n  package: P\n"
ROS_NODE: Final = f"master:\n  node_id: 1\n  {ROS}axis:\n  node_id: 5\n  dcf: epos.eds\n  {ROS}"
ROS_CLASS: Final = (
    "master: {{node_id: 1, driver: D, package: P}}\naxis:\n  node_id: 5\n  dcf: epos.eds\n"
    "  # a driver\n  driver: ros2_canopen::{}\n  package: canopen_{}_driver\n"
)
MAPPED: Final = NODE + "  tpdo:\n    1:\n      mapping:\n        - "

CORPUS: Final = (
    Case("yaml", "master: [1\n", 2, "not YAML: expected ',' or ']'"),
    Case("yaml", "a:\n\tb: 1\n", 2, "not YAML: a tab; indent with spaces"),
    Case("yaml", "a:\n  b: 1\n c: 2\n", 3, "it is indented otherwise than the lines before"),
    Case("yaml", "a:\n  b: 1\n  c:2\n  d: 3\n", 4, "no colon with a space behind it"),
    Case("yaml", "a: @x\n", 1, "'@' that cannot start any token; put it into quotes"),
    Case("yaml", "", 1, "the file is empty"),
    Case("yaml", "master: 1\n--- \nmaster: 2\n", 2, "but found another document"),
    Case("yaml", "a: \x01\n", 1, "a character that no text has"),
    Case("yaml", "- " * 2_000, 1, "nest too deep"),
    Case("yaml-twice", NODE + "  boot: true\n  boot: false\n", 6, "'boot' is there twice: "),
    Case("yaml-twice", NODE + NODE.removeprefix(MASTER), 5, "'axis' is there twice: "),
    Case("yaml-key", NODE + "  ? [a]\n  : 1\n", 5, "a key is a text or a number"),
    Case("yaml-value", NODE + "  boot: !!int x\n", 5, "'x' is no", alone=False),
    Case("yaml-value", NODE + "  namespace: !!python/object:os.system x\n", 5, "'x' is no "),
    Case("yaml-number", NODE + "  scale_pos_to_dev: 010\n", 5, "'010' is octal", alone=False),
    Case("yaml-number", NODE + "  period: 0010\n", 5, "'0010' is octal", alone=False),
    Case("yaml-number", NODE + "  period: 089\n", 5, "'089' is a text for PyYAML", alone=False),
    Case("yaml-number", NODE + "  period: 1:30\n", 5, "'1:30' is base 60", alone=False),
    Case("yaml-number", NODE + "  period: 1_0\n", 5, "'1_0' has _", alone=False),
    Case("yaml-number", NODE + "  period: 0b11\n", 5, "'0b11' is binary", alone=False),
    Case("yaml-number", NODE + "  scale_pos_to_dev: 1.5e3\n", 5, "'1.5e3' is a text", alone=False),
    Case("yaml-number", NODE + "  scale_pos_to_dev: 1e-3\n", 5, "'1e-3' is a text", alone=False),
    Case("yaml-merge", NODE + "  <<: 5\n", 5, "<< takes a mapping"),
    Case("yaml-loop", NODE + "  namespaces: &a [*a]\n", 5, "it holds itself", alone=False),
    Case("kind", MASTER + "axis: 5\n", 2, "'5' is not a mapping", alone=False),
    Case("kind", "master:\n", 1, "nothing is not a mapping"),
    Case("kind", NODE + "  sdo: {index: 1}\n", 5, "sdo: a mapping is not a list"),
    Case("kind", NODE + "  sdo: [5]\n", 5, "'5' is not a mapping", alone=False),
    Case("kind", NODE + "  sdo: [{value: 5}]\n", 5, "an entry of sdo needs an index"),
    Case("kind", NODE + "  software_file: []\n", 5, "a list is not a text"),
    Case("kind", MASTER + "5: {dcf: epos.eds}\n", 2, "the name of a node must be a text"),
    Case("kind", MASTER + "nodes:\n  - axis: {node_id: 5}\n", 2, "a list is not a mapping"),
    Case("kind", "master: {error_behavior: {a: 1}}\n", 1, "a sub-index of 1029h is a number"),
    Case("no-number", NODE + "  heartbeat_producer: soon\n", 5, "'soon' is not a number"),
    Case("no-number", NODE + "  heartbeat_producer: '0x10'\n", 5, "'0x10' is not a number"),
    Case("no-number", NODE + "  heartbeat_multiplier: .nan\n", 5, "'.nan' is not a number"),
    Case("kind", SLEEPY + "  error_behavior: {a: 1}\n", 5, "a sub-index of 1029h is a number"),
    Case("no-number", "master: {start: 'false'}\n", 1, "start: 'false' is not a number"),
    Case("no-number", "master: {time_cob_id: x}\n", 1, "'x' is not a number"),
    Case("no-number", NODE + "  sdo: [{index: '0x6081', value: 1}]\n", 5, "without quotes it is"),
    Case("no-number", NODE + "  sdo: [{index: 6081h, value: 1}]\n", 5, "did you mean 0x6081?"),
    Case("no-number", MAPPED + "{index: 6041h}\n", 8, "did you mean 0x6041?"),
    Case("no-number", NODE.replace("5", "five"), 3, "'five' is not a number"),
    Case("number-range", NODE + "  guard_time: 65536\n", 5, "65536 is not in 0..65535"),
    Case("no-dcf", MASTER + "axis:\n  node_id: 5\n", 2, "no dcf"),
    Case("no-dcf", MASTER + "axis: {node_id: 5, eds: epos.eds}\n", 2, "called dcf, not eds", False),
    Case("no-file", NODE.replace("epos", "epso"), 4, "did you mean 'epos.eds'?"),
    Case("no-file", NODE.replace("epos.eds", '"a\\0b"'), 4, "no file 'a?b'"),
    Case("eds", NODE.replace("epos", "broken"), 172, "DefaultValue=ten is no UNSIGNED32"),
    Case("no-identity", NODE.replace("epos", "bare"), 4, "1018h:01 is not in bare.eds"),
    Case(
        "object-missing", NODE + "  sdo: [{index: 0x5555, value: 0}]\n", 5, "epos.eds has no 5555h"
    ),
    Case(
        "object-missing",
        NODE + "  sdo: [{index: 0x1018, sub_index: 9, value: 0}]\n",
        5,
        "epos.eds:",
    ),
    Case("object-missing", MAPPED + "{index: 0x5555}\n", 8, "5555h:00 does not exist"),
    Case(
        "value-range",
        NODE + "  sdo: [{index: 0x6060, value: 200}]\n",
        5,
        "200 is not a valid INTEGER8",
    ),
    Case(
        "value-type",
        NODE + "  sdo: [{index: 0x1008, value: 0}]\n",
        5,
        "VISIBLE_STRING",
        alone=False,
    ),
    Case("value-range", SLEEPY + "  sdo: [{index: 0x2003, value: -1}]\n", 5, "-1 is not a valid"),
    Case("odd-size", SLEEPY + "  sdo: [{index: 0x2002, value: 5}]\n", 5, "is a UNSIGNED24"),
    Case("pdo-missing", NODE + "  tpdo: {99: {}}\n", 5, "tpdo 99 is not in epos.eds, which has 1,"),
    Case("pdo-missing", NODE + "  tpdo: {'1': {}}\n", 5, "tpdo 1 is not in epos.eds"),
    Case(
        "cob-id-none",
        MANY + "".join(f"n{node}: {{<<: *a, node_id: {node}}}\n" for node in range(2, 99)),
        *(2, "none is left, 0x680..0x6DF are taken"),
    ),
    Case("event-deadline", NODE + "  rpdo: {1: {event_deadline: 5}}\n", 5, "dcfgen fails on it"),
    Case("pdo-key", NODE + "  tpdo: {1: {event_deadline: 5}}\n", 5, "event_deadline of a TPDO"),
    *(
        Case("pdo-key", f"{NODE}  rpdo: {{1: {{{key}: 5}}}}\n", 5, f"{key} of an RPDO: dcfgen")
        for key in ("event_timer", "inhibit_time", "sync_start")
    ),
    Case("no-node-id", MASTER + "axis: {dcf: epos.eds}\n", 2, "no node_id, and none in epos.eds"),
    Case("no-node-id", ROS_NODE.replace("  node_id: 5\n", ""), 5, "and none in epos.eds"),
    Case("no-node-id", NODE.replace("5", "255"), 3, "dcfgen leaves it out"),
    Case("no-node-id", ROS_NODE.replace("  node_id: 1\n", ""), 1, "not in the EDS"),
    Case("node-id", NODE.replace("5", "128"), 3, "128 is not in 1..127"),
    Case("node-id", "master: {node_id: 128}\n", 1, "128 is not in 1..127"),
    Case(
        "node-id-twice",
        NODE + "b: {node_id: 5, dcf: lamp.eds}\n",
        5,
        "5 is also the node-ID of axis",
        False,
    ),
    Case(
        "node-id-twice",
        f"{NODE}b: {{node_id: 5, dcf: epos.eds}}\n",
        5,
        "is also the node-ID of axis",
    ),
    Case("node-id-twice", NODE.replace("5", "1"), 3, "1 is also the node-ID of master: "),
    Case("no-driver", ROS_NODE.replace("  driver: D\n", "", 1), 1, "no driver"),
    Case("no-driver", ROS_NODE[: -len("  package: P\n")], 5, "no package"),
    Case("hidden", ".a: {boot: true}\n" + ROS_NODE, 1, "also takes it for a node"),
    Case("node-name", ROS_NODE.replace("axis", "webmaster"), 5, "'master' is in its name"),
    Case("no-nodes", MASTER + "defaults: {dcf: epos.eds}\n", 2, "defaults, but no nodes"),
    Case("no-master", ROS_NODE[ROS_NODE.index("axis") :], 0, "it has no section master"),
    Case("slaves-only", NODE.removeprefix(MASTER), 0, "it has no section master"),
    Case("sync-period", "master: {sync_period: 10}\n", 1, "a SYNC each 10 µs"),
    Case("bit-rate", "master: {baudrate: 42}\n", 1, "42 kbit/s is not one of 10, 20, 50, "),
    Case("no-value", NODE + "  sdo: [{index: 0x6081}]\n", 5, "6081h:00: no value"),
    Case("driver-class", ROS_CLASS.format("ProxiDriver", "proxy"), 6, "mean 'ProxyDriver'?"),
    Case("driver-class", ROS_CLASS.format("ProxyDriver", "402"), 7, "is in canopen_proxy_driver"),
    Case("driver-value", NODE + "  polling: nope\n", 5, "'nope' is not true or false"),
    Case("driver-value", NODE + "  polling: 1\n", 5, "'1' is not true or false"),
    Case("driver-value", NODE + "  period: fast\n", 5, "'fast' is not a whole number above 0"),
    Case("driver-value", NODE + "  period: []\n", 5, "a list is not a whole number above 0"),
    *(
        Case(
            "driver-value",
            NODE + f"  switching_state: {number}\n",
            5,
            f"'{number}' is not a target state: 2..6, 5 is Operation enabled",
        )
        for number in (1, 7, 8, 99)
    ),
    Case("driver-value", NODE + "  position_mode: 42\n", 5, "'42' is not a mode of CiA 402"),
    Case("driver-value", NODE + "  homing_timeout_seconds: -1\n", 5, "'-1' is not a whole"),
    Case("scale", NODE + "  scale_pos_to_dev: 0\n", 5, "scale_pos_to_dev: 0 times "),
    Case("scale", NODE + "  scale_vel_from_dev: 1\n", 5, "scale_vel_from_dev: 1 is not 1"),
    Case("scale", NODE + "  channels: [{scale_pos_to_dev: 5}]\n", 5, "scale_pos_to_dev: 5 times"),
    Case("file-elsewhere", NODE.replace("epos", "install/epos"), 4, "using the file in "),
    Case("not-whole", NODE + "  heartbeat_producer: 10.5\n", 5, "10.5 is cut off: 10"),
    Case("flag-text", NODE + "  boot: 'no'\n", 5, "'no' is not true or false: true is taken"),
    Case("unknown-key", MASTER + "axis: {dcf: epos.eds, noode_id: 5}\n", 2, "'node_id'?", False),
    Case("unknown-key", MASTER + "axis: {dfc: epos.eds, node_id: 5}\n", 2, "'dcf'?", False),
    Case("unknown-key", NODE + "  heartbeat_prodcer: 5\n", 5, "did you mean 'heartbeat_producer'?"),
    Case(
        "unknown-key", SLEEPY + "  sdo: [{index: 0x2000, value: 1, xyz: 1}]\n", 5, "known: index, "
    ),
    Case("own-key", NODE + "  colour: red\n", 5, "'colour' is not a known key"),
    Case("section-lost", MASTER + "nodes: {}\naxis: {dcf: a}\n", 3, "'axis' is beside nodes"),
    Case(
        "defaults-win",
        MASTER + "defaults: {dcf: io.eds}\nnodes: {a: {node_id: 5, dcf: epos.eds}}\n",
        *(3, "dcf is overridden by defaults: "),
    ),
    Case(
        "defaults-other",
        f"{MASTER}defaults:\n  sdo: [{{index: 0x6081, value: 1}}]\nnodes:\n"
        "  a: {node_id: 5, dcf: epos.eds}\n  b: {node_id: 6, dcf: io.eds}\n",
        *(6, "sdo of defaults are for other nodes: ", False),
    ),
    Case("identity", NODE + "  revision_number: 5\n", 5, "0x00000005, but the EDS has 0x"),
    Case("identity", NODE.replace("epos", "other"), 18, "VendorNumber=0x0000000B is expected"),
    Case("identity-key", NODE + "  vendor_id: 0\n", 5, "vendor_id of a node is not read: 0x"),
    Case("no-object", SLEEPY + "  time_cob_id: 5\n", 5, "lamp.eds has no 1012h"),
    Case("no-object", SLEEPY + "  software_version: 5\n", 5, "lamp.eds has no 1F56h:01"),
    Case("no-object", SLEEPY + "  restore_configuration: 9\n", 5, "lamp.eds has no 1011h:09"),
    Case("no-object", SLEEPY + "  error_behavior: {9: 1}\n", 5, "1029h:9 is not in lamp.eds"),
    Case("no-object", SLEEPY + "  serial_number: 5\n", 5, "lamp.eds has no 1018h:04"),
    Case(
        "read-only",
        NODE + "  sdo: [{index: 0x6041, value: 0}]\n",
        5,
        "6041h:00 cannot be written: ",
    ),
    Case("value-limits", SLEEPY + "  sdo: [{index: 0x2000, value: 99}]\n", 5, "99 is not in"),
    Case("not-mappable", MAPPED + "{index: 0x1017}\n", 8, "1017h:00 cannot be mapped: "),
    Case("direction", MAPPED + "{index: 0x607A}\n", 8, "607Ah:00 cannot be mapped into a TPDO"),
    Case("mapped-length", MAPPED + "{index: 0x6041, bits: 8}\n", 8, "bits: 8, but 6041h:00 has 16"),
    Case("pdo-length", MAPPED + "\n        - ".join(["{index: 0x6064}"] * 3) + "\n", 7, "96 bits"),
    Case("not-enabled", SLEEPY + "  tpdo: {2: {enabled: true}}\n", 5, "with bit 31: it stays off"),
    Case(
        "not-disabled", NODE + "  tpdo: {1: {enabled: false}}\n", 5, "but the master still uses it"
    ),
    Case(
        "cob-id-twice", NODE + "  tpdo: {2: {cob_id: 0x185}}\n", 5, "is also that of TPDO 1 of axis"
    ),
    Case("cob-id-restricted", NODE + "  tpdo: {2: {cob_id: 0x605}}\n", 5, "0x605 is restricted"),
    Case("error-control", SLEEPY + "  guard_time: 5\n", 5, "guarding is left out"),
    Case("no-entry", BEATING + "  heartbeat_consumer: true\n", 5, "no entry of 1016h is free"),
)
