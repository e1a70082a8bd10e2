"""What docs/examples/subscriber.py needs of LCM's module for Python, where that is not installed.

Speaks LCM's protocol: each datagram is a magic number, a sequence number, the channel's name with
its end, and the message. Those in fragments are left out, for shefd sends none."""
import re
import socket
import struct


class LCM:
    def __init__(self, url):
        address, port = re.match(r"udpm://([0-9.]+):([0-9]+)", url).groups()
        self.handlers = []
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self.socket.bind((address, int(port)))
        group = socket.inet_aton(address) + socket.inet_aton("0.0.0.0")
        self.socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, group)

    def subscribe(self, channel, handler):
        self.handlers.append((re.compile(channel), handler))

    def handle(self):
        datagram = self.socket.recv(65536)
        if struct.unpack_from(">I", datagram)[0] != 0x4c433032:  # LC02: in one piece
            return
        name, _, message = datagram[8:].partition(b"\0")
        for channel, handler in self.handlers:
            if channel.fullmatch(name.decode()):
                handler(name.decode(), message)
