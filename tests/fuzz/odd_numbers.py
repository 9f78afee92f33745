"""Every number of every message, against the daemon as it is shipped: after each answer it lives.

    odd_numbers.py [--rounds N | --seconds N] [--seed S] [--finds FOLDER] [CORPUS_FOLDER | SESSION...]

A round takes a sound message, puts a number into one of its fields that nobody would send, says it by
the framed stream, by HTTP or as a glTF file, and looks at what it made with some technique, plain,
checked, refined or traced. Then the daemon must answer a ping, and render a scene of its own. A
process that ends, or one that says nothing any more, is a find.

Which fields there are is what the schema's descriptors say, which techniques and parameters what the
daemon says, which objects what the scene says: a field, a technique or a parameter more is tried
without a line here. `SOUND` alone is by hand: how a message begins that is sound where it does not
follow from the scene.

Sessions are lines of JSON that can be read and replayed; SCENE stands for the scene's id. A find is
made as short as it can be and written to the folder; those kept in the corpus are said again first.
"""
import argparse
import base64
import collections
import json
import math
import pathlib
import random
import re
import shutil
import struct
import sys
import tempfile
import time
import urllib.parse

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "net"))
from conftest import IS_SANITIZED, Daemon, blob_name, bounced_pb2  # noqa: E402
from google.protobuf import text_format  # noqa: E402
from google.protobuf.descriptor import FieldDescriptor as Field  # noqa: E402

SCENES = HERE.parent / "scenes"
FILES = ["cornell.glb", "two_lights.glb", "orthographic.glb", "checker.glb"]
FIRST_ANSWER = 40  # of the envelope's bodies: those below are requests
PATIENCE_S = 120 if IS_SANITIZED else 60  # a busy machine, and a frame whose programs are compiled
DEADLINE_MS = 2000
SIZE = [16, 12]
ROUNDS_A_SESSION = 12
TRIALS_MAX = 60  # daemons that are started to make a find shorter

ODD_REALS = [0.0, -0.0, 5e-324, 1e-45, 1e-30, 1e-9, -1.0, 1.0, 0.5, math.pi, 65536.0, 2.0**31, 2.0**53,
             1e12, 1e15, 1.1e15, 1e18, 1.9e18, 1e19, 1e30, 3.4028235e38, 3.5e38, 1e154, 1.7e308, -1e15,
             -1e18, -1e30, -3.4028235e38, math.inf, -math.inf, math.nan]
ODD_WHOLES = [0, 1, 2, 3, -1, -2, -3, 7, 15, 16, 100, 255, 256, 4096, 16384, 65535, 65536, 2**24, 2**31 - 1,
              -2**31, 2**31, 2**32 - 1, 2**53, 2**63 - 1, -2**63, 2**63, 2**64 - 1]
RANGES = {Field.TYPE_INT32: (-2**31, 2**31 - 1), Field.TYPE_SINT32: (-2**31, 2**31 - 1),
          Field.TYPE_UINT32: (0, 2**32 - 1), Field.TYPE_INT64: (-2**63, 2**63 - 1),
          Field.TYPE_SINT64: (-2**63, 2**63 - 1), Field.TYPE_UINT64: (0, 2**64 - 1)}
REALS = (Field.TYPE_DOUBLE, Field.TYPE_FLOAT)
TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


class Find(Exception):
    """The daemon is gone, or deaf."""


# --- what the schema has ------------------------------------------------------------------------


def requests():
    body = bounced_pb2.Envelope.DESCRIPTOR.oneofs_by_name["body"]
    return [field for field in body.fields if field.number < FIRST_ANSWER]


def leaves(message, path=()):
    """Paths to every field of a message, however deep, that holds a number or a text."""
    for field in message.fields:
        if field.type == Field.TYPE_MESSAGE:
            yield from leaves(field.message_type, (*path, field))
        elif field.type not in (Field.TYPE_BYTES, Field.TYPE_BOOL):
            yield (*path, field)


