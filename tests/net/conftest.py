"""What the network tests share: a daemon on ports and sockets of its own, and two raw clients."""
import contextlib
import http.client
import json
import os
import pathlib
import re
import signal
import socket
import struct
import subprocess
import sys
import time

import pytest

HERE = pathlib.Path(__file__).parent
SCENES = HERE.parent / "scenes"
BOUNCED = os.environ["BD_BOUNCED"]
# Freed memory stays in the sanitizer's quarantine.
IS_SANITIZED = any(init in pathlib.Path(BOUNCED).read_bytes() for init in (b"__asan_init", b"__tsan_init"))
IS_GRADIENT = BOUNCED.endswith("bounced_gradient")
ANSWER_S = 60 if IS_SANITIZED else 10  # until an answer that does not come is missed
sys.path[:0] = [os.environ["BD_PB2_DIR"], str(HERE.parent)]
sys.dont_write_bytecode = True

import bounced_pb2  # noqa: E402


class Daemon:
    def __init__(self, folder, *options, token=None, env=None, http="127.0.0.1:0"):
        self.folder = folder
        self.socket_path = str(folder / "s.sock")
        self.data = folder / "data"
        self.token = token
        words = [BOUNCED, "--http", http, "--listen", "unix:" + self.socket_path,
                 "--listen", "tcp:127.0.0.1:0", "--data", str(self.data), *options]
        if token:
            (folder / "tokens").write_text("# ours\n" + token + "\n")
            (folder / "tokens").chmod(0o600)
            words += ["--token-file", str(folder / "tokens")]
        if os.environ.get("BD_DEVICE"):
            words += ["--device", os.environ["BD_DEVICE"]]
        self.log_path = folder / "log"
        self.process = subprocess.Popen(words, stderr=open(self.log_path, "wb"),
                                        env={**os.environ, **(env or {})})
        self._wait_for_ports()

    def _wait_for_ports(self):
        until = time.time() + 30
        while time.time() < until:
            log = self.log_path.read_text()
            http_port = re.search(r"http://127\.0\.0\.1:(\d+)", log)
            tcp_port = re.search(r"listening on 127\.0\.0\.1:(\d+)", log)
            if http_port and tcp_port and os.path.exists(self.socket_path):
                self.port, self.tcp_port = int(http_port[1]), int(tcp_port[1])
                return
            if self.process.poll() is not None:
                break
            time.sleep(0.01)
        raise AssertionError("the daemon did not start:\n" + self.log_path.read_text())

    def stop(self, expect=0):
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        assert self.process.wait(timeout=20) == expect, self.log_path.read_text()

    def rss_kib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s+(\d+)", status)[1])

    def open_files(self):
        return len(os.listdir(f"/proc/{self.process.pid}/fd"))

    # --- HTTP ---

    def request(self, method, path, body=None, headers=None, timeout=20):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        headers = dict(headers or {})
        if self.token and "Authorization" not in headers:
            headers["Authorization"] = "Bearer " + self.token
        with contextlib.closing(connection):
            connection.request(method, path, body, headers)
            response = connection.getresponse()
            return response.status, dict(response.getheaders()), response.read()

    def json(self, method, path, body=None, headers=None):
        if body is not None and not isinstance(body, (bytes, str)):
            body = json.dumps(body)
        status, _, text = self.request(method, path, body,
                                       {"Content-Type": "application/json", **(headers or {})})
        return status, json.loads(text) if text else None

    def raw(self, data, timeout=10, shut=False):
        """Sends bytes, returns everything until the server closes."""
        with socket.create_connection(("127.0.0.1", self.port), timeout) as sock:
            with contextlib.suppress(ConnectionError):
                sock.sendall(data)
            if shut:
                sock.shutdown(socket.SHUT_WR)
            return read_all(sock)

    def healthy(self):
        status, reply = self.json("GET", "/healthz")
        return self.process.poll() is None and status == 200 and reply == {"ok": True}

    def metrics(self):
        text = self.request("GET", "/metrics")[2].decode()
        lines = [line.rsplit(" ", 1) for line in text.splitlines() if not line.startswith("#")]
        return {name: float(value) for name, value in lines}

    def put_blob(self, data):
        name = blob_name(data)
        status, _, text = self.request("PUT", "/v1/blobs/" + name, data,
                                       {"Content-Type": "application/octet-stream"})
        assert status in (200, 201), text
        return name

    def add_scene(self, file="cornell.glb"):
        blob = self.put_blob((SCENES / file).read_bytes())
        status, reply = self.json("POST", "/v1/scenes", {"blob": blob, "name": file})
        assert status == 201, reply
        return reply["id"]

    def framed(self, tcp=False, hello=True):
        if tcp:
            sock = socket.create_connection(("127.0.0.1", self.tcp_port), ANSWER_S)
        else:
            sock = socket.socket(socket.AF_UNIX)
            sock.settimeout(ANSWER_S)
            sock.connect(self.socket_path)
        client = Framed(sock)
        if hello:
            client.hello(self.token if tcp else None)
        return client


