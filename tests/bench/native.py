"""What the processor's loops save on a software device: each frame by device and by processor, in turns.

usage: native.py BUILD_DIR SCENES_DIR -o RESULT.json [--runs N] [--side 256,1024] [--techniques rsm,...] [--brdf lambert]

Everything anew in each frame, programs compiled before. Medians of the pass `gather` (with rays `weigh` and `choose`
too) and of whole frames without loading, compiling and encoding, their ratio, evaluations of a VPL at a receiver a second for
lists, and how far apart the two pictures' indirect light is, RMS over the mean.
"""
import sys

import by_hand
import live

SCENES = ("cornell_box", "sponza_dabrovic", "sibenik")
EXECUTORS = ("device", "native")
ARITHMETIC = ("weigh", "choose", "gather")


def whole_ms(report):
    return sum(one.get("ms") or 0 for one in report["passes"])


def arithmetic_ms(report):
    return sum(one.get("ms") or 0 for one in report["passes"] if one["name"] in ARITHMETIC)


def median(values):
    ordered = sorted(values)
    return ordered[len(ordered) // 2]


def apart(numpy, device, native):
    return float(numpy.sqrt(((native.astype(float) - device) ** 2).mean()) / device.mean())


def row_of(scene, name, technique, side, parameters, runs):
    import numpy

    reports, layers = {executor: [] for executor in EXECUTORS}, {}
    for turn in range(runs + 1):
        for executor in EXECUTORS:
            frame = scene.render(size=(side, side), technique=technique, layers=["indirect"], fresh="all",
                                 parameters={**parameters, "executor": executor})
            layers[executor] = frame.layers["indirect"]
            if turn:
                reports[executor].append(frame.report)
    row = {"scene": name, "technique": technique, "side": side}
    for executor in EXECUTORS:
        row[f"{executor}_gather_ms"] = median(list(map(arithmetic_ms, reports[executor])))
        row[f"{executor}_frame_ms"] = median(list(map(whole_ms, reports[executor])))
    row["gather_ratio"] = row["device_gather_ms"] / row["native_gather_ms"]
    row["frame_ratio"] = row["device_frame_ms"] / row["native_frame_ms"]
    counts = reports["native"][0]["counts"]
    if technique != "hisr":
        row["native_gevals_per_s"] = counts["fragments"] * counts["vpls"] / row["native_gather_ms"] * 1e-6
    row = {key: round(value, 2) if isinstance(value, float) else value for key, value in row.items()}
    return {**row, "rms_over_mean": float(f"{apart(numpy, layers['device'], layers['native']):.2g}")}


def main(words=None):
    made = by_hand.parser(__doc__)
    made.add_argument("--runs", type=by_hand.count, default=5)
    made.add_argument("--side", type=lambda text: [int(word) for word in text.split(",")], default=[256])
    made.add_argument("--techniques", type=lambda text: text.split(","), default=["rsm", "multires_gather", "isr", "hisr"])
    made.add_argument("--brdf", default="lambert")
    made.add_argument("--rays", action="store_true")
    options = by_hand.parse(made, words, names=SCENES)
    sys.path.insert(0, str(options.build / "clients/python"))
    import bounced
    parameters = {"brdf": options.brdf, **({"indirect_visibility": "rays"} if options.rays else {})}
    result = {"machine": live.machine(options.build), "parameters": parameters, "runs": options.runs, "rows": []}
    with bounced.private() as daemon:
        for name in SCENES:
            scene = daemon.scenes.add(options.scenes / f"{name}.glb")
            for technique in options.techniques:
                for side in options.side:
                    row = row_of(scene, name, technique, side, parameters, options.runs)
                    by_hand.say(f"{name} {technique} {side}: gather {row['gather_ratio']:.1f} times, frame {row['frame_ratio']:.1f} times, "
                                f"{row['rms_over_mean']:.1e} apart")
                    result["rows"].append(row)
    by_hand.write(result, options.output)


if __name__ == "__main__":
    main()
