"""The commands `tkernel-emu` and `ucode-resolver`."""
