"""The server's side of a WebSocket, as far as a browser and small messages need it (RFC 6455)."""

import base64
import hashlib
import socket
import struct

BINARY, CLOSE, PING, PONG = 2, 8, 9, 10
MAGIC = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"


def accept(handler):
    """Answers the handshake of an http.server handler and takes its connection over."""
    key = handler.headers["Sec-WebSocket-Key"]
    proof = base64.b64encode(hashlib.sha1((key + MAGIC).encode()).digest()).decode()
    handler.send_response(101)
    handler.send_header("Upgrade", "websocket")
    handler.send_header("Connection", "Upgrade")
    handler.send_header("Sec-WebSocket-Accept", proof)
    handler.send_header("Sec-WebSocket-Protocol", "bounced.v1")
    handler.end_headers()
    handler.wfile.flush()
    return Socket(handler.connection, handler.rfile)


class Socket:
    def __init__(self, connection, reader):
        self.connection, self.reader = connection, reader

    def _exactly(self, size):
        data = self.reader.read(size)
        if len(data) < size:
            raise EOFError
        return data

    def _frame(self):
        first, second = self._exactly(2)
        size = second & 127
        if size == 126:
            size = struct.unpack(">H", self._exactly(2))[0]
        elif size == 127:
            size = struct.unpack(">Q", self._exactly(8))[0]
        mask = self._exactly(4)
        data = self._exactly(size)
        plain = bytes(byte ^ mask[i & 3] for i, byte in enumerate(data))
        return first & 128, first & 15, plain

    def receive(self):
        """The next binary message; pings are answered on the way."""
        held = b""
        while True:
            is_last, code, data = self._frame()
            if code == CLOSE:
                raise EOFError
            if code == PING:
                self.send(data, PONG)
            elif code in (0, BINARY):
                held += data
                if is_last:
                    return held

    def send(self, data, code=BINARY):
        size = len(data)
        head = bytes([128 | code])
        if size < 126:
            head += bytes([size])
        elif size < 65536:
            head += struct.pack(">BH", 126, size)
        else:
            head += struct.pack(">BQ", 127, size)
        self.connection.sendall(head + data)

    def cut(self):
        try:
            self.connection.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
