"""A daemon that answers all that the page asks, draws marks instead of light, and can be cut off.

Its scenes are the nodes, lights and meshes' boxes of a .glb. Its pictures show each light as a disc of
the light's colour where a pinhole camera sees it, on a ground as bright as all lights together: a test
can tell from pixels what the page asked for.

usage: stand_in.py PORT SCENE.glb...
"""

import copy
import hashlib
import json
import pathlib
import struct
import sys
import threading
import time
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import bounced_pb2 as pb
import websocket
from stand_in_scene import Refused, Scene, draw, half_of, report_of

DIST = pathlib.Path(__file__).parents[2] / "clients/web/dist"
TYPES = {"html": "text/html", "js": "text/javascript", "css": "text/css", "svg": "image/svg+xml", "txt": "text/plain"}
STEPS = 3
CREDITS = 2
TOKEN = "0123456789abcdef"  # where it is locked


class View:
    """Renders by itself, as far as its credits reach, until its picture is final."""

    def __init__(self, client, request_id, number, opened):
        self.client, self.request_id, self.number = client, request_id, number
        self.scene, self.request = opened.scene, opened.frame
        self.credits, self.frames, self.step, self.sequence = opened.credits or CREDITS, 0, 0, 0
        self.condition = threading.Condition()
        self.is_open = True
        threading.Thread(target=self.run, daemon=True).start()

    def touch(self):
        with self.condition:
            self.step = 0
            self.condition.notify_all()

    def run(self):
        while True:
            with self.condition:
                self.condition.wait_for(lambda: not self.is_open or (self.credits > 0 and self.step < STEPS))
                if not self.is_open:
                    return
                request, step, sequence = copy.deepcopy(self.request), self.step, self.sequence
                self.step += 1
                self.credits -= 1
                self.frames += 1
            time.sleep(0.03)
            self.send(request, step, sequence)

    def send(self, request, step, sequence):
        server = self.client.server
        with server.lock:
            scene = server.scenes.get(self.scene)
            if not scene:
                return
            payload, report = draw(scene, request, (step + 1) / STEPS), report_of(scene, request, step)
            transient = scene.transient
        event = pb.Envelope(request_id=self.request_id)
        event.view_frame.CopyFrom(pb.ViewFrame(
            view=self.number, number=self.frames, final=step == STEPS - 1, step=step, age_ms=30.0, sequence=sequence,
            credits=self.credits, encoding=request.encoding or "jpeg", report=report, transient=transient))
        self.client.send(event, payload)

    def end(self):
        with self.condition:
            self.is_open = False
            self.condition.notify_all()


def check_view(frame):
    if frame.check or frame.target_error:
        raise Refused("usage", "a view is not checked", "check")
    if bool(frame.camera) == frame.HasField("pose"):
        raise Refused("usage", "a view has a camera or a pose", "pose")


