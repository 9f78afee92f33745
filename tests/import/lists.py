#!/usr/bin/env python3
"""Every file of the shared scenes does on import what tests/scenes/lists says, by the real child.

    lists.py SUMMARY BOUNCED SOURCE_ROOT [PATH_PART]   only files whose path has PATH_PART

Skips (exit 77) where ../shared/scenes is not there. Fails for a file that is in no list: a new
file wants a verdict.
"""

import concurrent.futures
import json
import subprocess
import sys
from pathlib import Path

FILE_SECONDS = 10
RIG = ("default_camera", "default_lights")


def read_list(path, kind):
    entries = {}
    for line in path.read_text().splitlines():
        if line and not line.startswith("#"):
            fields = line.split("\t")
            assert fields[0] not in entries, f"{fields[0]} twice in {path}"
            entries[fields[0]] = (kind, fields[1:])
    return entries


def check_loaded(summary, fields):
    features = summary["features"]
    shown = [str(features["triangles"]), str(summary["materials"]), str(sum(features["lights"]))]
    flags = [flag for flag in summary["flags"] if flag not in RIG]
    if shown + flags != fields:
        return f"shows {shown + flags}, the list says {fields}"
    box = features["bounds_min"] + features["bounds_max"]
    if not all(abs(value) < 1e15 for value in box) or not features["diagonal_m"] > 0:
        return f"bounds {box}"
    return None


def check_refused(summary, fields):
    said = [summary["error"], summary["field"] or "-", summary["message"]]
    if said[:2] != fields[:2] or fields[2] not in said[2]:
        return f"says {said}, the list says {fields}"
    return None


def check(tools, root, name, kind, fields):
    command = [*tools, str(root / name)]
    try:
        run = subprocess.run(command, capture_output=True, timeout=FILE_SECONDS)
    except subprocess.TimeoutExpired:
        return f"{name}: more than {FILE_SECONDS} s"
    if run.returncode not in (0, 4) or run.stderr:
        return f"{name}: exit {run.returncode}: {run.stderr.decode(errors='replace')[-2000:]}"
    summary = json.loads(run.stdout)
    loaded = summary["verdict"] == "load"
    if loaded != (kind != "refuse"):
        return f"{name}: {summary['verdict']} ({summary.get('message')}), the list says {kind}"
    problem = check_loaded(summary, fields) if loaded else check_refused(summary, fields)
    return f"{name}: {problem}" if problem else None


def main():
    summary, bounced, source = sys.argv[1:4]
    part = sys.argv[4] if len(sys.argv) > 4 else ""
    root = (Path(source) / "../shared/scenes").resolve()
    if not root.is_dir():
        print("no ../shared/scenes: skipped")
        return 77
    entries = {}
    for kind in ("load", "repair", "refuse"):
        entries.update(read_list(Path(source) / f"tests/scenes/lists/{kind}.txt", kind))
    found = {str(path.relative_to(root)) for path in root.rglob("*")
             if path.suffix in (".glb", ".gltf")}
    problems = [f"{name}: in no list" for name in sorted(found - entries.keys())]
    problems += [f"{name}: listed, but not there" for name in sorted(entries.keys() - found)]
    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        jobs = [pool.submit(check, (summary, bounced), root, name, *entries[name])
                for name in sorted(found & entries.keys()) if part in name]
        problems += [problem for job in jobs if (problem := job.result())]
    print("\n".join(problems))
    print(f"{len(jobs)} files, {len(problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
