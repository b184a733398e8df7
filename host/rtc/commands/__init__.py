"""The command `tickrig rtc`, and the requests to a running system. The model is a separate part."""
