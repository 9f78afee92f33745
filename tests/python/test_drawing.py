"""What cameras and lights see, drawn or found by rays, with the real renderer: pictures agree but at edges, counts of
triangles and samples decide, and nothing else does."""
import sys

import bounced
import numpy
import pytest
from conftest import SCENES

sys.path.insert(0, str(SCENES.parents[1] / "clients"))
from harness import gltf, shapes  # noqa: E402

SIZE = (96, 64)
LAYERS = ["direct", "albedo", "normal", "depth"]
RAYS = {"indirect_visibility": "rays", "rays": 9}
TECHNIQUES = (("direct", {}), ("rsm", {}), ("multires_gather", {}), ("isr", {}), ("hisr", RAYS))
SIDE = 370  # squares of the floor: 273,800 triangles


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


@pytest.fixture(scope="module")
def scene(client):
    return client.scenes.add(SCENES / "two_lights.glb")


@pytest.fixture(scope="module")
def fine_scene(client):
    """Waves on a floor, of more triangles than are drawn without asking how many samples there are."""
    along = numpy.linspace(-1, 1, SIDE + 1)
    x, z = numpy.meshgrid(along, along)
    places = numpy.stack([x, .05 * numpy.sin(9 * x) * numpy.cos(7 * z), z], -1).reshape(-1, 3)
    first = (numpy.arange(SIDE)[:, None] * (SIDE + 1) + numpy.arange(SIDE)).ravel()
    below = first + SIDE + 1
    triangles = numpy.stack([first, below, first + 1, first + 1, below, below + 1], -1).reshape(-1, 3)
    scene = client.scenes.add(SCENES / "two_lights.glb")
    with scene.edit() as edit:
        edit.add_node(mesh=edit.add_mesh(bounced.Primitive(places, triangles)))
    return scene


def render(scene, drawing=None, technique="direct", size=SIZE, layers=LAYERS, **asked):
    how = {name: asked.pop(name) for name in ("fresh", "aa", "plan_only") if name in asked}
    parameters = {**({"drawing": drawing} if drawing else {}), **asked}
    return scene.render(size=size, technique=technique, layers=layers, parameters=parameters, **how)


def pixels(frame):
    return b"".join(frame.layers[name].tobytes() for name in LAYERS)


def traced(frame):
    return {o["pass"] for o in frame.report["omitted"] if o["reason"].startswith("drawing triangles")}


def states(frame):
    return {p["name"]: p["state"] for p in frame.report["passes"]}


@pytest.mark.parametrize("technique,asked", TECHNIQUES)
@pytest.mark.parametrize("aa", (1, 3))
def test_pictures_agree_but_at_edges(scene, technique, asked, aa):
    drawn, found = (render(scene, drawing, technique, aa=aa, layers=[*LAYERS, "indirect"], **asked)
                    for drawing in ("raster", "rays"))
    assert not traced(drawn) and "gbuffer" in traced(found)
    for layer in (*LAYERS, "indirect"):
        a, b = (frame.layers[layer].astype(float) for frame in (drawn, found))
        shape = a.shape[:2]
        covered = numpy.isfinite(a).reshape(*shape, -1).all(-1) & numpy.isfinite(b).reshape(*shape, -1).all(-1)
        a, b = a[covered], b[covered]
        scale = numpy.abs(a).mean()
        differ = numpy.abs(a - b).reshape(len(a), -1).max(-1) > 2e-3 * scale
        assert differ.mean() < (.03 if layer == "indirect" else .01), layer
        if layer == "indirect":  # a pixel at an edge is of a block, and asks for others
            assert b.mean() == pytest.approx(a.mean(), rel=.01)


def test_bytes_follow_from_the_request_alone(client, scene):
    first = {drawing: pixels(render(scene, drawing)) for drawing in ("raster", "rays")}
    assert first["raster"] != first["rays"]
    for drawing in ("rays", "raster", "rays"):
        assert pixels(render(scene, drawing)) == first[drawing]
        assert pixels(render(scene, drawing, fresh="all")) == first[drawing]
    assert pixels(render(scene)) == first["raster"]  # the structure is there, and nobody but it asked for rays
    with bounced.private() as another:
        alone = another.scenes.add(SCENES / "two_lights.glb")
        assert pixels(render(alone, "rays")) == first["rays"]


def test_counts_decide(client, fine_scene):
    if not render(fine_scene).report["device"]["software"]:
        pytest.skip("hardware draws faster than the processor traces")
    few, many = (64, 48), (640, 480)  # samples, beside 273,800 triangles
    for size in (few, many):
        ways = {drawing: render(fine_scene, drawing, "multires_gather", size, shadow_size=128, **RAYS)
                for drawing in ("raster", "rays", "auto")}
        assert "gbuffer" in traced(ways["rays"]) and not traced(ways["raster"])
        assert ("gbuffer" in traced(ways["auto"])) == (size == few)
        assert "shadow_map" in traced(ways["auto"])
        like = "rays" if size == few else "raster"
        assert ways["auto"].layers["depth"].tobytes() == ways[like].layers["depth"].tobytes()
        assert ways["raster"].layers["depth"].tobytes() != ways["rays"].layers["depth"].tobytes()
    assert not traced(render(fine_scene, technique="rsm", size=few, shadow_size=1024, **RAYS)) & {"shadow_map"}
    assert not traced(render(fine_scene, size=few))  # who has no other rays builds nothing for them
    assert not traced(render(fine_scene, technique="rsm", size=few, paper_mode=1, **RAYS))


