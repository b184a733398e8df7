"""Captures of Wireshark, tshark and tcpdump: pcapng read and written, pcap read."""
