"""Imperfect shadow maps beside rays: how wrong, how long, how large.

usage: imperfect_shadows.py BUILD_DIR SCENES_DIR -o RESULT.json [--scenes NAME,NAME] [--side N] [--runs N] [--truths FOLDER]

`maps`: `rsm`, brdf=lambert, the same 1,024 virtual lights, each asked by every pixel. `off_percent`: relative RMSE of the indirect
layer against rays to all of them; `none`: without visibility. Milliseconds of what is made (`bvh`, or points and maps) and of
answers, medians of runs; `ns` of an answer.

`techniques`: defaults with rays and with maps, against the reference, and milliseconds of a frame.
"""
import pathlib
import sys

import numpy

import by_hand
import live
import many_light

SCENES = ("cornell_box_spot_side", "cornell_box", "sponza_dabrovic", "sibenik")
VPLS = 1024
ALL = {"vpls": VPLS, "vpl_budget": VPLS, "rays": 1 << 20}
DEFAULT = {"ism_size": 64, "ism_points": 8192}
ASKED = [{"ism_size": 32, "ism_points": 2048}, {"ism_size": 32}, DEFAULT, {"ism_size": 128}, {"ism_points": 2048}, {"ism_points": 32768},
         {"ism_size": 128, "ism_points": 32768}, {"ism_holes": "open"}, {"ism_bias": 0}, {"ism_bias": 0.3}, {"ism_bias": 1}]
TECHNIQUES = ("many_light", "ssbc")


class Subject:
    def __init__(self, scene, name, options):
        self.scene, self.name, self.side, self.runs, self.truths = scene, name, options.side, options.runs, options.truths

    def render(self, technique, **settings):
        return self.scene.render(size=(self.side, self.side), technique=technique, layers=["indirect"], fresh="all",
                                 parameters={"brdf": "lambert", **settings})

    def frames(self, technique, **settings):
        return [self.render(technique, **settings) for _ in range(self.runs)]


def pass_ms(frames, *names):
    return round(float(numpy.median([sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] in names) for frame in frames])), 1)


def off(picture, exact):
    return round(100 * float(numpy.sqrt(((picture - exact) ** 2).mean()) / exact.mean()), 2)


def mib_of(asked, vpls):
    """Of the atlas, and of the sixteen sets of points."""
    settings = {**DEFAULT, **asked}
    return round((vpls * 4 * settings["ism_size"] ** 2 + 16 * 32 * settings["ism_points"]) / 2 ** 20, 1)


def maps(subject):
    rays = subject.frames("rsm", indirect_visibility="rays", **ALL)
    exact, vpls = many_light.picture(rays[0], "indirect"), rays[0].report["counts"]["vpls"]
    asked = subject.side ** 2 * vpls
    none = many_light.picture(subject.render("rsm", indirect_visibility="none", **ALL), "indirect")
    rows = [{"by": "rays", "made_ms": pass_ms(rays, "bvh"), "answers_ms": pass_ms(rays, "visibility")}, {"by": "none", "off_percent": off(none, exact)}]
    for settings in ASKED:
        frames = subject.frames("rsm", indirect_visibility="ism", **ALL, **settings)
        seen = many_light.picture(frames[0], "indirect")
        rows.append({"by": "maps", **settings, "off_percent": off(seen, exact), "mean_percent": round(100 * float(seen.mean() / exact.mean() - 1), 2),
                     "made_ms": pass_ms(frames, "shadow_points", "imperfect_shadows"), "answers_ms": pass_ms(frames, "visibility"),
                     "mib": mib_of(settings, vpls), "flags": list(frames[0].report["flags"])})
    for row in rows:
        if "answers_ms" in row:
            row["ns"] = round(1e6 * row["answers_ms"] / asked, 1)
    return {"vpls": vpls, "rows": rows}


def techniques(subject):
    truth = many_light.truth_of(subject.scene, subject.name, (subject.side, subject.side), "lambert", subject.truths)["indirect"]
    for technique in TECHNIQUES:
        row = {"technique": technique}
        for word in ("rays", "ism", "none"):
            frames = subject.frames(technique, indirect_visibility=word)
            whole = numpy.median([sum(p.get("ms") or 0 for p in frame.report["passes"] if p["name"] not in many_light.NOT_TIMED) for frame in frames])
            row[word] = {"off_percent": round(many_light.error_percent(many_light.picture(frames[0], "indirect"), truth), 2), "ms": round(float(whole), 1)}
        yield row


def main(words=None):
    made = by_hand.parser(__doc__)
    by_hand.add_names(made, SCENES)
    made.add_argument("--side", type=by_hand.count, default=192)
    made.add_argument("--runs", type=by_hand.count, default=3)
    made.add_argument("--truths", type=pathlib.Path)
    options = by_hand.parse(made, words, names=SCENES)
    result = {"command": f"imperfect_shadows.py BUILD SCENES -o RESULT --side {options.side} --runs {options.runs} --scenes {','.join(options.names)}",
              "machine": live.machine(options.build), "rows": []}
    with live.package(options.build).private() as daemon:
        for name in options.names:
            subject = Subject(daemon.scenes.add(options.scenes / f"{name}.glb"), name, options)
            row = {"scene": name, "side": subject.side, **maps(subject), "techniques": list(techniques(subject))}
            by_hand.say(row)
            result["rows"].append(row)
    by_hand.write(result, options.output)


if __name__ == "__main__":
    sys.exit(main())
