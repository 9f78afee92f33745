"""Rooms with walls of metal that is no mirror: how far off each technique is that follows light.

usage: metal.py BUILD_DIR SCENES_DIR -o RESULT.json [--size WxH] [--spp 1024] [--by NAME,NAME] [--pictures FOLDER]

The Cornell box lit from its side, with other materials; and the bundled buddha, which is of gold. Defaults, whole BRDF, all reflections: relative RMSE of the
indirect layer against the reference, by pixel and as means of 8x8 pixels, mean of three seeds, and of their mean; its sum; milliseconds of new frames' passes
without the structure that rays are asked of. PICTURES gets a row for each room: the truth, then each technique, of one exposure.
"""
import pathlib
import tempfile

import numpy
from PIL import Image

import by_hand
import live
from harness.glb import Glb
from many_light import NOT_TIMED, blocks, picture

SEEDS = (1, 2, 3)
BOX = "cornell_box_spot_side"
# Of the box's materials those that are metal, and how rough; of the buddha none is changed.
ROOMS = {"side walls .4": (BOX, ("leftWall", "rightWall"), .4),
         "floor and walls .5": (BOX, ("floor", "leftWall", "rightWall", "backWall"), .5),
         "boxes and a wall .3": (BOX, ("shortBox", "tallBox", "rightWall"), .3),
         "floor and walls .75": (BOX, ("floor", "leftWall", "rightWall", "backWall"), .75),
         "buddha": ("buddha_room", (), 1)}
TECHNIQUES = ("many_light", "ssbc", "photon", "point_projection")


def make(scenes, name, metal, roughness, folder):
    glb = Glb.load(scenes / f"{name}.glb")
    for material in glb.doc["materials"]:
        if material.get("name") in metal:
            of_it = material.setdefault("pbrMetallicRoughness", {})
            of_it.update(metallicFactor=1, roughnessFactor=roughness)
    glb.save(folder / "room.glb")
    return folder / "room.glb"


def off_percent(seen, truth):
    return 100 * float(numpy.sqrt(((seen - truth) ** 2).mean()) / truth.mean())


def row_of(scene, technique, truth, size):
    frames = [scene.render(size=size, technique=technique, layers=["indirect"], fresh="all", seed=seed) for seed in SEEDS]
    seen = [picture(frame, "indirect") for frame in frames]
    ms = [sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in NOT_TIMED) for frame in frames]
    mean = numpy.mean(seen, axis=0)
    return {"technique": technique, "indirect_percent": round(numpy.mean([off_percent(one, truth) for one in seen]), 1),
            "indirect_8x8_percent": round(numpy.mean([off_percent(blocks(one), blocks(truth)) for one in seen]), 1),
            "of_mean_picture_percent": round(off_percent(mean, truth), 1), "sum": round(float(mean.mean() / truth.mean()), 3),
            "ms": round(float(numpy.median(ms)))}, seen[0]


def shown(image, exposure):
    return (255 * numpy.clip(image * exposure / (1 + image * exposure) * 1.3, 0, 1) ** (1 / 2.2)).astype("uint8")


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("--size", type=lambda text: tuple(int(side) for side in text.split("x")), default=(96, 96))
    made.add_argument("--spp", type=by_hand.count, default=1024)
    made.add_argument("--by", type=lambda text: tuple(text.split(",")), default=TECHNIQUES)
    made.add_argument("--pictures", type=pathlib.Path)
    options = by_hand.parse(made, words, names=tuple({room[0] for room in ROOMS.values()}))
    size = "x".join(map(str, options.size))
    result = {"command": f"metal.py BUILD SCENES -o RESULT --size {size} --spp {options.spp} --by {','.join(options.by)}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon, tempfile.TemporaryDirectory() as folder:
        for room, (name, metal, roughness) in ROOMS.items():
            scene = daemon.scenes.add(make(options.scenes, name, metal, roughness, pathlib.Path(folder)))
            truth = picture(scene.render(size=options.size, technique="reference", layers=["indirect"], parameters={"spp": options.spp}), "indirect")
            strip = [truth]
            for technique in options.by:
                row, seen = row_of(scene, technique, truth, options.size)
                result["rows"].append({"room": room, **row})
                by_hand.say(f"{room}: {row}")
                strip.append(seen)
            if options.pictures:
                strip = numpy.concatenate([shown(one, 1 / truth.mean()) for one in strip], axis=1)
                Image.fromarray(strip).save(options.pictures / f"{room.replace(' ', '_')}.png")
    by_hand.write(result, options.output)


if __name__ == "__main__":
    main()
