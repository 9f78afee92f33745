"""A WebSocket client for tests that do one thing after the other, on Debian's asyncio library."""
import asyncio
import struct
import threading

import bounced_pb2
import websockets

LOOP = asyncio.new_event_loop()
threading.Thread(target=LOOP.run_forever, daemon=True).start()


def wait(coroutine, timeout=20):
    return asyncio.run_coroutine_threadsafe(coroutine, LOOP).result(timeout)


async def _connect(*args, **options):
    return await websockets.connect(*args, **options)


def unit(envelope, payload=b""):
    header = envelope.SerializeToString()
    return struct.pack("<I", len(header)) + header + payload


def parse(data):
    size = struct.unpack("<I", data[:4])[0]
    return bounced_pb2.Envelope.FromString(data[4:4 + size]), data[4 + size:]


class WebSocket:
    def __init__(self, daemon, headers=None, hello=True, origin=None, compression=None, resume=None):
        self.socket = wait(_connect(
            f"ws://127.0.0.1:{daemon.port}/v1/socket", subprotocols=["bounced.v1"],
            extra_headers=headers or {}, origin=origin, max_size=None, compression=compression,
            ping_interval=None))
        self.next_id = 1
        if hello:
            envelope = bounced_pb2.Envelope()
            envelope.hello.min = envelope.hello.max = 1
            if resume is not None:
                envelope.hello.resume = resume
            self.hello = self.ask(envelope)[0].hello_reply
            assert self.hello.version == 1

    def send(self, envelope, payload=b""):
        if not envelope.HasField("request_id"):
            envelope.request_id = self.next_id
            self.next_id += 1
        wait(self.socket.send(unit(envelope, payload)))
        return envelope.request_id

    def receive(self, timeout=10):
        return parse(wait(asyncio.wait_for(self.socket.recv(), timeout)))

    def ask(self, envelope, payload=b""):
        wanted = self.send(envelope, payload)
        while True:
            answer, data = self.receive()
            if answer.request_id in (wanted, 0) and answer.WhichOneof("body") != "progress":
                return answer, data

    def close(self):
        wait(self.socket.close())
