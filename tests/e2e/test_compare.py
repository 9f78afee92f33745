"""bounce compare: figures against their definitions, exit codes, errors, the error map."""
import json
import struct
import zlib

import numpy
import pytest

import metrics_by_definition as definition
from conftest import SHARED
from harness import exr

WIDTH, HEIGHT = 48, 40


def scene():
    """Something with a highlight, an edge, a gradient and colours."""
    y, x = numpy.mgrid[0:HEIGHT, 0:WIDTH]
    light = 0.2 + 0.5 * numpy.exp(numpy.sin(x / 5) * numpy.cos(y / 4))
    light[x > 30] *= 0.15
    light[5:7, 8:10] = 40
    return light[..., None] * numpy.stack([x / WIDTH + 0.2, 0 * x + 0.6, 1 - y / HEIGHT], axis=-1)


def noisy(truth, sigma, seed):
    random = numpy.random.default_rng(seed)
    return (truth * (1 + sigma * random.standard_normal(truth.shape))).astype(numpy.float32)


def planes(image, layer=""):
    return {layer + c: image[..., i] for i, c in enumerate("RGB")}


def save(folder, name, channels, **strings):
    (folder / name).write_bytes(exr.write(channels, strings))


@pytest.fixture
def pictures(bounce):
    """ref.exr with halves, half1.exr and half2.exr without, image.exr 5 % too bright."""
    a, b = noisy(scene(), 0.05, 1), noisy(scene(), 0.05, 2)
    image = (scene() * 1.05).astype(numpy.float32)
    mean = ((a.astype(float) + b) / 2).astype(numpy.float32)
    save(bounce.folder, "ref.exr", {**planes(mean), **planes(a, "half_a."), **planes(b, "half_b."),
                                    **planes(mean, "direct.")}, filter="point", scene="sha256:1")
    save(bounce.folder, "half1.exr", planes(a))
    save(bounce.folder, "half2.exr", planes(b))
    save(bounce.folder, "image.exr", {**planes(image), "depth.Z": image[..., 0]}, filter="point",
         scene="sha256:1")
    bounce.a, bounce.b, bounce.image = a.astype(float), b.astype(float), image.astype(float)
    return bounce


def figures(result, code=0):
    assert result.returncode == code, result.stderr
    return json.loads(result.stdout)


SINGLE = 5e-6  # what filters in single precision keep


def assert_alike(got, want, relative=1e-7):
    for name, value in want.items():
        assert got[name]["value"] == pytest.approx(value, rel=relative, abs=1e-9), name


def test_every_figure_against_its_definition(pictures):
    got = figures(pictures("compare", "ref.exr", "image.exr", "--json"))
    a, b, image = pictures.a, pictures.b, pictures.image
    assert got["debiased"] == "reference" and got["size"] == [WIDTH, HEIGHT]
    assert_alike(got, definition.sums(a, b, image, image))
    mean, median = definition.hdr_flip((a + b) / 2, image)
    assert_alike(got, {"psnr": definition.psnr((a + b) / 2, image),
                       "ssim": definition.ssim((a + b) / 2, image),
                       "flip": definition.flip((a + b) / 2, image),
                       "hdr_flip": mean, "hdr_flip_median": median}, SINGLE)
    for figure in ("rel_rmse", "ssim", "flip", "p99"):
        assert got[figure]["low"] < got[figure]["value"] < got[figure]["high"]


def test_a_second_half_in_its_own_file_is_the_same(pictures):
    whole = figures(pictures("compare", "ref.exr", "image.exr", "--json"))
    apart = figures(pictures("compare", "half1.exr", "--half", "half2.exr", "image.exr", "--json"))
    del whole["reference"], apart["reference"]
    assert apart.pop("notes") == ["REFERENCE does not say its pixel filter"]
    assert whole.pop("notes") == [] and apart == whole


def test_a_reference_against_a_reference(pictures):
    truth = scene()
    i1, i2 = noisy(truth * 1.01, 0.1, 3), noisy(truth * 1.01, 0.1, 4)
    save(pictures.folder, "other.exr", {**planes((i1 + i2) / 2), **planes(i1, "half_a."),
                                        **planes(i2, "half_b.")})
    got = figures(pictures("compare", "ref.exr", "other.exr", "--json"))
    assert got["debiased"] == "both"
    assert_alike(got, definition.sums(pictures.a, pictures.b, i1.astype(float), i2.astype(float)))


