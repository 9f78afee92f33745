"""Writes the first inputs of the corpora, out of what the other tests have: BUILD_PB2 OUT.

What fuzzing finds beyond them is merged in by hand (README.md) and kept small."""
import hashlib
import json
import pathlib
import struct
import sys
import zlib

HERE = pathlib.Path(__file__).resolve().parent
SCENES = HERE.parent / "scenes"
SMALL_BYTES = 8192


def write(folder, name, content):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(content)


def envelopes(pb):
    yield pb.Envelope(request_id=1, hello=pb.Hello(min=1, max=1, token="0123456789abcdef"))
    yield pb.Envelope(request_id=2, scene_add=pb.SceneAdd(
        blob="sha256:" + "0" * 64, name="box", files=[pb.KeyValue(key="a.bin", value="sha256:" + "1" * 64)]))
    yield pb.Envelope(request_id=3, render=pb.Render(scene="0123456789abcdef", frame=pb.FrameRequest(
        technique="rsm", size=[64, 48], parameters=[pb.KeyValue(key="vpls", value="256")])))
    yield pb.Envelope(request_id=4, cancel=pb.Cancel(request_id=3))
    yield pb.Envelope(request_id=5, edit_batch=pb.EditBatch(scene="0123456789abcdef", ops=[
        pb.EditOp(set_light=pb.LightEdit(light=0, intensity=5)),
        pb.EditOp(add_node=pb.NodeEdit(name="n", parent=-1, transform=pb.TransformEdit(
            translation=[1, 2, 3]))),
        pb.EditOp(set_mesh_vertices=pb.MeshVertices(mesh=0, primitive=0, positions=pb.Data(
            values=[0, 0, 0, 1, 0, 0, 0, 1, 0])))]))
    yield pb.Envelope(request_id=6, view_open=pb.ViewOpen(scene="0123456789abcdef", credits=2))


def seed_messages(pb, out):
    units = []
    for index, envelope in enumerate(envelopes(pb)):
        header = envelope.SerializeToString()
        unit = struct.pack("<II", 4 + len(header) + 3, len(header)) + header + b"abc"
        units.append(unit)
        write(out / "message", f"unit-{index}", b"\0" + unit)
    write(out / "message", "all-by-seven", b"\7" + b"".join(units))


def seed_json(out):
    texts = {
        "scene_add": (0, {"blob": "sha256:" + "0" * 64, "files": {"a.bin": "x"}, "name": "box"}),
        "render": (1, {"scene": "s", "frame": {"size": [64, 48], "parameters": {"vpls": 256}}}),
        "edit": (2, {"base_revision": 1, "ops": [
            {"set_light": {"light": 0, "intensity": 5}},
            {"set_transform": {"node": 2, "translation": [1, 2, 3], "rotation": [0, 0, 0, 1]}},
            {"set_mesh_vertices": {"mesh": 0, "positions": {"values": [0.5, 1, 2]}}},
            {"set_material": {"material": 1, "alpha_mode": "mask", "double_sided": True}}]}),
        "view": (3, {"scene": "s", "credits": 2, "frame": {"pose": {"eye": [0, 0, 1]}}}),
        "envelope": (4, {"request_id": "9007199254740993", "cancel": {"request_id": 3}}),
    }
    for name, (kind, value) in texts.items():
        write(out / "json", name, bytes([kind]) + json.dumps(value).encode())


def seed_scenes(out):
    for path in sorted(SCENES.glob("*.gl*")):
        if path.stat().st_size <= SMALL_BYTES:
            write(out / "gltf", path.name, path.read_bytes())


# --- scripts (script.h) --------------------------------------------------------------------------

def script(*steps):
    """Each step is bytes and its command; without one, what is sent at the end."""
    return b"".join(step.replace(b"\xff", b"\xff\xff") if command is None
                    else step.replace(b"\xff", b"\xff\xff") + b"\xff" + command.encode()
                    for step, command in steps)


def random_bytes(seed):
    """What machine.c gives in the place of the system's random bytes."""
    while True:
        seed = (seed * 6364136223846793005 + 1442695040888963407) % 2**64
        yield seed >> 56


def take(source, count):
    return bytes(next(source) for _ in range(count))


