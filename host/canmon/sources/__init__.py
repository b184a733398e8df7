"""Sources of frames: buses, log files, pipes, serial ports."""
