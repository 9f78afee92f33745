"""Imports beside everything else: at low priority, few at once, for files of scenes and of edits."""
import json
import pathlib
import struct
import subprocess
import threading
import zlib

import bounced_pb2 as pb
import pytest
from conftest import IS_SANITIZED, SCENES
from stopwatch import Stopwatch
from test_framed import envelope

SCHED_OTHER, SCHED_BATCH = 0, 3


def glb(megabytes, seed=0):
    """One mesh of so many megabytes: a strip of triangles that all differ, and nothing else."""
    count = megabytes * (1 << 20) // 36 * 3
    pattern = b"".join(struct.pack("<3f", seed + i, i % 7, i % 11) for i in range(1023))
    data = (pattern * (count // 1023 + 1))[:12 * count]
    document = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(data)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3",
                       "min": [seed, 0, 0], "max": [seed + 1022, 6, 10]}]}).encode()
    document += b" " * (-len(document) % 4)
    return (struct.pack("<III", 0x46546C67, 2, 28 + len(document) + len(data)) +
            struct.pack("<II", len(document), 0x4E4F534A) + document +
            struct.pack("<II", len(data), 0x004E4942) + data)


def png(side_px):
    """One colour, so that the file is small however large the picture."""
    rows = zlib.compress((b"\0" + b"\x7f" * 3 * side_px) * side_px, 1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", side_px, side_px, 8, 2, 0, 0, 0)) +
            chunk(b"IDAT", rows) + chunk(b"IEND", b""))


class Stat:
    """A process or a thread, of /proc/.../stat, and the words that the process was started with."""

    def __init__(self, folder):
        text = (folder / "stat").read_text()
        self.started_with = (folder / "cmdline").read_bytes()
        words = text[text.rindex(")") + 2:].split()
        self.has_ended = words[0] in "ZX"
        self.parent, self.nice, self.policy = int(words[1]), int(words[16]), int(words[38])


def stats_of(folders):
    for folder in folders:
        try:
            yield folder, Stat(folder)
        except (FileNotFoundError, ProcessLookupError):
            pass  # gone meanwhile


def children(pid):
    """Those that import: one that is about to has the daemon's words yet, and one that ended has none."""
    found = stats_of(p for p in pathlib.Path("/proc").iterdir() if p.name.isdigit())
    return [(folder, stat) for folder, stat in found
            if stat.parent == pid and not stat.has_ended and b"--import" in stat.started_with]


def disk_priority(folder):
    """Nothing of one that ended meanwhile: it has none."""
    said = subprocess.run(["ionice", "-p", folder.name], capture_output=True, text=True).stdout
    return said if any(not stat.has_ended for _, stat in stats_of([folder])) else ""


def while_importing(daemon, bodies):
    """Whatever there is to see of the daemon, again and again, until every body is answered."""
    replies = []

    def post(path, body):
        replies.append(daemon.json("POST", path, body)[0])

    threads = [threading.Thread(target=post, args=body) for body in bodies]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        yield
    assert replies and set(replies) <= {200, 201}, replies


def test_a_child_and_its_thread_have_low_priority(start):
    daemon = start()
    own = Stat(pathlib.Path(f"/proc/{daemon.process.pid}"))
    low, seen, threads, disks = (max(own.nice, 10), SCHED_BATCH), set(), set(), set()
    for attempt in range(20):  # on a busy machine an import may be over before anybody looks
        blob = daemon.put_blob(glb(8, attempt))
        for _ in while_importing(daemon, [("/v1/scenes", {"blob": blob})]):
            for folder, stat in children(daemon.process.pid):
                seen.add((stat.nice, stat.policy))
                disks.add(disk_priority(folder))
            tasks = pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir()
            threads |= {(stat.nice, stat.policy) for _, stat in stats_of(tasks)}
        if seen and low in threads and disks - {""}:
            break
    assert seen == {low}
    assert (own.nice, SCHED_OTHER) in threads and low in threads
    assert disks - {""} == {"best-effort: prio 7\n"}
    # And when it is over, all who are left are as they were.
    tasks = pathlib.Path(f"/proc/{daemon.process.pid}/task").iterdir()
    assert {stat.nice for _, stat in stats_of(tasks)} == {own.nice}


