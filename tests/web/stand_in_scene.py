"""Scenes and pictures of the stand-in daemon."""

import copy
import io
import json
import math
import struct
import time

import numpy as np
from PIL import Image, ImageDraw

import bounced_pb2 as pb


class Refused(Exception):
    def __init__(self, code, message, field=""):
        super().__init__(message)
        self.code, self.field = code, field


def rotation_matrix(q):
    x, y, z, w = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def local_matrix(transform):
    if len(transform.matrix) == 16:
        return np.array(transform.matrix).reshape(4, 4).T
    m = np.eye(4)
    m[:3, :3] = rotation_matrix(list(transform.rotation) or [0, 0, 0, 1]) * (list(transform.scale) or [1, 1, 1])
    m[:3, 3] = list(transform.translation) or [0, 0, 0]
    return m


def corners_of(low, high):
    return [np.where(pick, high, low) for pick in np.ndindex(2, 2, 2)]


class Scene:
    def __init__(self, scene_id, name, glb):
        size = struct.unpack("<I", glb[12:16])[0]
        gltf = json.loads(glb[20:20 + size])
        self.glb, self.flags = glb, []  # what an export is, edits or not, and what it says
        self.id, self.name, self.revision, self.transient = scene_id, name, 1, 0
        self.lights = [self.light_of(one) for one in
                       gltf.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])]
        self.meshes = []
        for mesh in gltf.get("meshes", []):
            places = [gltf["accessors"][part["attributes"]["POSITION"]] for part in mesh["primitives"]]
            self.meshes.append((np.min([a["min"] for a in places], 0), np.max([a["max"] for a in places], 0)))
        self.cameras = [pb.CameraEdit(yfov=camera.get("perspective", {}).get("yfov", 0.7))
                        for camera in gltf.get("cameras", [])]
        self.nodes = [self.node_of(node) for node in gltf["nodes"]]
        for i, node in enumerate(gltf["nodes"]):
            for child in node.get("children", []):
                self.nodes[child].parent = i
        self.log = [pb.LogEntry(revision=1, kind="import", time_ms=int(time.time() * 1000))]
        self.past, self.future, self.durable = [], [], None
        self.states = {1: self.state()}  # by revision
        self.answered = {}  # revision and transient of edits, by the names that their client gave them

    @staticmethod
    def light_of(light):
        spot = light.get("spot", {})
        return pb.LightEdit(name=light.get("name"), kind=light["type"], color=light.get("color", [1, 1, 1]),
                            intensity=light.get("intensity", 1), cone_inner=spot.get("innerConeAngle", 0),
                            cone_outer=spot.get("outerConeAngle", math.pi / 4))

    @staticmethod
    def node_of(node):
        light = node.get("extensions", {}).get("KHR_lights_punctual", {}).get("light", -1)
        edit = pb.NodeEdit(name=node.get("name", ""), parent=-1, mesh=node.get("mesh", -1),
                           camera=node.get("camera", -1), light=light, shown=True)
        for field in ("translation", "rotation", "scale", "matrix"):
            getattr(edit.transform, field).extend(node.get(field, []))
        return edit

    def world(self, i):
        local = local_matrix(self.nodes[i].transform)
        parent = self.nodes[i].parent
        return local if parent < 0 else self.world(parent) @ local

    def place(self, i, point=(0, 0, 0)):
        return (self.world(i) @ [*point, 1])[:3]

    def boxes(self):
        """Of each mesh that is placed, its eight corners in the world."""
        return [[self.place(i, corner) for corner in corners_of(*self.meshes[node.mesh])]
                for i, node in enumerate(self.nodes) if node.mesh >= 0 and node.shown]

    def message(self, has_objects):
        points = np.concatenate(self.boxes())
        scene = pb.Scene(id=self.id, name=self.name, revision=self.revision, bounds_min=points.min(0),
                         bounds_max=points.max(0), transient=self.transient, counts=pb.SceneCounts(triangles=12),
                         cameras=[self.nodes[i].name for i in self.placed_cameras()])
        if not has_objects:
            return scene
        for i, node in enumerate(self.nodes):
            scene.objects.add(kind="node", id=i, name=node.name, node=node, world_from_node=self.world(i).T.flatten())
        for i, light in enumerate(self.lights):
            scene.objects.add(kind="light", id=i, name=light.name, light=light)
        for i, (low, high) in enumerate(self.meshes):
            scene.objects.add(kind="mesh", id=i, bounds_min=low, bounds_max=high)
        for i, camera in enumerate(self.cameras):
            scene.objects.add(kind="camera", id=i, camera=camera)
        return scene

    def placed_cameras(self):
        return [i for i, node in enumerate(self.nodes) if node.camera >= 0]

    def pose_of(self, request):
        """The request's own, or that of the camera which it names."""
        if request.HasField("pose"):
            return request.pose
        node = self.placed_cameras()[int(request.camera)]
        world = self.world(node)
        return pb.CameraPose(eye=world[:3, 3], target=world[:3, 3] - world[:3, 2], up=world[:3, 1],
                             yfov=self.cameras[self.nodes[node].camera].yfov)

    # --- edits ---

    def state(self):
        return copy.deepcopy((self.nodes, self.lights))

    def change(self, ops):
        for k, op in enumerate(ops):
            kind = op.WhichOneof("op")
            if kind == "set_transform":
                self.nodes[op.set_transform.node].transform.CopyFrom(op.set_transform)
            elif kind == "set_light":
                self.set_light(op.set_light, f"ops[{k}].set_light")
            elif kind == "set_node":
                self.nodes[op.set_node.node].shown = op.set_node.shown
            else:
                raise Refused("unsupported", f"no {kind} here", f"ops[{k}]")

    def set_light(self, change, field):
        if change.HasField("intensity") and change.intensity < 0:
            raise Refused("usage", "must be at least 0", field + ".intensity")
        light = self.lights[change.light]
        if change.color:
            del light.color[:]
        light.MergeFrom(change)

    def edit(self, batch):
        before = self.state()
        self.change(batch.ops)
        if batch.durability != "transient":
            self.advance(before, "edit", batch, batch.message)
            return
        self.durable = self.durable or before
        self.transient += 1

    def commit(self, request):
        if self.durable is None:
            raise Refused("usage", "nothing transient lies on the scene")
        before, self.durable = self.durable, None
        self.advance(before, "edit", request)

    def advance(self, before, kind, request, message="", of=0):
        self.past.append(before)
        self.future.clear()
        self.transient = 0
        self.note(kind, request, message, of)

    def note(self, kind, request, message="", of=0):
        self.revision += 1
        self.states[self.revision] = self.state()
        self.log.append(pb.LogEntry(revision=self.revision, kind=kind, message=message, changes=["light 0"], of=of,
                                    author=f"local {request.by}",
                                    time_ms=int(time.time() * 1000)))

    def undo(self, request):
        is_redo = request.redo
        source, target = (self.future, self.past) if is_redo else (self.past, self.future)
        if not source:
            raise Refused("usage", "there is nothing to redo" if is_redo else "there is nothing to undo")
        target.append(self.state())
        self.nodes, self.lights = source.pop()
        self.note("redo" if is_redo else "undo", request, of=self.revision)

    def revert(self, request):
        revision = request.revision
        if revision not in self.states:
            raise Refused("not_found", "there is no such revision", "revision")
        before = self.state()
        self.nodes, self.lights = copy.deepcopy(self.states[revision])
        self.advance(before, "revert", request, of=revision)


