"""The same over http:// addresses."""
import socket
import struct
import threading

import bounced
import bounced_pb2 as pb
import pytest
from conftest import SCENES
from stopwatch import Stopwatch

pytest.importorskip("websockets")


@pytest.fixture
def web(serve):
    with bounced.connect(serve().http) as client:
        yield client


def test_scene_and_frame(web):
    scene = web.scenes.add(SCENES / "cornell.glb")
    frame = scene.render(size=(300, 200), layers=["direct"])
    assert frame.layers["direct"].shape == (200, 300, 3) and len(frame.data) > 300 * 200 * 28
    with pytest.raises(bounced.NotFound):
        web.scenes.get("nonsense")


def test_large_messages_both_ways(serve, tmp_path):
    (tmp_path / "big.bin").write_bytes(bytes(range(256)) * 12000)
    with bounced.connect(serve().http) as client:
        bounced.files.upload(client._conn, [bounced.files.file_content(tmp_path / "big.bin")])
        scene = client.scenes.add(SCENES / "cornell.glb")
        assert scene.render(size=(1024, 1024)).rgba.shape == (1024, 1024, 4)


def test_many_threads_share_it(web):
    scene, errors = web.scenes.add(SCENES / "cornell.glb"), []

    def work(seed):
        try:
            for _ in range(5):
                assert scene.render(size=(64, 64), seed=seed).report["seed"] == seed
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not errors and not any(thread.is_alive() for thread in threads)


def test_tokens(serve):
    served = serve(token="correct-horse-battery")
    with bounced.connect(served.http, token="correct-horse-battery") as client:
        assert client.scenes.list() == []
    for token in (None, "wrong"):
        with pytest.raises(bounced.Error) as caught:
            bounced.connect(served.http, token)
        assert caught.value.code == "unauthorized"


def test_a_server_that_ends_is_noticed(serve):
    served = serve()
    client = bounced.connect(served.http, resume_s=1)
    served.process.terminate()
    with pytest.raises(bounced.Unreachable):
        while True:
            client.stats()
    client.close()


def test_what_is_no_such_server(serve):
    with pytest.raises(bounced.Unreachable):
        bounced.connect("http://127.0.0.1:1", timeout_s=5)
    served = serve()
    with pytest.raises(bounced.Error) as caught:
        bounced.connect(served.http + "/elsewhere")
    assert caught.value.code == "not_found"
    with pytest.raises(bounced.Unreachable):  # speaks, but not HTTP
        bounced.connect(served.tcp.replace("tcp:", "http://"), timeout_s=5)


def test_a_server_that_is_silent_during_tls():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        hang_up = threading.Timer(10, lambda: listener.accept()[0].close())
        hang_up.start()
        watch = Stopwatch()
        with pytest.raises(bounced.Unreachable, match="timed out"):
            bounced.connect("https://127.0.0.1:%d" % listener.getsockname()[1], timeout_s=0.3)
        assert watch.own_s() < 5
        hang_up.cancel()


class FragmentingServer:
    """Answers every request by a stats_reply in three fragments with a ping between them, and
    keeps the pongs."""

    def __init__(self):
        from websockets import server
        kind = getattr(server, "ServerProtocol", None) or server.ServerConnection
        self.protocol = kind(subprotocols=["bounced.v1"], max_size=None)
        self.pongs = []
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "http://127.0.0.1:%d" % self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self._serve, daemon=True)
        self.thread.start()

    def _serve(self):
        peer, _ = self.listener.accept()
        with peer:
            while data := peer.recv(65536):
                self.protocol.receive_data(data)
                for event in self.protocol.events_received():
                    self._take(event)
                for piece in self.protocol.data_to_send():
                    peer.sendall(piece)

    def _take(self, event):
        if hasattr(event, "headers"):
            self.protocol.send_response(self.protocol.accept(event))
        elif event.opcode.name == "PONG":
            self.pongs.append(bytes(event.data))
        elif event.opcode.name == "BINARY":
            size = struct.unpack_from("<I", event.data)[0]
            self._answer(pb.Envelope.FromString(event.data[4:4 + size]))

    def _answer(self, request):
        answer = pb.Envelope(request_id=request.request_id)
        if request.HasField("hello"):
            answer.hello_reply.version = 1
        else:
            answer.stats_reply.jobs_done = 5
        header = answer.SerializeToString()
        message = struct.pack("<I", len(header)) + header
        self.protocol.send_binary(message[:3], fin=False)
        self.protocol.send_ping(b"alive?")
        self.protocol.send_continuation(message[3:5], fin=False)
        self.protocol.send_continuation(message[5:], fin=True)


def test_fragments_and_pings():
    server = FragmentingServer()
    with bounced.connect(server.address) as client:
        for _ in range(3):
            assert client.stats() == {"jobs_done": 5}
    server.thread.join(10)
    assert server.pongs == [b"alive?"] * 4
    server.listener.close()
