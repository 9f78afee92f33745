"""Technique point_projection: a function of the scene, the view, the parameters and the seed; what its light rests on."""
import bounced
import numpy
import pytest
from conftest import SCENES
from glass_scenes import LIGHTS, add, walls

SIDE = (32, 32)
BOARD = [(-.15, 0, -.15), (-.15, 0, .15), (.15, 0, .15), (.15, 0, -.15)]


@pytest.fixture(scope="module")
def client():
    with bounced.private() as client:
        yield client


@pytest.fixture(scope="module")
def scene(client):
    return client.scenes.add(SCENES / "cornell.glb")


def render(scene, **parameters):
    frame = scene.render(size=SIDE, technique="point_projection", layers=["indirect"], fresh="all",
                         parameters={"points": 16384, **parameters})
    return frame


def light(frame):
    return frame.layers["indirect"][..., :3]


def states(frame):
    return {entry["name"]: entry["state"] for entry in frame.report["passes"]}


def test_the_same_bytes_twice_and_others_by_seed(scene):
    first, second = render(scene), render(scene)
    assert light(first).tobytes() == light(second).tobytes()
    other = scene.render(size=SIDE, technique="point_projection", layers=["indirect"], fresh="all", seed=1,
                         parameters={"points": 16384})
    assert light(other).tobytes() != light(first).tobytes()
    assert abs(light(other).mean() / light(first).mean() - 1) < 0.02


def test_reports_tell_of_rays_that_light_points(scene):
    """One to a lamp from each, one down on each, and cells' 64."""
    few, many = (render(scene, points=points).report["counts"]["rays"] for points in (4096, 16384))
    assert few > 4096 and many - few > 12288


def test_fewer_reflections_are_darker(scene):
    means = [light(render(scene, indirect_bounces=count)).mean() for count in (1, 2, 64)]
    assert means[0] < 0.75 * means[1] and means[1] < means[2]


def test_importance_is_nearer_to_all_points_than_chance(scene):
    settings = {"finest": 1, "coarsest": 64, "depth_threshold": 0, "normal_threshold": 0, "indirect_bounces": 1, "map_rays": 0}
    every = light(render(scene, projection="all", **settings))
    off = {by: numpy.sqrt(((light(render(scene, projection=by, exploit=512, clusters=128, **settings)) - every) ** 2).mean())
           for by in ("importance", "uniform")}
    assert off["importance"] < 0.7 * off["uniform"]


def test_rays_bring_what_a_poor_map_misses(client, tmp_path):
    scene = add(client, tmp_path, walls(), light=LIGHTS[0], at=(.6, .5, .1))

    def tiles(technique, **parameters):
        frame = scene.render(size=(32, 32), technique=technique, layers=["indirect"], fresh="all", parameters=parameters,
                             pose=bounced.Pose((0, 0, .95), (.3, 0, -1), yfov=1.2))
        return light(frame).mean(2).reshape(4, 8, 4, 8).mean((1, 3))

    truth = tiles("reference", spp=192)
    off = [abs(tiles("point_projection", points=4096, exploit=64, explore=1, clusters=64, microbuffer=16, map_rays=rays) / truth - 1).mean()
           for rays in (0, 64)]
    assert off[1] < .5 * off[0]


def test_a_filter_takes_noise_and_leaves_the_mean(scene):
    def noise_and_mean(noise_filter):
        frames = [light(scene.render(size=(64, 64), technique="point_projection", layers=["indirect"], seed=seed,
                                     parameters={"points": 16384, "exploit": 256, "finest": 1, "coarsest": 64,
                                                 "noise_filter": noise_filter})).mean(axis=-1) for seed in range(4)]
        return numpy.median(numpy.std(frames, axis=0)), numpy.mean(frames)
    (noisy, mean), (smooth, smooth_mean) = noise_and_mean("off"), noise_and_mean("on")
    assert smooth < 0.9 * noisy
    assert abs(smooth_mean / mean - 1) < 0.01


def test_blocks_are_split_where_light_changes(scene):
    """Where a box stands on a floor the floor's depth and normal are even, and its light is not."""

    def told(**parameters):
        frame = scene.render(size=(96, 96), technique="point_projection", layers=["indirect"], fresh="all",
                             parameters={"points": 65536, "finest": 1, **parameters})
        return light(frame).astype(float), frame.report["counts"]["fragments"]

    every, pixels = told(depth_threshold=0, normal_threshold=0)
    (whole, few), (split, more) = told(light_threshold="inf"), told(light_threshold=.1)
    assert few < more < pixels
    assert ((split - every) ** 2).mean() < .95 * ((whole - every) ** 2).mean()


