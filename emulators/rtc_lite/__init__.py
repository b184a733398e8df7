"""RTC-Lite nodes on a pty or in virtual time: `rtc-lite-emu`."""