class Pinhole:
    def __init__(self, pose, width, height):
        self.eye = np.array(pose.eye)
        forward = np.array(pose.target) - self.eye
        self.forward = forward / np.linalg.norm(forward)
        right = np.cross(self.forward, list(pose.up) or [0, 1, 0])
        self.right = right / np.linalg.norm(right)
        self.up = np.cross(self.right, self.forward)
        self.middle = (width / 2, height / 2)
        self.scale = height / (2 * math.tan(pose.yfov / 2))

    def at(self, world):
        """Its pixel; None behind the eye."""
        d = np.array(world) - self.eye
        depth = d @ self.forward
        if depth <= 0:
            return None
        return (self.middle[0] + self.scale * (d @ self.right) / depth,
                self.middle[1] - self.scale * (d @ self.up) / depth)


TINTS = {"direct": (1, 0.6, 0.6), "indirect": (0.6, 0.6, 1)}


def ground_of(scene, request):
    total = sum(light.intensity for light in scene.lights)
    level = 40 + 120 * (1 - math.exp(-total / 20))
    level *= 0.5 if request.technique == "direct" else 1
    tint = TINTS.get(request.layers[0] if request.layers else "", (1, 1, 1))
    return tuple(int(level * share) for share in tint)


def draw(scene, request, share):
    """The picture as bytes; a bar on top is `share` of its width."""
    width, height = request.size or (64, 64)
    image = Image.new("RGB", (width, height), ground_of(scene, request))
    pen, camera = ImageDraw.Draw(image), Pinhole(scene.pose_of(request), width, height)
    for box in scene.boxes():
        seen = [camera.at(corner) for corner in box]
        for a, bit in ((a, bit) for a in range(8) for bit in (1, 2, 4) if not a & bit):
            if seen[a] and seen[a | bit]:
                pen.line([seen[a], seen[a | bit]], fill=(200, 200, 190), width=max(1, width // 400))
    for i, node in enumerate(scene.nodes):
        at = camera.at(scene.place(i)) if node.light >= 0 and node.shown else None
        if at:
            r = height / 30
            color = tuple(int(255 * min(1, c)) for c in scene.lights[node.light].color)
            pen.ellipse([at[0] - r, at[1] - r, at[0] + r, at[1] + r], fill=color)
    pen.rectangle([0, 0, width * share, 3], fill=(120, 120, 120))
    out = io.BytesIO()
    image.save(out, "JPEG" if request.encoding == "jpeg" else "PNG")
    return out.getvalue()


def half_of(request):
    """Bare floats: grey, and a quarter brighter in the left half where it is not the reference."""
    width, height = request.size
    pixels = np.ones((height, width, 4), np.float16)
    if request.technique != "reference":
        pixels[:, :width // 2] = 1.25
    return pixels.tobytes()


def report_of(scene, request, step):
    report = pb.Report(scene="sha256:" + "0" * 64, revision=scene.revision, size=list(request.size),
                       technique=request.technique, seed=0, aa=request.aa or 1, exposure_stops=1.25, stopped="complete")
    report.time_ms.total = 18.0 / (1 + step)
    report.time_ms.encode = 1.5
    for name, ms, state in (("gbuffer", 4, "ran"), ("shadow_map", 2, "reused"), ("rsm", 2, "reused"),
                            ("vpl_grid", 2, "reused"), ("gather", 9.3, "ran"), ("tonemap", 0.4, "ran")):
        report.passes.add(name=name, ms=ms, state=state)
    report.omitted.add(**{"pass": "glossy", "reason": "no glossy surface"})
    report.counts.triangles, report.counts.vpls = 12, 1024
    if request.check:
        value = 0.05 / (1 + step)
        report.error.add(metric="rel_rmse", value=value, low=value * 0.8, high=value * 1.25, samples=request.check,
                         against="model")
    return report
