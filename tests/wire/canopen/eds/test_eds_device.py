from __future__ import annotations

import pytest

from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile, Finding, finding_lines
from tickrig.wire.canopen.eds.eds_value import parse_number
from tickrig.wire.canopen.eds.object_table import RO, RW, WO, EntryDescription

U8 = "ParameterName=x\nDataType=5\nAccessType=rw\n"
SOUND = f"[1000]\n{U8}"
COMMENT = "the comment behind a number or an access type is skipped"


def read(text: str) -> tuple[EdsDevice, list[str], list[str]]:
    file = EdsFile("a.eds", text)
    device = read_device(file)
    return device, [str(one) for one in file.errors], [str(one) for one in file.warnings]


def entries(text: str) -> list[EntryDescription]:
    device, errors, _ = read(text)
    assert errors == []
    return list(device.entries)


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "a.eds: has no objects (no-objects)"),
        ("[DeviceInfo]\nVendorName=x\n", "a.eds: has no objects (no-objects)"),
        (
            f"[2000]\n{U8}DefaultValue=0x1FF\n",
            "a.eds:5: [2000] DefaultValue=0x1FF is no UNSIGNED8 (default-value)",
        ),
        (
            f"[2000]\n{U8}DefaultValue=three\n",
            "a.eds:5: [2000] DefaultValue=three is no UNSIGNED8 (default-value)",
        ),
        (
            f"[2000]\n{U8}DefaultValue=-129\n",
            "a.eds:5: [2000] DefaultValue=-129 is no UNSIGNED8 (default-value)",
        ),
        (
            f"[2000]\n{U8}DefaultBytes=0g\n",
            "a.eds:5: [2000] DefaultBytes=0g is no 1 hexadecimal bytes (default-value)",
        ),
        (
            f"[2000]\n{U8}DefaultBytes=0102\n",
            "a.eds:5: [2000] DefaultBytes=0102 is no 1 hexadecimal bytes (default-value)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0xA\nAccessType=rw\nDefaultBytes=0g\n",
            "a.eds:5: [2000] DefaultBytes=0g is no hexadecimal bytes (default-value)",
        ),
    ],
)
def test_what_has_no_meaning_is_an_error_with_line_section_key_and_rule(
    text: str, error: str
) -> None:
    assert read(text)[1:] == ([error], [])


