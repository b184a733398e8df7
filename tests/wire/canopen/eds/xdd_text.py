"""An XDD of a small device, as editors write it: attributes of objects, and parameters."""

from __future__ import annotations

from typing import Final

EDITOR: Final = """<?xml version="1.0" encoding="utf-8"?>
<!-- attributes as CANopenEditor writes them -->
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1">
  <ISO15745Profile><ProfileBody xmlns="" fileName="e.xdc">
    <ApplicationProcess><parameterList>
      <parameter uniqueID="UID_OBJ_1018"><actualValue value="0x9"/></parameter>
      <parameter uniqueID="UID_SUB_101801"><UDINT/><defaultValue value="0x7"/></parameter>
    </parameterList></ApplicationProcess>
  </ProfileBody></ISO15745Profile>
  <ISO15745Profile><ProfileBody xmlns="">
    <ApplicationLayers><CANopenObjectList>
      <CANopenObject index="1000" name="Device type" objectType="7" PDOmapping="no"
          dataType="0007" accessType="ro" defaultValue="0x191"/>
      <CANopenObject index="1018" name="Identity" objectType="9" subNumber="2"
          uniqueIDRef="UID_OBJ_1018">
        <CANopenSubObject subIndex="0000" name="n" objectType="7" dataType="0005"
            accessType="ro" defaultValue="1" PDOmapping="no"/>
        <CANopenSubObject subIndex="0001" name="Vendor-ID" objectType="7" PDOmapping="no"
            uniqueIDRef="UID_SUB_101801"/>
      </CANopenObject>
    </CANopenObjectList></ApplicationLayers>
    <NetworkManagement>
      <CANopenGeneralFeatures granularity="8" ngSlave="false" NrOfNG_MonitoredNodes="0"/>
      <deviceCommissioning NodeID="17" nodeName="n" actualBaudRate="{rate}" networkNumber="2"
          networkName="net" CANopenManager="true"/>
    </NetworkManagement>
  </ProfileBody></ISO15745Profile>
</ISO15745ProfileContainer>
"""

XDD: Final = """<?xml version="1.0" encoding="utf-8"?>
<!-- written for these tests -->
<ISO15745ProfileContainer xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance"
    xmlns="http://www.canopen.org/xml/1.1">
  <ISO15745Profile>
    <ProfileHeader xmlns=""><ProfileClassID>Device</ProfileClassID></ProfileHeader>
    <ProfileBody xmlns:d="http://www.canopen.org/xml/1.1" xsi:type="d:ProfileBody_Device_CANopen"
        fileName="lamp.xdd" fileVersion="1" fileCreator="somebody" xmlns="">
      <d:DeviceIdentity>
        <d:vendorName> Lamps </d:vendorName><d:vendorID>0x1234</d:vendorID>
        <d:productName>Lamp</d:productName><d:productID>0x7</d:productID>
        <d:orderNumber>L-7</d:orderNumber>
      </d:DeviceIdentity>
      <d:ApplicationProcess>
        <d:dataTypeList>
          <d:enum name="Mode" uniqueID="UID_ENUM"><enumValue value="0"/><USINT/></d:enum>
        </d:dataTypeList>
        <d:parameterList>
          <d:parameter uniqueID="P1"><label lang="en">x</label><UDINT/>
            <d:defaultValue value="$NODEID+0x80"/></d:parameter>
          <d:parameter uniqueID="P2" access="readWrite"><d:dataTypeIDRef uniqueIDRef="UID_ENUM"/>
            <d:actualValue value="3"/>
            <d:allowedValues><d:range><d:minValue value="1"/><d:maxValue value="9"/><d:step/>
              </d:range><d:value value="5"/></d:allowedValues></d:parameter>
          <d:parameter uniqueID="P3" access="noAccess"><INT/></d:parameter>
          <d:parameter uniqueID="P4"><d:dataTypeIDRef uniqueIDRef="NOWHERE"/></d:parameter>
        </d:parameterList>
      </d:ApplicationProcess>
    </ProfileBody>
  </ISO15745Profile>
  <ISO15745Profile>
    <ProfileBody xmlns="">
      <ApplicationLayers>
        <CANopenObjectList>
          <CANopenObject index="1000" name="Device type" objectType="7" dataType="0007"
              accessType="ro" PDOmapping="no" defaultValue="0x00000191"/>
          <CANopenObject index="1014" name="COB-ID EMCY" uniqueIDRef="P1"/>
          <CANopenObject index="2000" name="Mode" objectType="7" PDOmapping="RPDO"
              uniqueIDRef="P2"/>
          <CANopenObject index="2001" name="Odd" objectType="7" PDOmapping="optional"
              uniqueIDRef="P3" denotation="an odd one"/>
          <CANopenObject index="2002" name="Levels" objectType="8" subNumber="2">
            <CANopenSubObject subIndex="00" name="Highest" objectType="7" dataType="0x0005"
              accessType="const" defaultValue="1"/>
            <CANopenSubObject subIndex="01" name="First" objectType="7" dataType="0003"
              accessType="rw" PDOmapping="TPDO" lowLimit="-5" highLimit="5"/>
            <other/>
          </CANopenObject>
          <CANopenObject index="2003" name="Nothing known" objectType="7"/>
          <CANopenObject index="2004" name="Lost type" objectType="7" uniqueIDRef="P4"/>
        </CANopenObjectList>
        <dummyUsage><dummy entry="Dummy0005=1"/></dummyUsage>
      </ApplicationLayers>
      <TransportLayers><PhysicalLayer><baudRate defaultValue="250 Kbps">
        <supportedBaudRate value="250 Kbps"/><supportedBaudRate value="1 Mbps"/>
        <supportedBaudRate value="auto-baudRate"/><supportedBaudRate value="250 Kbps"/>
      </baudRate></PhysicalLayer></TransportLayers>
      <NetworkManagement>
        <CANopenGeneralFeatures granularity="8" nrOfRxPDO="0" layerSettingServiceSlave="true"/>
        <CANopenMasterFeatures bootUpMaster="false"/>
        <deviceCommissioning nodeID="5" nodeName="lamp" actualBaudRate="500 Kbps"/>
      </NetworkManagement>
    </ProfileBody>
  </ISO15745Profile>
</ISO15745ProfileContainer>
"""
