#!/usr/bin/env python3
"""Every file of the lists that loads comes back from an export: the same content, or what the export
says of it; and the export of what came back is the same file, with nothing left to repair.

    round_trip.py SUMMARY SOURCE_ROOT MIB_MAX EVERY [PATH_PART]   files of at most MIB_MAX

The bundled scenes always; ../shared/scenes where it is there, one file of each EVERY.
"""
import collections
import concurrent.futures
import json
import subprocess
import sys
from pathlib import Path

FILE_SECONDS = 120
# Notes that leave what is seen as it was, bounds and all.
HARMLESS = ("left_out_empty_meshes", "left_out_empty_primitives", "left_out_unused_vertices",
            "left_out_unread_tangents", "left_out_unshown_pictures", "world_space_meshes_moved")


def problem_of(trip):
    if "fault" in trip:
        return f"{trip['field']}: {trip['fault']}"
    if not trip["stable"]:
        return "the second export is another file"
    if trip["flags"]:
        return f"the export has to be repaired: {trip['flags']}"
    unexpected = [note for note in trip["notes"] if not note.startswith(HARMLESS)]
    if unexpected or not trip["alike"]:
        return f"notes {trip['notes']}, alike: {trip['alike']}"
    if not trip["same"] and not trip["notes"]:
        return "other content, and nothing is said of it"
    return None


def check(summary, path):
    try:
        run = subprocess.run([summary, "--round-trip", str(path)], capture_output=True,
                             timeout=FILE_SECONDS)
    except subprocess.TimeoutExpired:
        return f"{path}: more than {FILE_SECONDS} s", None
    if run.returncode != 0 or run.stderr:
        return f"{path}: exit {run.returncode}: {run.stderr.decode(errors='replace')[-500:]}", None
    trip = json.loads(run.stdout)["round_trip"]
    problem = problem_of(trip)
    return (f"{path}: {problem}" if problem else None), trip


def size_of(path):
    """With the files beside a .gltf, of which it has a part at least."""
    files = path.parent.iterdir() if path.suffix == ".gltf" else [path]
    return sum(file.stat().st_size for file in files if file.is_file())


def files_of(source, mib_max, every, part):
    own, names = sorted((source / "tests/scenes").glob("*.gl*")), []
    root = (source / "../shared/scenes").resolve()
    for kind in ("load", "repair"):
        for line in (source / f"tests/scenes/lists/{kind}.txt").read_text().splitlines():
            if line and not line.startswith("#") and (root / line.split("\t")[0]).is_file():
                names.append(root / line.split("\t")[0])
    names = [path for path in names if part in str(path) and size_of(path) <= mib_max * 2**20]
    return own + names[::every]


def main():
    summary, source, mib_max, every = sys.argv[1:5]
    part = sys.argv[5] if len(sys.argv) > 5 else ""
    files = files_of(Path(source), float(mib_max), int(every), part)
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        results = list(pool.map(lambda path: check(summary, path), files))
    problems = [problem for problem, _ in results if problem]
    trips = [trip for _, trip in results if trip and "fault" not in trip]
    notes = collections.Counter(note.split(":")[0] for trip in trips for note in trip["notes"])
    print(*problems, sep="\n")
    print(f"{len(files)} files, {sum(t['same'] for t in trips)} with the same content, "
          f"{len(problems)} problems; notes: {dict(notes)}")
    return 1 if problems or not files else 0


if __name__ == "__main__":
    sys.exit(main())