@pytest.mark.parametrize("limit", [1, 2])
def test_few_at_once_those_of_edits_included(start, limit):
    daemon = start("--limit", f"imports_at_once={limit}")
    scene = daemon.add_scene()
    blobs = [daemon.put_blob(glb(4, seed)) for seed in range(4)]
    bodies = [("/v1/scenes", {"blob": blob}) for blob in blobs[:2]]
    bodies += [(f"/v1/scenes/{scene}/edits", {"ops": [{"import": {"blob": blobs[2]}}]}),
               ("/v1/scenes", {"blob": blobs[3]})]
    most = 0
    for _ in while_importing(daemon, bodies):
        most = max(most, len(children(daemon.process.pid)))
    assert 1 <= most <= limit


def test_frames_and_edits_go_on_while_all_imports_are_taken(start):
    daemon = start("--limit", "imports_at_once=1", "--limit", "requests_per_second=100000")
    scene = daemon.add_scene()
    blobs = [daemon.put_blob(glb(4, seed)) for seed in range(3)]
    slowest = 0
    for _ in while_importing(daemon, [("/v1/scenes", {"blob": blob}) for blob in blobs]):
        watch = Stopwatch()
        assert daemon.request("GET", f"/v1/scenes/{scene}/frame.png?size=8x8")[0] == 200
        assert daemon.json("POST", f"/v1/scenes/{scene}/edits",
                           {"ops": [{"set_light": {"light": 0, "intensity": 5}}]})[0] == 200
        slowest = max(slowest, watch.own_s())
    assert slowest < 2


def test_a_waiting_import_is_cancelled_at_once(start):
    daemon = start("--limit", "imports_at_once=1")
    client = daemon.framed()
    blobs = [client.put_blob(glb(8, seed)) for seed in range(2)]
    first, second = (client.send(envelope(scene_add=pb.SceneAdd(blob=blob))) for blob in blobs)
    client.send(envelope(cancel=pb.Cancel(request_id=second)))
    answers = [client.receive()[0] for _ in range(3)]
    assert answers[0].request_id == second and answers[0].error.code == "cancelled"
    assert answers[2].request_id == first and answers[2].HasField("scene")


def answers_to(client, *envelopes):
    """Request ids in the order in which they were answered, and the answers."""
    ids = [client.send(each) for each in envelopes]
    answers = {}
    while len(answers) < len(ids):
        answer = client.receive()[0]
        if answer.WhichOneof("body") != "progress":
            answers[answer.request_id] = answer
    return [ids.index(each) for each in answers], list(answers.values())


def edit(scene, *ops):
    return envelope(edit_batch=pb.EditBatch(scene=scene, ops=[pb.EditOp(**op) for op in ops]))


DIM = {"set_light": {"light": 0, "intensity": 5}}


def test_pictures_of_edits_leave_the_pool_to_the_journal(start):
    daemon = start(env={"UV_THREADPOOL_SIZE": "1"})
    client = daemon.framed()
    slow, quick = (daemon.add_scene("two_lights.glb") for _ in range(2))
    texture = {"add_texture": {"blob": client.put_blob(png(2048))}}
    # Its last operation is refused, which takes no turn at the journal.
    order, answers = answers_to(client, edit(slow, *[texture] * 4, {"set_light": {"light": 99}}),
                                edit(quick, DIM))
    assert order == [1, 0], answers
    assert answers[0].edit_reply.revision == 2 and answers[1].error.code == "not_found"
    client.close()


def test_pictures_of_edits_do_not_wait_for_imports(start):
    daemon = start("--limit", "imports_at_once=1")
    client = daemon.framed()
    scene = daemon.add_scene()
    blob, picture = client.put_blob(glb(16)), client.put_blob(png(2))
    order, answers = answers_to(client, envelope(scene_add=pb.SceneAdd(blob=blob)),
                                edit(scene, {"add_texture": {"blob": picture}}))
    assert order == [1, 0] and answers[0].edit_reply.revision == 2, answers
    client.close()


@pytest.mark.parametrize("limit", ["picture_side_px=1", "picture_texels=1", "import_bytes=16M"])
def test_limits_of_an_import(start, limit):
    if "import_bytes" in limit and IS_SANITIZED:
        pytest.skip("the sanitizer's own memory is above any such limit")
    daemon = start("--limit", limit)
    data = glb(24) if "import_bytes" in limit else (SCENES / "checker.glb").read_bytes()
    status, error = daemon.json("POST", "/v1/scenes", {"blob": daemon.put_blob(data)})
    assert (status, error["code"]) == (413, "limit"), error