def is_list(field):
    return field.label == Field.LABEL_REPEATED


LEARNED = []  # numbers that refusals named as limits: what is just allowed is the oddest of all


def learn(message):
    for text in re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?", message):
        if len(LEARNED) < 200 and float(text) not in LEARNED and math.isfinite(float(text)):
            LEARNED.append(float(text))


def odd_real(rng):
    return rng.choice(LEARNED if LEARNED and rng.random() < 0.4 else ODD_REALS)


def odd(rng, field):
    if field.type in REALS:
        value = odd_real(rng)
        if field.type == Field.TYPE_FLOAT and math.isfinite(value):
            value = max(min(value, 3.4028235e38), -3.4028235e38)
        return value
    if field.type in RANGES:
        low, high = RANGES[field.type]
        near = [int(value) + step for value in LEARNED for step in (-1, 0, 1) if value == int(value)]
        wholes = near if near and rng.random() < 0.3 else ODD_WHOLES
        return rng.choice([value for value in wholes if low <= value <= high] or [0])
    return odd_text(rng)


def odd_text(rng):
    if rng.random() < 0.3:
        return rng.choice(["", "1e999", "0x10", " 1", "1 "])
    return rng.choice([repr(odd_real(rng)), str(rng.choice(ODD_WHOLES))])


def odd_list(rng, field, old):
    """A list whose numbers are odd: some of them, all of them, or their count."""
    new, kind = list(old), rng.randrange(4)
    if kind == 0 or not new:
        return [odd(rng, field) for _ in range(len(new) or rng.choice([1, 2, 3, 4, 9, 16]))]
    if kind == 1:
        return rng.choice([new[:-1], new + [odd(rng, field)], [odd(rng, field)] * 100])
    for _ in range(kind - 1):
        new[rng.randrange(len(new))] = odd(rng, field)
    return new


def spoil(rng, message, path):
    """Puts odd numbers into the field that the path ends at."""
    for field in path[:-1]:
        if is_list(field):
            items = getattr(message, field.name)
            message = rng.choice(items) if items else items.add()
        else:
            message = getattr(message, field.name)
            message.SetInParent()
    field = path[-1]
    if is_list(field):
        new = odd_list(rng, field, getattr(message, field.name))
        message.ClearField(field.name)
        getattr(message, field.name).extend(new)
    else:
        setattr(message, field.name, odd(rng, field))


# --- sound messages -----------------------------------------------------------------------------


def mesh(at):
    data = bounced_pb2.Data(payload=True)
    return bounced_pb2.MeshEdit(primitives=[bounced_pb2.PrimitiveEdit(positions=data)])


# How those begin that do not follow from the scene's own objects.
SOUND_OPS = {
    "set_transform": lambda at: bounced_pb2.TransformEdit(
        node=at.id_of("node"), translation=[0, 0, 1], rotation=[0, 0, 0, 1], scale=[1, 1, 1]),
    "add_mesh": mesh,
    "set_mesh": lambda at: bounced_pb2.MeshEdit(mesh=at.id_of("mesh"), primitives=mesh(at).primitives),
    "set_mesh_vertices": lambda at: bounced_pb2.MeshVertices(
        mesh=at.id_of("mesh"), positions=bounced_pb2.Data(payload=True)),
    "set_environment": lambda at: bounced_pb2.Environment(radiance=[1, 1, 1]),
    "import": lambda at: bounced_pb2.ImportEdit(blob=at.blob),
}
SOUND = {
    "hello": lambda at: bounced_pb2.Hello(min=1, max=1),
    "blob_have": lambda at: bounced_pb2.BlobHave(blobs=[at.blob]),
    "blob_put": lambda at: bounced_pb2.BlobPut(blob=blob_name(TRIANGLE), size_bytes=len(TRIANGLE)),
    "scene_add": lambda at: bounced_pb2.SceneAdd(
        blob=at.blob, environment=bounced_pb2.Environment(radiance=[1, 1, 1])),
    "scene_get": lambda at: bounced_pb2.SceneGet(id="SCENE", objects=True),
    "render": lambda at: bounced_pb2.Render(scene="SCENE", frame=at.frame()),
    "edit_batch": lambda at: bounced_pb2.EditBatch(scene="SCENE"),
    "view_open": lambda at: bounced_pb2.ViewOpen(scene="SCENE", frame=at.frame()),
    "view_update": lambda at: bounced_pb2.ViewUpdate(view=1, pose=at.pose()),
    "view_credit": lambda at: bounced_pb2.ViewCredit(view=1, count=1),
    "view_close": lambda at: bounced_pb2.ViewClose(view=1),
    "scene_replay": lambda at: bounced_pb2.SceneReplay(revision=1, kind=""),
}


