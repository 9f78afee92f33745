"""papers.json and papers.csv: written after every group, whole or not at all; read to go on.

A group keeps the key of all that its frames came from, and names the command, the date, the build, the
device and the machine that it was measured with: figures may be measured in several runs.
"""
import csv
import json

from ..store import as_text, settings_text, write
from .figure import indirect_ms, stage_ms

FORMAT = 1
COLUMNS = ("figure", "group", "label", "scene", "technique", "settings", "size_px", "camera",
           "frame_ms", "frame_ms_q1", "frame_ms_q3", "runs", "indirect_ms", "stage_ms", "fragments",
           "vpls", "against", "rel_rmse", "rmse_max", "rel_rmse_trimmed", "signed", "passes_ms", "build",
           "motion", "motion_low", "motion_high", "true_motion")


class Store:
    """`groups` by (figure, group): what was measured, now or before."""

    def __init__(self, folder):
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.groups = {(g["figure"], g["name"]): g for g in self._read().get("groups", [])}
        self.notes = []  # what was skipped or failed in this run: {"figure", "group", "text"}

    def _read(self):
        try:
            found = json.loads((self.folder / "papers.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return found if found.get("format") == FORMAT else {}

    def holds(self, figure, name, key):
        group = self.groups.get((figure, name))
        return group is not None and group["key"] == key

    def put(self, group):
        self.groups[group["figure"], group["name"]] = group
        self.save()

    def forget(self, figure, name):
        """What an older build or other settings measured says nothing of this one."""
        if self.groups.pop((figure, name), None):
            self.save()

    def keep_only(self, figure, names):
        """Without groups that the figure no longer plans."""
        for of, name in [key for key in self.groups if key[0] == figure and key[1] not in names]:
            self.forget(of, name)

    def found(self, figure):
        """{group: {label: point}}: what figures are drawn from."""
        return {name: {p["label"]: p for p in group["points"]}
                for (of, name), group in self.groups.items() if of == figure}

    def save(self):
        write(self.folder / "papers.json", as_text(
            {"format": FORMAT, "groups": list(self.groups.values()), "notes": self.notes}))
        beside = self.folder / "papers.csv.part"
        with open(beside, "w", newline="", encoding="utf-8") as out:
            table = csv.DictWriter(out, COLUMNS, restval="")
            table.writeheader()
            for group in self.groups.values():
                for point in group["points"]:
                    table.writerows(rows_of(group, point))
        beside.replace(self.folder / "papers.csv")


def rows_of(group, point):
    """A row for each picture that the point's was compared with; one if with none."""
    time = point["time_ms"]
    base = {"figure": group["figure"], "group": group["name"], "label": point["label"],
            "scene": point["scene"], "technique": point["technique"],
            "settings": settings_text(point["settings"]), "size_px": point["size"],
            "camera": point["camera"] or "", "frame_ms": time["frame"]["median"],
            "frame_ms_q1": time["frame"]["q1"], "frame_ms_q3": time["frame"]["q3"],
            "runs": time["runs"], "indirect_ms": indirect_ms(point), "stage_ms": stage_ms(point),
            "fragments": point["counts"].get("fragments", ""), "vpls": point["counts"].get("vpls", ""),
            "passes_ms": " ".join(f"{k}={v['median']:.4g}" for k, v in time["passes"].items()),
            "build": group["build"]}
    motion = point.get("motion")
    if motion:
        base.update(motion=motion["value"], motion_low=motion["low"], motion_high=motion["high"], true_motion=motion["true"])
    rows = [{**base, "against": against, "rel_rmse": e["rel_rmse"], "rmse_max": e["rmse_max"],
             "rel_rmse_trimmed": e["trimmed"], "signed": e["signed"]}
            for against, e in point["error"].items() if e]
    return rows or [base]
