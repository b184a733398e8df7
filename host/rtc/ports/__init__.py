"""Data ports, service ports and the connectors between them (OMG RTC 1.0, OpenRTM-aist 1.x)."""
