"""The HTTP transport: every route, the queries, who may ask, what may be sent."""
import http.client
import json
import socket
import struct
import time

import bounced_pb2
import pytest
from conftest import SCENES, blob_name

GLB = (SCENES / "cornell.glb").read_bytes()
OCTETS = {"Content-Type": "application/octet-stream"}


def test_health_ready_metrics(shared):
    assert shared.healthy()
    status, ready = shared.json("GET", "/readyz")
    assert status == 200 and ready["ready"] is True and ready["device"]["class"]
    status, headers, text = shared.request("GET", "/metrics")
    assert status == 200 and headers["Content-Type"].startswith("text/plain; version=0.0.4")
    for line in text.decode().splitlines():
        assert line.startswith("# ") or float(line.rsplit(" ", 1)[1]) >= 0, line


def test_metrics_tell_of_stalls(shared):
    before = shared.metrics()
    time.sleep(0.1)
    after = shared.metrics()
    for name in ("loop_stall", "loop_work", "render_stall"):
        buckets = [value for key, value in after.items()
                   if key.startswith(f"bounced_{name}_seconds_bucket")]
        assert buckets == sorted(buckets) and buckets[-1] == after[f"bounced_{name}_seconds_count"]
        assert 0 <= after[f"bounced_{name}_seconds_max"] <= after[f"bounced_{name}_seconds_sum"] + 1
    # A connection that is open makes the loop's heart beat, and none that is closed.
    beats = "bounced_loop_stall_seconds_count"
    with socket.create_connection(("127.0.0.1", shared.port)):
        time.sleep(0.3)
    beaten = shared.metrics()[beats] - after[beats]
    assert 10 <= beaten <= 70, beaten
    assert after[beats] - before[beats] <= 10


def test_scene_from_blob_to_deletion(shared):
    blob = blob_name(GLB)
    assert shared.put_blob(GLB) == blob
    assert shared.request("HEAD", "/v1/blobs/" + blob)[0] == 200
    status, scene = shared.json("POST", "/v1/scenes", {"blob": blob, "name": "box"})
    assert status == 201 and scene["revision"] == 1 and scene["name"] == "box"
    assert scene["hash"].startswith("sha256:") and scene["counts"]["triangles"] > 0
    status, reply = shared.json("GET", "/v1/scenes")
    assert status == 200 and scene["id"] in [entry["id"] for entry in reply["scenes"]]
    assert shared.json("GET", "/v1/scenes/" + scene["id"]) == (200, scene)
    status, _, text = shared.request("DELETE", "/v1/scenes/" + scene["id"])
    assert (status, text) == (204, b"")
    assert shared.json("GET", "/v1/scenes/" + scene["id"])[0] == 404
    assert shared.json("DELETE", "/v1/scenes/" + scene["id"])[0] == 404


def test_techniques(shared):
    status, reply = shared.json("GET", "/v1/techniques")
    assert status == 200
    rsm = {technique["name"]: technique for technique in reply["techniques"]}["rsm"]
    assert rsm["model"]["lights"] == ["punctual", "emissive", "environment"]
    assert rsm["model"]["indirect_lights"] == rsm["model"]["lights"] and rsm["tolerance_indirect"] > 0
    assert rsm["is_reference"] is False and rsm["hazard_codes"] == ""
    size = next(p for p in rsm["parameters"] if p["key"] == "rsm_size")
    assert all(p["what"] for t in reply["techniques"] for p in t["parameters"]) and size.pop("what")
    assert size == {"key": "rsm_size", "minimum": 8, "maximum": 4096, "standard": "256",
                    "choices": [], "whole": True}
    status, headers, binary = shared.request("GET", "/v1/techniques",
                                             headers={"Accept": "application/x-protobuf"})
    message = bounced_pb2.TechniquesReply.FromString(binary)
    assert status == 200 and len(message.techniques) == len(reply["techniques"])
    assert shared.request("POST", "/v1/techniques", b"{}",
                          {"Content-Type": "application/json"})[0] == 405


