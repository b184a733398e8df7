"""Readers that make slaves from the nodes of the file and their EDS files."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from tickrig.host.canopen.bus_file.bus_values import BusDefaults, BusSlave, DriveChannel, Identity
from tickrig.host.canopen.bus_file.known_keys import DRIVER, EXTRA, SCALES, check_keys
from tickrig.host.canopen.bus_file.notes import UNSIGNED8, UNSIGNED16, UNSIGNED32, BusFileSection
from tickrig.host.canopen.bus_file.pdo_reader import RPDO, TPDO, CobIds, PdoReader
from tickrig.host.canopen.bus_file.sheet import IDENTITY, Sheet, Writes
from tickrig.host.text.document import FilePlace, Item
from tickrig.wire.canopen.eds.eds_file import shorten
from tickrig.wire.canopen.nmt import INVALID

_MOST_CHANNELS: Final = 8
TIME, EMCY, HEARTBEAT, GUARD_TIME, LIFE_TIME = 0x1012, 0x1014, 0x1017, 0x100C, 0x100D
ERROR_BEHAVIOR, RESTORE, SOFTWARE = 0x1029, 0x1011, 0x1F56


_WRITE: Final = ("index", "sub_index", "value")


class SlaveReader:
    """Reader that makes one slave from its section in the bus.yml and its EDS.

    Args:
        name: name of the slave's section.
        node: section of the slave.
        sheet: EDS or DCF of the node.
        options: options of the bus.yml, used for settings that the slave lacks.
        cob_ids: source of the COB-IDs that `auto` gives to PDOs, shared by all nodes of the bus.
    """

    def __init__(
        self, name: str, node: BusFileSection, sheet: Sheet, options: BusDefaults, cob_ids: CobIds
    ) -> None:
        self._name, self._node, self._sheet, self._options = name, node, sheet, options
        self._cob_ids = cob_ids
        self.writes = Writes(sheet, node.name, node.notes)

    def read(self) -> BusSlave:
        """Return the slave with its PDOs.

        The SDO writes that configure the slave are added to the attribute `writes`, in the order in
        which dcfgen writes them.
        """
        node, sheet = self._node, self._sheet
        self._check_identity_keys()
        slave = BusSlave(
            self._name, sheet.node_id, node.place, sheet.path, sheet.device, self._identity()
        )
        slave = self._with_error_control(slave)
        pdo_reader = PdoReader(node, sheet, self.writes, self._cob_ids)
        rpdos, tpdos = pdo_reader.read("rpdo", RPDO), pdo_reader.read("tpdo", TPDO)
        slave = self._with_boot(replace(slave, master_pdos=(*tpdos, *rpdos)))
        self._sdo()
        return replace(
            slave,
            driver=node.text("driver"),
            package=node.text("package"),
            channels=_read_channels(node, self._name),
            settings=self._settings(),
            extra=read_extra(node),
        )

    def _with_error_control(self, slave: BusSlave) -> BusSlave:
        """Read how master and slave supervise each other.

        Write the values that differ from the EDS.
        """
        node = self._node
        self._changed("time_cob_id", TIME, 0x100)
        heartbeat = self._changed("heartbeat_producer", HEARTBEAT, 0, UNSIGNED16)
        guard_time = self._changed("guard_time", GUARD_TIME, 0, UNSIGNED16)
        life_time = self._changed("life_time_factor", LIFE_TIME, 0, UNSIGNED8)
        if guard_time and life_time and heartbeat:
            text = "heartbeat and node guarding cannot be used together: guarding is left out"
            node.note("error-control", "guard_time", text)
            guard_time = life_time = 0
        self._error_behavior()
        multiplier = self._options.heartbeat_multiplier
        return replace(
            slave,
            heartbeat_producer_ms=heartbeat,
            heartbeat_consumer=node.flag("heartbeat_consumer", default=False),
            heartbeat_multiplier=node.real("heartbeat_multiplier", multiplier),
            guard_time_ms=guard_time,
            life_time_factor=life_time,
            retry_factor=node.whole("retry_factor", self._options.retry_factor, 0, UNSIGNED8),
            emcy_cob_id=self._sheet.value(EMCY, 0, INVALID),
        )

    def _with_boot(self, slave: BusSlave) -> BusSlave:
        """Read the actions of the master at boot-up."""
        node = self._node
        return replace(
            slave,
            boot=node.flag("boot", default=True),
            mandatory=node.flag("mandatory", default=False),
            reset_communication=node.flag("reset_communication", default=True),
            software_file=node.text("software_file"),
            software_version=self._whole_of("software_version", UNSIGNED32, SOFTWARE, 1),
            restore_configuration=self._whole_of("restore_configuration", UNSIGNED8, RESTORE),
            boot_timeout_ms=node.whole("boot_timeout_ms") if "boot_timeout_ms" in node else None,
        )

    def _identity(self) -> Identity:
        """Return the identity to check. The file can only set revision and serial number."""
        node, sheet = self._node, self._sheet
        for index, sub in ((0x1000, 0), (IDENTITY, 1)):
            if sheet.row(index, sub) is None:
                text = f"{index:04X}h:{sub:02X} is not in {sheet.path.name}"
                node.note("no-identity", "dcf", text)
        self._check_head()
        product = sheet.identity("ProductNumber", 2) if sheet.row(IDENTITY, 2) else 0
        return Identity(
            sheet.value(0x1000, 0),
            sheet.identity("VendorNumber", 1),
            product,
            self._identity_number("revision_number", "RevisionNumber", 3),
            self._identity_number("serial_number", "LSS_SerialNumber", 4),
        )

    def _check_head(self) -> None:
        """Report numbers of DeviceInfo that differ from the numbers in 1018h."""
        sheet = self._sheet
        for sub, key in ((1, "VendorNumber"), (2, "ProductNumber"), (3, "RevisionNumber")):
            head, number = sheet.head_number("DeviceInfo", key), sheet.value(IDENTITY, sub)
            if head and number and head != number:
                place = FilePlace(str(sheet.path), sheet.file.line("DeviceInfo", key))
                where = sheet.place(IDENTITY, sub)
                text = f"{key}=0x{head:08X} is expected, but 1018h has 0x{number:08X}: {where}"
                self._node.notes.note("identity", place, self._node.name, text)

    def _identity_number(self, key: str, head: str, sub: int) -> int:
        """Return a number that the file may set.

        The number is not checked if the EDS lacks the entry.
        """
        node, sheet = self._node, self._sheet
        in_eds = sheet.identity(head, sub)
        number = node.whole(key, in_eds)
        if sheet.row(IDENTITY, sub) is None:
            if number and key in node:
                text = f"{sheet.path.name} has no 1018h:{sub:02X}, so none is checked"
                node.wrong("no-object", key, text)
            return 0
        if in_eds and number not in {0, in_eds}:
            where = sheet.place(IDENTITY, sub)
            node.wrong("identity", key, f"0x{number:08X}, but the EDS has 0x{in_eds:08X}: {where}")
        return number

    def _check_identity_keys(self) -> None:
        """Report keys that the master does not read, because the EDS provides their values."""
        for key, head, sub in (
            ("vendor_id", "VendorNumber", 1),
            ("product_code", "ProductNumber", 2),
        ):
            if key in self._node:
                where = self._sheet.place(IDENTITY, sub)
                number = self._sheet.identity(head, sub)
                text = f"{key} of a node is not read: 0x{number:08X} is checked: {where}"
                self._node.note("identity-key", key, text)

    def _changed(self, key: str, index: int, usual: int, high: int = 0xFFFF_FFFF) -> int:
        """Read a number that an object holds. Write the number if it differs from the EDS."""
        node, sheet = self._node, self._sheet
        before = sheet.value(index, 0, usual)
        if key not in node:
            return before
        number = node.whole(key, before, 0, high)
        compared = usual if index == TIME else before  # dcfgen compares 1012h with its own default
        if number != compared:
            if index in sheet:
                self.writes.add(index, 0, number, node.place_of(key))
            else:
                node.wrong("no-object", key, f"{sheet.path.name} has no {index:04X}h")
        return number

    def _error_behavior(self) -> None:
        if "error_behavior" not in self._node:
            return
        section = self._node.section("error_behavior")
        for sub in section.fields:
            number = section.whole(sub, 0, 0, UNSIGNED8)
            row = self._sheet.row(ERROR_BEHAVIOR, sub) if isinstance(sub, int) and sub else None
            if not isinstance(sub, int):
                section.note("kind", sub, f"{sub!r:.40}: a sub-index of 1029h is a number")
            elif row is None:
                text = f"1029h:{shorten(str(sub))} is not in {self._sheet.path.name}"
                section.note("no-object", sub, text)
            elif number != self._sheet.value(ERROR_BEHAVIOR, row.sub):
                self.writes.add(ERROR_BEHAVIOR, row.sub, number, section.place_of(sub))

    def _whole_of(self, key: str, most: int, index: int, sub: int | None = None) -> int:
        """Read a number. Report that the EDS lacks its object, of which it may be the sub-index."""
        number = self._node.whole(key, 0, 0, most)
        sub = number if sub is None else sub
        if key in self._node and self._sheet.row(index, sub) is None:
            text = f"{self._sheet.path.name} has no {index:04X}h:{sub:02X}"
            self._node.wrong("no-object", key, text)
        return number

    def _sdo(self) -> None:
        for entry in self._node.sections("sdo"):
            check_keys(entry, _WRITE)
            if "index" not in entry:
                entry.note("kind", "index", "an entry of sdo needs an index")
                continue
            if (index := entry.whole("index", -1, 0, UNSIGNED16)) < 0:
                continue
            sub = entry.whole("sub_index", 0, 0, UNSIGNED8)
            value = entry.whole("value", 0, -(1 << 63), (1 << 64) - 1)
            item = entry.fields.get("value")
            self.writes.add(index, sub, value, entry.place, item.text if item else "")
            if item is None:
                entry.note("no-value", "value", f"{index:04X}h:{sub:02X}: no value: 0 is written")

    def _settings(self) -> dict[str, Item]:
        fields = self._node.fields
        return {key: fields[key] for key in DRIVER if key in fields}


def read_extra(section: BusFileSection) -> dict[str, Item]:
    """Return the keys that only this project reads."""
    if EXTRA not in section:
        return {}
    return {str(key): item for key, item in section.section(EXTRA).fields.items()}


def _read_channels(node: BusFileSection, name: str) -> tuple[DriveChannel, ...]:
    """Read names and scales of the axes of a node. Read one axis if the number is missing."""
    count = node.whole("num_channels", 1, 1, _MOST_CHANNELS)
    names = node.fields.get("channel_names")
    own = node.sections("channels")
    given = [item.text for item in names.items] if names else []
    usual = {key: node.real(key, getattr(DriveChannel(""), key)) for key in SCALES if key in node}
    channels = []
    for at in range(count):
        default = name if count == 1 else f"{name}/{at}"
        joint = given[at] if at < len(given) and given[at] else default
        scales = dict(usual)
        if at < len(own):
            check_keys(own[at], SCALES)
            scales |= {key: own[at].real(key, 0.0) for key in SCALES if key in own[at]}
        channels.append(DriveChannel(joint, **scales))
    return tuple(channels)