OPS = {
    "nodes": [{"add_node": {"name": "n", "parent": 0, "mesh": 0, "transform": {"translation": [1, 2, 3]}}},
              {"set_node": {"node": 2, "parent": -1, "shown": False}},
              {"set_transform": {"node": 1, "rotation": [0, 0.7, 0, 0.7], "scale": [2, 1, 1]}},
              {"remove_node": {"id": 3}}],
    "materials": [{"add_material": {"name": "m", "metallic": 1, "alpha_mode": "blend"}},
                  {"set_material": {"material": 0, "emissive": [1, 0, 0], "unlit": True}},
                  {"remove_material": {"id": -2}}],
    "meshes": [{"add_mesh": {"primitives": [{"positions": {"values": [0, 0, 0, 1, 0, 0, 0, 1, 0]},
                                             "uv0": {"values": [0, 0, 1, 0, 0, 1]}}]}},
               {"set_mesh_vertices": {"mesh": 1, "primitive": 1,
                                      "positions": {"values": [0, 0, 2, 1, 0, 2, 0, 1, 2]}}},
               {"set_mesh": {"mesh": 0, "name": "other"}}, {"remove_mesh": {"id": -2}}],
    "lights": [{"add_light": {"kind": "spot", "cone_inner": 0.1, "cone_outer": 0.5, "range": 3}},
               {"set_light": {"light": 0, "kind": "directional", "color": [1, 0.5, 0]}},
               {"add_node": {"light": -2}}],
    "cameras": [{"add_camera": {"yfov": 1, "near": 0.01, "far": 100}},
                {"set_camera": {"camera": 0, "orthographic": True, "xmag": 1, "ymag": 1}},
                {"remove_node": {"id": 6}}, {"remove_camera": {"id": -2}}],
    "sky": [{"set_environment": {"radiance": [1, 1, 2]}}],
    "refused": [{"set_light": {"light": 1, "intensity": 7}}, {"remove_light": {"id": 0}}],
}


# One number or name each: what an edit touches and what follows from it must agree.
SMALL = [{"set_light": {"light": 0, "intensity": 11}}, {"set_light": {"light": 1, "cone_outer": 0.5}},
         {"set_light": {"light": 0, "name": "x"}}, {"set_camera": {"camera": 0, "yfov": 0.9}},
         {"set_material": {"material": 0, "roughness": 0.5}}, {"set_material": {"material": 1, "emissive": [9, 9, 9]}},
         {"set_transform": {"node": 1, "translation": [0, 0, 1]}}, {"set_node": {"node": 0, "shown": False}},
         {"set_environment": {"radiance": [0, 0, 0]}}, {"set_mesh_vertices": {"mesh": 0, "positions": {
             "values": [0, 0, 0, 2, 0, 0, 2, 1, 0, 0, 1, 0]}}}]


def batch(ops, **more):
    return json.dumps({"ops": ops, **more}, separators=(",", ":")).encode()


def seed_edits(pb, out):
    for name, ops in OPS.items():
        write(out / "edits", name, script((batch(ops), None)))
    write(out / "edits", "small", script(*((batch([op]), "e") for op in SMALL)))
    lamp, node = batch(OPS["lights"]), batch(OPS["nodes"])
    write(out / "edits", "undo-redo", script((lamp, "e"), (b"", "u"), (b"", "r"), (node, "e"), (b"", "u"),
                                             (b"", "u"), (b"\0", "v")))
    write(out / "edits", "transient", script((lamp, "t"), (node, "t"), (b"", "c"), (lamp, "t"), (node, "e"),
                                             (b"", "u")))
    write(out / "edits", "failed", script((lamp, "x"), (node, "e")))
    message = pb.EditBatch(ops=[pb.EditOp(add_mesh=pb.MeshEdit(primitives=[pb.PrimitiveEdit(
        material=0, positions=pb.Data(payload=True))]))])
    floats = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    write(out / "edits", "payload", script((floats, "d"), (message.SerializeToString(), "b")))
    data = {"payload": True, "offset": 4, "size_bytes": 36}
    write(out / "edits", "slice", script((b"abcd" + floats, "d"), (batch([{"add_mesh": {"primitives": [
        {"positions": data}]}}, {"set_mesh": {"mesh": -2, "primitives": [{"positions": {**data, "offset": 6}}]}}]), "e")))