def test_options(shared):
    """Each is a field of the schema, and a query takes it by its name and by its earlier one."""
    status, reply = shared.json("GET", "/v1/options")
    assert status == 200
    options = {option["name"]: option for option in reply["options"]}
    assert set(options) == set(bounced_pb2.FrameRequest.DESCRIPTOR.fields_by_name)
    assert options["aa"] == {"name": "aa", "form": "N", "takes": "a whole number from 1 to 4096", "words": [],
                             "standard": "1; by `bounce` 16 to PNG and JPEG", "help": "sub-frames averaged",
                             "minimum": 1, "maximum": 4096}
    assert options["tonemap"]["words"] == ["neutral", "agx", "linear"]
    scene = shared.add_scene()
    values = {"size": "8x8", "camera": "0", "pose": "0,0,3,0,0,0", "technique": "reference", "parameters": "spp=2",
              "layers": "albedo", "exposure": "1", "encoding": "png", "region": "0,0,8,8"}
    for name, option in options.items():
        value = values.get(name) or (option["words"][:1] or [f"{option.get('minimum', 1):g}"])[0]
        more = "" if name == "size" else "&size=8x8"
        more += "&technique=reference" if name in ("region", "parameters") else ""
        for said in filter(None, (name, option.get("alias"))):
            if name == "encoding":
                continue  # the path says it
            status, text = shared.request("GET", f"/v1/scenes/{scene}/frame.exr?{said}={value}{more}")[::2]
            assert status == 200, (said, text[:200])


@pytest.mark.parametrize("extension,magic", [("png", b"\x89PNG"), ("jpg", b"\xff\xd8\xff"),
                                             ("exr", b"\x76\x2f\x31\x01")])
def test_frame(shared, extension, magic):
    scene = shared.add_scene()
    path = f"/v1/scenes/{scene}/frame.{extension}?size=32x24&aa=1&exposure=1.5&tonemap=agx"
    status, headers, image = shared.request("GET", path)
    assert status == 200 and image.startswith(magic), image[:200]
    names = [entry.split(";")[0].strip() for entry in headers["Server-Timing"].split(",")]
    assert "gbuffer" in names and names[-1] == "total"
    assert headers["Bounced-Scene"].startswith("sha256:") and headers["Bounced-Device"]
    assert shared.request("GET", path)[2] == image  # the same bytes again


def test_report_and_plan(shared):
    scene = shared.add_scene()
    status, report = shared.json("GET", f"/v1/scenes/{scene}/frame.json?size=16x8&seed=7")
    assert status == 200 and report["size"] == [16, 8] and report["seed"] == 7
    assert report["stopped"] == "complete" and "total" in report["time_ms"]
    status, headers, text = shared.request("GET", f"/v1/scenes/{scene}/frame.png?size=16x8&plan=1")
    assert status == 200 and headers["Content-Type"] == "application/json"
    assert {entry["state"] for entry in json.loads(text)["passes"]} <= {"planned", "reused"}


def test_scene_with_files_beside_it(shared):
    main, side = (SCENES / "bare.gltf").read_bytes(), (SCENES / "bare.bin").read_bytes()
    body = {"blob": shared.put_blob(main), "files": {"bare.bin": shared.put_blob(side)}}
    status, scene = shared.json("POST", "/v1/scenes", body)
    assert status == 201, scene
    del body["files"]
    status, error = shared.json("POST", "/v1/scenes", body)
    assert status == 400 and error["code"] == "bad_input"


def multipart(parts, boundary="xyz"):
    body = b"".join(b"--%b\r\nContent-Disposition: form-data; name=\"%b\"; filename=\"f\"\r\n\r\n%b\r\n"
                    % (boundary.encode(), name.encode(), data) for name, data in parts)
    return body + b"--" + boundary.encode() + b"--\r\n"


