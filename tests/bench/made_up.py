"""A result of bench with known numbers, for tests of what is made from one."""


def point(technique, settings, ms, full, model, scene="box", noise=1e-4):
    def error(value):
        return {"value": value, "low": value * 0.9, "high": value * 1.1, "signed": -value / 2,
                "noise": noise}

    def time(value):
        return {"median": value, "q1": value * 0.95, "q3": value * 1.2}

    return {"key": f"{scene}{technique}{settings}", "scene": scene, "technique": technique,
            "settings": dict(word.split("=") for word in settings.split()), "state": "done",
            "command": "bounce render ...", "pictures": [], "seeds": [1], "flags": [], "counts": {},
            "time_ms": {"frame": time(ms), "gpu": time(ms * 0.8), "runs": 5,
                        "camera_moved": time(ms * 0.6),
                        "passes": {"gbuffer": time(ms * 0.2), "gather": time(ms * 0.5)}},
            "error": {"full": {"beauty": error(full), "indirect": error(2 * full)},
                      "model": {"beauty": error(model), "indirect": error(2 * model)}}}


def result():
    """`quick` is stuck at its model's 12 %; `exact` halves its error with four times the time."""
    points = [point("quick", f"n={4 ** i}", 10 * 2 ** i, (0.12 ** 2 + (0.2 / 2 ** i) ** 2) ** 0.5,
                    0.2 / 2 ** i) for i in range(6)]
    points += [point("exact", f"spp={4 ** i}", 20 * 4 ** i, 0.32 / 2 ** i, 0.32 / 2 ** i)
               for i in range(6)]
    points.append({"key": "bad", "scene": "box", "technique": "quick", "settings": {"n": "0"},
                   "state": "failed", "fault": "n=0: <too few>", "command": "x", "pictures": []})
    steps = [{"name": "bounces 2 to 4", "rel_rmse": 0.1, "signed": -0.08},
             {"name": "occlusion of indirect light", "rel_rmse": 0.066, "signed": 0.03},
             {"name": "settings: n=1024", "rel_rmse": 0.006, "signed": 0.001}]
    return {
        "format": 1, "title": "Error against run time", "command": "bounce bench box.glb",
        "date": "2026-01-02T03:04:05+00:00", "build": "0.1.0",
        "machine": {"cpu": "A processor", "cores": 2, "kernel": "6.1", "load_before": 0.0},
        "device": {"name": "a device", "class": "a class", "software": True},
        "scenes": [{"name": "box", "file": "box.glb", "hash": "sha256:0", "size": [64, 64],
                    "camera": "Camera", "triangles": 32}],
        "techniques": [{"name": "quick", "summary": "", "is_reference": False, "ladder": []},
                       {"name": "exact", "summary": "", "is_reference": True, "ladder": []}],
        "points": points,
        "references": [{"scene": "box", "file": "box-0.exr", "settings": "", "spp": 64, "seed": 1,
                        "noise": {"beauty": 1e-3, "indirect": None}, "seconds": 1.0}],
        "decomposition": [{"scene": "box", "technique": "quick", "layer": layer, "mean": 1.0,
                           "gram": [], "steps": steps, "total": 0.12, "floor": 0.1199}
                          for layer in ("beauty", "indirect")]}
