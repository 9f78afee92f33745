"""A sky that is turned is the sky whose map was rolled: seen, lighting, and in the reference, which has code of its own."""
import bounced
import numpy
import pytest
from conftest import SCENES

WIDTH, HEIGHT = 16, 8
LOOK = {"size": (48, 36), "layers": ["direct", "emission"]}


@pytest.fixture(scope="module")
def daemon():
    with bounced.private() as daemon:
        yield daemon


def write_sky(path, values):
    """Radiance, as it is: no runs in so narrow a picture. Powers of two, which its bytes hold as they are, but for their middle."""
    head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (HEIGHT, WIDTH)
    texels = [bytes([128, 128, 128, 129 + int(value)]) for value in values.reshape(-1)]
    rows = [b"\2\2" + bytes([0, WIDTH]) + b"".join(
        bytes([WIDTH]) + bytes(t[plane] for t in texels[y * WIDTH:(y + 1) * WIDTH]) for plane in range(4)) for y in range(HEIGHT)]
    path.write_bytes(head + b"".join(rows))
    return path


@pytest.fixture(scope="module")
def skies(tmp_path_factory):
    folder = tmp_path_factory.mktemp("skies")
    values = numpy.random.default_rng(3).integers(0, 3, (HEIGHT, WIDTH))
    values[2, 3] = 6
    # Turned by a quarter to the left, what was to the right of the middle is in the middle.
    return {"straight": write_sky(folder / "a.hdr", values), "rolled": write_sky(folder / "b.hdr", numpy.roll(values, -WIDTH // 4, axis=1))}


def layers(daemon, technique, parameters, sky, turn=None):
    scene = daemon.scenes.add(SCENES / "cornell.glb", environment=bounced.Environment(map=sky))
    if turn:
        with scene.edit() as edit:
            edit.set_environment(rotation=turn)
    frame = scene.render(**LOOK, technique=technique, parameters=parameters)
    scene.remove()
    return {name: pixels.astype(float) for name, pixels in frame.layers.items()}


def off(one, other):
    return numpy.sqrt(((one - other) ** 2).mean()) / other.mean()


@pytest.mark.parametrize("technique,parameters", [("direct", {"light_rays": 256}), ("reference", {"spp": 256, "bounces": 0})])
def test_it_is_the_sky_whose_map_was_rolled(daemon, skies, technique, parameters):
    quarter = (0, 5, 0, 5)
    straight = layers(daemon, technique, parameters, skies["straight"])
    rolled = layers(daemon, technique, parameters, skies["rolled"])
    turned = layers(daemon, technique, parameters, skies["straight"], quarter)
    assert off(turned["emission"], rolled["emission"]) < 1e-5
    assert off(straight["emission"], rolled["emission"]) > .1
    assert off(turned["direct"], rolled["direct"]) < .05
    assert turned["direct"].mean() == pytest.approx(rolled["direct"].mean(), rel=.01)
    assert off(straight["direct"], rolled["direct"]) > .1


def test_upside_down(daemon, skies):
    """What was the zenith is below."""
    once = layers(daemon, "direct", {}, skies["straight"], (1, 0, 0, 0))
    twice = layers(daemon, "direct", {}, skies["straight"], (0, 0, 0, 1))
    straight = layers(daemon, "direct", {}, skies["straight"])
    assert off(once["emission"], straight["emission"]) > .1
    assert (twice["emission"] == straight["emission"]).all() and (twice["direct"] == straight["direct"]).all()