def test_without_halves_it_says_so(pictures):
    got = figures(pictures("compare", "half1.exr", "image.exr", "--json"))
    assert got["debiased"] == "none" and got["noise_floor"]["value"] is None
    want = definition.sums(pictures.a, pictures.a, pictures.image, pictures.image)
    del want["noise_floor"], want["mape_floor"], want["smape_floor"]
    assert_alike(got, want)
    text = pictures("compare", "half1.exr", "image.exr").stdout.decode()
    assert "not debiased" in text and "noise_floor" not in text


def test_the_table_has_the_headline_first(pictures):
    result = pictures("compare", "ref.exr", "image.exr")
    lines = result.stdout.decode().splitlines()
    assert result.returncode == 0 and result.stderr == ""
    assert "48x40" in lines[0] and "tiles of 4x4" in lines[1]
    assert lines[2].split()[0] == "rel_rmse" and ".." in lines[2]
    assert len({line.index(line.split()[1]) + len(line.split()[1]) for line in lines[2:]}) == 1


def test_alike_is_alike(pictures):
    got = figures(pictures("compare", "image.exr", "image.exr", "--json", "--tolerance",
                           "rel_rmse=0", "--tolerance", "psnr=1000", "--tolerance", "flip=0"))
    assert got["psnr"]["value"] is None  # infinite
    assert got["ssim"]["value"] == 1 and got["missed"] == []


@pytest.mark.parametrize("tolerance,missed", [
    ("rel_rmse={v}", False), ("rel_rmse={under}", True), ("rel_rmse.high={v}", True),
    ("rel_rmse.high=9", False), ("ssim=0.5", False), ("ssim=0.9999", True),
    ("ssim.low={ssim}", True), ("signed_error=0.06", False), ("signed_error=0.04", True),
    ("nonfinite=0", False), ("max_rel=1", False)])
def test_tolerances(pictures, tolerance, missed):
    got = figures(pictures("compare", "ref.exr", "image.exr", "--json"))
    value = got["rel_rmse"]["value"]
    text = tolerance.format(v=value * 1.0001, under=value * 0.999, ssim=got["ssim"]["value"])
    result = pictures("compare", "ref.exr", "image.exr", "--tolerance", text)
    assert result.returncode == (1 if missed else 0), result.stderr
    assert (tolerance.split("=")[0] in result.stderr) == missed
    assert b"rel_rmse" in result.stdout
    got = figures(pictures("compare", "ref.exr", "image.exr", "--tolerance", text, "--json"),
                  1 if missed else 0)
    assert len(got["missed"]) == missed


def test_a_picture_too_dark_misses_signed_error_too(pictures):
    save(pictures.folder, "dark.exr", planes(0.9 * pictures.image))
    result = pictures("compare", "ref.exr", "dark.exr", "--tolerance", "signed_error=0.04")
    assert result.returncode == 1 and "signed_error is -0.0" in result.stderr


def test_pixels_that_are_no_numbers(pictures):
    image = pictures.image.copy()
    image[3, 4, 1], image[5, 6, 0] = numpy.nan, -numpy.inf
    save(pictures.folder, "holes.exr", planes(image), filter="point")
    got = figures(pictures("compare", "ref.exr", "holes.exr", "--json"))
    assert got["nonfinite"]["value"] == 2 and got["pixels"] == WIDTH * HEIGHT - 2
    keep = numpy.isfinite(image).all(axis=-1)
    want = definition.sums(*(side[keep] for side in (pictures.a, pictures.b, image, image)))
    assert_alike(got, {"rel_rmse": want["rel_rmse"], "mape": want["mape"], "p99": want["p99"]})
    result = pictures("compare", "ref.exr", "holes.exr", "--tolerance", "rel_rmse=9")
    assert result.returncode == 1 and "nonfinite is 2" in result.stderr
    assert pictures("compare", "ref.exr", "holes.exr", "--tolerance", "nonfinite=2").returncode == 0


def test_layers(pictures):
    image = {**planes(pictures.image), **planes(pictures.image * 2, "direct.")}
    save(pictures.folder, "both.exr", image, filter="point")
    got = figures(pictures("compare", "ref.exr", "both.exr", "--layer", "beauty", "--layer",
                           "direct", "--json"))
    assert list(got["layers"]) == ["beauty", "direct"]
    assert got["layers"]["direct"]["debiased"] == "none"
    assert got["layers"]["direct"]["signed_error"]["value"] == pytest.approx(1.1, abs=0.02)
    result = pictures("compare", "ref.exr", "both.exr", "--layer", "beauty", "--layer", "direct",
                      "--tolerance", "signed_error=0.5")
    assert result.returncode == 1 and "direct: signed_error" in result.stderr
    assert "beauty: " not in result.stderr