TECHNIQUES = bounced_pb2.Envelope(techniques=bounced_pb2.Techniques())


# --- the daemon and its scene -------------------------------------------------------------------


class World:
    """A daemon, the scene that is spoilt, and what was said to it."""

    def __init__(self, rng):
        self.rng, self.folder = rng, pathlib.Path(tempfile.mkdtemp(prefix="odd_numbers."))
        options = []
        for limit in ("requests_per_second=1000000", "image_side_px=512", "views_per_connection=4"):
            options += ["--limit", limit]
        self.daemon = Daemon(self.folder, *options)
        self.said, self.scene, self.objects, self.blob, self.techniques = [], "", [], "", []
        self.client = None
        self.connect()
        self.untouched = self.add_file("cornell.glb")
        self.techniques = self.ask(TECHNIQUES).techniques_reply.techniques

    def connect(self):
        """Anew: what was under way on the connection before, views too, ends with it."""
        if self.client:
            self.client.close()
        try:
            self.client = self.daemon.framed()
            self.client.sock.settimeout(PATIENCE_S)
        except (OSError, EOFError):
            self.wait_for_end()
            raise Find("takes no connection") from None

    def close(self):
        if self.daemon.process.poll() is None:
            self.daemon.process.kill()
        self.daemon.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def log_tail(self):
        return self.daemon.log_path.read_text(errors="replace")[-600:]

    # --- saying things ---

    def ask(self, envelope, payload=b""):
        """The answer, or None where the daemon closed the connection, as it may."""
        try:
            wanted = self.client.send(envelope, payload)
            until = time.time() + PATIENCE_S
            while time.time() < until:
                answer, _ = self.client.receive()
                if answer.request_id in (wanted, 0) and answer.WhichOneof("body") not in EVENTS:
                    ANSWERS[answer.error.code or answer.WhichOneof("body")] += 1
                    learn(answer.error.message)
                    return answer
        except TimeoutError:
            pass
        except (OSError, EOFError):
            self.wait_for_end()
            self.connect()
            return None
        raise Find(f"no answer within {PATIENCE_S} s")

    def look_alive(self):
        if self.daemon.process.poll() is not None:
            raise Find(f"ended with {self.daemon.process.returncode}")

    def http(self, method, path, body=None):
        kind = "application/octet-stream" if isinstance(body, bytes) else "application/json"
        head = {"Content-Type": kind} if body is not None else {}
        try:
            reply = self.daemon.request(method, path, body, head, timeout=PATIENCE_S)
            ANSWERS[reply[0]] += 1
            return reply
        except TimeoutError:
            raise Find(f"no answer to {method} {path} within {PATIENCE_S} s") from None
        except OSError:
            self.wait_for_end()
            return 0, {}, b""

    def wait_for_end(self):
        until = time.time() + 2  # a process that dies closes its sockets first
        while time.time() < until:
            self.look_alive()
            time.sleep(0.02)

    def witness_lives(self):
        """A ping by HTTP, and a frame of a scene that nobody spoils by the stream."""
        status, _, _ = self.http("GET", "/healthz")
        self.look_alive()
        if status != 200:
            raise Find(f"/healthz answers {status}")
        frame = bounced_pb2.FrameRequest(size=SIZE, technique="direct", encoding="none", fresh="camera",
                                         parameters=[bounced_pb2.KeyValue(key="shadow_size", value="16")])
        answer = self.ask(bounced_pb2.Envelope(render=bounced_pb2.Render(scene=self.untouched, frame=frame)))
        self.look_alive()
        if answer is None or not answer.HasField("render_reply"):
            raise Find(f"a sound scene is not rendered: {answer}")

    # --- scenes ---

    def put(self, data):
        self.http("PUT", "/v1/blobs/" + blob_name(data), data)
        return blob_name(data)

    def add(self, data):
        """The scene's id, or None where the file is refused."""
        status, _, reply = self.http("POST", "/v1/scenes", json.dumps({"blob": self.put(data)}))
        return json.loads(reply)["id"] if status == 201 else None

    def add_file(self, file):
        scene = self.add((SCENES / file).read_bytes())
        if not scene:
            raise Find(f"{file} is refused")
        return scene

    def begin(self, file):
        """Another scene from here on; what was said before does not matter any more."""
        if self.scene and self.scene != self.untouched:
            self.http("DELETE", f"/v1/scenes/{self.scene}")
        self.connect()
        self.said = []
        self.say({"file": file})

    def see_objects(self):
        get = bounced_pb2.SceneGet(id=self.scene, objects=True)
        answer = self.ask(bounced_pb2.Envelope(scene_get=get))
        self.objects = list(answer.scene.objects) if answer is not None else []

    def id_of(self, kind):
        ids = [thing.id for thing in self.objects if thing.kind == kind]
        return self.rng.choice(ids) if ids else 0

    # --- sound parts of messages ---

    def pose(self):
        return bounced_pb2.CameraPose(eye=[1, 2, 3], target=[0, 0, 0], up=[0, 1, 0])

    def parameters(self, technique):
        """As cheap as they are allowed to be, and now and then another that is allowed."""
        for row in technique.parameters:
            value = None
            if row.whole and row.minimum < 16 < row.maximum:
                value = "16"
            if row.whole and 16 <= row.minimum < float(row.standard or 0):
                value = str(int(row.minimum))
            if self.rng.random() < 0.1:
                value = self.rng.choice(list(row.choices) or [row.standard, repr(row.minimum), repr(row.maximum)])
            if value is not None:
                yield bounced_pb2.KeyValue(key=row.key, value=value)

    def frame(self):
        """Of any technique: plain, checked, refined, through a pose, several samples, several layers."""
        technique = self.rng.choice(self.techniques)
        frame = bounced_pb2.FrameRequest(size=SIZE, technique=technique.name, deadline_ms=DEADLINE_MS,
                                         encoding=self.rng.choice(["png", "exr", "none", "half"]),
                                         parameters=list(self.parameters(technique)))
        kind = self.rng.choice(["plain", "check", "target", "pose", "aa"])
        if technique.is_reference or kind == "plain":
            frame.region.extend([0, 0, 4, 4] if technique.is_reference and self.rng.random() < 0.3 else [])
        elif kind == "check":
            frame.check, frame.against = 16, self.rng.choice(["model", "full"])
        elif kind == "target":
            frame.target_error, frame.against = 5, self.rng.choice(["model", "full"])
        elif kind == "pose":
            frame.pose.CopyFrom(self.pose())
        else:
            frame.aa = 2
        cameras = [thing.name for thing in self.objects if thing.kind == "camera"]
        if cameras and not frame.HasField("pose"):
            frame.camera = str(self.rng.randrange(len(cameras)))
        return frame

    def operation(self, name):
        """A sound operation of a batch: from the object that it would set, or by hand."""
        if name in SOUND_OPS:
            return SOUND_OPS[name](self)
        field = bounced_pb2.EditOp.DESCRIPTOR.fields_by_name[name]
        kind = name.split("_", 1)[1]
        message = getattr(bounced_pb2, field.message_type.name)()
        alike = [thing for thing in self.objects if thing.kind == kind]
        if alike and is_said_of(kind, field.message_type):
            message.CopyFrom(getattr(self.rng.choice(alike), kind))
        own = next((f.name for f in field.message_type.fields if f.name in (kind, "id")), None)
        if own:
            message.ClearField(own)
            if not name.startswith("add_"):
                setattr(message, own, self.id_of(kind))
        return message

    def sound(self, path):
        """The request that the path begins with, sound but for what the path will spoil."""
        body = path[0]
        envelope = bounced_pb2.Envelope()
        message = getattr(envelope, body.name)
        message.SetInParent()
        if body.name in SOUND:
            message.CopyFrom(SOUND[body.name](self))
        elif "scene" in body.message_type.fields_by_name:
            message.scene = "SCENE"
        if body.name == "edit_batch":
            named = len(path) > 2 and path[1].name == "ops"
            ops = [path[2].name] if named else [self.rng.choice(bounced_pb2.EditOp.DESCRIPTOR.fields).name]
            for name in ops:
                getattr(message.ops.add(), name).CopyFrom(self.operation(name))
            if len(path) > 1 and path[1].name == "frame":
                message.dry_run = True
                message.frame.CopyFrom(self.frame())
        return envelope

    # --- steps: what a session's lines say ---

    def say(self, step):
        """Carries out one line of a session. True if the scene may be another now."""
        self.said.append(step)
        kind = next(iter(step))
        return getattr(self, "say_" + kind)(step)

    def say_file(self, step):
        self.scene = self.add_file(step["file"])
        self.blob = blob_name((SCENES / step["file"]).read_bytes())
        self.see_objects()
        return True

    def say_framed(self, step):
        envelope = bounced_pb2.Envelope()
        text_format.Parse(step["framed"].replace("SCENE", self.scene), envelope)
        if envelope.WhichOneof("body") in UNANSWERED:
            self.client.send(envelope)
            return False
        answer = self.ask(envelope, base64.b64decode(step.get("payload", "")))
        if answer is not None and envelope.HasField("view_open") and answer.HasField("view_reply"):
            self.watch_view()
        return answer is not None and answer.WhichOneof("body") in ("edit_reply", "scene")

    def watch_view(self):
        """A frame of it, or its end."""
        self.client.sock.settimeout(5)
        try:
            while self.client.receive()[0].WhichOneof("body") not in ("view_frame", "view_end"):
                pass
        except TimeoutError:
            self.connect()  # a frame of many seconds: what is left of it goes with the connection
        except (OSError, EOFError):
            self.wait_for_end()
            self.connect()
        self.client.sock.settimeout(PATIENCE_S)

    def say_leave(self, step):
        self.connect()
        return False

    def say_hello(self, step):
        envelope = text_format.Parse(step["hello"], bounced_pb2.Envelope())
        client = self.daemon.framed(hello=False)
        client.sock.settimeout(PATIENCE_S)
        try:
            client.ask(envelope)
        except TimeoutError:
            raise Find("no answer to hello") from None
        except (OSError, EOFError):
            pass
        client.close()
        return False

    def say_http(self, step):
        method, path, body = step["http"]
        body = body and body.replace("SCENE", self.scene)
        status = self.http(method, path.replace("SCENE", self.scene), body)[0]
        return method == "POST" and status == 200

    def say_gltf(self, step):
        data = spoilt_file(step["gltf"], {key: value for key, value in step["set"]}, step["floats"])
        scene = self.add(data)
        if not scene:
            return False
        self.http("DELETE", f"/v1/scenes/{self.scene}")
        self.scene = scene
        self.see_objects()
        return True