def test_points_are_taken_over_from_another_view(scene):
    pose = {"layers": ["indirect"], "technique": "point_projection", "parameters": {"points": 8192}}
    scene.render(size=SIDE, fresh="all", **pose)
    moved = scene.render(size=(24, 24), **pose)
    assert states(moved)["points"] == "reused" and states(moved)["project"] == "ran"


def test_a_picture_changes_little_where_something_moves_a_little(client, tmp_path):
    """A board in a room goes a hundredth of its width on: far less than another seed's picture is another."""
    scene = add(client, tmp_path, walls(), light=LIGHTS[0], at=(.2, .5, .1))
    with scene.edit() as edit:
        mesh = edit.add_mesh(bounced.Primitive(BOARD, [[0, 1, 2], [0, 2, 3]]))
        node = edit.add_node(mesh=mesh, translation=(.2, -.6, 0))

    def shown(at, seed=0):
        with scene.edit() as edit:
            edit.set_transform(node, translation=(at, -.6, 0))
        frame = scene.render(size=(48, 48), technique="point_projection", layers=["indirect"], fresh="all", seed=seed,
                             parameters={"points": 65536, "indirect_bounces": 1}, pose=bounced.Pose((0, 0, .95), (0, 0, -1), yfov=1.4))
        return light(frame).astype(float)

    first, moved, other = shown(.2), shown(.203), shown(.2, seed=1)
    part = numpy.median(abs(moved - first)) / numpy.median(abs(other - first))  # at edges light is another
    assert part < .25


def test_as_the_paper_has_it(scene):
    paper, own = light(render(scene, paper_mode=1)), light(render(scene))
    assert 0.5 < paper.mean() / own.mean() < 1.5
    assert paper.tobytes() != own.tobytes()


@pytest.mark.parametrize("height", [.001, .01])
def test_a_lamp_nearer_to_a_wall_than_points_are_to_each_other(client, tmp_path, height):
    """All of its light falls somewhere: not on one point, or on none, as they happen to lie."""
    scene = add(client, tmp_path, walls(), light=LIGHTS[0], at=(.2, -1 + height, .1))

    def mean(technique, **parameters):
        frame = scene.render(size=(32, 32), technique=technique, layers=["indirect"], parameters=parameters,
                             pose=bounced.Pose((0, 0, .95), (0, 0, -1), yfov=1.4))
        return float(light(frame).mean())

    assert mean("point_projection", points=16384) == pytest.approx(mean("reference", spp=512), rel=.08)


@pytest.mark.parametrize("at", [(-.5, .4, .1), (-.01, -.99, .1)], ids=["amid", "in the corner"])
def test_nothing_passes_a_wall_without_thickness(client, tmp_path, at):
    """Points of the floor beside it stand for no place on its other side, nor a lamp's light for them."""
    sheet = (numpy.float32([(0, y, z) for y, z in ((-1, -1), (-1, 1), (1, 1), (1, -1))]), numpy.float32([(1, 0, 0)] * 4),
             numpy.uint32([(0, 1, 2), (0, 2, 3)]))
    scene = add(client, tmp_path, [*walls(), (sheet, walls()[0][1])], light=LIGHTS[0], at=at)

    def most(x):
        frame = scene.render(size=(48, 48), technique="point_projection", layers=["indirect"], fresh="all", parameters={"points": 4096},
                             pose=bounced.Pose((x, 0, .95), (-x, 0, -1), yfov=1.4))
        return light(frame).max()

    assert most(-.5) > 0
    assert most(.5) == 0


@pytest.mark.parametrize("parameter, value", [("points", 1), ("clusters", 2000), ("explore", 0), ("microbuffer", 33),
                                              ("projection", "none"), ("exploit", 0), ("map_rays", 3), ("map_rays", 2048)])
def test_what_is_out_of_range_is_refused(scene, parameter, value):
    with pytest.raises(bounced.Error) as refused:
        render(scene, **{parameter: value})
    assert parameter in str(refused.value)