def test_all_errors_of_a_file_are_told_at_once() -> None:
    text = (
        f"[1000]\nrubbish\n[2000]\n{U8}DefaultValue=300\nPDOMapping=maybe\n"
        f"[2001]\nParameterName=y\n[2002]\n{U8}DefaultBytes=x\n[2002]\n{U8}"
    )
    device, errors, warnings = read(text)
    assert errors == [
        "a.eds:7: [2000] DefaultValue=300 is no UNSIGNED8 (default-value)",
        "a.eds:15: [2002] DefaultBytes=x is no 1 hexadecimal bytes (default-value)",
    ]
    assert len(warnings) == 11
    assert [row.index for row in device.entries] == [0x1000, 0x2000, 0x2001, 0x2002]


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        (
            f"[1000]\n{U8}\nrubbish\n",
            "a.eds:6: [1000] 'rubbish' is no keyword with a value: it is skipped (no-keyword)",
        ),
        (
            f"[1000]\n{U8}[1000]\nx=1\n",
            "a.eds:5: [1000] is there twice: of each keyword the first is taken (doubled-section)",
        ),
        (
            f"[1a00]\n{U8}[1A00]\n",
            "a.eds:5: [1A00] is there twice: of each keyword the first is taken (doubled-section)",
        ),
        (
            f"[1000]\n{U8}datatype=2\n",
            "a.eds:5: [1000] datatype is there twice: 5 is taken (doubled-key)",
        ),
        (
            "[1017]\nParameterName=x\nDataType=6\n",
            "a.eds:1: [1017] AccessType is missing: rw is taken (access-missing)",
        ),
        (
            "[1017]\nDataType=6\nAccessType=rw\n",
            "a.eds:1: [1017] ParameterName is missing: none is taken (name-missing)",
        ),
        (
            "[1017]\nParameterName=x\nAccessType=rw\n",
            "a.eds:1: [1017] DataType is missing: UNSIGNED16 is taken (data-type-missing)",
        ),
        (
            "[2017]\nParameterName=x\nAccessType=rw\n",
            "a.eds:1: [2017] DataType is missing: DOMAIN is taken (data-type-missing)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0x0007 # UNSIGNED32\nAccessType=rw\n",
            f"a.eds:3: [2000] {COMMENT} (inline-comment)",
        ),
        (f"[2000]\n{U8}ObjectType=0x07 // VAR\n", f"a.eds:5: [2000] {COMMENT} (inline-comment)"),
        (f"[2000]\n{U8}PDOMapping=1;yes\n", f"a.eds:5: [2000] {COMMENT} (inline-comment)"),
        (
            "[2000]\nParameterName=x\nDataType=5\nAccessType=ro # read only\n",
            f"a.eds:4: [2000] {COMMENT} (inline-comment)",
        ),
        (f"[2000]\n{U8}DefaultValue=# none\n", f"a.eds:5: [2000] {COMMENT} (inline-comment)"),
        (f"[2000]\n{U8}HighLimit=9//most\n", f"a.eds:5: [2000] {COMMENT} (inline-comment)"),
        (f"[2000]\n{U8}Factor=2 # times\n", f"a.eds:5: [2000] {COMMENT} (inline-comment)"),
        (
            "[2000]\nParameterName=x\nDataType=8\nAccessType=rw\nDefaultValue=1.5 # V\n",
            f"a.eds:5: [2000] {COMMENT} (inline-comment)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=7\nAccessType=rw\nDefaultValue=0000 0080h\n",
            "a.eds:5: [2000] DefaultValue=0000 0080h is no number of CiA 306: 0x00000080 is "
            "taken (number-form)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=7\nAccessType=rw\nDefaultValue=-1\n",
            "a.eds:5: [2000] DefaultValue=-1 is no UNSIGNED32: 0xFFFFFFFF is taken (value-sign)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=2\nAccessType=rw\nDefaultValue=0xFFFFFFFF\n",
            "a.eds:5: [2000] DefaultValue=0xFFFFFFFF is no INTEGER8: -1 is taken (value-sign)",
        ),
        (
            f"[2000]\n{U8}HighLimit=-1\n",
            "a.eds:5: [2000] HighLimit=-1 is no UNSIGNED8: 0xFF is taken (value-sign)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0xA\nAccessType=rw\nDefaultValue=0x0102FF\n",
            "a.eds:5: [2000] DefaultValue=0x0102FF is no hexadecimal bytes: 01 02 FF is taken "
            "(byte-form)",
        ),
        *(
            (
                f"[2000]\nParameterName=x\nDataType=0xA\nAccessType=rw\nDefaultValue={text}\n",
                f"a.eds:5: [2000] DefaultValue={text} is no hexadecimal bytes: 01 FF is taken "
                "(byte-form)",
            )
            for text in ("0x1 0xFF", "0x01, 0xFF", "01 FF # two")
        ),
        *(
            (
                f"[2000]\n{U8}DefaultValue={text}\n",
                f"a.eds:5: [2000] DefaultValue={text} is no number of CiA 306: {taken} is taken "
                "(number-form)",
            )
            for text, taken in (("+5", "5"), ("5.0", "5"), ("+0x5", "0x5"))
        ),
        (
            f"[2000]\n{U8}LowLimit=$NODEID+1\n",
            "a.eds:5: [2000] LowLimit=$NODEID+1 depends on the node-ID: no limit is taken "
            "(limit-value)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0xF\nAccessType=rw\nDefaultValue=hello\n",
            "a.eds:5: [2000] DefaultValue=hello is no hexadecimal bytes: its text is taken "
            "(byte-form)",
        ),
        (
            f"[2000]\n{U8}ParameterValue=7\n",
            "a.eds:5: [2000] ParameterValue stands in an EDS: it is taken, not DefaultValue "
            "(dcf-key)",
        ),
        (
            f"{SOUND}[2001]\nParameterName=x\nObjectType=8\nSubNumber=3\n",
            "a.eds:5: [2001] there is no sub-index: the object is left out (sub0-missing)",
        ),
        (
            f"{SOUND}[SupportedModules]\nNrOfEntries=2\n",
            "a.eds:5: [SupportedModules] a modular device: the objects of its modules are left "
            "out, for [ConnectedModules] of a DCF has to say which are there (modules)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0xA0\nAccessType=rw\n[A0sub1]\nDefaultValue=5\n"
            "[A0sub2]\nDefaultValue=2\n[A0sub3]\nDefaultValue=9\n",
            "a.eds:3: [2000] DataType=0x00A0 is derived in [A0sub1]: UNSIGNED8 of 2 to 9 is taken "
            "(data-type-derived)",
        ),
        (
            f"[1017]\n{U8}PDOMapping=yes\n",
            "a.eds:5: [1017] PDOMapping=yes is not a number: 1 is taken (number-word)",
        ),
        (
            f"[1017]\n{U8}ObjectType=3\n",
            "a.eds:5: [1017] ObjectType=3 is no kind of object: VAR is taken (object-type)",
        ),
        (
            "[1017]\nParameterName=x\nDataType=0x17\nAccessType=rw\n",
            "a.eds:3: [1017] DataType=0x0017 is unknown: UNSIGNED16 is taken (data-type-unknown)",
        ),
        (
            "[1017]\nParameterName=x\nDataType=5\nAccessType=rx\n",
            "a.eds:4: [1017] AccessType=rx is not in CiA 306: rw is taken (access-form)",
        ),
        (
            f"[2000]\n{U8}LowLimit=low\n",
            "a.eds:5: [2000] LowLimit=low is no UNSIGNED8: no limit is taken (limit-value)",
        ),
        (
            f"[2000]\n{U8}LowLimit=9\nHighLimit=8\n",
            "a.eds:5: [2000] LowLimit 9 is above HighLimit 8: neither is taken (limit-order)",
        ),
        (
            f"[2000]\n{U8}MaxBytes=few\n",
            "a.eds:5: [2000] MaxBytes=few is not a number: 4294967295 is taken (no-number)",
        ),
        (
            f"[2000]\n{U8}MaxBytes=-1\n",
            "a.eds:5: [2000] MaxBytes=-1 is not in 0..4294967295: 4294967295 is taken (no-number)",
        ),
        (
            f"[2000sub1]\n{U8}",
            "a.eds:1: [2000sub1] has no object [2000]: a RECORD is taken (sub-orphan)",
        ),
        (
            f"[2000]\n{U8}ObjectType=7\n[2000sub1]\n{U8}",
            "a.eds:5: [2000] ObjectType=7 has no sub-indices, and there are: RECORD is "
            "taken (object-type)",
        ),
        (
            "[2000]\nParameterName=x\nObjectType=8\nCompactSubObj=2\nAccessType=rw\n",
            "a.eds:1: [2000] DataType is missing: DOMAIN is taken (data-type-missing)",
        ),
        (
            f"[1000]\n{U8}[DeviceComissioning]\nNodeID=200\n",
            "a.eds:6: [DeviceComissioning] NodeID=200 is not in 1..127: none is taken (node-id)",
        ),
        (
            f"[1000]\n{U8}[DeviceCommissioning]\nNodeID=x\n",
            "a.eds:6: [DeviceComissioning] NodeID=x is not a number: 0 is taken (no-number)",
        ),
        (
            f"[2000]\n{U8}PDOMapping=\n",
            "a.eds:5: [2000] PDOMapping is empty: 0 is taken (empty-value)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=\nAccessType=rw\n",
            "a.eds:3: [2000] DataType is empty: 15 is taken (empty-value)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=5\nAccessType=\n",
            "a.eds:4: [2000] AccessType is empty: rw is taken (access-form)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=5\nAccessType=R\n",
            "a.eds:4: [2000] AccessType=R is not in CiA 306: ro is taken (access-form)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0x40\nAccessType=ro\n",
            "a.eds:3: [2000] DataType=0x0040 is unknown: DOMAIN is taken (data-type-unknown)",
        ),
        (
            f"[2000]\n{U8}DefaultValue=0x12ul\n",
            "a.eds:5: [2000] DefaultValue=0x12ul is no number of CiA 306: 0x12 is taken "
            "(number-form)",
        ),
        (
            f"[2000]\n{U8}HighLimit=0099\n",
            "a.eds:5: [2000] HighLimit=0099 is no number of CiA 306: 99 is taken (number-form)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=1\nAccessType=rw\nDefaultValue=0xFF\n",
            "a.eds:5: [2000] DefaultValue=0xFF is no BOOLEAN: 1 is taken (boolean-value)",
        ),
        (f"[2000]\n{U8}Factor=0\n", "a.eds:5: [2000] Factor=0 is no factor: 1 is taken (factor)"),
        (
            f"[2000]\n{U8}Factor=big\n",
            "a.eds:5: [2000] Factor=big is no factor: 1 is taken (factor)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=9\nAccessType=ro\nDefaultValue=5 €\n",
            "a.eds:5: [2000] DefaultValue=5 € is not ASCII: its bytes in UTF-8 are taken "
            "(text-value)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=9\nAccessType=ro\nDefaultValue=5 °C\n",
            "a.eds:5: [2000] DefaultValue=5 °C is not ASCII: its bytes in ISO 8859-1 are "
            "taken (text-value)",
        ),
        (
            f"[2000]\n{U8}ObjectType=9\nCompactSubObj=1\n",
            "a.eds:6: [2000] CompactSubObj in a RECORD: its entries are taken to be alike "
            "(compact-record)",
        ),
        (
            "[1017]\nParameterName=x\nDataType=6\nAccessType=rw\n=5\n",
            "a.eds:5: [1017] '=5' is no keyword with a value: it is skipped (no-keyword)",
        ),
        (
            "[1000]\nParameterName=x\nObjectType=9\n[1000sub0]\nParameterName=x\nAccessType=ro\n",
            "a.eds:4: [1000sub0] DataType is missing: UNSIGNED8 is taken (data-type-missing)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=0x40\nAccessType=ro\n[40sub1]\nDefaultValue=0x40\n",
            "a.eds:3: [2000] DataType=0x0040 is unknown: DOMAIN is taken (data-type-unknown)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=7\nAccessType=ro\nDefaultValue=NODEID+0x 1 80\n",
            "a.eds:5: [2000] DefaultValue=NODEID+0x 1 80 is no number of CiA 306: "
            "NODEID+0x180 is taken (number-form)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=7\nAccessType=ro\nDefaultValue=1Ah\n",
            "a.eds:5: [2000] DefaultValue=1Ah is no number of CiA 306: 0x1A is taken (number-form)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=7\nAccessType=ro\nHighLimit=0x1FFFFFFFFFFFFFFFF\n",
            "a.eds:5: [2000] HighLimit=0x1FFFFFFFFFFFFFFFF is no UNSIGNED32: no limit is "
            "taken (limit-value)",
        ),
        (
            "[2000]\nParameterName=x\nDataType=7\nAccessType=ro\nDefaultValue=1_000\n",
            "a.eds:5: [2000] DefaultValue=1_000 is no number of CiA 306: 1000 is taken "
            "(number-form)",
        ),
    ],
)
def test_what_has_one_meaning_is_a_warning_with_line_section_key_and_rule(
    text: str, warning: str
) -> None:
    device, errors, warnings = read(text)
    assert (errors, warnings) == ([], [warning])
    assert device.entries


