"""What rays add to a frame, and what so few of them leave as noise.

usage: rays_added.py BUILD_DIR SCENES_DIR -o RESULT.json [--technique rsm] [--runs N] [--vpls 1024,8192] [--rays 16]

256x192. All programs are compiled before anything counts. For each scene and number of virtual lights, in
turns and everything anew: the frame without rays, and with `rays` of them at each pixel or block; medians of
whole frames without loading, compiling and encoding, and beside `rays_ms` what of them the structure (`bvh`),
the choice, the rays and the filter took. Noise of the indirect layer against a ray to every light, in per cent
of its mean: raw, and filtered where the technique filters.
"""
import math
import sys

import by_hand
import live

SIZE = (256, 192)
SCENES = ("cornell_box", "cornell_box_spot_side", "sponza_dabrovic")
ALL = 1 << 24
GOAL_MS = {"sponza_dabrovic": 200}  # added; others:
GOAL_OF_BOXES_MS = 60
GOAL_RAW, GOAL_FILTERED = 15.0, 7.5
PARTS = ("bvh", "vpl_order", "weigh", "choose", "visibility", "gather", "filter")


def whole_ms(report):
    return sum(one.get("ms") or 0 for one in report["passes"])


def median(values):
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


def noise_percent(numpy, layer, truth):
    return 100 * math.sqrt(numpy.mean((layer - truth) ** 2)) / float(numpy.mean(truth))


def row_of(scene, name, vpls, options, reads_filter):
    import numpy

    def frame(**parameters):
        return scene.render(size=SIZE, technique=options.technique, layers=["indirect"], fresh="all",
                            parameters={"vpls": vpls, **parameters})

    with_rays = {"indirect_visibility": "rays", "rays": options.rays}
    without, added = [], []
    for turn in range(options.runs + 1):
        pair = frame().report, frame(**with_rays).report
        if turn:  # the first compiles
            without.append(pair[0]), added.append(pair[1])
    truth = frame(indirect_visibility="rays", rays=ALL).layers["indirect"]
    row = {"scene": name, "vpls": vpls, "none_ms": median(map(whole_ms, without)), "rays_ms": median(map(whole_ms, added))}
    row["added_ms"] = row["rays_ms"] - row["none_ms"]
    row["parts_ms"] = {part: median([sum(p.get("ms") or 0 for p in one["passes"] if p["name"] == part) for one in added])
                       for part in PARTS}
    row["gather_none_ms"] = median([sum(p.get("ms") or 0 for p in one["passes"] if p["name"] == "gather") for one in without])
    row["rays"] = added[0]["counts"]["rays"]
    off = {"noise_filter": "off"} if reads_filter else {}
    row["noise_raw_percent"] = noise_percent(numpy, frame(**with_rays, **off).layers["indirect"], truth)
    if reads_filter:
        row["noise_filtered_percent"] = noise_percent(numpy, frame(**with_rays).layers["indirect"], truth)
    return {key: round(value, 2) if isinstance(value, float) else value for key, value in row.items()}


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("--technique", default="rsm")
    made.add_argument("--runs", type=by_hand.count, default=5)
    made.add_argument("--rays", type=by_hand.count, default=16)
    made.add_argument("--vpls", type=lambda text: [int(word) for word in text.split(",")], default=[1024, 8192])
    options = by_hand.parse(made, words, names=SCENES)
    sys.path.insert(0, str(options.build / "clients/python"))
    import bounced
    result = {"machine": live.machine(options.build), "technique": options.technique, "size": SIZE, "rays": options.rays,
              "goal_added_ms": {"boxes": GOAL_OF_BOXES_MS, **GOAL_MS}, "goal_noise_percent": [GOAL_RAW, GOAL_FILTERED],
              "rows": []}
    with bounced.private() as daemon:
        reads_filter = any(one["key"] == "noise_filter" for technique in daemon.techniques()
                           if technique["name"] == options.technique for one in technique["parameters"])
        for name in SCENES:
            scene = daemon.scenes.add(options.scenes / f"{name}.glb")
            for vpls in options.vpls:
                row = row_of(scene, name, vpls, options, reads_filter)
                by_hand.say(f"{name}, {vpls}: {row['none_ms']:.0f} + {row['added_ms']:.0f} ms, "
                            f"noise {row['noise_raw_percent']:.1f} %, filtered {row.get('noise_filtered_percent', 0):.1f} %")
                result["rows"].append(row)
    by_hand.write(result, options.output)


if __name__ == "__main__":
    main()
