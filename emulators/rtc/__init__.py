"""A system of RT components that runs: the commands `tickrig rtc`."""
