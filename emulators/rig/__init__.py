"""The rig: stations, clocks, timetable, ports, links into virtual time; no wire in particular."""
