"""The rig: stations, clocks, timetable, ports, links into virtual time; for all kinds of wires."""
