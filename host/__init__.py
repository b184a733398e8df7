"""Host-side proxies and monitors: hardware or emulator, they cannot tell."""