def test_layers_of_one_channel_have_no_perceptual_figures(pictures):
    save(pictures.folder, "deep.exr", {"depth.Z": pictures.image[..., 0]})
    got = figures(pictures("compare", "deep.exr", "image.exr", "--layer", "depth", "--json"))
    assert got["rel_rmse"]["value"] == 0 and got["flip"]["value"] is None
    result = pictures("compare", "deep.exr", "image.exr", "--layer", "depth", "--tolerance",
                      "flip=1")
    assert result.returncode == 2 and "depth has no flip" in result.stderr


def test_what_cannot_be_compared(pictures):
    half = pictures.image[::2]
    save(pictures.folder, "small.exr", planes(half))
    save(pictures.folder, "box.exr", planes(pictures.image), filter="box")
    bad = pictures.image.copy()
    bad[2, 3, 1] = numpy.nan
    save(pictures.folder, "nan.exr", planes(bad))
    save(pictures.folder, "grey.exr", {"Y": pictures.image[..., 0]})
    (pictures.folder / "broken.exr").write_bytes((pictures.folder / "ref.exr").read_bytes()[:900])
    (pictures.folder / "text.exr").write_text("no picture")
    (pictures.folder / "folder.exr").mkdir()
    cases = [
        (("ref.exr", "small.exr"), 1, ["48x40", "48x20", "sizes differ"]),
        (("half1.exr", "image.exr", "--half", "small.exr"), 1, ["48x40", "48x20"]),
        (("ref.exr", "box.exr"), 1, ["filter", "point", "box"]),
        (("ref.exr", "grey.exr"), 1, ["channels"]),
        (("ref.exr", "image.exr", "--layer", "direct"), 1, ["image.exr", "no layer direct"]),
        (("image.exr", "ref.exr", "--layer", "direct"), 1, ["image.exr", "no layer direct"]),
        (("ref.exr", "image.exr", "--layer", "indirect"), 4, ["no layer indirect"]),
        (("none.exr", "image.exr"), 3, ["none.exr"]),
        (("half1.exr", "--half", "none.exr", "image.exr"), 3, ["none.exr"]),
        (("ref.exr", "none.exr"), 4, ["none.exr"]),
        (("nan.exr", "image.exr"), 4, ["nan.exr", "NaN", "3,2"]),
        (("half1.exr", "--half", "nan.exr", "image.exr"), 4, ["NaN", "3,2"]),
        (("ref.exr", "broken.exr"), 4, ["broken.exr"]),
        (("text.exr", "image.exr"), 4, ["text.exr"]),
        (("ref.exr", "folder.exr"), 4, ["folder.exr"]),
        (("ref.exr", "image.exr", "--half", "half2.exr"), 2, ["two halves"]),
        (("half1.exr", "image.exr", "--half", "half1.exr"), 2, ["same file"]),
        (("ref.exr",), 2, ["REFERENCE IMAGE"]),
        (("ref.exr", "image.exr", "more.exr"), 2, ["more.exr"]),
        (("ref.exr", "image.exr", "--tolerance", "rmse=1"), 2, ["rmse", "rel_rmse", "hdr_flip"]),
        (("ref.exr", "image.exr", "--tolerance", "mean_image=1"), 2, ["mean_image"]),
        (("ref.exr", "image.exr", "--tolerance", "flip"), 2, ["NAME=VALUE"]),
        (("ref.exr", "image.exr", "--tolerance", "flip=much"), 2, ["much"]),
        (("ref.exr", "image.exr", "--tolerance", "flip.low=1"), 2, ["flip.high"]),
        (("ref.exr", "image.exr", "--tolerance", "max_rel.high=1"), 2, ["no interval"]),
        (("ref.exr", "image.exr", "--ppd", "1"), 2, ["ppd"]),
        (("ref.exr", "image.exr", "--ignore", "size"), 2, ["size"]),
        (("ref.exr", "image.exr", "--map", "map.jpg"), 2, ["map.jpg"]),
        (("ref.exr", "image.exr", "--map", "map.png", "--layer", "a", "--layer", "b"), 2, ["map"]),
        (("ref.exr", "image.exr", "--map", "nowhere/map.png"), 4, ["nowhere"]),
        (("ref.exr", "image.exr", "--fast"), 2, ["--fast"]),
    ]
    for words, code, texts in cases:
        result = pictures("compare", *words, "--quiet")
        assert result.returncode == code, (words, result.stderr)
        assert all(text in result.stderr for text in texts), (words, result.stderr)
        assert len(result.stderr.splitlines()) == 1 and b"rel_rmse" not in result.stdout
    error = figures(pictures("compare", "ref.exr", "small.exr", "--json"), 1)
    assert error["code"] == "differs" and error["details"]["field"] == "size"