def seed_journal(out):
    def damage(*changes):
        return b"".join(struct.pack("<I", at)[:3] + bytes([how, by]) for at, how, by in changes)
    write(out / "journal", "whole", b"\0")
    write(out / "journal", "flipped", b"\0" + damage((9000, 0, 1), (40000, 0, 128)))
    write(out / "journal", "cut", b"\0" + damage((30000, 5, 0)))
    write(out / "journal", "pages", b"\0" + damage((20480, 3, 2), (28672, 4, 0)))
    write(out / "journal", "log-whole", b"\1")
    write(out / "journal", "log-torn", b"\1" + damage((50000, 2, 0)))
    write(out / "journal", "log-cut", b"\1" + damage((70000, 5, 0)))
    write(out / "journal", "forged-delta", b"\2" + bytes([0, 2, 9, 0, 0, 3]))
    write(out / "journal", "forged-index", b"\2" + bytes([14, 0, 60, 0, 2, 17, 22, 0, 0, 0, 0, 1]))
    write(out / "journal", "forged-content", b"\2" + bytes([26, 0, 20, 0, 2, 12, 26, 2, 4, 0, 3, 4]))
    write(out / "journal", "session", b"\3" + bytes(range(1, 64)) + b"\xff\0" + bytes(range(64, 90)))


def request(line, *headers, body=b""):
    if body:
        headers += (f"Content-Length: {len(body)}",)
    return "\r\n".join((line + " HTTP/1.1", "Host: localhost", *headers, "", "")).encode() + body


JSON_TYPE = "Content-Type: application/json"


def png():
    """Two pixels by two, grey."""
    def chunk(name, content):
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 2, 2, 8, 0, 0, 0, 0))
            + chunk(b"IDAT", zlib.compress(b"\0\x40\x80\0\xc0\xff")) + chunk(b"IEND", b""))


def seed_http_requests(out, scene, blob):
    at = f"/v1/scenes/{scene}"
    gets = ["/", "/healthz", "/readyz", "/metrics", "/v1/devices", "/v1/stats", "/v1/techniques", "/v1/scenes",
            at, at + "?objects=1", at + "/log?limit=3", at + "/export"]
    write(out, "gets", script((b"".join(request("GET " + path) for path in gets), None)))
    frame = f"GET {at}/frame.png?size=8x8&technique=rsm&exposure=auto&layers=albedo&camera=front"
    write(out, "frame", script((request(frame), None)))
    every = ("size=8x4&camera=0&technique=rsm&set=vpls%3D64&layers=beauty,albedo&aa=2&seed=7&exposure=1.5&tonemap=agx&half=1"
             "&quality=80&deadline_ms=400&plan=0&fresh=all&against=full")
    checked = "size=8x4&technique=reference&region=0,0,4,4&check=16&target_error=5"
    write(out, "queries", script((request(f"GET {at}/frame.exr?{every}"), "a"), (request(f"GET {at}/frame.jpg?{every}"), "a"),
                                 (request(f"GET {at}/frame.json?{checked}"), "a"), (request(f"GET {at}/frame.png?%zz=1"), None)))
    write(out, "frame-cancelled", script((request(frame), "x"), (request(frame), "c")))
    edit = batch(OPS["lights"], client_edit_id="x", message="m")
    posts = [("edits", edit), ("edits", edit), ("undo", b"{}"), ("undo", b'{"redo":true}'), ("revert", b'{"revision":2}'),
             ("edits", batch(OPS["nodes"], durability="transient")), ("commit", b"{}"),
             ("names", b'{"name":"best"}'), ("edits", batch(OPS["sky"], dry_run=True))]
    write(out, "edits", script(*((request(f"POST {at}/{word}", JSON_TYPE, body=body), "a")
                                 for word, body in posts)))
    write(out, "edits-together", script(*((request(f"POST {at}/{word}", JSON_TYPE, body=body), "2134"[i % 4])
                                          for i, (word, body) in enumerate(posts))))
    put = request(f"PUT /v1/blobs/sha256:{blob[0]}", "Content-Type: application/octet-stream", body=blob[1])
    add = json.dumps({"blob": "sha256:" + blob[0], "name": "bare"}).encode()
    write(out, "add-scene", script((put, "a"), (request("POST /v1/scenes", JSON_TYPE, body=add), "a"),
                                   (request("GET /v1/scenes"), "a"), (request("DELETE " + at), None)))
    picture = png()
    names = {name: hashlib.sha256(content).hexdigest() for name, content in (("png", picture), ("glb", blob[1]))}
    heavy = [{"add_texture": {"blob": "sha256:" + names["png"], "wrap_s": "mirror"}},
             {"set_material": {"material": 0, "base_color_texture": -2}},
             {"import": {"parent": 0, "blob": "sha256:" + names["glb"], "name": "in"}}]
    write(out, "heavy", script(*((request(f"PUT /v1/blobs/sha256:{names[name]}", "Content-Type: application/octet-stream",
                                          body=content), "a") for name, content in (("png", picture), ("glb", blob[1]))),
                               (request(f"HEAD /v1/blobs/sha256:{names['png']}"), "a"),
                               (request(f"POST {at}/edits", JSON_TYPE, body=batch(heavy)), "a"),
                               (request(f"POST {at}/edits", JSON_TYPE, body=batch(OPS["meshes"])), "r"),
                               (request(f"GET {at}?objects=1"), None)))
    form = (b'--xyz\r\nContent-Disposition: form-data; name="scene"\r\n\r\n' + blob[1] + b"\r\n--xyz--\r\n")
    write(out, "multipart", script((request("POST /v1/render?size=4x4&encoding=exr",
                                            "Content-Type: multipart/form-data; boundary=xyz",
                                            "Bounced-Client: x", "Expect: 100-continue", body=form), None)))
    write(out, "streams", script((request(f"GET {at}/stream.mjpeg?size=4x4&fps=5"), "g"), (b"", "a"), (b"\3", "t"),
                                 (b"", "a"), (b"", "2"), (request("GET /v1/events"), "3"),
                                 (request(f"POST {at}/edits", JSON_TYPE, body=edit), "a"), (b"\7", "t"),
                                 (b"", "2"), (b"ignored", "3"), (request("DELETE " + at), "a")))
    write(out, "silence", script((b"GET / HTTP/1.1\r\nHo", "s"), (b"\6", "t"), (b"", "2"),
                                 (request("PUT /v1/blobs/sha256:" + "0" * 64, "Content-Length: 9",
                                          "Content-Type: application/octet-stream"), "s"), (b"\11", "t"),
                                 (b"", "3"), (b"", "f"), (b"\6", "t"), (b"", "4"), (b"", "h"), (b"\11", "t")))
    write(out, "odd-heads", script((request("GET /x", "Transfer-Encoding: chunked"), "h"),
                                   (b"GET / HTTP/1.1\r\nHost : a\r\n\r\n", "h"),
                                   (request("POST /v1/scenes", "Content-Length: 5", "Content-Length: 6"), "h"),
                                   (b"\x16\x03\x01", None)))
    login = request("POST /v1/session", "Authorization: Bearer admin-admin-admin", JSON_TYPE, body=b"{}")
    cookie = take(random_bytes(2), 32).hex()
    write(out, "tokens", script((b"", "T"), (request("GET /v1/scenes"), "a"), (login, "a"),
                                (request("GET /v1/stats", f"Cookie: bounced_session={cookie}"), "a"),
                                (request("GET " + at, "Authorization: Bearer read-read-read-read"), "a"),
                                (request("GET /metrics", "Authorization: Bearer edit-edit-edit-edit"), "a"),
                                (request(f"POST {at}/edits", "Authorization: Bearer edit-edit-edit-edit", JSON_TYPE,
                                         body=batch(OPS["meshes"])), "a"),
                                (request("POST /v1/scenes", "Authorization: Bearer edit-edit-edit-edit", JSON_TYPE, body=add), "a"),
                                (request("DELETE /v1/session", f"Cookie: bounced_session={cookie}",
                                         "Origin: http://localhost"), None)))