def test_texts_beyond_ascii_have_the_bytes_of_their_coding() -> None:
    text = "[2000]\nParameterName=x\nDataType=9\nAccessType=ro\nDefaultValue="
    assert [entries(text + word)[0].default for word in ("°", "€")] == [b"\xb0", b"\xe2\x82\xac"]
    _, errors, _ = read("[2000]\nParameterName=x\nDataType=0xA0\nAccessType=ro\nDefaultValue=€")
    assert errors == ["a.eds:5: [2000] DefaultValue=€ is no VISIBLE_CHAR (default-value)"]


def test_letters_of_c_and_lone_letters_mean_what_they_meant() -> None:
    row = "ParameterName=x\nDataType=0x1B\nAccessType=W\nDefaultValue=0x1234567890ABCDEFLL\n"
    (entry,) = entries(f"[2120]\n{row}")
    assert (entry.default, entry.access) == (bytes.fromhex("efcdab9078563412"), WO)


PDO_MAPPING = (
    "[1600]\nParameterName=RPDO 1 mapping\nObjectType=9\nDataType=7\nAccessType={access}\n"
    "CompactSubObj=4\n[1600Value]\nNrOfEntries=2\n1=0x20000108\n2=0x20010110\n"
)


def test_a_compact_record_has_its_elements_and_counts_those_in_use() -> None:
    head, *elements = entries(PDO_MAPPING.format(access="rw"))
    assert (head.sub, head.data_type, head.default, head.access) == (
        *(0, DataType.UNSIGNED8),
        *(b"\x02", RW),
    )
    assert [row.sub for row in elements] == [1, 2, 3, 4]
    assert [row.default if row.has_default else None for row in elements] == [
        *(bytes.fromhex("08010020"), bytes.fromhex("10010120")),
        *(None, None),
    ]
    assert entries(PDO_MAPPING.format(access="ro"))[0].access == RO