ANSWERS = collections.Counter()  # of all kinds: whether what is said is sound enough to be taken
UNANSWERED = ("view_credit",)
EVENTS = ("progress", "scene_event", "view_frame", "view_end")


def is_said_of(kind, message):
    """Whether the scene tells objects of that kind in the words of that message."""
    field = bounced_pb2.SceneObject.DESCRIPTOR.fields_by_name.get(kind)
    return field is not None and field.message_type is message


# --- the other faces ----------------------------------------------------------------------------

POSTS = {"edit_batch": "edits", "edit_undo": "undo", "edit_revert": "revert", "edit_commit": "commit",
         "revision_name": "names"}
QUERY_NAMES = {"jpeg_quality": "quality", "exr_half": "half"}


def json_of(value):
    """As json.dumps, with infinities as numbers that are too large."""
    if isinstance(value, dict):
        return "{" + ",".join(f"{json.dumps(key)}:{json_of(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ",".join(map(json_of, value)) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return "null" if math.isnan(value) else "-1e999" if value < 0 else "1e999"
    return json.dumps(value)


def plain(message):
    """A message in the words of the JSON face."""
    if message.DESCRIPTOR.name == "KeyValue":
        raise TypeError
    out = {}
    for field, value in message.ListFields():
        if field.type != Field.TYPE_MESSAGE:
            out[field.name] = list(value) if is_list(field) else value
        elif field.message_type.name == "KeyValue":
            out[field.name] = {pair.key: pair.value for pair in value}
        else:
            out[field.name] = [plain(item) for item in value] if is_list(field) else plain(value)
    return out


def query_of(frame):
    pairs = []
    for field, value in frame.ListFields():
        name = QUERY_NAMES.get(field.name, field.name)
        if field.name == "parameters":
            pairs += [("set", f"{pair.key}={pair.value}") for pair in value]
        elif field.name == "size":
            pairs.append((name, "x".join(map(str, value))))
        elif field.name not in ("pose", "encoding"):
            pairs.append((name, ",".join(map(str, value)) if is_list(field) else
                          str(int(value)) if isinstance(value, bool) else str(value)))
    return urllib.parse.urlencode(pairs)


def by_http(envelope):
    """The request as HTTP has it; None where it has none."""
    body = envelope.WhichOneof("body")
    message = getattr(envelope, body)
    if body in POSTS:
        words = plain(message)
        words.pop("scene", None)
        return ["POST", f"/v1/scenes/SCENE/{POSTS[body]}", json_of(words)]
    if body == "scene_add":
        return ["POST", "/v1/scenes", json_of(plain(message))]
    if body == "render":
        return ["GET", "/v1/scenes/SCENE/frame.json?" + query_of(message.frame), None]
    return None


# --- files --------------------------------------------------------------------------------------


def read_glb(data):
    size = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + size]), data[20 + size:]


