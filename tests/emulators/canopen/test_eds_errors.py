from __future__ import annotations

import pytest

from tickrig.emulators.canopen.eds import describe
from tickrig.emulators.canopen.eds_file import EdsError, EdsFile

U8 = "ParameterName=x\nDataType=5\nAccessType=rw\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello\n", "a.eds: line 1 is no keyword with a value: 'hello'"),
        (
            "[1000]\nDataType=7\nrubbish\n",
            "a.eds: [1000] line 3 is no keyword with a value: 'rubbish'",
        ),
        ("[1000]\nx=1\n[1000]\n", "a.eds: [1000] is there twice, line 3"),
        ("[1a00]\nx=1\n[1A00]\n", "a.eds: [1A00] is there twice"),
        ("[1000]\nx=1\nx=2\n", "a.eds: [1000] x is there twice, line 3"),
        ("[1017]\nParameterName=x\nDataType=6\n", "a.eds: [1017] AccessType is missing"),
        ("[1017]\nDataType=6\nAccessType=rw\n", "a.eds: [1017] ParameterName is missing"),
        ("[1017]\nParameterName=x\nAccessType=rw\n", "a.eds: [1017] DataType is missing"),
        (f"[1017]\n{U8}PDOMapping=yes\n", "a.eds: [1017] PDOMapping=yes is not a number"),
        (f"[1017]\n{U8}ObjectType=3\n", "a.eds: [1017] ObjectType=3 is no kind of object"),
        (
            "[1017]\nParameterName=x\nDataType=0x17\nAccessType=rw\n",
            "a.eds: [1017] DataType=0x0017 is unknown",
        ),
        (
            "[1017]\nParameterName=x\nDataType=5\nAccessType=rx\n",
            "a.eds: [1017] access type 'rx' is none of ro, wo, rw, rwr, rww, const",
        ),
        (f"[2000]\n{U8}DefaultValue=0x1FF\n", "a.eds: [2000] DefaultValue=0x1FF is no UNSIGNED8"),
        (f"[2000]\n{U8}DefaultValue=three\n", "a.eds: [2000] DefaultValue=three is no UNSIGNED8"),
        (f"[2000]\n{U8}ParameterValue=-1\n", "a.eds: [2000] ParameterValue=-1 is no UNSIGNED8"),
        (f"[2000]\n{U8}LowLimit=low\n", "a.eds: [2000] LowLimit=low is no UNSIGNED8"),
        (f"[2000]\n{U8}LowLimit=9\nHighLimit=8\n", "a.eds: [2000] LowLimit 9 is above HighLimit 8"),
        (f"[2000]\n{U8}DefaultBytes=0g\n", "a.eds: [2000] DefaultBytes=0g is no hexadecimal bytes"),
        (f"[2000]\n{U8}MaxBytes=few\n", "a.eds: [2000] MaxBytes=few is not a number"),
        (f"[2000sub1]\n{U8}", "a.eds: [2000sub1] has no object [2000]"),
        (
            f"[2000]\n{U8}ObjectType=7\n[2000sub1]\n{U8}",
            "a.eds: [2000sub1] is part of a VAR, which has none",
        ),
        (
            "[2000]\nParameterName=x\nObjectType=8\nCompactSubObj=2\n",
            "a.eds: [2000] DataType is missing",
        ),
        (
            "[DeviceComissioning]\nNodeID=200\n",
            "a.eds: [DeviceComissioning] NodeID=200 is not in 1..127",
        ),
        (
            "[DeviceCommissioning]\nNodeID=x\n",
            "a.eds: [DeviceComissioning] NodeID=x is not a number",
        ),
    ],
)
def test_a_malformed_eds_gives_file_section_and_reason(text: str, message: str) -> None:
    with pytest.raises(EdsError) as error:
        describe(EdsFile("a.eds", text))
    assert str(error.value) == message
    assert error.value.file == "a.eds"
    assert error.value.section in message
    assert message.endswith(error.value.reason)