def test_one_shot_render(shared):
    headers = {"Content-Type": "model/gltf-binary"}
    status, got, image = shared.request("POST", "/v1/render?size=16x16&encoding=exr", GLB, headers)
    assert status == 200 and image.startswith(b"\x76\x2f\x31\x01")
    assert got["Content-Type"] == "image/x-exr"
    headers = {"Content-Type": "multipart/form-data; boundary=xyz", "Bounced-Client": "test"}
    body = multipart([("bare.bin", (SCENES / "bare.bin").read_bytes()),
                      ("scene", (SCENES / "bare.gltf").read_bytes())])
    status, _, image = shared.request("POST", "/v1/render?size=16x16", body, headers)
    assert status == 200 and image.startswith(b"\x89PNG"), image[:200]
    assert shared.json("GET", "/v1/stats")[1]["jobs_running"] == 0
    assert not [name for name in shared.data.joinpath("blobs").iterdir()
                if name.name == blob_name(body)[7:]]


@pytest.mark.parametrize("body", [
    b"", b"--xyz", b"--xyz--", b"--xyz\r\n", multipart([]), multipart([("a", b"1")]),
    multipart([("scene", b"{}"), ("scene", b"{}")]), multipart([("scene", GLB)])[:-8],
    multipart([("scene", b"")]), multipart([("", GLB)]), multipart([("scene", GLB)], "other"),
])
def test_multipart_nonsense(shared, body):
    headers = {"Content-Type": "multipart/form-data; boundary=xyz", "Bounced-Client": "test"}
    status, _, text = shared.request("POST", "/v1/render?size=16x16", body, headers)
    assert status == 400 and json.loads(text)["code"] in ("bad_input", "usage"), text
    assert shared.healthy()


def test_protobuf_both_ways(shared):
    blob = shared.put_blob(GLB)
    add = bounced_pb2.SceneAdd(blob=blob, name="pb").SerializeToString()
    status, headers, text = shared.request("POST", "/v1/scenes", add, {
        "Content-Type": "application/x-protobuf", "Accept": "application/x-protobuf"})
    assert status == 201 and headers["Content-Type"] == "application/x-protobuf"
    assert bounced_pb2.Scene.FromString(text).name == "pb"
    status, _, _ = shared.request("POST", "/v1/scenes", b"\xff\xff\xff",
                                  {"Content-Type": "application/x-protobuf"})
    assert status == 400


@pytest.mark.parametrize("query,field", [
    ("size=0x4", "size"), ("size=12", "size"), ("size=4x4x4", "size"), ("size=-4x4", "size"),
    ("aa=x", "aa"), ("aa=", "aa"), ("seed=18446744073709551616", "seed"), ("plan=yes", "plan_only"), ("plan_only=2", "plan_only"), ("pose=1,2,3", "pose"), ("pose=0,0,0,0,0,-1,0", "pose.yfov"), ("check=15", "check"), ("target_error=0", "target_error"), ("target_error=3:truth", "against"), ("exr_half=yes", "exr_half"), ("fresh=yes", "fresh"),
    ("exposure=bright", "exposure"), ("tonemap=vivid", "tonemap"), ("layers=beautiful", "layers"), ("layers=direct,normal", "layers"),
    ("set=vpls", "parameters"), ("parameters==1", "parameters"), ("aa=4097", "aa"), ("jpeg_quality=0", "jpeg_quality"), ("sise=4x4", "sise"), ("encoding=exr", "encoding"), ("quality=101", "jpeg_quality"),
    ("region=1,2,3", "region"), ("region=1,2,3,4,5", "region"), ("region=a,0,1,1", "region"),
    ("region=0,0,0,1", "region"), ("layers=half", "layers"),
    ("camera=%zz", "query"), ("camera=a%00b", "query"), ("camera", "query"),
    ("camera=" + "x" * 64, "camera"), ("set=" + "k" * 40 + "=1", "parameters"),
])
def test_bad_queries_name_their_field(shared, query, field):
    scene = shared.add_scene()
    status, error = shared.json("GET", f"/v1/scenes/{scene}/frame.png?{query}")
    assert status in (400, 413), error
    assert error["details"]["field"] == field and error["message"]


