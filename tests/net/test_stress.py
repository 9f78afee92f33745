"""Everything at once: clients of every face that edit, look, cancel, break off, come back and leave,
the journal's upkeep beside them, and the daemon's end in the middle of it, once asked and once killed.

    BD_STRESS_SECONDS=60 BD_STRESS_SEED=7   (2 and 1; the seed is in every failure)

What has to hold: every request is answered exactly once, and once more only to who resumed; no edit
that was acknowledged is lost, none is there twice; no picture, event or answer shows a revision that
the journal does not have, with the hash that it has there; undo, redo and revert lead to the hash that
was; and the scene that a start makes of the journal is the one that was served.
"""
import os
import signal
import time

import bounced_pb2
from conftest import IS_GRADIENT, Daemon
from stress_books import Past, World
from stress_clients import PATIENCE_S, SEED, Client
from stress_http import HttpClient

pb = bounced_pb2
SECONDS = float(os.environ.get("BD_STRESS_SECONDS", "2"))
ROUND_SECONDS = 12  # of a long run: each has all three ends
FACES = ("unix", "unix", "tcp", "websocket")
OPTIONS = ("--limit", "requests_per_second=1000000", "--limit", "views_per_client=4096",
           "--limit", "jobs_per_client=4096", "--limit", "jobs_waiting=48")


def ask(connection, **bodies):
    envelope = pb.Envelope()
    for name, body in bodies.items():
        getattr(envelope, name).CopyFrom(body)
    answer, _ = connection.ask(envelope)
    assert not answer.HasField("error"), answer
    return answer


def read_logs(world, connection):
    for past in world.pasts.values():
        reply = ask(connection, scene_log=pb.SceneLog(scene=past.scene, after=past.last, limit=4000))
        past.read(reply.scene_log_reply.entries)
        past.last = max([past.last, *(e.revision for e in reply.scene_log_reply.entries)])


def make_scenes(world, daemon):
    connection = daemon.framed()
    for _ in range(3):
        scene = daemon.add_scene("two_lights.glb")
        triangle = pb.EditBatch(scene=scene, ops=[pb.EditOp(add_mesh=pb.MeshEdit(primitives=[
            pb.PrimitiveEdit(positions=pb.Data(values=[0, 0, 0, 1, 0, 0, 0, 1, 0]))]))])
        mesh = ask(connection, edit_batch=triangle).edit_reply.ids[0]
        world.pasts[scene] = Past(scene, mesh)
    read_logs(world, connection)
    connection.close()


def oldest(connection, scene):
    return ask(connection, scene_log=pb.SceneLog(scene=scene, limit=1)).scene_log_reply.oldest


def make_history(world, daemon):
    """So many edits that the upkeep has written snapshots and forgotten edits, and goes on to."""
    connection = daemon.framed()
    scene = next(iter(world.pasts))
    for burst in range(100):
        for _ in range(128):
            number = world.next_edit()
            op = pb.EditOp(set_light=pb.LightEdit(light=0, intensity=number))
            connection.send(pb.Envelope(edit_batch=pb.EditBatch(scene=scene, message=str(number),
                                                                ops=[op])))
        for _ in range(128):
            assert connection.receive()[0].HasField("edit_reply")
        read_logs(world, connection)
        if burst >= 10 and oldest(connection, scene) > 1:
            break
    assert oldest(connection, scene) > 1
    connection.close()


def verify(world, daemon):
    """What a start made of the journal, beside all that was told."""
    connection = daemon.framed()
    for scene in world.pasts:  # what may lie transient
        ask(connection, edit_commit=pb.EditCommit(scene=scene))
    read_logs(world, connection)
    for past in world.pasts.values():
        past.check()
        scene = ask(connection, scene_get=pb.SceneGet(id=past.scene, objects=True)).scene
        assert scene.revision == past.last and not scene.transient
        assert scene.hash == past.entries[past.last][3]
        light = next(o.light for o in scene.objects if o.kind == "light" and o.id == 0)
        wanted = past.intensity()
        assert wanted is None or light.intensity == wanted, (past.last, wanted)
    connection.close()


def end_of(world, daemon, how):
    """The end of the traffic: everybody settles, or the daemon ends first."""
    if how:
        world.is_ending = True
        daemon.process.send_signal(how)
        status = daemon.process.wait(timeout=PATIENCE_S)
        assert status == (0 if how == signal.SIGTERM else -how), daemon.log_path.read_text()
    world.is_over = True


def traffic(world, daemon, seconds, how):
    world.is_over = world.is_ending = False
    world.phase += 1
    clients = [Client(world, daemon, f"{face}{i}", face) for i, face in enumerate(FACES)]
    clients.append(HttpClient(world, daemon))
    reader = daemon.framed()
    for client in clients:
        client.start()
    until = time.time() + seconds
    while time.time() < until and not world.failures:
        time.sleep(.05)
        read_logs(world, reader)
    reader.close()
    end_of(world, daemon, how)
    for client in clients:
        client.join(2 * PATIENCE_S)
        assert not client.is_alive(), "a client hangs"
    assert not world.failures, "\n".join([f"BD_STRESS_SEED={SEED}", *world.failures])


def run_rounds(world, start):
    rounds = max(1, round(SECONDS / ROUND_SECONDS))
    daemon = start()
    make_scenes(world, daemon)
    make_history(world, daemon)
    for _ in range(rounds):
        for how in (None, signal.SIGTERM, signal.SIGKILL):
            traffic(world, daemon, SECONDS / rounds / 3, how)
            if how:
                daemon = start()
            verify(world, daemon)


def test_everything_at_once(tmp_path):
    assert IS_GRADIENT
    world, daemons = World(), []

    def start():
        daemons.append(Daemon(tmp_path, *OPTIONS, env={"BD_FAKE_FRAME_MS": "2"}))
        return daemons[-1]

    try:
        run_rounds(world, start)
    finally:
        for daemon in daemons:
            if daemon.process.poll() is None:
                daemon.process.kill()
    print(f"{world.answered} answers, {world.resumed} resumed, revisions "
          f"{[past.last for past in world.pasts.values()]}")
    assert world.answered > 100 and world.resumed > 0
