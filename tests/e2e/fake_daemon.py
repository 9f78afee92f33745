#!/usr/bin/python3
"""A daemon that renders nothing and misbehaves on request, to test the client alone.

Started by bounce as `bounced --private 3`, or by a test with the path of a Unix socket.
FAKE_MODE says how to behave, FAKE_LOG where to write what was asked, one JSON object a line.
"""
import hashlib
import json
import os
import signal
import socket
import struct
import sys
import time

sys.path.insert(0, os.environ["BD_PB2_DIR"])
import bounced_pb2 as pb  # noqa: E402
from google.protobuf.json_format import MessageToDict  # noqa: E402

MODE = os.environ.get("FAKE_MODE", "ok")
IDLE_SECONDS = 1
# What users may have put into names and messages: a terminal would obey it.
EVIL = "\x1b[2J\x9b1m\n7 edit" if MODE == "hostile" else ""
PICTURE = b"\x89PNG fake picture"


def log(entry):
    with open(os.environ["FAKE_LOG"], "a", encoding="utf-8") as out:
        out.write(json.dumps(entry) + "\n")


class Peer:
    def __init__(self, sock):
        self.sock = sock
        self.blobs = {}
        self.replays = 0
        self.waiting = None  # id of a render that is never answered
        if MODE == "impatient":
            self.sock.settimeout(IDLE_SECONDS)

    def read(self, size):
        data = b""
        while len(data) < size:
            try:
                piece = self.sock.recv(size - len(data))
            except TimeoutError:
                sys.exit(0)  # impatient
            if not piece:
                sys.exit(0)
            data += piece
        return data

    def receive(self):
        total, header_len = struct.unpack("<II", self.read(8))
        header = self.read(header_len)
        return pb.Envelope.FromString(header), self.read(total - 4 - header_len)

    def send(self, envelope, payload=b""):
        header = envelope.SerializeToString()
        prefix = struct.pack("<II", 4 + len(header) + len(payload), len(header))
        self.sock.sendall(prefix + header + payload)

    def error(self, request_id, code, message, field="test"):
        answer = pb.Envelope(request_id=request_id)
        answer.error.code = code
        answer.error.message = message
        answer.error.details.field = field
        self.send(answer)

    def serve(self):
        while True:
            envelope, payload = self.receive()
            body = envelope.WhichOneof("body")
            entry = MessageToDict(envelope, preserving_proto_field_name=True)
            log({"body": body, "payload": len(payload), **entry})
            getattr(self, "on_" + body)(envelope, payload)

    def on_hello(self, envelope, _):
        if MODE == "slow_start":
            time.sleep(60)
        if MODE == "unauthorized":
            self.error(envelope.request_id, "unauthorized", "no token, or a wrong one")
            sys.exit(0)
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.hello_reply.version = 1
        answer.hello_reply.limits.add(key="idle_seconds",
                                      value=str(IDLE_SECONDS if MODE == "impatient" else 120))
        self.send(answer)

    def on_blob_have(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.blob_reply.SetInParent()
        if MODE == "has_everything":
            answer.blob_reply.have.extend(envelope.blob_have.blobs)
        self.send(answer)

    def on_blob_put(self, envelope, payload):
        put = envelope.blob_put
        data = self.blobs.get(put.blob, b"")
        if put.offset != len(data):
            return self.error(envelope.request_id, "bad_input", "a piece out of order")
        data += payload
        self.blobs[put.blob] = data
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.blob_reply.offset = len(data)
        answer.blob_reply.complete = len(data) == put.size_bytes
        if answer.blob_reply.complete:
            log({"blob": put.blob, "right": "sha256:" + hashlib.sha256(data).hexdigest() == put.blob})
        return self.send(answer)

    def on_render(self, envelope, _):
        if MODE == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if MODE == "close":
            sys.exit(0)
        if MODE == "garbage":
            self.sock.sendall(b"\xff" * 64)
            sys.exit(0)
        if MODE.startswith("error:"):
            return self.error(envelope.request_id, MODE[6:], "no, because of a test")
        progress = pb.Envelope(request_id=envelope.request_id)
        progress.progress.stage = "render" + EVIL
        self.send(progress)
        if MODE in ("endless", "deaf"):
            self.waiting = envelope.request_id
            return None
        answer = pb.Envelope(request_id=envelope.request_id)
        report = answer.render_reply.report
        report.technique = "rsm" + EVIL
        report.size.extend([4, 4])
        report.flags.append("a_flag of the test" + EVIL)
        report.parameters.add(key="vpls", value="256")
        report.passes.add(name="gbuffer", ms=1.5, state="ran")
        report.stopped = "complete"
        frame = envelope.render.frame
        payload = b"" if frame.plan_only or frame.encoding == "none" else PICTURE
        return self.send(answer, payload)

    def on_cancel(self, envelope, _):
        if MODE == "deaf":
            return
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.done.SetInParent()
        self.send(answer)
        if envelope.cancel.request_id:
            self.error(envelope.cancel.request_id, "cancelled", "cancelled")

    def on_scene_list(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.scene_list_reply.scenes.add(id="s1", name="box.glb" + EVIL, revision=3)
        self.send(answer)

    def on_scene_add(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.scene.id = "s2"
        answer.scene.name = envelope.scene_add.name
        answer.scene.revision = 1
        self.send(answer)

    def on_scene_replay(self, envelope, _):
        """Every second one comes too fast, and what it makes is something else."""
        self.replays += 1
        if self.replays % 2:
            return self.error(envelope.request_id, "busy", "too fast", "requests_per_second")
        if MODE == "full":
            return self.error(envelope.request_id, "no_memory", "the disk is full")
        answer = pb.Envelope(request_id=envelope.request_id)
        body = answer.edit_reply if envelope.scene_replay.scene else answer.scene
        body.hash = "sha256:" + "0" * 64
        body.revision = envelope.scene_replay.revision
        if not envelope.scene_replay.scene:
            body.id = "s9"
        return self.send(answer)

    def on_scene_remove(self, envelope, _):
        if envelope.scene_remove.id != "s1":
            return self.error(envelope.request_id, "not_found", "no such scene")
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.done.SetInParent()
        return self.send(answer)

    def on_edit_batch(self, envelope, _):
        batch = envelope.edit_batch
        if MODE == "unsupported":
            return self.error(envelope.request_id, "unsupported", "no such request is known")
        if batch.message == "refuse":
            return self.error(envelope.request_id, "conflict", "another revision")
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.edit_reply.revision = 2
        answer.edit_reply.ids.extend(7 + k for k in range(len(batch.ops)))
        return self.send(answer)

    def on_change(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.edit_reply.revision = 5
        answer.edit_reply.flags.append("a_flag of the edit" + EVIL)
        self.send(answer)

    on_edit_undo = on_edit_revert = on_edit_commit = on_change

    def on_revision_name(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.done.SetInParent()
        self.send(answer)

    def on_scene_log(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        entries = answer.scene_log_reply.entries
        entries.add(revision=1, kind="import", time_ms=1700000000000)
        entries.add(revision=2, kind="edit", message="a lamp" + EVIL,
                    changes=["light 0" + EVIL, "node 3"], names=["lit" + EVIL])
        entries.add(revision=3, kind="undo", of=2, author="local Anna" + EVIL)
        self.send(answer)

    def on_scene_export(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.scene_export_reply.revision = 3
        self.send(answer, b"glTF of the scene")

    def on_scene_watch(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.done.SetInParent()
        self.send(answer)
        for revision in (2, 3):
            event = pb.Envelope(request_id=envelope.request_id)
            event.scene_event.scene = "s1"
            event.scene_event.kind = "edited"
            event.scene_event.revision = revision
            event.scene_event.changes.extend(["light 0" + EVIL, "node 3"])
            self.send(event)
        if MODE == "close":
            sys.exit(0)

    def on_devices(self, envelope, _):
        answer = pb.Envelope(request_id=envelope.request_id)
        answer.devices_reply.devices.add(name="Fake" + EVIL, spec="software", software=True, in_use=True)
        self.send(answer)


def main():
    log({"argv": sys.argv[1:], "pid": os.getpid()})
    if MODE == "no_device":
        sys.exit(6)
    if sys.argv[1] == "--private":
        Peer(socket.socket(fileno=int(sys.argv[2]))).serve()
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(sys.argv[1])
    listener.listen()
    while True:
        peer, _ = listener.accept()
        if os.fork() == 0:
            listener.close()
            Peer(peer).serve()
        peer.close()


if __name__ == "__main__":
    main()
