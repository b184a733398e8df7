"""An infra-red reader of ucodes on a pty or in virtual time: `ucode-reader-emu`."""