@pytest.mark.parametrize("method,path,status", [
    ("GET", "/index.html", 404), ("POST", "/", 405), ("GET", "/v1", 404), ("GET", "/v1/scenes/", 404), ("GET", "/v2/scenes", 404),
    ("GET", "/v1/scenes/none", 404), ("GET", "/v1/scenes/x/frame.bmp", 404),
    ("GET", "/v1/scenes/none/frame.png", 404), ("GET", "/v1/scenes/x/edits", 405),
    ("GET", "/v1/scenes/x/stream.mjpeg", 404), ("GET", "/" + "a" * 300, 404),
    ("POST", "/healthz", 405), ("PATCH", "/v1/scenes", 405), ("OPTIONS", "/v1/scenes", 405),
    ("HEAD", "/v1/blobs/sha256:" + "0" * 64, 404), ("HEAD", "/v1/blobs/sha256:xyz", 400),
])
def test_wrong_paths_and_methods(shared, method, path, status):
    got, headers, text = shared.request(method, path)
    assert got == status
    assert headers["Content-Type"] == "application/json"
    if method != "HEAD":
        assert set(json.loads(text)) == {"code", "message", "details"}


def test_blob_with_the_wrong_hash(shared):
    path = "/v1/blobs/sha256:" + "0" * 64
    status, _, text = shared.request("PUT", path, b"hello", OCTETS)
    assert status == 400 and json.loads(text)["code"] == "bad_input"
    assert shared.request("HEAD", path)[0] == 404
    assert shared.put_blob(b"") == blob_name(b"")  # the empty one is a blob too


@pytest.mark.parametrize("body,code", [
    (b"", "bad_input"), (b"{", "bad_input"), (b"[]", "bad_input"), (b"{}", "usage"),
    (b'{"blob":7}', "bad_input"), (b'{"blob":"sha256:00"}', "usage"),
    (json.dumps({"blob": "sha256:" + "0" * 64}).encode(), "not_found"),
])
def test_bad_scene_requests(shared, body, code):
    status, error = shared.json("POST", "/v1/scenes", body)
    assert status in (400, 404) and error["code"] == code, error


# --- who may ask ---------------------------------------------------------------------------


@pytest.mark.parametrize("host,status", [
    ("127.0.0.1", 200), ("localhost:9", 200), ("LOCALHOST", 200), ("render.example", 200),
    ("evil.example", 403), ("127.0.0.1.evil.example", 403), ("localhost.evil", 403),
    ("localhost:80x", 403), ("", 403), ("[::1]", 403), ("127.0.0.1@evil", 403),
])
def test_host(start, host, status):
    daemon = start("--public-name", "render.example")
    assert daemon.request("GET", "/v1/scenes", headers={"Host": host})[0] == status


@pytest.mark.parametrize("origin,status", [
    ("http://127.0.0.1", 200), ("https://127.0.0.1", 200), ("http://evil.example", 403),
    ("null", 403), ("", 403), ("http://127.0.0.1.evil", 403), ("file://", 403),
])
def test_origin(shared, origin, status):
    got = shared.request("GET", "/v1/scenes", headers={"Host": "127.0.0.1", "Origin": origin})[0]
    assert got == status


@pytest.mark.parametrize("path", ["/v1/scenes", "/v1/render"])
@pytest.mark.parametrize("kind", ["", "text/plain", "application/x-www-form-urlencoded",
                                  "multipart/form-data; boundary=x", "application/jsonx"])
def test_content_types_of_simple_requests(shared, path, kind):
    status, headers, _ = shared.request("POST", path, b"{}", {"Content-Type": kind})
    assert status == 415
    assert not [name for name in headers if name.lower().startswith("access-control")]


TOKEN = "correct-horse-battery"


def test_tokens(start):
    daemon = start(token=TOKEN)
    assert daemon.json("GET", "/v1/scenes")[0] == 200
    for value in ("", "Bearer", "Bearer ", "Bearer wrong-wrong-wrong-", "Basic " + TOKEN,
                  "Bearer " + TOKEN + "x", "Bearer " + TOKEN[:-1]):
        status, headers, text = daemon.request("GET", "/v1/scenes",
                                               headers={"Authorization": value})
        assert status == 401 and json.loads(text)["code"] == "unauthorized"
        assert headers["WWW-Authenticate"] == "Bearer"
    assert daemon.request("GET", "/healthz", headers={"Authorization": ""})[0] == 200
    assert daemon.request("GET", "/metrics", headers={"Authorization": ""})[0] == 401


