"""What a technique shows after so many seconds, beside the reference: pictures, and how far they are off.

usage: in_time.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--size WxH] [--by TECHNIQUE,TECHNIQUE]
                  [--seconds S,S] [--spp N] [--sheet FILE.jpg]

At its defaults with 1, 4, 9, ... 64 sub-frames, as many as fit; where not one does, its cheapest rung. Milliseconds of a new frame's
passes without the structure that rays are asked of, readback and encoding. Relative RMSE of beauty by pixel and by 8x8 pixels against a
reference over the whole pixel, of pixels' tones x / (x + mean), since a lamp in sight is all of a sum of squares. The
sheet has a row a scene and technique: the times, and the reference.
"""
import io
import pathlib
import sys

import numpy

import by_hand
import live
import many_light

SCENES = ("cornell_box", "sponza_dabrovic", "kitchen_lux", "conference_room", "veach_ajar")
SECONDS, SUB_FRAMES = (1.0, 3.0, 10.0), (1, 4, 9, 16, 25, 36, 49, 64)


def render(scene, size, technique, aa, parameters):
    return scene.render(size=size, technique=technique, layers=["beauty"], fresh="all", aa=aa, parameters=parameters)


def beauty(frame):
    return frame.layers["beauty"][..., :3].astype(float)


def tones(image, mean):
    return image / (image + mean)


def off_percent(image, truth):
    mean = truth.mean()
    ours, theirs = tones(image, mean), tones(truth, mean)

    def relative(a, b):
        return round(100 * float(numpy.sqrt(((a - b) ** 2).mean()) / b.mean()), 2)

    return {"off_percent": relative(ours, theirs), "off_8x8_percent": relative(many_light.blocks(ours), many_light.blocks(theirs))}


def taken(scene, size, technique, rungs, most_s):
    """(what was asked, frame, its milliseconds) of the most that fits into each time; dearer ones are not tried."""
    parameters = dict(word.split("=") for word in rungs[0].split())
    frame = render(scene, size, technique, 1, parameters)
    made = [("cheapest rung", frame, many_light.times_ms([frame]))]
    for aa in SUB_FRAMES:
        frame = render(scene, size, technique, aa, {})
        made.append((f"aa={aa}", frame, many_light.times_ms([frame])))
        if made[-1][2] > 1e3 * most_s:
            break
    return made


def fitting(made, seconds):
    fits = [one for one in made if one[2] <= 1e3 * seconds]
    return fits[-1] if fits else made[0]


def rows_of(scene, name, options):
    truth = beauty(render(scene, options.size, "reference", 1, {"spp": options.spp, "filter": "box"}))
    for technique in options.by:
        row, pictures = {"scene": name, "by": technique, "after": []}, []
        made = taken(scene, options.size, technique, options.ladders[technique], max(options.seconds))
        for seconds in options.seconds:
            asked, frame, ms = fitting(made, seconds)
            pictures.append(beauty(frame))
            row["after"].append({"s": seconds, "asked": asked, "ms": round(ms, 1), **off_percent(pictures[-1], truth)})
        by_hand.say(row)
        yield row, numpy.concatenate([*pictures, truth], axis=1)


def encode(image, mean):
    return numpy.uint8(255 * numpy.clip(tones(image, mean) * 1.2, 0, 1) ** (1 / 2.2))


def write_sheet(path, strips):
    from PIL import Image
    buffer = io.BytesIO()
    Image.fromarray(numpy.concatenate([encode(strip, strip.mean()) for strip in strips])).save(buffer, "JPEG", quality=88)
    path.write_bytes(buffer.getvalue())


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--size", type=lambda text: tuple(int(side) for side in text.split("x")), default=(160, 120))
    made.add_argument("--by", type=lambda text: text.split(","), default=["point_projection", "many_light"])
    made.add_argument("--seconds", type=lambda text: [float(word) for word in text.split(",")], default=list(SECONDS))
    made.add_argument("--spp", type=by_hand.count, default=512)
    made.add_argument("--sheet", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    size = "x".join(map(str, options.size))
    result = {"command": f"in_time.py BUILD SCENES -o RESULT --size {size} --by {','.join(options.by)} --spp {options.spp} --scenes {','.join(options.names)}",
              "machine": live.machine(options.build), "rows": []}
    strips = []
    with live.package(options.build).private() as daemon:
        options.ladders = {one["name"]: one["ladder"] for one in daemon.techniques()}
        for name in options.names:
            for row, strip in rows_of(daemon.scenes.add(options.scenes / f"{name}.glb"), name, options):
                result["rows"].append(row)
                strips.append(strip)
    by_hand.write(result, options.output)
    if options.sheet:
        write_sheet(options.sheet, strips)


if __name__ == "__main__":
    sys.exit(main())
