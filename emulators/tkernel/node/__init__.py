"""A node of OpenRTM on T-Kernel: a board with RT components and narrow limits: `tkernel-emu`."""
