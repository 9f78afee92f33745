"""Texts with a zero byte, or that are no UTF-8, are refused where they come in, by the field that has them."""
import json
import struct

import pytest
from conftest import blob_name, bounced_pb2 as pb

BAD = {b"holds a zero byte": b"a\0b", b"is no UTF-8": b"a\xffb", b"is no UTF-8 ": b"ab\xc3", b"is no UTF-8  ": b"\xed\xa0\x80"}
HOLDER = "ZZZ"


def send_bad(client, envelope, bad):
    """The same message with other bytes where it says HOLDER."""
    envelope.request_id = client.next_id
    client.next_id += 1
    header = envelope.SerializeToString().replace(HOLDER.encode(), bad)
    client.sock.sendall(struct.pack("<II", 4 + len(header), len(header)) + header)
    return client.receive()[0]


ENVELOPES = {
    "name": pb.Envelope(scene_add=pb.SceneAdd(blob="sha256:" + 64 * "0", name=HOLDER)),
    "files[1].key": pb.Envelope(scene_add=pb.SceneAdd(files=[pb.KeyValue(key="a"), pb.KeyValue(key=HOLDER)])),
    "ops[2].set_light.name": pb.Envelope(edit_batch=pb.EditBatch(scene="s1", ops=[
        pb.EditOp(remove_node=pb.Removal(id=0)), pb.EditOp(remove_node=pb.Removal(id=0)),
        pb.EditOp(set_light=pb.LightEdit(light=0, name=HOLDER))])),
    "frame.layers[0]": pb.Envelope(render=pb.Render(scene="s1", frame=pb.FrameRequest(layers=[HOLDER]))),
    "scene": pb.Envelope(scene_watch=pb.SceneWatch(scene=HOLDER)),
}


@pytest.mark.parametrize("field", ENVELOPES)
def test_no_such_text_gets_in(shared, field):
    client = shared.framed()
    for says, bad in BAD.items():
        envelope = pb.Envelope()
        envelope.CopyFrom(ENVELOPES[field])
        answer = send_bad(client, envelope, bad)
        assert answer.request_id == client.next_id - 1 and answer.error.code == "bad_input", answer
        assert answer.error.details.field == field
        assert says.decode().strip() in answer.error.message
    good = client.ask(pb.Envelope(scene_list=pb.SceneList()))[0]
    assert good.WhichOneof("body") == "scene_list_reply"  # the connection goes on


def test_texts_that_are_one_get_in(shared):
    client = shared.framed()
    name = "Süd\U0001f4a1, \u6771"
    answer = client.ask(pb.Envelope(scene_add=pb.SceneAdd(blob=blob_name(b"no scene"), name=name)))[0]
    assert answer.error.code == "not_found"


def test_nor_by_http(shared):
    scene = shared.add_scene("two_lights.glb")
    batch = pb.EditBatch(ops=[pb.EditOp(set_light=pb.LightEdit(light=0, name=HOLDER))]).SerializeToString()
    for bad in BAD.values():
        status, _, body = shared.request("POST", f"/v1/scenes/{scene}/edits", batch.replace(HOLDER.encode(), bad),
                                         {"Content-Type": "application/x-protobuf"})
        assert status == 400 and json.loads(body)["details"]["field"] == "ops[0].set_light.name", body
    for text in ("%00", "%ff", "%ed%a0%80", "a%c3"):
        assert shared.request("GET", f"/v1/scenes/{scene}/log?after={text}")[0] == 400
        assert shared.request("GET", f"/v1/scenes/{scene}/frame.png?camera={text}")[0] == 400
    body = json.dumps({"ops": [{"set_light": {"light": 0, "name": "a\0b"}}]})
    assert shared.request("POST", f"/v1/scenes/{scene}/edits", body, {"Content-Type": "application/json"})[0] == 400