def test_a_compact_array_counts_its_elements() -> None:
    text = f"[2000]\n{U8}ObjectType=8\nCompactSubObj=3\n[2000Name]\nNrOfEntries=1\n2=second\n"
    assert [
        (row.sub, row.name, row.default if row.has_default else None) for row in entries(text)
    ] == [
        *[(0, "Number of entries", b"\x03"), (1, "x1", None), (2, "second", None)],
        (3, "x3", None),
    ]


def test_a_data_type_of_the_file_is_what_its_section_says() -> None:
    own = "[2000]\nParameterName=x\nDataType=0xA0\nAccessType=rw\n[a0SUB1]\nDefaultValue={}\n"
    assert entries(own.format("0x06"))[0].data_type is DataType.UNSIGNED16
    assert read(own.format("six"))[2] == [
        "a.eds:6: [A0sub1] DefaultValue=six is not a number: 15 is taken (no-number)"
    ]


def test_limits_and_lengths_of_a_data_type_of_the_file_count() -> None:
    row = "[2000]\nParameterName=x\nDataType=0xA0\nAccessType=rw\n"
    numbers = "[00A0]\nObjectType=6\n[00A0sub1]\nDefaultValue=3\n[00A0sub2]\nDefaultValue=-5\n"
    (entry,) = entries(f"{row}{numbers}[00A0sub3]\nDefaultValue=5\n")
    assert (entry.data_type, entry.low, entry.high) == (DataType.INTEGER16, -5, 5)
    (entry,) = entries(f"{row}LowLimit=0\n{numbers}")
    assert (entry.low, entry.high) == (0, None)
    (entry,) = entries(f"{row}[A0sub1]\nDefaultValue=9\n[A0sub2]\nDefaultValue=10\n")
    assert (entry.data_type, entry.max_bytes) == (DataType.VISIBLE_STRING, 10)


