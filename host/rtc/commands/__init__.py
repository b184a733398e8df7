"""The command `tickrig rtc`, and what can be asked of a running system; the model is beside it."""