def test_filters_and_scenes_that_differ(pictures):
    save(pictures.folder, "box.exr", planes(pictures.image), filter="box", scene="sha256:2")
    result = pictures("compare", "ref.exr", "box.exr", "--ignore", "filter")
    assert result.returncode == 0
    assert "note: pixel filters differ" in result.stderr and "note: scenes differ" in result.stderr
    assert pictures("compare", "ref.exr", "box.exr", "--ignore", "filter", "-q").stderr == ""


def test_noise_that_both_sides_share_is_noted(pictures):
    def note(halves, **strings):
        made = {"technique": "reference", "seed": "7"}
        save(pictures.folder, "a.exr", planes(pictures.a), **made)
        sides = {**planes(pictures.a, "half_a."), **planes(pictures.b, "half_b.")} if halves else {}
        save(pictures.folder, "b.exr", {**planes(pictures.a), **sides}, **{**made, **strings})
        return "seed" in pictures("compare", "a.exr", "b.exr").stderr

    assert note(False)
    assert not note(True) and not note(False, seed="8") and not note(False, technique="rsm")


def test_regions(pictures):
    """Outside its region a file is black, which is no picture of anything."""
    box, other = numpy.zeros((HEIGHT, WIDTH, 1)), numpy.zeros((HEIGHT, WIDTH, 1))
    box[10:30, 5:45], other[20:40, 0:20] = 1, 1
    save(pictures.folder, "part.exr", {**planes(pictures.a * box), **planes(
        pictures.a * box, "half_a."), **planes(pictures.b * box, "half_b.")}, region="5,10,40,20")
    save(pictures.folder, "other.exr", planes(pictures.image * other), region="0,20,20,20")
    save(pictures.folder, "third.exr", planes(pictures.image), region="10,0,38,15")
    for image, rows, columns in (("image.exr", slice(10, 30), slice(5, 45)),
                                 ("other.exr", slice(20, 30), slice(5, 20)),
                                 ("third.exr", slice(10, 15), slice(10, 45))):
        got = figures(pictures("compare", "part.exr", image, "--json", "--map", "map.png"))
        sides = (pictures.a, pictures.b, pictures.image, pictures.image)
        assert_alike(got, definition.sums(*(side[rows, columns] for side in sides)))
        assert got["at"] == [columns.start, rows.start]
        assert got["size"] == [columns.stop - columns.start, rows.stop - rows.start]
    assert "40x20 at 5,10" in pictures("compare", "part.exr", "image.exr").stdout.decode()


def test_regions_that_make_no_sense(pictures):
    for region, code, text in (("0,0,5,5", 1, "no pixel in common"), ("0,0,0,0", 1, "no pixel"),
                               ("1,1,48,1", 4, "1,1,48,1"), ("1,1,1", 4, "WIDTH"),
                               ("4294967295,0,2,1", 4, "48x40"), ("all", 4, "all")):
        save(pictures.folder, "a.exr", planes(pictures.a), region="5,10,40,20")
        save(pictures.folder, "b.exr", planes(pictures.a), region=region)
        result = pictures("compare", "a.exr", "b.exr", "--quiet")
        assert result.returncode == code and text in result.stderr, (region, result.stderr)


def test_the_same_words_give_the_same_bytes(pictures):
    words = ("compare", "ref.exr", "image.exr", "--json", "--map", "map.png")
    first = pictures(*words).stdout
    picture = (pictures.folder / "map.png").read_bytes()
    assert pictures(*words).stdout == first
    assert (pictures.folder / "map.png").read_bytes() == picture