@pytest.mark.parametrize("text", ["a#b", "a//b", "a;b", "a # b", "//", "#"])
def test_a_text_keeps_what_would_be_a_comment_behind_a_number(text: str) -> None:
    row = "[2000]\nParameterName=x #1\nDataType=9\nAccessType=ro\n"
    (entry,) = entries(f"{row}DefaultValue={text}\n")
    assert (entry.name, entry.default) == ("x #1", text.encode())
    assert read(f"{row}DefaultValue={text}\n")[2] == []


@pytest.mark.parametrize(
    ("index", "sub", "kind"),
    [
        ("1001", "", DataType.UNSIGNED8),
        ("1008", "", DataType.VISIBLE_STRING),
        ("1021", "", DataType.DOMAIN),
        ("1016", "sub1", DataType.UNSIGNED32),
        ("1023", "sub2", DataType.UNSIGNED8),
        ("1400", "sub2", DataType.UNSIGNED8),
        ("1800", "sub5", DataType.UNSIGNED16),
        ("1600", "sub0", DataType.UNSIGNED8),
        ("1600", "sub8", DataType.UNSIGNED32),
        ("1280", "sub3", DataType.UNSIGNED8),
        ("1F50", "sub1", DataType.DOMAIN),
        ("1F89", "", DataType.UNSIGNED32),
        ("1400", "sub9", DataType.DOMAIN),
        ("1017", "sub1", DataType.DOMAIN),
        ("6040", "", DataType.DOMAIN),
    ],
)
def test_a_communication_object_has_the_data_type_of_cia_301(
    index: str, sub: str, kind: DataType
) -> None:
    head = f"[{index}]\nParameterName=x\nObjectType=9\n" if sub else ""
    text = f"{head}[{index}{sub}]\nParameterName=x\nAccessType=rw\n"
    assert entries(text)[0].data_type is kind
    assert "DataType is missing" in read(text)[2][-1]