def seed_http_sessions(out, scene, blob):
    def unit(request_id=None, **body):
        if request_id:
            body["request_id"] = request_id
        return json.dumps(body, separators=(",", ":")).encode(), "j"
    hello = unit(1, hello={"min": 1, "max": 1, "resume": ""})
    token = take(random_bytes(2), 32).hex()
    again = unit(1, hello={"min": 1, "resume": token})
    frame = {"size": [4, 4], "technique": "rsm"}
    views = [unit(2, view_open={"scene": scene, "frame": frame, "credits": 2}), (b"", "g"), (b"", "a"),
             unit(view_credit={"view": 1, "count": 1}), unit(3, view_update={"view": 1, "pose": {
                 "eye": [0, 0, 5], "target": [0, 0, 0]}, "sequence": 7}), (b"", "a"), (b"\2", "t"), (b"", "a")]
    edit = unit(4, edit_batch={"scene": scene, "ops": OPS["lights"], "durability": "transient"})
    write(out, "view", script((b"", "f"), hello, *views, edit, (b"", "a"), unit(5, view_close={"view": 1})))
    # Ended while a frame is rendered, encoded, or on its way back.
    for name, under_way in (("rendering", ""), ("encoding", "g"), ("encoded", "gr")):
        write(out, "view-closed-" + name, script((b"", "f"), hello, views[0], *((b"", c) for c in under_way),
                                                 unit(3, view_close={"view": 1}), *views, *((b"", c) for c in under_way)))
    write(out, "resume", script((b"", "f"), hello, *views, unit(6, scene_watch={}), edit, (b"", "x"), (b"", "a"),
                                (b"", "f"), again, (b"", "a"), (b"", "2"), (b"", "f"), again, (b"\7", "t")))
    write(out, "requests", script((b"", "f"), hello, unit(2, render={"scene": scene, "frame": frame, "progress": True}),
                                  unit(3, cancel={"request_id": 2}), unit(4, scene_list={}), unit(5, devices={}),
                                  unit(6, scene_get={"id": scene, "objects": True}), unit(7, stats={}),
                                  unit(8, edit_undo={"scene": scene}), unit(9, scene_log={"scene": scene}),
                                  unit(11, scene_export={"scene": scene}), (b"", "a"),
                                  unit(10, scene_remove={"id": scene}), unit(12, techniques={}), (b"", "q")))
    # A light's whole state, as a journal has it (server/scene/model/delta.h).
    light = b"BDDELT01" + struct.pack("<III64s?I7f", 1, 3, 0, b"lamp", False, 1, 1, 1, 1, 5, 9, 0.7, 0.1)
    replays = [step for i, kind in enumerate(("edit", "undo", "redo", "revert"))
               for step in ((light, "d"), unit(2 + i, scene_replay={"scene": scene, "revision": 10 + i, "kind": kind,
                                                                    "of": i, "client_edit_id": "r%d" % i}), (b"", "a"))]
    write(out, "replay", script((b"", "f"), hello, *replays, unit(8, edit_undo={"scene": scene}), (b"", "a"),
                                unit(9, edit_undo={"scene": scene, "redo": True}), (b"", "a")))
    half = len(blob[1]) // 2
    put = {"blob": "sha256:" + blob[0], "size_bytes": len(blob[1])}
    write(out, "upload", script((b"", "f"), hello, (blob[1][:half], "d"), unit(2, blob_put={**put, "offset": 0}), (b"", "a"),
                                (blob[1][half:], "d"), unit(3, blob_put={**put, "offset": half}), (b"", "r"),
                                unit(4, blob_have={"blobs": [put["blob"]]}), (b"", "a"),
                                unit(5, scene_add={"blob": put["blob"]}), (b"", "r"), unit(6, cancel={"request_id": 5})))
    upgrade = request("GET /v1/socket", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
                      "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==", "Sec-WebSocket-Protocol: bounced.v1")
    write(out, "websocket", script((upgrade, "s"), hello, *views, (b"\x89ping", "w"), (b"\x02\0\0", "w"),
                                   (b"\x80\0\0", "w"), (b"\x88\x03\xe8", "w")))
    write(out, "websocket-silence", script((upgrade, "s"), hello, views[0], (b"\10", "t"), (b"\x8a", "w"), (b"\10", "t"),
                                           (b"\10", "t"), (b"\10", "t"), (b"", "2"), (upgrade, "s"), (b"\6", "t"),
                                           (b"", "3"), (upgrade, "s"), hello, (b"\x02\1\0\0\0\7", "w"), (b"", "4"),
                                           (upgrade, "s"), hello, (b"\x81x", "w"), (b"", "q"), (b"\6", "t")))
    # The lengths in sight: hello and scene_list, and one that ends early.
    raw = [struct.pack("<I", len(unit)) + unit for unit in (b"\x08\1\x52\2\x08\1", b"\x08\2\x6a\0")]
    write(out, "raw-units", script((upgrade, "s"), *((b"\x82" + unit, "w") for unit in raw), (b"", "2"), (b"", "f"),
                                   (b"".join(struct.pack("<I", len(unit)) + unit for unit in raw), "s"),
                                   (struct.pack("<II", 9, 5) + b"abc", None)))
    write(out, "two-views", script((b"", "f"), hello, *views, (b"", "2"), (b"", "f"), hello, *views,
                                   unit(8, scene_remove={"id": scene}), (b"", "a")))


def seed_http(out):
    source = random_bytes(1)
    scene = "%016x" % int.from_bytes(take(source, 8), "little")
    content = (SCENES / "wall_floor.glb").read_bytes()
    blob = (hashlib.sha256(content).hexdigest(), content)
    seed_http_requests(out / "http", scene, blob)
    seed_http_sessions(out / "http", scene, blob)


def main(pb2_folder, out):
    sys.path.insert(0, pb2_folder)
    import bounced_pb2 as pb
    out = pathlib.Path(out)
    seed_messages(pb, out)
    seed_json(out)
    seed_scenes(out)
    seed_edits(pb, out)
    seed_journal(out)
    seed_http(out)


if __name__ == "__main__":
    main(*sys.argv[1:3])
