"""bench.json and bench.csv: written after every point, whole or not at all; read to go on."""
import csv
import json
import math
import os
import platform
from pathlib import Path

FORMAT = 1
COLUMNS = ("scene", "technique", "settings", "state", "frame_ms", "frame_ms_q1", "frame_ms_q3",
           "gpu_ms", "camera_moved_ms", "runs", "against", "layer", "rel_rmse", "rel_rmse_low",
           "rel_rmse_high", "signed", "reference_noise", "seeds", "passes_ms", "fault")


def machine():
    model = platform.machine()
    for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    return {"cpu": model, "cores": os.cpu_count(), "kernel": platform.release(),
            "load_before": os.getloadavg()[0]}


def finite(value):
    """The same with None for what JSON has no number for."""
    if isinstance(value, dict):
        return {key: finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write(path, text):
    """Beside it first, then renamed: an interruption leaves the old file."""
    beside = path.with_name(path.name + ".part")
    beside.write_text(text, encoding="utf-8")
    beside.replace(path)


def as_text(result):
    """JSON with a line for each entry of a list: figures to be compared between runs, not prose."""
    parts = []
    for key, value in finite(result).items():
        body = json.dumps(value, allow_nan=False)
        if isinstance(value, list) and value:
            entries = ",\n  ".join(json.dumps(entry, allow_nan=False) for entry in value)
            body = f"[\n  {entries}\n ]"
        parts.append(f" {json.dumps(key)}: {body}")
    return "{\n" + ",\n".join(parts) + "\n}\n"


def settings_text(settings):
    return " ".join(f"{key}={value}" for key, value in settings.items())


def rung_text(point):
    """Of a point, what it does not share with all others of the run."""
    return settings_text(point.get("rung", point["settings"]))


class Store:
    """`result` is the whole of bench.json."""

    def __init__(self, folder, head):
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.pictures = folder / "pictures"
        self.pictures.mkdir(exist_ok=True)
        self.earlier = {p["key"]: p for p in self._read().get("points", []) if p["state"] == "done"}
        self.result = {"format": FORMAT, **head, "scenes": [], "techniques": [], "points": [],
                       "references": [], "decomposition": []}

    def _read(self):
        try:
            found = json.loads((self.folder / "bench.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if found.get("format") == FORMAT else {}

    def taken_over(self, key):
        """The point of an earlier run that has this key and whose pictures are still there."""
        point = self.earlier.get(key)
        if point and all((self.pictures / name).is_file() for name in point["pictures"]):
            return point
        return None

    def save(self):
        write(self.folder / "bench.json", as_text(self.result))
        self._save_csv()

    def _save_csv(self):
        beside = self.folder / "bench.csv.part"
        with open(beside, "w", newline="", encoding="utf-8") as out:
            table = csv.DictWriter(out, COLUMNS, restval="")
            table.writeheader()
            for point in self.result["points"]:
                table.writerows(rows_of(point))
        beside.replace(self.folder / "bench.csv")


def rows_of(point):
    """A row for each reference and layer that the point was measured against; one if it failed."""
    base = {"scene": point["scene"], "technique": point["technique"], "state": point["state"],
            "settings": settings_text(point["settings"]), "fault": point.get("fault", "")}
    if point["state"] != "done":
        return [base]
    time = point["time_ms"]
    base.update(frame_ms=time["frame"]["median"], frame_ms_q1=time["frame"]["q1"],
                frame_ms_q3=time["frame"]["q3"], gpu_ms=time["gpu"]["median"],
                camera_moved_ms=time["camera_moved"]["median"], runs=time["runs"],
                seeds=" ".join(map(str, point["seeds"])),
                passes_ms=" ".join(f"{k}={v['median']:.4g}" for k, v in time["passes"].items()))
    return [{**base, "against": against, "layer": layer, "rel_rmse": error["value"],
             "rel_rmse_low": error["low"], "rel_rmse_high": error["high"],
             "signed": error["signed"], "reference_noise": error["noise"]}
            for against, layers in point["error"].items() for layer, error in layers.items()]