def test_the_elements_of_a_compact_communication_object_have_its_data_type() -> None:
    head = "[1016]\nParameterName=x\nObjectType=8\nAccessType=rw\nCompactSubObj=2\n"
    assert [row.data_type for row in entries(head)] == [
        *(DataType.UNSIGNED8, DataType.UNSIGNED32, DataType.UNSIGNED32),
    ]


@pytest.mark.parametrize(
    ("kind", "limits", "default"),
    [
        (5, "LowLimit=1\n", b"\1"),
        (2, "HighLimit=-3\n", b"\xfd"),
        (2, "LowLimit=-3\nHighLimit=3\n", b"\0"),
        (8, "LowLimit=1.5\n", b"\0\0\xc0?"),
        (5, "LowLimit=300\n", b"\0"),
        (9, "LowLimit=3\n", b""),
        (7, "LowLimit=-1\n", bytes(4)),
    ],
)
def test_without_a_default_the_value_next_to_0_is_there(
    kind: int, limits: str, default: bytes
) -> None:
    text = f"[2000]\nParameterName=x\nDataType={kind}\nAccessType=rw\n{limits}"
    (entry,) = entries(text)
    assert (entry.default, entry.has_default) == (default, False)


def test_an_object_without_a_known_data_type_has_the_text_of_its_value_without_a_word_of_it() -> (
    None
):
    text = "[2000]\nParameterName=x\nAccessType=ro\nDefaultValue=0x01\n"
    device, errors, warnings = read(text)
    assert (device.entries[0].default, errors) == (b"\1", [])
    assert [warning.rpartition(" ")[2] for warning in warnings] == ["(data-type-missing)"]


