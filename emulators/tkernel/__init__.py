"""OpenRTM on T-Kernel: its node, the ucode reader, the resolution service, the demonstration."""
