"""A picture of a scene by every technique at its defaults, with its price and how far it is off: the README's sheet.

usage: technique_sheet.py BUILD_DIR SCENES_DIR -o RESULT.json --sheet FILE.jpg [--scene NAME] [--size WxH] [--aa N] [--spp N]

Milliseconds of a new frame's passes with N sub-frames, without the structure that rays are asked of, readback and encoding. Off: relative
RMSE of means over 8x8 pixels of beauty, in tones x / (x + mean), against a reference over the whole pixel, which is the last picture.
"""
import pathlib
import sys

import by_hand
import in_time
import live
import many_light

COLUMNS, LINE_PX = 4, 16


def frames_of(daemon, scene, options):
    truth = in_time.beauty(in_time.render(scene, options.size, "reference", 1, {"spp": options.spp, "filter": "box"}))
    for technique in daemon.techniques():
        name = technique["name"]
        if name == "reference":
            continue
        frame = in_time.render(scene, options.size, name, options.aa, {})
        picture = in_time.beauty(frame)
        yield {"by": name, "ms": round(many_light.times_ms([frame])), **in_time.off_percent(picture, truth)}, picture
    yield {"by": "reference"}, truth


def label_of(row):
    if "ms" not in row:
        return row["by"]
    return f"{row['by']}  {row['ms'] / 1000:.2f} s  {row['off_8x8_percent']:.1f} %"


def write_sheet(path, made, mean):
    from PIL import Image, ImageDraw
    height, width = made[0][1].shape[:2]
    rows = -(-len(made) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * width, rows * (height + LINE_PX)), "white")
    draw = ImageDraw.Draw(sheet)
    for k, (row, picture) in enumerate(made):
        at = k % COLUMNS * width, k // COLUMNS * (height + LINE_PX)
        sheet.paste(Image.fromarray(in_time.encode(picture, mean)), at)
        draw.text((at[0] + 3, at[1] + height + 2), label_of(row), fill="black")
    sheet.save(path, "JPEG", quality=88)


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("--scene", default="sponza_dabrovic")
    made.add_argument("--size", type=lambda text: tuple(int(side) for side in text.split("x")), default=(200, 150))
    made.add_argument("--aa", type=by_hand.count, default=4)
    made.add_argument("--spp", type=by_hand.count, default=512)
    made.add_argument("--sheet", type=pathlib.Path, required=True)
    options = by_hand.parse(made, words)
    size = "x".join(map(str, options.size))
    result = {"command": f"technique_sheet.py BUILD SCENES -o RESULT --scene {options.scene} --size {size} --aa {options.aa} --spp {options.spp}",
              "machine": live.machine(options.build)}
    with live.package(options.build).private() as daemon:
        scene = daemon.scenes.add(options.scenes / f"{options.scene}.glb")
        frames = list(frames_of(daemon, scene, options))
    result["rows"] = [row for row, _ in frames]
    for row in result["rows"]:
        by_hand.say(row)
    by_hand.write(result, options.output)
    write_sheet(options.sheet, frames, frames[-1][1].mean())


if __name__ == "__main__":
    sys.exit(main())