def numbers_of(value, path=""):
    """Paths to every number of a JSON document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from numbers_of(item, f"{path}/{key}")
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        yield path


def put_number(document, path, text):
    at, *keys = document, *path.split("/")[1:]
    for key in keys[:-1]:
        at = at[int(key) if isinstance(at, list) else key]
    at[int(keys[-1]) if isinstance(at, list) else keys[-1]] = f"@{text}@"


def spoilt_file(file, numbers, floats):
    """A .glb with some of its JSON's numbers, and some of its buffer's floats, replaced."""
    document, rest = read_glb((SCENES / file).read_bytes())
    for path, text in numbers.items():
        put_number(document, path, text)
    text = re.sub(r'"@([^@]*)@"', r"\1", json.dumps(document)).encode()
    text += b" " * (-len(text) % 4)
    rest = bytearray(rest)
    for at, value in floats:
        struct.pack_into("<f", rest, 8 + 4 * at, float(value))
    body = struct.pack("<II", len(text), 0x4E4F534A) + text + bytes(rest)
    return struct.pack("<III", 0x46546C67, 2, 12 + len(body)) + body


def spoil_file(rng):
    file = rng.choice(FILES)
    document, rest = read_glb((SCENES / file).read_bytes())
    step = {"gltf": file, "set": [], "floats": []}
    paths = [path for path in numbers_of(document) if not path.startswith(("/accessors", "/bufferViews", "/buffers"))
             or rng.random() < 0.02]
    for _ in range(rng.choice([1, 1, 2, 4])):
        value = rng.choice([value for value in ODD_REALS if math.isfinite(value)])
        text = rng.choice([repr(value), repr(value), str(rng.choice(ODD_WHOLES)), "1e999"])
        if rng.random() < 0.8:
            step["set"].append([rng.choice(paths), text])
        else:
            value = rng.choice([value for value in ODD_REALS if not math.isfinite(value) or abs(value) < 3.5e38])
            step["floats"].append([rng.randrange(len(rest) // 4 - 2), repr(value)])
    return step


# --- rounds -------------------------------------------------------------------------------------


# What of a request is tried how often; all others together get the rest.
SHARES = {"ops": 0.4, "render": 0.2}


def choose_path(rng, paths):
    """Every operation as often as every other, and frames as often as they are asked for."""
    draw = rng.random()
    if draw < SHARES["ops"]:
        operation = rng.choice(bounced_pb2.EditOp.DESCRIPTOR.fields)
        return rng.choice([path for path in paths if path[2:3] == (operation,)])
    if draw < SHARES["ops"] + SHARES["render"]:
        return rng.choice([path for path in paths if path[0].name == "render"])
    return rng.choice(paths)


def hold_deadline(envelope):
    """A frame that may take longer than anybody waits here, and does, is no find."""
    if envelope.WhichOneof("body") == "render" and envelope.render.frame.deadline_ms > 500 * PATIENCE_S:
        envelope.render.frame.deadline_ms = DEADLINE_MS


def choose_steps(world, paths):
    """What a round says: one line, or a view and what happens to it."""
    rng = world.rng
    if rng.random() < 0.15:
        return [spoil_file(rng)]
    path = choose_path(rng, paths)
    envelope = world.sound(path)
    spoil(rng, envelope, path)
    if rng.random() < 0.2:
        others = [other for other in paths if other[0] is path[0] and (path[0].name != "edit_batch" or
                  other[1:3] == path[1:3])]
        spoil(rng, envelope, rng.choice(others))
    hold_deadline(envelope)
    if path[0].name == "hello":
        return [{"hello": line_of(envelope)}]
    http = by_http(envelope)
    if http and rng.random() < 0.4:
        return [{"http": http}]
    payload = TRIANGLE if path[0].name in ("edit_batch", "blob_put") else b""
    if payload and rng.random() < 0.3:
        payload = struct.pack("<9f", *(max(min(rng.choice(ODD_REALS), 3.4028235e38), -3.4028235e38) for _ in range(9)))
    steps = [{"framed": line_of(envelope), "payload": base64.b64encode(payload).decode()}]
    if path[0].name in ("view_update", "view_credit"):
        opening = bounced_pb2.Envelope(view_open=SOUND["view_open"](world))
        steps.insert(0, {"framed": line_of(opening)})
    return steps


def line_of(envelope):
    return text_format.MessageToString(envelope, as_one_line=True).strip()


def look(world):
    """How the scene looks now: by one technique or two."""
    for _ in range(world.rng.choice([1, 2])):
        envelope = bounced_pb2.Envelope(render=bounced_pb2.Render(scene="SCENE", frame=world.frame()))
        world.say({"framed": line_of(envelope)})


def play_round(world, paths):
    changed, steps = False, choose_steps(world, paths)
    for step in steps:
        changed |= bool(world.say(step))
    if any(step.get("framed", "").startswith("view_") for step in steps):
        world.say({"leave": "a view that asks for much goes before what the same client asks for next"})
    if changed:
        look(world)
    world.witness_lives()
    if changed:
        world.see_objects()


# --- sessions, kept and made short --------------------------------------------------------------


def replay(world, steps):
    """Says a session again; raises Find where the daemon ends or falls silent."""
    world.begin("cornell.glb")
    for step in steps:
        world.say(step)
    world.witness_lives()


def read_session(path):
    return [json.loads(line) for line in path.read_text().splitlines() if line.startswith("{")]


def fails(steps, rng):
    world = World(rng)
    try:
        replay(world, steps)
        return False
    except Find:
        return True
    finally:
        world.close()


def shorten(steps, rng):
    """Leaves out what the find does not need, from the front."""
    trials, at = 0, 0
    if not fails(steps, rng):
        return steps
    half = len(steps) // 2
    while half > 1 and trials < 6 and fails(steps[half:], rng):
        steps, half, trials = steps[half:], len(steps[half:]) // 2, trials + 1
    while at < len(steps) and trials < TRIALS_MAX:
        trials += 1
        without = steps[:at] + steps[at + 1:]
        if fails(without, rng):
            steps = without
        else:
            at += 1
    return steps


def write_session(path, words, steps):
    path.write_text(f"# {words}\n" + "".join(json.dumps(step) + "\n" for step in steps))


def keep(find, world, folder, seed):
    """Writes a find down: why, and the lines that lead to it."""
    folder.mkdir(parents=True, exist_ok=True)
    said, tail = list(world.said), world.log_tail()
    words = re.sub(r"\s+", " ", f"{find}: {tail.strip().splitlines()[-1] if tail.strip() else ''}")
    print(f"odd_numbers: {words}", flush=True)
    is_alive = world.daemon.process.poll() is None
    world.close()
    path = folder / f"find-{seed}-{int(time.time())}.jsonl"
    write_session(path, words, said)
    print(f"odd_numbers: kept as {path}", flush=True)
    if not is_alive:  # to wait for each silence would take hours
        write_session(path, words, shorten(said, random.Random(seed)))


def replay_all(paths, rng):
    """The kept sessions, all in one daemon while it lives."""
    failed, world = [], World(rng)
    for path in paths:
        try:
            replay(world, read_session(path))
        except Find as find:
            print(f"odd_numbers: {path}: {find}\n{world.log_tail()}", flush=True)
            failed.append(path)
            world.close()
            world = World(rng)
    world.close()
    return failed


def fuzz(rounds, seconds, seed, folder):
    rng, done, finds, until = random.Random(seed), 0, 0, time.time() + seconds
    paths = [(body, *path) for body in requests() for path in leaves(body.message_type)]
    world = World(rng)
    try:
        while done < rounds and time.time() < until:
            try:
                if done % ROUNDS_A_SESSION == 0 or not world.said:
                    world.begin(rng.choice(FILES))
                play_round(world, paths)
            except Find as find:
                finds += 1
                keep(find, world, folder, seed)
                world = World(rng)
            done += 1
    finally:
        world.close()
    print(f"odd_numbers: seed {seed}, {done} rounds over {len(paths)} fields, {finds} finds; answers:",
          ", ".join(f"{kind} {count}" for kind, count in ANSWERS.most_common()), flush=True)
    return finds


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--finds", type=pathlib.Path, default=pathlib.Path("odd_numbers_finds"))
    parser.add_argument("sessions", nargs="*", type=pathlib.Path)
    options = parser.parse_args()
    sessions = [path for given in options.sessions
                for path in (sorted(given.glob("*.jsonl")) if given.is_dir() else [given])]
    failed = replay_all(sessions, random.Random(options.seed)) if sessions else []
    finds = 0
    if options.rounds or options.seconds:
        finds = fuzz(options.rounds or math.inf, options.seconds or math.inf, options.seed, options.finds)
    return 1 if failed or finds else 0


if __name__ == "__main__":
    sys.exit(main())