def test_what_moves_is_found_again_and_nothing_else(client):
    scene = client.scenes.add(SCENES / "two_lights.glb")
    look = {"drawing": "rays", "technique": "multires_gather"}
    objects = scene.objects()
    node = {kind: next(o["id"] for o in objects if o["kind"] == "node" and o["node"][kind] == 0) for kind in ("light", "camera")}
    render(scene, **look)
    with scene.edit() as edit:
        edit.set_transform(node["light"], translation=(.2, 1.1, .3))
    after_light = states(render(scene, **look))
    assert all(after_light[name] == "reused" for name in ("bvh", "gbuffer", "discontinuity"))
    assert all(after_light[name] == "ran" for name in ("shadow_map", "rsm", "direct"))
    with scene.edit() as edit:
        edit.set_transform(node["camera"], translation=(0, 1, 3))
    after_camera = states(render(scene, **look))
    assert all(after_camera[name] == "reused" for name in ("bvh", "shadow_map", "rsm"))
    assert after_camera["gbuffer"] == "ran"
    scene.remove()


def test_a_back_that_is_shown_from_now_on_is_found(client):
    """A wall before the camera that shows it its back: what rays pass by is a matter of materials, not of places alone."""
    scene = client.scenes.add(SCENES / "two_lights.glb")
    with scene.edit() as edit:
        sides = edit.add_material(double_sided=False)
        corners = numpy.array([[-3, 0, 0], [3, 0, 0], [0, 3, 0]], float) + [0, 0, 1.5]
        edit.add_node(mesh=edit.add_mesh(bounced.Primitive(corners, [[0, 2, 1]], material=sides)))
    look = {"drawing": "rays", "technique": "rsm"}
    hidden = render(scene, **look)
    material = max((o["id"] for o in scene.objects("material")))
    with scene.edit() as edit:
        edit.set_material(material, double_sided=True)
    shown = render(scene, **look)
    assert numpy.nanmean(shown.layers["depth"] < hidden.layers["depth"] - .1) > .1
    assert pixels(shown) == pixels(render(scene, **look, fresh="all"))
    scene.remove()


def bvh_ms(frame):
    return sum(p["ms"] for p in frame.report["passes"] if p["name"] == "bvh")


def test_a_structure_follows_what_moved(client, fine_scene):
    """Of some 270,000 triangles a few move, within the scene's bounds: what the rest is in is not built again. Both times are of one
    machine and one minute; they are a hundred apart."""
    built = bvh_ms(render(fine_scene, technique="rsm", fresh="all", **RAYS))
    node = next(o["id"] for o in fine_scene.objects("node") if o["name"] == "Metal")
    with fine_scene.edit() as edit:
        edit.set_transform(node, translation=(.01, .31, .8))
    frame = render(fine_scene, technique="rsm", **RAYS)
    assert states(frame)["bvh"] == "ran"
    assert 0 < bvh_ms(frame) < built / 3, (built, bvh_ms(frame))


def quarters(turn):
    """Four squares of four colours around the line of sight; their edges are those of the turn."""
    writer = gltf.Writer()
    for i, colour in enumerate(((1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0))):
        angle = turn + i * numpy.pi / 2
        u, v = numpy.array([[numpy.cos(angle), numpy.sin(angle), 0], [-numpy.sin(angle), numpy.cos(angle), 0]])
        positions, normals, indices, _ = shapes.quad(2 * (u + v), 2 * u, 2 * v)
        writer.node("quarter", mesh=writer.mesh("quarter", positions, normals, indices, writer.material(f"colour {i}", colour)))
    writer.light("lamp", "point", 10, position=(0, 0, 1.5))
    writer.camera("camera", (0, 0, 2), (0, 0, -1), yfov=1)
    return writer.glb()


@pytest.mark.parametrize("turn,size", [(0, (33, 33)), (0, (64, 33)), (0, (33, 64)), (45, (32, 32)), (45, (33, 33)),
                                       (45, (64, 48)), (0, (1025, 769)), (45, (1024, 768))])
def test_places_exactly_on_edges_show_the_same_surface_to_all(client, tmp_path, turn, size):
    file = tmp_path / "quarters.glb"
    file.write_bytes(quarters(numpy.radians(turn)))
    scene = client.scenes.add(file)
    drawn = render(scene, "raster", size=size, layers=["albedo"]).layers["albedo"]
    traced = render(scene, "rays", size=size, layers=["albedo"]).layers["albedo"]
    reference = scene.render(size=size, technique="reference", layers=["albedo"], parameters={"spp": 2}).layers["albedo"]
    for other in (traced, reference):
        assert numpy.abs(other - drawn).max() < .01
