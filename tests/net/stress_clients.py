"""A client of the stress test: does what chance says, takes what comes, and keeps the books."""
import contextlib
import os
import random
import select
import socket
import threading
import time
import traceback

import bounced_pb2
from conftest import SCENES, blob_name, frame
from test_edits import TRIANGLE
from ws_client import WebSocket

pb = bounced_pb2
SEED = int(os.environ.get("BD_STRESS_SEED", "1"))
PATIENCE_S = 60
IN_FLIGHT = 12
GLB = (SCENES / "two_lights.glb").read_bytes()


class View:
    def __init__(self, scene):
        self.scene, self.number, self.frames, self.uncredited = scene, None, 0, 0


class Client(threading.Thread):
    """One session: sends what chance says, takes what comes, keeps the books."""

    ACTIONS = {"edit": 30, "drag": 10, "heavy": 3, "undo": 6, "revert": 2, "commit": 2, "name": 2,
               "repeat": 3, "stale": 2, "dry_run": 2, "render": 8, "cancel": 6, "view": 3, "move": 6,
               "credit_late": 4, "close_view": 2, "watch": 1, "ask": 4, "add": 1, "blob": 1,
               "break_off": 1, "leave": .3}
    # What a request may be refused by; `busy` and `cancelled` have reasons of their own.
    REFUSED = {"heavy": {"not_found"}, "undo": {"conflict"}, "revert": {"not_found"},
               "name": {"not_found"}, "stale": {"conflict"}, "render": {"deadline"},
               "own": {"not_found"}, "close": {"not_found"}}
    MAY_BE_BUSY = {"render", "view", "add"}

    def __init__(self, world, daemon, name, face):
        super().__init__(daemon=True)
        self.world, self.bounced, self.title, self.face = world, daemon, name, face
        self.random = random.Random(f"{SEED}/{world.phase}/{name}")
        self.own_edits = []  # (scene, client_edit_id, revision)
        self.next_id = 1
        self.begin()
        self.connect()

    def begin(self):
        self.pending = {}    # request id: (kind, scene, what the answer is checked against)
        self.unsure = {}     # the same, of those that perhaps never arrived
        self.cancelled = set()
        self.answered = {}   # request id: (epoch, bytes)
        self.epoch = 0       # how often the session was resumed
        self.views = {}      # by the request that opened it
        self.is_watching = False
        self.is_mute = False  # nothing more can be said on this connection
        self.unsaid = []

    # --- the connection ---

    def connect(self, resume=""):
        if self.face == "websocket":
            self.connection = WebSocket(self.bounced, resume=resume)
            hello = self.connection.hello
        else:
            self.connection = self.bounced.framed(tcp=self.face == "tcp", hello=False)
            self.connection.sock.settimeout(PATIENCE_S)
            message = pb.Envelope(hello=pb.Hello(min=1, max=1, resume=resume))
            hello = self.connection.ask(message)[0].hello_reply
        if resume and not hello.resumed:
            raise ConnectionError("the session was not resumed")
        self.session = hello.session
        for wanted in set(hello.under_way) & set(self.unsure):  # they did arrive
            self.pending[wanted] = self.unsure.pop(wanted)

    def has_news(self, seconds):
        if self.face != "websocket":
            return bool(select.select([self.connection.sock], [], [], seconds)[0])
        try:
            self.news = self.connection.receive(seconds)
            return True
        except TimeoutError:
            return False

    def take_news(self):
        self.take(*(self.news if self.face == "websocket" else self.connection.receive()))

    def send(self, kind, about=None, payload=b"", scene=None, **bodies):
        if self.is_mute:
            self.unsaid.append((kind, about, payload, scene, bodies))
            return
        envelope = pb.Envelope(request_id=self.next_id, **bodies)
        self.pending[self.next_id] = (kind, scene, about)
        self.next_id += 1
        self.connection.send(envelope, payload)

    # --- its life ---

    def run(self):
        try:
            self.do_edit(next(iter(self.world.pasts)))
            self.do_break_off()  # however short the run is
            while not self.world.is_over:
                self.act()
                for _ in range(IN_FLIGHT):
                    if not self.has_news(.05 if len(self.pending) >= IN_FLIGHT else .001):
                        break
                    self.take_news()
            self.settle()
            self.connection.close()
        except AssertionError:
            self.world.fail(f"{self.title}: {traceback.format_exc()}")
        except Exception:  # of whichever library: connections break when the daemon ends
            if not self.world.is_ending:
                self.world.fail(f"{self.title}: {traceback.format_exc()}")

    def settle(self):
        until = time.time() + PATIENCE_S
        while self.pending and not self.world.is_ending:
            assert time.time() < until, f"never answered: {self.pending}"
            if self.has_news(.1):
                self.take_news()

    def act(self):
        if len(self.pending) < IN_FLIGHT:
            action = self.random.choices(list(self.ACTIONS), self.ACTIONS.values())[0]
            getattr(self, "do_" + action)(self.random.choice(list(self.world.pasts)))

    # --- what comes ---

    def take(self, envelope, data):
        kind = envelope.WhichOneof("body")
        if kind == "progress":
            assert {envelope.request_id} & {*self.pending, *self.unsure}, envelope
        elif kind == "scene_event":
            self.take_event(envelope.scene_event)
        elif kind == "view_frame":
            self.take_frame(self.views[envelope.request_id], envelope.view_frame, data)
        elif kind == "view_end":
            self.views.pop(envelope.request_id, None)
        else:
            self.take_answer(envelope)

    def take_event(self, event):
        past = self.world.pasts.get(event.scene)
        if past and event.kind == "edited" and not event.transient:
            past.tell(event.revision, event.hash)

    def take_frame(self, view, shown, data):
        assert shown.number == view.frames + 1 or (self.epoch and shown.number > view.frames), shown
        assert data.startswith(b"\xff\xd8")
        view.frames = shown.number
        view.uncredited += 1
        assert view.uncredited <= 2, "more frames than credits"
        if not shown.transient:
            self.world.pasts[view.scene].tell(shown.report.revision, shown.report.scene)
        if self.random.random() < .9:
            self.credit(view)

    def take_answer(self, envelope):
        wanted = envelope.request_id
        said = envelope.SerializeToString(deterministic=True)
        if wanted in self.answered:
            epoch, before = self.answered[wanted]
            assert epoch < self.epoch, f"request {wanted} was answered twice: {envelope}"
            assert said == before, f"request {wanted} got two different answers: {envelope}"
            self.answered[wanted] = self.epoch, before
            return
        kind, scene, about = self.pending.pop(wanted, None) or self.unsure.pop(wanted)
        self.answered[wanted] = self.epoch, said
        self.world.answered += 1
        if envelope.HasField("error"):
            self.take_error(wanted, kind, about, envelope.error)
        elif handler := getattr(self, "on_" + kind, None):
            handler(wanted, scene, about, envelope)

    def take_error(self, wanted, kind, about, error):
        if kind == "view":
            self.views.pop(wanted)
        assert error.message and "\n" not in error.message
        if error.code == "busy":
            assert kind in self.MAY_BE_BUSY or self.world.is_ending, (kind, error)
        elif error.code == "cancelled":
            assert wanted in self.cancelled or self.world.is_ending, (kind, error)
        else:
            assert error.code in self.REFUSED.get(kind, ()), (kind, about, error)

    # --- what it does, each with a scene; on_KIND takes the answer ---

    def send_edit(self, kind, scene, edit_id, number):
        op = pb.EditOp(set_light=pb.LightEdit(light=0, intensity=number))
        self.send(kind, (edit_id, number), scene=scene, edit_batch=pb.EditBatch(
            scene=scene, ops=[op], client_edit_id=edit_id, message=str(number)))

    def do_edit(self, scene):
        number = self.world.next_edit()
        self.send_edit("edit", scene, f"{self.title}-{number}", number)

    def on_edit(self, _wanted, scene, about, envelope):
        reply = envelope.edit_reply
        assert reply.revision > 1 and not reply.transient and not reply.repeated_id, envelope
        self.on_again(_wanted, scene, about, envelope)

    def on_again(self, _wanted, scene, about, envelope):
        """Whether it had arrived the first time or not."""
        reply = envelope.edit_reply
        self.world.pasts[scene].tell(reply.revision, reply.hash, about[0])
        self.own_edits.append((scene, about, reply.revision))

    def do_repeat(self, _scene):
        if self.own_edits:
            scene, about, revision = self.random.choice(self.own_edits[-100:])
            self.send_edit("repeat", scene, *about)
            self.pending[self.next_id - 1] = ("repeat", scene, revision)

    def on_repeat(self, _wanted, _scene, revision, envelope):
        reply = envelope.edit_reply
        assert reply.repeated_id and reply.revision == revision, (revision, envelope)

    def do_drag(self, scene):
        op = pb.EditOp(set_light=pb.LightEdit(light=1, intensity=self.random.randint(1, 1000)))
        self.send("drag", scene=scene, edit_batch=pb.EditBatch(scene=scene, ops=[op],
                                                               durability="transient"))

    def on_drag(self, _wanted, _scene, _about, envelope):
        assert envelope.edit_reply.transient > 0, envelope

    def do_heavy(self, scene):
        op = pb.EditOp(set_mesh_vertices=pb.MeshVertices(mesh=self.world.pasts[scene].mesh,
                                                         positions=pb.Data(payload=True)))
        self.send("heavy", scene=scene, payload=TRIANGLE,
                  edit_batch=pb.EditBatch(scene=scene, ops=[op]))

    def on_heavy(self, _wanted, scene, _about, envelope):
        self.world.pasts[scene].tell(envelope.edit_reply.revision, envelope.edit_reply.hash)

    def do_undo(self, scene):
        self.send("undo", scene=scene, edit_undo=pb.EditUndo(scene=scene,
                                                             redo=self.random.random() < .4))

    def do_revert(self, scene):
        request = pb.EditRevert(scene=scene, name="good")
        if self.random.random() < .5:
            back = self.world.pasts[scene].last - self.random.randint(0, 30)
            request = pb.EditRevert(scene=scene, revision=max(1, back))
        self.send("revert", scene=scene, edit_revert=request)

    on_undo = on_revert = on_heavy

    def do_commit(self, scene):
        self.send("commit", scene=scene, edit_commit=pb.EditCommit(scene=scene))

    def do_name(self, scene):
        name = self.random.choice(["good", "none"])
        remove = name == "none" or self.random.random() < .2
        self.send("name", scene=scene, revision_name=pb.RevisionName(scene=scene, name=name,
                                                                     remove=remove))

    def do_stale(self, scene):
        op = pb.EditOp(set_light=pb.LightEdit(light=0, intensity=1))
        self.send("stale", scene=scene,
                  edit_batch=pb.EditBatch(scene=scene, ops=[op], base_revision=1))

    def on_stale(self, _wanted, _scene, _about, envelope):
        raise AssertionError(f"revision 1 is long past: {envelope}")

    def do_dry_run(self, scene):
        op = pb.EditOp(set_light=pb.LightEdit(light=0, intensity=3))
        self.send("dry_run", scene=scene, edit_batch=pb.EditBatch(
            scene=scene, ops=[op], dry_run=True, frame=pb.FrameRequest(technique="rsm")))

    def do_render(self, scene):
        request = frame(encoding=self.random.choice(["png", "half", "none"]))
        if self.random.random() < .5:
            request.deadline_ms = self.random.randint(1, 60)
        self.send("render", scene=scene, render=pb.Render(
            scene=scene, frame=request, progress=self.random.random() < .5))

    def do_cancel(self, _scene):
        if self.pending:
            wanted = self.random.choice(list(self.pending))
            self.cancelled.add(wanted)
            self.send("cancel", wanted, cancel=pb.Cancel(request_id=wanted))

    def on_cancel(self, _wanted, _scene, cancelled, _envelope):
        self.views.pop(cancelled, None)

    def do_view(self, scene):
        if len(self.views) < 3:
            self.views[self.next_id] = View(scene)
            self.send("view", scene=scene, view_open=pb.ViewOpen(
                scene=scene, frame=frame(), refine=self.random.random() < .5))

    def on_view(self, opened, _scene, _about, envelope):
        if opened in self.views:
            self.views[opened].number = envelope.view_reply.view

    def choose_view(self):
        """(the request that opened it, itself) or None."""
        known = [item for item in self.views.items() if item[1].number is not None]
        return self.random.choice(known) if known else None

    def do_move(self, _scene):
        if chosen := self.choose_view():
            pose = pb.CameraPose(eye=[self.random.random(), 1, 5], target=[0, 1, 0])
            self.send("own", view_update=pb.ViewUpdate(view=chosen[1].number, pose=pose))

    def credit(self, view):
        if view.number is not None and not self.is_mute:
            credit = pb.ViewCredit(view=view.number, count=view.uncredited)
            view.uncredited = 0
            self.connection.send(pb.Envelope(request_id=0, view_credit=credit))

    def do_credit_late(self, _scene):
        if chosen := self.choose_view():
            self.credit(chosen[1])

    def do_close_view(self, _scene):
        if chosen := self.choose_view():
            self.send("close", chosen[0], view_close=pb.ViewClose(view=chosen[1].number))

    def on_close(self, _wanted, _scene, opened, _envelope):
        self.views.pop(opened, None)

    def do_watch(self, _scene):
        if not self.is_watching:
            self.is_watching = True
            self.send("watch", scene_watch=pb.SceneWatch())

    def do_ask(self, scene):
        request = self.random.choice([
            dict(scene_get=pb.SceneGet(id=scene, objects=True)), dict(scene_list=pb.SceneList()),
            dict(scene_log=pb.SceneLog(scene=scene, limit=20)), dict(stats=pb.Stats()),
            dict(devices=pb.Devices()), dict(blob_have=pb.BlobHave(blobs=[blob_name(GLB)]))])
        self.send("ask", scene=scene, **request)

    def on_ask(self, _wanted, scene, _about, envelope):
        past = self.world.pasts[scene]
        if envelope.HasField("scene_log_reply"):
            past.read(envelope.scene_log_reply.entries)
        elif envelope.HasField("scene") and not envelope.scene.transient:
            past.tell(envelope.scene.revision, envelope.scene.hash)

    def do_add(self, _scene):
        """A scene that nobody else knows comes, is edited, and goes."""
        self.send("add", scene_add=pb.SceneAdd(blob=blob_name(GLB), name="own"))

    def on_add(self, _wanted, _scene, _about, envelope):
        scene = envelope.scene.id
        for intensity in range(3):
            op = pb.EditOp(set_light=pb.LightEdit(light=0, intensity=intensity))
            self.send("own", edit_batch=pb.EditBatch(scene=scene, ops=[op]))
        self.send("own", scene_remove=pb.SceneRemove(id=scene))

    def do_blob(self, _scene):
        data = self.random.randbytes(self.random.randint(0, 5000))
        self.send("blob", payload=data, blob_put=pb.BlobPut(
            blob=blob_name(data), offset=0, size_bytes=len(data)))

    # --- the network goes away ---

    def do_break_off(self, _scene=None):
        """And comes back. What was sent has arrived for sure if our end was heard."""
        is_heard = self.face != "websocket" and self.random.random() < .5
        if is_heard:
            self.connection.sock.shutdown(socket.SHUT_WR)
            self.is_mute = True
            with contextlib.suppress(EOFError, ConnectionResetError):
                while True:
                    self.take_news()
        self.cut()
        time.sleep(self.random.choice([0, .02]))
        self.doubt(lambda kind: kind == "blob" or not is_heard)  # uploads begin anew
        self.epoch += 1
        for view in self.views.values():
            view.uncredited = 0
        self.is_mute = False
        self.connect(resume=self.session)
        self.world.resumed += 1
        for kind, scene, about in list(self.unsure.values()):
            if kind in ("edit", "again"):
                self.send_edit("again", scene, *about)
        unsaid, self.unsaid = self.unsaid, []
        for kind, about, payload, scene, bodies in unsaid:
            self.send(kind, about, payload, scene, **bodies)

    def doubt(self, which):
        for wanted, request in list(self.pending.items()):
            if which(request[0]):
                self.unsure[wanted] = self.pending.pop(wanted)

    def do_leave(self, _scene):
        """For good: nobody will hear what becomes of what is pending."""
        self.cut()
        self.begin()
        self.connect()

    def cut(self):
        if self.face == "websocket":
            self.connection.socket.transport.abort()
        else:
            self.connection.sock.close()