def rows_of_png(data):
    """Height x width x 3 of an 8-bit RGB file."""
    width, height = struct.unpack_from(">II", data, 16)
    at, packed = 8, b""
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        packed += data[at + 8:at + 8 + size] if kind == b"IDAT" else b""
        at += 12 + size
    raw = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).reshape(height, 1 + 3 * width)
    out = numpy.zeros((height, width + 1, 3), numpy.int64)  # a column of zeroes at the left
    above = numpy.zeros((width + 1, 3), numpy.int64)
    for y, row in enumerate(raw):
        for x, sample in enumerate(row[1:].reshape(width, 3).astype(numpy.int64), 1):
            left, up, corner = out[y, x - 1], above[x], above[x - 1]
            nearest = numpy.argmin(abs(numpy.stack([up - corner, left - corner,
                                                    left + up - 2 * corner])), axis=0)
            paeth = numpy.choose(nearest, [left, up, corner])
            out[y, x] = (sample + [0 * up, left, up, (left + up) // 2, paeth][row[0]]) % 256
        above = out[y]
    return out[:, 1:]


def test_the_map(pictures):
    image = pictures.a.copy()
    mean = image.mean()
    for column, error in enumerate((0, 1e-3, 1e-2, 1e-1, 1, 10, 1e5)):
        image[20, column] += error * mean
    image[30, 10] = numpy.nan
    save(pictures.folder, "errors.exr", planes(image))
    assert pictures("compare", "half1.exr", "errors.exr", "--map", "map.png").returncode == 0
    got = rows_of_png((pictures.folder / "map.png").read_bytes())
    assert got.shape[0] >= HEIGHT and got.shape[1] > WIDTH
    light = got[20, :7].sum(axis=-1)
    assert (numpy.diff(light[1:6]) > 30).all(), light
    assert abs(light[0] - light[1]) < 8 and light[5] == light[6]
    assert tuple(got[30, 10]) == (0, 255, 0)
    assert (got[:HEIGHT, :WIDTH].sum(axis=-1) > 60).sum() == 6  # and nowhere else


def test_the_production_references(bounce):
    reference = [SHARED / f"references/sponza_dabrovic.lambert.{half}.exr" for half in (1, 2)]
    if not reference[0].exists():
        pytest.skip(f"{reference[0]} is not here")
    # The first half against both: I is A, so that (I - A) is 0, whatever B.
    got = figures(bounce("compare", reference[0], "--half", reference[1], reference[0],
                         "--layer", "indirect", "--json"))
    assert got["rel_rmse"]["value"] == 0
    assert got["mean_image"]["value"] == pytest.approx(0.084546, rel=1e-4)
    assert 0 < got["noise_floor"]["value"] < 0.2


def test_help_lists_every_figure(pictures):
    got = figures(pictures("compare", "ref.exr", "image.exr", "--json"))
    names = {name for name, value in got.items() if isinstance(value, dict)}
    result = pictures("compare", "--help")
    assert result.returncode == 0 and len(names) == 23
    assert names <= set(result.stdout.decode().split())


# --- what a display shows ---

def coded(linear):
    """sRGB codes, 0 to 1."""
    linear = numpy.clip(linear, 0, 1)
    return numpy.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def decoded(codes):
    return numpy.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def png(image, bits, **texts):
    """RGB of 8 or 16 bits, and the codes that it holds, 0 to 1."""
    most = 2 ** bits - 1
    codes = numpy.round(coded(image) * most).astype(">u2" if bits == 16 else "u1")
    rows = b"".join(b"\0" + row.tobytes() for row in codes)

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", image.shape[1], image.shape[0], bits, 2, 0, 0, 0))
    said = b"".join(chunk(b"tEXt", key.encode() + b"\0" + text.encode()) for key, text in texts.items())
    return (b"\x89PNG\r\n\x1a\n" + head + said + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""),
            codes.astype(float) / most)


@pytest.mark.parametrize("bits", [8, 16])
def test_pngs_are_compared_as_a_display_shows_them(bounce, bits):
    truth, image = numpy.clip(scene(), 0, 0.9), numpy.clip(scene() * 1.03, 0, 1)
    codes = []
    for name, picture in (("ref.png", truth), ("image.png", image)):
        data, code = png(picture, bits)
        (bounce.folder / name).write_bytes(data)
        codes.append(code)
    got = figures(bounce("compare", "ref.png", "image.png", "--json"))
    a, b = (decoded(code) for code in codes)
    assert got["rel_rmse"]["value"] == pytest.approx(((b - a) ** 2).mean() ** 0.5 / a.mean(), rel=1e-5)
    assert got["mean_image"]["value"] == pytest.approx(b.mean(), rel=1e-5)
    # The codes themselves are what psnr is of: nothing exposes or bends them once more.
    assert got["psnr"]["value"] == pytest.approx(-10 * numpy.log10(((codes[1] - codes[0]) ** 2).mean()), rel=1e-4)
    assert "hdr_flip" not in got or got["hdr_flip"]["value"] is None
    assert [note.split(",")[0] for note in got["notes"]] == [
        "REFERENCE is decoded from sRGB to linear", "IMAGE is decoded from sRGB to linear"]
    bounce("compare", "ref.png", "image.png", "--tolerance", "rel_rmse=0.5", "--map", "map.png")
    assert (bounce.folder / "map.png").read_bytes().startswith(b"\x89PNG")


def test_sixteen_bits_are_kept(bounce):
    """A difference far below a step of 8 bits is found."""
    truth = numpy.full((HEIGHT, WIDTH, 3), 0.5)
    for name, picture in (("ref.png", truth), ("image.png", truth * 1.0005)):
        (bounce.folder / name).write_bytes(png(picture, 16)[0])
    got = figures(bounce("compare", "ref.png", "image.png", "--json"))
    assert got["rel_rmse"]["value"] == pytest.approx(5e-4, rel=0.1)


def test_an_exr_beside_a_png_is_shown_as_that_says(bounce):
    image = scene().astype(numpy.float32)
    save(bounce.folder, "ref.exr", {**planes(image), **planes(image * 2, "half_a."), **planes(image * 0, "half_b.")})
    shown = numpy.clip(image.astype(float) * 2 ** -1.5, 0, 1)
    data, _ = png(shown, 16, exposure_stops="-1.5", tonemap="linear")
    (bounce.folder / "image.png").write_bytes(data)
    got = figures(bounce("compare", "ref.exr", "image.png", "--json"))
    assert got["rel_rmse"]["value"] < 1e-4 and got["debiased"] == "none"
    assert got["notes"][0] == "REFERENCE holds light: it is shown with -1.5 stops, curve linear, as the other side was"
    # Without its word: 0 stops and no curve, and a note that says so.
    (bounce.folder / "mute.png").write_bytes(png(shown, 16)[0])
    got = figures(bounce("compare", "ref.exr", "mute.png", "--json"))
    assert got["rel_rmse"]["value"] > 0.3
    assert "the other side does not say how it was" in got["notes"][0]
    got = figures(bounce("compare", "mute.png", "ref.exr", "--json"))
    assert got["rel_rmse"]["value"] > 0.3
    # Pictures that were shown differently are told apart.
    (bounce.folder / "brighter.png").write_bytes(png(shown, 8, exposure_stops="-1.25", tonemap="linear")[0])
    got = figures(bounce("compare", "image.png", "brighter.png", "--json"))
    assert any("exposure or tone curve differ" in note for note in got["notes"])


def test_jpegs_are_read(bounce):
    truth = numpy.clip(scene(), 0, 1)
    Image = pytest.importorskip("PIL.Image")
    (bounce.folder / "ref.png").write_bytes(png(truth, 8)[0])
    codes = numpy.round(coded(truth) * 255).astype(numpy.uint8)
    Image.fromarray(codes).save(bounce.folder / "image.jpg", quality=98, subsampling=0,
                                comment=b"exposure_stops=1.5\ntonemap=agx\n")
    got = figures(bounce("compare", "ref.png", "image.jpg", "--json"))
    assert 0 < got["rel_rmse"]["value"] < 0.05
    assert "+1.5 stops, curve agx" in got["notes"][1]


@pytest.mark.parametrize("words,code,says", [
    (("ref.exr", "image.png", "--half", "ref.exr"), 2, "halves"),
    (("ref.exr", "image.png", "--layer", "direct"), 1, "no layers"),
    (("ref.exr", "cut.png"), 4, "cut.png: broken PNG"),
    (("cut.jpg", "image.png"), 4, "cut.jpg: picture of 0 x 0"),
    (("ref.exr", "small.png"), 1, "sizes differ"),
])
def test_pictures_that_cannot_be_compared(bounce, words, code, says):
    image = scene().astype(numpy.float32)
    save(bounce.folder, "ref.exr", {**planes(image), **planes(image, "direct.")})
    data, _ = png(image, 8)
    (bounce.folder / "image.png").write_bytes(data)
    (bounce.folder / "cut.png").write_bytes(data[:len(data) // 2])
    (bounce.folder / "cut.jpg").write_bytes(b"\xff\xd8\xff\xe0\x00\x10JFIF\0")
    (bounce.folder / "small.png").write_bytes(png(image[:8], 8)[0])
    result = bounce("compare", *words)
    assert result.returncode == code and says in result.stderr, result.stderr
