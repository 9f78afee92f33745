"""A daemon that is made up, on the other end of a socket pair: for answers that a real one gives
seldom, and for what exactly was asked.

    peer.on("edit_batch", lambda peer, envelope, payload: peer.answer(envelope, edit_reply={...}))

`peer.asked` has every (body, message, payload) but hello.
"""
import socket
import struct
import threading

import bounced
import bounced_pb2 as pb
from bounced.transport import StreamTransport


class FakePeer:
    def __init__(self, session="", **limits):
        """session: by which a client may take up a connection that broke, at another peer."""
        self.session = session
        self.limits = {"message_bytes": 1 << 24, **limits}
        self.asked = []
        self.fault = None
        self.blobs = {}
        self.news = threading.Condition()
        self._handlers = {"hello": FakePeer._on_hello, "blob_have": FakePeer._on_blob_have,
                          "blob_put": FakePeer._on_blob_put}
        self._lock = threading.Lock()
        self._sock, theirs = socket.socketpair()
        self.transport = StreamTransport(theirs)
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def __enter__(self):
        self.client = bounced.Client(self.transport, timeout_s=10)
        return self

    def __exit__(self, *_):
        self.client.close()
        self.end()

    def end(self):
        """What a handler raised comes out here."""
        self.hang_up()
        self._thread.join(10)
        assert not self._thread.is_alive()
        assert self.fault is None, repr(self.fault)

    def on(self, body, handler):
        self._handlers[body] = handler

    def hang_up(self):
        try:
            self._sock.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass

    def send(self, envelope, payload=b""):
        header = envelope.SerializeToString()
        with self._lock:
            self._sock.sendall(struct.pack("<II", 4 + len(header) + len(payload), len(header)) +
                               header + payload)

    def raw(self, data):
        self._sock.sendall(data)

    def answer(self, request, payload=b"", **body):
        """body: one name with a dictionary of its fields."""
        envelope = pb.Envelope(request_id=request.request_id, **body)
        for name in body:
            getattr(envelope, name).SetInParent()
        self.send(envelope, payload)

    def refuse(self, request, code, message, field=""):
        self.answer(request, error={"code": code, "message": message, "details": {"field": field}})

    def wait_for(self, body, count=1, timeout_s=10):
        """The messages `body` that came, once there are so many."""
        def found():
            return [(message, payload) for name, message, payload in self.asked if name == body]

        with self.news:
            assert self.news.wait_for(lambda: len(found()) >= count, timeout_s), (body, self.asked)
        return found()

    def _exactly(self, size):
        data = b""
        while len(data) < size:
            piece = self._sock.recv(size - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data

    def _serve(self):
        try:
            while True:
                total, header_len = struct.unpack("<II", self._exactly(8))
                envelope = pb.Envelope.FromString(self._exactly(header_len))
                self._take(envelope, self._exactly(total - 4 - header_len))
        except (EOFError, OSError):
            pass
        except BaseException as error:  # of a test's handler: nobody may wait for it
            self.fault = error
            self.hang_up()

    def _take(self, envelope, payload):
        body = envelope.WhichOneof("body")
        if body != "hello":
            with self.news:
                self.asked.append((body, getattr(envelope, body), payload))
                self.news.notify_all()
        if body in self._handlers:
            self._handlers[body](self, envelope, payload)

    def _on_hello(self, envelope, _):
        limits = [{"key": key, "value": str(value)} for key, value in self.limits.items()]
        self.answer(envelope, hello_reply={
            "version": 1, "limits": limits, "build": "made up", "capabilities": ["under_way"],
            "session": self.session, "resumed": bool(self.session and envelope.hello.resume)})

    def _on_blob_have(self, envelope, _):
        held = [blob for blob in envelope.blob_have.blobs if blob in self.blobs]
        self.answer(envelope, blob_reply={"have": held})

    def _on_blob_put(self, envelope, payload):
        put = envelope.blob_put
        self.blobs[put.blob] = self.blobs.get(put.blob, b"") + payload
        size = len(self.blobs[put.blob])
        self.answer(envelope, blob_reply={"offset": size, "complete": size == put.size_bytes})
