"""Writes the first inputs of the corpora, out of what the other tests have: BUILD_PB2 OUT.

What fuzzing finds beyond them is merged in by hand (README.md) and kept small."""
import json
import pathlib
import struct
import sys

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


def main(pb2_folder, out):
    sys.path.insert(0, pb2_folder)
    import bounced_pb2 as pb
    out = pathlib.Path(out)
    seed_messages(pb, out)
    seed_json(out)
    seed_scenes(out)


if __name__ == "__main__":
    main(*sys.argv[1:3])
