"""The commands `tickrig run`, `check`, `init`, `record`, `compare`, `campaign` and others."""