class Client:
    """One page's connection: on_NAME answers the request of that name."""

    def __init__(self, server, socket):
        self.server, self.socket = server, socket
        self.views, self.watches = {}, []
        self.session, self.is_kept = None, False
        self.write_lock = threading.Lock()

    def send(self, envelope, payload=b""):
        header = envelope.SerializeToString()
        with self.write_lock:
            try:
                self.socket.send(struct.pack("<I", len(header)) + header + payload)
            except OSError:
                pass  # the reader notices

    def serve(self):
        try:
            while True:
                message = self.socket.receive()
                size = struct.unpack("<I", message[:4])[0]
                self.answer(pb.Envelope.FromString(message[4:4 + size]))
        except (OSError, EOFError):
            pass
        finally:
            if not self.is_kept:
                for view in self.views.values():
                    view.end()

    def adopt(self, other):
        """Goes on with what the connection of before had."""
        self.views, self.watches = other.views, other.watches
        for view in self.views.values():
            with view.condition:
                view.client, view.credits = self, CREDITS
            view.touch()

    def answer(self, envelope):
        kind = envelope.WhichOneof("body")
        self.server.asked.append(envelope)
        reply = pb.Envelope(request_id=envelope.request_id)
        method, payload = getattr(self, "on_" + kind, None), b""
        try:
            if not method:
                raise Refused("unsupported", f"no {kind} here")
            if kind in self.server.refused_late:
                time.sleep(self.server.refused_late.pop(kind))
                raise Refused("usage", f"no {kind} this time")
            if kind == "render":
                self.server.wait_to_trace(envelope.render.frame)
            with self.server.lock:
                payload = method(getattr(envelope, kind), reply) or b""
        except Refused as refused:
            reply.error.code, reply.error.message = refused.code, str(refused)
            reply.error.details.field = refused.field
        if kind == self.server.lost:
            self.server.lost = None
            self.server.cut(is_kept=True)
        elif kind in self.server.delays_s:
            threading.Timer(self.server.delays_s[kind], self.send, (reply, payload)).start()
        elif kind != "view_credit":
            self.send(reply, payload)

    def on_hello(self, hello, reply):
        reply.hello_reply.version = 1
        reply.hello_reply.author = "local"
        self.session = reply.hello_reply.session = f"session {len(self.server.requests('hello'))}"
        before = self.server.kept.pop(hello.resume, None)
        reply.hello_reply.resumed = before is not None
        if before:
            self.adopt(before)
        reply.hello_reply.device.name = "stand-in"
        setattr(reply.hello_reply.device, "class", "stand-in")
        reply.hello_reply.device.software = True

    def on_techniques(self, _, reply):
        for name in ("direct", "multires_gather", "reference"):
            technique = reply.techniques_reply.techniques.add(name=name, summary=f"what {name} does",
                                                              is_reference=name == "reference")
            technique.parameters.add(key="vpls", minimum=1, maximum=65536, standard="1024", whole=True)
            technique.parameters.add(key="brdf", standard="full", choices=["full", "lambert"])
            technique.parameters.add(key="paper_mode", minimum=0, maximum=1, standard="0", whole=True)
            technique.ladder.extend(["vpls=64", "vpls=1024", "vpls=4096 brdf=full"])

    def on_blob_have(self, have, reply):
        reply.blob_reply.have.extend(blob for blob in have.blobs if blob.split(":")[1] in self.server.blobs)
        reply.blob_reply.SetInParent()

    def on_scene_list(self, _, reply):
        reply.scene_list_reply.scenes.extend(scene.message(False) for scene in self.server.scenes.values())

    def on_scene_get(self, get, reply):
        reply.scene.CopyFrom(self.scene(get.id).message(get.objects))

    def on_scene_remove(self, remove, reply):
        del self.server.scenes[self.scene(remove.id).id]
        reply.done.SetInParent()
        self.server.tell(remove.id, "removed")

    def on_cancel(self, cancel, reply):
        """Of what goes on after its answer: views and watches."""
        self.watches = [watch for watch in self.watches if watch != cancel.request_id]
        for view in list(self.views.values()):
            if view.request_id == cancel.request_id:
                self.views.pop(view.number).end()
        reply.done.SetInParent()

    def on_scene_watch(self, _, reply):
        self.watches.append(reply.request_id)
        reply.done.SetInParent()

    def on_scene_log(self, log, reply):
        reply.scene_log_reply.entries.extend(self.scene(log.scene).log)

    def scene(self, scene_id):
        if scene_id not in self.server.scenes:
            raise Refused("not_found", "there is no such scene", "scene")
        return self.server.scenes[scene_id]

    def edited(self, request, reply, how, kind="edited"):
        """Carried out once, and answered alike each time that it is asked for under one name."""
        scene, name = self.scene(request.scene), request.client_edit_id
        if not name or name not in scene.answered:
            how(scene)
            scene.answered[name] = scene.revision, scene.transient
            self.server.tell(scene.id, kind, author=f"local {request.by}", batch=scene.log[-1].kind, of=scene.log[-1].of,
                             changes=["light 0"])
        reply.edit_reply.revision, reply.edit_reply.transient = scene.answered[name]

    def on_edit_batch(self, batch, reply):
        kind = "transient" if batch.durability == "transient" else "edited"
        self.edited(batch, reply, lambda scene: scene.edit(batch), kind)

    def on_edit_commit(self, commit, reply):
        self.edited(commit, reply, lambda scene: scene.commit(commit))

    def on_edit_undo(self, undo, reply):
        self.edited(undo, reply, lambda scene: scene.undo(undo))

    def on_edit_revert(self, revert, reply):
        self.edited(revert, reply, lambda scene: scene.revert(revert))

    def on_render(self, render, reply):
        report = report_of(self.scene(render.scene), render.frame, self.server.measured)
        reply.render_reply.report.CopyFrom(report)
        self.server.measured += 1
        if render.frame.encoding == "half":
            return half_of(render.frame)
        return b""

    def on_view_open(self, opened, reply):
        self.scene(opened.scene)
        check_view(opened.frame)
        number = max(self.views, default=0) + 1
        reply.view_reply.view = number
        self.views[number] = View(self, reply.request_id, number, opened)

    def on_view_update(self, update, reply):
        view = self.views[update.view]
        with view.condition:
            if update.HasField("frame"):
                check_view(update.frame)
                view.request = update.frame
            if update.HasField("pose"):
                view.request.ClearField("camera")
                view.request.pose.CopyFrom(update.pose)
            view.sequence = update.sequence
        view.touch()
        reply.done.SetInParent()

    def on_view_close(self, close, reply):
        self.views.pop(close.view).end()
        reply.done.SetInParent()

    def on_view_credit(self, credit, _):
        view = self.views.get(credit.view)
        if view:
            with view.condition:
                view.credits += credit.count
                view.condition.notify_all()


