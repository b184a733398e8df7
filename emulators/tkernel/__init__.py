"""OpenRTM on T-Kernel: node, ucode reader, resolution service and demonstration."""
