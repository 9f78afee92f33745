"""Files of a scene, how they travel, and every way in which a uri can try to leave."""
import hashlib
import json
import os
import struct

import bounced
import pytest
from bounced import files
from conftest import SCENES


def gltf(folder, name="s/box.gltf", **lists):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"asset": {"version": "2.0"},
                                **{kind: [{"uri": uri} for uri in uris]
                                   for kind, uris in lists.items()}}))
    return path


def put(folder, name, text):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def name_of(text):
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


def test_uris_are_named_as_the_file_spells_them(tmp_path):
    path = gltf(tmp_path, buffers=["my%20data.bin", "./my%20data.bin"],
                images=["my%20data.bin", "tex/a.png", "100%.png", "data:image/png;base64,AAAA"])
    put(tmp_path, "s/my data.bin", "one")
    put(tmp_path, "s/tex/a.png", "two")
    put(tmp_path, "s/100%.png", "three")
    found = {content.uri: content.blob for content in files.scene_contents(path)}
    assert found == {"": name_of(path.read_text()), "my%20data.bin": name_of("one"),
                     "./my%20data.bin": name_of("one"), "tex/a.png": name_of("two"),
                     "100%.png": name_of("three")}


@pytest.mark.parametrize("uri", [
    "../secret", "%2e%2e/secret", "a/../../secret", "/etc/passwd", "%2fetc/passwd",
    "file:///etc/passwd", "http://h/x", "C:/x", "link", "../missing", "", "a%00b",
    "s/../../secret"])
def test_uris_that_lead_out_are_refused(tmp_path, uri):
    path = gltf(tmp_path, images=["fine.png", uri])
    put(tmp_path, "secret", "secret")
    put(tmp_path, "s/fine.png", "fine")
    (tmp_path / "s/link").symlink_to("../secret")
    with pytest.raises(bounced.BadInput) as caught:
        files.scene_contents(path)
    assert caught.value.field == "images[1].uri" and "box.gltf" in caught.value.message


def test_links_inside_the_folder_and_a_linked_scene_are_followed(tmp_path):
    path = gltf(tmp_path, images=["link/a.png"])
    put(tmp_path, "s/real/a.png", "a")
    (tmp_path / "s/link").symlink_to("real")
    (tmp_path / "folder").symlink_to("s")
    assert len(files.scene_contents(path)) == 2
    assert len(files.scene_contents(tmp_path / "folder/box.gltf")) == 2


def test_a_missing_file_is_a_warning(tmp_path):
    path = gltf(tmp_path, images=["gone.png", "gone/a.png"])
    with pytest.warns(bounced.MissingFileWarning, match="gone.png"):
        assert [content.uri for content in files.scene_contents(path)] == [""]


def test_uris_of_a_glb_are_resolved_too(tmp_path):
    put(tmp_path, "b.bin", "b")
    text = json.dumps({"buffers": [{"uri": "b.bin"}]}).encode()
    text += b" " * (-len(text) % 4)
    (tmp_path / "x.glb").write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text),
                                                 0x4E4F534A) + text)
    assert [content.uri for content in files.scene_contents(tmp_path / "x.glb")] == ["", "b.bin"]


@pytest.mark.parametrize("text", ["", "not json", "[1]", '{"buffers": 3}', '{"images": [3, {}]}',
                                  '{"images": [{"uri": 3}]}', "[" * 100000])
def test_what_is_no_gltf_is_the_importers_to_refuse(tmp_path, text):
    put(tmp_path, "x.gltf", text)
    assert [content.size_bytes for content in files.scene_contents(tmp_path / "x.gltf")] == [
        len(text)]


def test_only_regular_files_are_read(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(bounced.BadInput, match="not a regular file"):
        files.scene_contents(tmp_path / "pipe")
    with pytest.raises(bounced.BadInput, match="not a regular file"):
        files.scene_contents(tmp_path)
    with pytest.raises(bounced.Error, match="No such file") as caught:
        files.scene_contents(tmp_path / "gone.glb")
    assert caught.value.code == "io"


def test_files_travel_in_pieces_once_and_not_when_held(peer, tmp_path):
    put(tmp_path, "big.bin", "x" * 2_500_000)
    put(tmp_path, "empty.bin", "")
    contents = [files.file_content(tmp_path / name)
                for name in ("big.bin", "empty.bin", "big.bin")]
    files.upload(peer.client._conn, contents)
    pieces = peer.wait_for("blob_put")
    assert [len(payload) for _, payload in pieces] == [1 << 20, 1 << 20, 2_500_000 - (2 << 20), 0]
    assert [put.offset for put, _ in pieces] == [0, 1 << 20, 2 << 20, 0]
    assert peer.blobs[contents[0].blob] == b"x" * 2_500_000
    files.upload(peer.client._conn, contents)
    assert len(peer.wait_for("blob_put")) == 4


def test_pieces_fit_the_daemons_messages(tmp_path):
    with bounced.private(limits={"message_bytes": 4096}) as daemon:
        scene = daemon.scenes.add(SCENES / "cornell.glb")
        assert scene.info()["counts"]["lights"] == 1


def test_a_file_that_shrinks_meanwhile(peer, tmp_path):
    put(tmp_path, "a", "x" * 100)
    content = files.file_content(tmp_path / "a")
    put(tmp_path, "a", "x" * 50)
    with pytest.raises(bounced.Error, match="changed while it was read"):
        files.upload(peer.client._conn, [content])