def test_an_object_may_be_a_domain() -> None:
    text = "[2000]\nParameterName=x\nObjectType=2\nAccessType=ro\nDefaultValue=0102\n"
    assert [(row.data_type, row.default) for row in entries(text)] == [
        (DataType.DOMAIN, b"\1\2"),
    ]


def test_a_boolean_and_a_time_have_values_and_limits_of_their_own() -> None:
    head = "[2000]\nParameterName=x\nAccessType=ro\nDataType="
    (entry,) = entries(f"{head}1\nDefaultValue=true\nHighLimit=true\nLowLimit=false\n")
    assert (entry.default, entry.low, entry.high) == (b"\1", False, True)
    (entry,) = entries(f"{head}0xC\nDefaultValue=0x102 # then\nLowLimit=1\n")
    assert (entry.default, entry.low) == (b"\2\1\0\0\0\0", None)


def test_a_list_is_numbered_with_leading_zeros_too() -> None:
    text = f"{PDO_MAPPING.format(access='rw')}".replace("\n1=", "\n01=").replace("\n2=", "\n002=")
    assert [row.default for row in entries(text)] == [
        row.default for row in entries(PDO_MAPPING.format(access="rw"))
    ]


@pytest.mark.parametrize(
    ("said", "bit_rate", "taken"),
    [
        ("500", 500_000, ""),
        ("0", None, ""),
        ("500000", 500_000, "500 kbit/s is"),
        ("1001", None, "none is"),
    ],
)
def test_a_bit_rate_of_a_dcf_is_in_kbit(said: str, bit_rate: int | None, taken: str) -> None:
    device, errors, warnings = read(f"{SOUND}[DeviceComissioning]\nBaudrate={said}\n")
    assert (device.bit_rate, errors) == (bit_rate, [])
    where = "a.eds:6: [DeviceComissioning]"
    text = f"{where} Baudrate={said} is more than 1000 kbit/s: {taken} taken (bit-rate-unit)"
    assert warnings == ([text] if taken else [])


def test_what_describes_no_device_may_say_what_it_wants() -> None:
    text = f"{SOUND}[Comments]\nLines=1\nLines=2\nfree text\n[Comments]\nmore\n"
    assert read(text)[1:] == ([], [])


def test_of_what_stands_before_the_first_section_one_line_is_told() -> None:
    _, errors, warnings = read("hello\nyou\n=\n[Tools]\n=\n")
    assert errors == ["a.eds: has no objects (no-objects)"]
    assert warnings == ["a.eds:1: 'hello' is no keyword with a value: it is skipped (no-keyword)"]


def test_comments_and_blanks_are_skipped() -> None:
    text = f"; a; comment\n# another\n  [2000] ; here\n{U8}  DefaultValue = 7\t;here\n"
    assert entries(text)[0].default == b"\x07"


def test_objects_that_only_define_a_type_are_none() -> None:
    text = f"{SOUND}[00A0]\nObjectType=6\n[00A0sub1]\n{U8}[2000]\nObjectType=0\n"
    assert [row.index for row in entries(text)] == [0x1000]


def test_long_texts_are_shortened() -> None:
    _, (error,), _ = read(f"[2000]\n{U8}DefaultValue={'x' * 1_000}\n")
    assert error == f"a.eds:5: [2000] DefaultValue={'x' * 37}... is no UNSIGNED8 (default-value)"


@pytest.mark.parametrize("text", ["\u0663", "1_000"])
def test_what_python_alone_takes_is_no_number(text: str) -> None:
    with pytest.raises(ValueError, match="is no number"):
        parse_number(text)


def test_what_is_so_in_many_sections_is_one_line() -> None:
    alike = [Finding("a.eds", section, "no DataType", 3) for section in ("1000", "1000", "1001")]
    other = Finding("b.eds", "", "empty")
    assert list(finding_lines([*alike, other])) == [
        "a.eds:3: [1000] no DataType (and 1 more like it)",
        "b.eds: empty",
    ]