def test_keep_alive_carries_many_requests(shared):
    connection = http.client.HTTPConnection("127.0.0.1", shared.port, timeout=10)
    for _ in range(50):
        connection.request("GET", "/v1/scenes")
        assert connection.getresponse().read()
    first = connection.sock
    connection.request("GET", "/nope")
    assert connection.getresponse().read() and connection.sock is first
    connection.close()


def test_exr_layers(shared):
    scene = shared.add_scene()
    _, _, image = shared.request("GET", f"/v1/scenes/{scene}/frame.exr?size=8x8&layers=direct,depth")
    assert b"direct.R" in image and b"depth.Z" in image and b"indirect.R" not in image
    assert struct.unpack("<I", image[:4])[0] == 20000630


@pytest.mark.parametrize("method,path,field", [
    ("GET", "/healthz?x=1", "x"), ("GET", "/readyz?probe", "probe"), ("GET", "/metrics?name[]=a", "name[]"),
    ("GET", "/v1/devices?x=1", "x"), ("GET", "/v1/stats?x=1", "x"), ("GET", "/v1/techniques?name=rsm", "name"),
    ("GET", "/v1/scenes?prefix=a", "prefix"), ("POST", "/v1/scenes?name=a", "name"),
    ("GET", "/v1/scenes/{id}?objcts=1", "objcts"), ("DELETE", "/v1/scenes/{id}?force=1", "force"),
    ("GET", "/v1/scenes/{id}/frame.png?size=8x8&siez=9x9", "siez"),
    ("GET", "/v1/scenes/{id}/stream.mjpeg?size=8x8&framerate=1", "framerate"),
    ("GET", "/v1/scenes/{id}/events?after=1", "after"), ("GET", "/v1/events?x=1", "x"),
    ("GET", "/v1/scenes/{id}/log?befor=1", "befor"), ("GET", "/v1/scenes/{id}/export?format=glb", "format"),
    ("POST", "/v1/scenes/{id}/edits?dry_run=1", "dry_run"), ("POST", "/v1/scenes/{id}/undo?n=1", "n"),
    ("HEAD", "/v1/blobs/sha256:" + "0" * 64 + "?x=1", None), ("GET", "/v1/socket?token=x", "token"),
    ("POST", "/v1/render?sizes=8x8", "sizes"),
])
def test_a_name_that_is_not_there_is_refused(shared, method, path, field):
    """In a query of every path; `frame.png?siez=` gave another picture than was meant."""
    scene = shared.add_scene()
    kind = {"Content-Type": "application/json" if "render" not in path else "model/gltf-binary"}
    body = None if method in ("GET", "HEAD") else b"{}" if "render" not in path else GLB
    status, _, text = shared.request(method, path.replace("{id}", scene), body, kind)
    assert status == 400, text
    if field:
        assert json.loads(text)["details"]["field"] == field, text
    assert shared.json("GET", "/v1/scenes/" + scene)[1]["revision"] == 1


def test_a_name_that_is_not_there_in_a_body(shared):
    blob = shared.put_blob(GLB)
    status, error = shared.json("POST", "/v1/scenes", {"blob": blob, "nmae": "x"})
    assert (status, error["details"]["field"]) == (400, "nmae") and 'mean "name"' in error["message"]
    status, error = shared.json("POST", "/v1/session", {"token": "x"})
    assert (status, error["details"]["field"]) == (400, "token"), error
    status, error = shared.json("POST", "/v1/scenes", {"blob": blob, "environment": {"radience": [1, 1, 1]}})
    assert (status, error["details"]["field"]) == (400, "environment.radience"), error


def test_a_misspelt_option_is_told_which_was_meant(shared):
    scene = shared.add_scene()
    error = shared.json("GET", f"/v1/scenes/{scene}/frame.png?siez=8x8")[1]
    assert error["message"] == 'there is no option "siez"; did you mean "size"?'
