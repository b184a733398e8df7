"""RT components as those of OpenRTM-aist: CORBA servants, names, ports (extra tickrig[openrtm])."""