def read_all(sock):
    data = b""
    with contextlib.suppress(ConnectionError):
        while piece := sock.recv(65536):
            data += piece
    return data


def blob_name(data):
    import hashlib
    return "sha256:" + hashlib.sha256(data).hexdigest()


def pack(envelope, payload=b""):
    header = envelope.SerializeToString()
    return struct.pack("<II", 4 + len(header) + len(payload), len(header)) + header + payload


class Framed:
    def __init__(self, sock):
        self.sock = sock
        self.next_id = 1

    def hello(self, token=None, low=1, high=1):
        envelope = bounced_pb2.Envelope()
        envelope.hello.min, envelope.hello.max = low, high
        if token:
            envelope.hello.token = token
        return self.ask(envelope)[0]

    def send(self, envelope, payload=b""):
        if not envelope.HasField("request_id"):
            envelope.request_id = self.next_id
            self.next_id += 1
        self.sock.sendall(pack(envelope, payload))
        return envelope.request_id

    def _exactly(self, size):
        data = b""
        while len(data) < size:
            piece = self.sock.recv(size - len(data))
            if not piece:
                raise EOFError
            data += piece
        return data

    def receive(self):
        total, header_bytes = struct.unpack("<II", self._exactly(8))
        rest = self._exactly(total - 4)
        envelope = bounced_pb2.Envelope.FromString(rest[:header_bytes])
        return envelope, rest[header_bytes:]

    def ask(self, envelope, payload=b""):
        wanted = self.send(envelope, payload)
        while True:
            answer, data = self.receive()
            if answer.request_id in (wanted, 0) and answer.WhichOneof("body") != "progress":
                return answer, data

    def put_blob(self, data, piece=1 << 20):
        answer = None
        for offset in range(0, max(len(data), 1), piece):
            envelope = bounced_pb2.Envelope()
            envelope.blob_put.blob = blob_name(data)
            envelope.blob_put.offset, envelope.blob_put.size_bytes = offset, len(data)
            answer, _ = self.ask(envelope, data[offset:offset + piece])
        assert answer.blob_reply.complete, answer
        return blob_name(data)

    def close(self):
        self.sock.close()


def frame(size=(16, 16), **fields):
    request = bounced_pb2.FrameRequest(size=size)
    for name, value in fields.items():
        if isinstance(value, list):
            getattr(request, name).extend(value)
        else:
            setattr(request, name, value)
    return request


def reload(daemon, needle="read again"):
    """What the daemon logs when it is told to read its files again."""
    before = len(daemon.log_path.read_text())
    daemon.process.send_signal(signal.SIGHUP)
    until = time.time() + ANSWER_S
    while time.time() < until:
        log = daemon.log_path.read_text()[before:]
        if needle in log and log.endswith("\n"):
            return log
        time.sleep(0.01)
    raise AssertionError(daemon.log_path.read_text())


@pytest.fixture
def start(tmp_path):
    """Starts daemons; each must still be alive at the end, and end well."""
    daemons = []

    def go(*options, **keywords):
        if "env" in keywords and not IS_GRADIENT:
            pytest.skip("frames as slow as the test wants them need the fake scheduler")
        folder = tmp_path / str(len(daemons))
        folder.mkdir()
        daemons.append(Daemon(folder, *options, **keywords))
        return daemons[-1]

    yield go
    for daemon in daemons:
        daemon.stop()


@pytest.fixture(scope="module")
def shared(tmp_path_factory):
    """One daemon for the tests that leave it as they found it."""
    daemon = Daemon(tmp_path_factory.mktemp("shared"))
    yield daemon
    daemon.stop()
