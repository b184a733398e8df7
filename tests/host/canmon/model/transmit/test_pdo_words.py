from __future__ import annotations

import re
from pathlib import Path

import pytest

from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import EdsObjects, ObjectText, read_eds_objects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.transmit import PdoFrames
from tickrig.wire.canopen.datatypes import DataType

EPOS = Path(__file__).parents[5] / "examples/eds/epos.eds"


@pytest.fixture(scope="module")
def words() -> PdoFrames:
    return PdoFrames({5: read_eds_objects(EPOS, 5), 6: made()})


def made(**values: bytes) -> EdsObjects:
    """A node with a REAL32, an UNSIGNED8 in 4 bits, a BOOLEAN, and something without a name."""
    texts = {
        (0x2000, 0): ObjectText("torque", DataType.REAL32),
        (0x2001, 0): ObjectText("torque_mode", DataType.UNSIGNED8),
        (0x2002, 0): ObjectText("brake", DataType.BOOLEAN),
    }
    mapping = (0x2000_0020, 0x2001_0004, 0x2002_0001, 0x2003_0003)
    numbers = {(0x1600, 0): 4, (0x1605, 0): 1, (0x1605, 1): 0x2002_0001, (0x1601, 0): 0xFE}
    numbers |= {(0x1600, sub): entry for sub, entry in enumerate(mapping, 1)}
    numbers |= {(0x1602, 0): 1, (0x1602, 1): 0x2002_0001, (0x1402, 1): 0x8000_0306}
    wire = {entry: number.to_bytes(4, "little") for entry, number in numbers.items()}
    return EdsObjects(texts, {**wire, (0x2002, 0): b"\1"})


@pytest.mark.parametrize(
    ("text", "frame"),
    [
        ("5.rpdo1 controlword=0x0F target_velocity=-2", "205#0F00FEFFFFFF"),
        ("5.RPDO1 target=100", "205#000064000000"),
        ("5.rpdo1", "205#000000000000"),
        ("6.rpdo1 torque=1.5 torque_mode=9", "206#0000C03F19"),
        ("6.rpdo1 brake=0 2003h:00=5", "206#00000000A0"),
        ("6.rpdo1 torque=2", "206#0000004010"),
    ],
)
def test_a_pdo_is_made_of_the_names_of_its_objects(words: PdoFrames, text: str, frame: str) -> None:
    assert str(words.frame(text)) == frame


def test_what_is_sent_by_name_is_decoded_by_the_same_names(words: PdoFrames) -> None:
    frame = words.frame("5.rpdo1 controlword=6 target_velocity=123456")
    decoded = Decoder({5: EPOS}).take(Record(0, "can0", frame))
    assert decoded.kind == "rpdo1"
    assert [(signal.name, signal.value) for signal in decoded.signals] == [
        ("controlword", 6),
        ("target_velocity", 123_456),
    ]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hello", "'hello' is neither a frame as 123#DEADBEEF nor a PDO as 5.rpdo1"),
        ("7.rpdo1", "7.rpdo1: no description of node 7; give --eds 7=FILE"),
        ("5.rpdo0", "PDOs are numbered 1 to 512"),
        ("5.rpdo1 speed=1", "no 'speed'; it has controlword, target_velocity"),
        ("6.rpdo1 tor=1", "more than one 'tor'; it has torque, torque_mode, brake, 2003h:00"),
        ("5.rpdo1 controlword", "'controlword' is not NAME=VALUE"),
        ("5.rpdo1 controlword=1.5", "controlword is UNSIGNED16, 1.5 is not"),
        ("5.rpdo1 controlword=70000", "controlword is UNSIGNED16, 70000 is not"),
        ("6.rpdo1 torque=much", "torque is REAL32, much is not"),
        ("6.rpdo1 torque_mode=16", "torque_mode is UNSIGNED8, 16 is not"),
        ("6.rpdo1 brake=2", "brake is BOOLEAN, 2 is not"),
        ("6.rpdo1 2003h:00=8", "2003h:00 is a number of 3 bits, 8 is not"),
        ("6.rpdo2", "6.rpdo2: nothing is mapped to it (1601h:00 is 254)"),
        ("6.rpdo3", "6.rpdo3: it has no CAN-ID (1402h:01 is not valid)"),
        ("6.rpdo6", "6.rpdo6: it has no CAN-ID (1405h:01 is not valid)"),
        ("6.tpdo1", "6.tpdo1: nothing is mapped to it (1A00h:00 is 0)"),
    ],
)
def test_what_cannot_be_sent_is_told_with_what_there_is(
    words: PdoFrames, text: str, said: str
) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        words.frame(text)