class Handler(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        pass

    def do_GET(self):
        server = self.server.stand_in
        path = self.path.split("?")[0]
        if path == "/v1/socket":
            server.serve(websocket.accept(self))
            self.close_connection = True
        elif path == "/v1/scenes":
            server.is_answering.wait()
            self.reply(401 if server.is_locked else 200, b'{"scenes":[]}')
        elif path.endswith("/export"):
            self.export(path.split("/")[-2])
        elif (file := DIST / (path.lstrip("/") or "index.html")).is_file():
            self.reply(200, file.read_bytes(), TYPES[file.suffix[1:]])
        else:
            self.reply(404, b"{}")

    do_HEAD = do_GET

    def export(self, scene_id):
        server = self.server.stand_in
        if server.is_locked or scene_id not in server.scenes:
            self.reply(401, b'{"code":"auth","message":"a token is needed"}')
            return
        scene = server.scenes[scene_id]
        self.reply(200, scene.glb, "model/gltf-binary", [("Bounced-Flag", flag) for flag in scene.flags])

    def do_PUT(self):
        self.server.stand_in.blobs[self.path.split("sha256:")[1]] = self.body()
        self.reply(201)

    def do_POST(self):
        server = self.server.stand_in
        if self.path == "/v1/session":
            server.tokens.append(self.headers["Authorization"])
            server.is_locked = server.is_locked and self.headers["Authorization"] != "Bearer " + TOKEN
            self.reply(401 if server.is_locked else 204)
            return
        body = json.loads(self.body())
        digest = body["blob"].split(":")[1]
        data = server.blobs.get(digest, b"")
        if hashlib.sha256(data).hexdigest() != digest or data[:4] != b"glTF":
            self.reply(400, json.dumps({"code": "bad_input", "message": "this is no glTF"}).encode())
            return
        self.reply(201, json.dumps({"id": server.add(data, body["name"]), "revision": 1}).encode())

    def body(self):
        return self.rfile.read(int(self.headers.get("Content-Length", 0)))

    def reply(self, status, body=b"", kind="application/json", heads=()):
        self.send_response(status)
        for name, value in heads:
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)


class Threads(ThreadingHTTPServer):
    daemon_threads = True
    allow_reuse_address = True


class StandIn:
    def __init__(self, port=0):
        self.lock = threading.RLock()
        self.scenes, self.blobs, self.clients = {}, {}, []
        self.asked = []  # envelopes, in order
        self.is_locked = False
        self.kept = {}  # clients of connections that broke, by session
        self.delays_s = {}  # of answers, by kind of request
        self.lost = None  # kind of request whose next answer is lost: all connections break before it, and are kept
        self.is_answering = threading.Event()  # GET /v1/scenes, which else says nothing
        self.is_answering.set()
        self.refused_late = {}  # seconds by kind: its next request is refused after as long
        self.measured = 0
        self.tokens = []  # that were tried
        self.samples_most = 1 << 30  # that are traced a pixel; for more the answer waits
        self.http = Threads(("127.0.0.1", port), Handler)
        self.http.stand_in = self
        self.url = f"http://127.0.0.1:{self.http.server_address[1]}/"
        threading.Thread(target=self.http.serve_forever, daemon=True).start()

    def wait_to_trace(self, frame):
        samples = int({one.key: one.value for one in frame.parameters}.get("spp", 0))
        if samples % 2:
            raise Refused("usage", f"spp={samples}: must be an even number", "spp")
        while frame.technique == "reference" and samples > self.samples_most:
            time.sleep(0.02)

    def requests(self, kind):
        return [getattr(envelope, kind) for envelope in list(self.asked) if envelope.WhichOneof("body") == kind]

    def add(self, data, name):
        with self.lock:
            scene_id = f"scene{len(self.scenes) + 1}"
            self.scenes[scene_id] = Scene(scene_id, name, data)
        self.tell(scene_id, "added")
        return scene_id

    def serve(self, socket):
        if self.is_locked:
            socket.cut()
            return
        client = Client(self, socket)
        self.clients.append(client)
        client.serve()

    def tell(self, scene_id, kind, **more):
        for client in list(self.clients):
            for watch in client.watches:
                event = pb.Envelope(request_id=watch)
                event.scene_event.CopyFrom(pb.SceneEvent(scene=scene_id, kind=kind, **more))
                client.send(event)
            for view in client.views.values():
                if view.scene == scene_id:
                    view.touch()

    def cut(self, is_kept=False):
        """The connections break; who comes back is let in. What they had is kept for them, or forgotten."""
        for client in self.clients:
            client.is_kept = is_kept
            if is_kept:
                self.kept[client.session] = client
            client.socket.cut()
        self.clients.clear()

    def close(self):
        self.cut()
        self.is_answering.set()
        self.http.shutdown()
        self.http.server_close()


if __name__ == "__main__":
    one = StandIn(int(sys.argv[1]))
    for name in sys.argv[2:]:
        one.add(pathlib.Path(name).read_bytes(), pathlib.Path(name).name)
    print(one.url, flush=True)
    threading.Event().wait()
