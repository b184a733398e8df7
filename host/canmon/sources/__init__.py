"""Where frames come from: buses, log files, pipes, serial ports."""
