"""Shapes of bus.yml, as people write them, with the nodes of `bench.write_bus`."""

from __future__ import annotations

from typing import Final

PLAIN: Final = """\
options:
  dcf_path: "@BUS_CONFIG_PATH@"

master:
  node_id: 1
  driver: "ros2_canopen::MasterDriver"
  package: "canopen_master_driver"
  sync_period: 10000

left:
  node_id: 2
  dcf: epos.eds
  driver: "ros2_canopen::Cia402Driver"
  package: "canopen_402_driver"
  period: 10
  revision_number: 0
  sdo:
    - {index: 0x6081, sub_index: 0, value: 1000}
    - {index: 0x6083, value: 2000}
    - {index: 0x6060, value: -3}
  tpdo:
    1:
      enabled: true
      cob_id: "auto"
      transmission: 0x01
      mapping:
        - {index: 0x6041, sub_index: 0}
        - {index: 0x6061, sub_index: 0}
    2:
      cob_id: "auto"
      transmission: 255
      event_timer: 100
      inhibit_time: 5
      mapping:
        - {index: 0x6064}
    3:
      enabled: false
  rpdo:
    1:
      enabled: true
      cob_id: 0x205
      mapping:
        - {index: 0x6040, sub_index: 0}
        - {index: 0x6060, sub_index: 0}
    2:
      enabled: false
      cob_id: 0x80000302
"""

COGEN: Final = """\
options:
  dcf_path: "@BUS_CONFIG_PATH@"
  heartbeat_multiplier: 2.5
master:
  node_id: 1
  heartbeat_producer: 100
defaults:
  dcf: epos.eds
  heartbeat_producer: 200
  heartbeat_consumer: true
  sdo:
    - {index: 0x6081, value: 5}
  tpdo:
    2: {cob_id: auto, mapping: [{index: 0x6064}]}
    1: {cob_id: auto, mapping: []}
nodes:
  zulu:
    node_id: 3
  alpha:
    node_id: 2
    heartbeat_producer: 300
"""

HIDDEN: Final = """\
.drive: &drive
  dcf: epos.eds
  mandatory: true
  retry_factor: 5
  reset_communication: false
  restore_configuration: 1
  software_version: 7
  serial_number: 0x1234
master:
  node_id: 1
first: {<<: *drive, node_id: 2}
second:
  <<: *drive
  node_id: 3
  mandatory: false
  boot: false
lamp:
  dcf: io.eds
  node_id: 9
  guard_time: 100
  life_time_factor: 3
  error_behavior: {1: 2}
"""

HEARTBEATS: Final = """\
master: {node_id: 4, heartbeat_producer: 50, heartbeat_multiplier: 4}
one: {node_id: 1, dcf: epos.eds, heartbeat_consumer: true, heartbeat_producer: 0}
two: {node_id: 2, dcf: epos.eds, heartbeat_consumer: no, heartbeat_multiplier: 1.5}
"""

LAMPS: Final = """\
options: {retry_factor: 7}
master:
  node_id: 99
  heartbeat_producer: 100
  error_behavior: {1: 2, 2: 1}
  start: false
  start_nodes: 0
one:
  dcf: lamp.eds
  node_id: 0x21
  heartbeat_consumer: true
  heartbeat_producer: 0
  guard_time: 100
  error_behavior: {1: 2}
  time_cob_id: 256
  sdo:
    - {index: 0x2000, value: '7'}
    - {index: 0x2001, value: 2}
    - {index: 0x2003, value: true}
    - {index: 0x2003, value: 5}
    - {index: 0x1016, sub_index: 1}
  tpdo:
    5: {cob_id: auto, sync_start: 3, transmission: 1, mapping: [{index: 0x2000}, {index: 0x2003}]}
    2: {enabled: "false", cob_id: 640, mapping: [{index: 8192, sub_index: 0}]}
two:
  dcf: lamp.dcf
  heartbeat_consumer: false
  serial_number: 5
  revision_number: 6
  tpdo:
    1: {cob_id: 0x80000189}
    5: {cob_id: auto, mapping: [{index: 0x2000}]}
"""

COUNTED: Final = """\
master: {node_id: 1}
lamp:
  dcf: counted.eds
  node_id: 9
  rpdo:
    1: {cob_id: auto, transmission: 1, mapping: [{index: 0x2000}]}
    2: {enabled: true, cob_id: 0x345, transmission: 254}
"""

GOOD: Final = {
    "plain": PLAIN,
    "cogen": COGEN,
    "hidden": HIDDEN,
    "heartbeats": HEARTBEATS,
    "lamps": LAMPS,
    "counted": COUNTED,
}
