"""What legs of a day on a GPU left behind, as figures to keep.

usage: collect.py FOLDER [-o DIR]

FOLDER is searched for legs (a result.json beside a files.tar.gz). DIR, by default tests/bench/results,
gets, by the name of the device (nvidia, software, ...):

    DEVICE.json                 machine, driver, devices, and of each leg every step's result and time
    DEVICE.txt                  the same for people: counts, and the last words of what did not pass
    DEVICE.sandbox.json, DEVICE.first_light.json, DEVICE.edit_latency.json,
    DEVICE.slice_overhead.*.txt, DEVICE.ray_device.*.txt
    DEVICE.bench.json, .csv, .svg, .html; DEVICE.papers.json, .csv, .html

Pages are drawn where matplotlib is. Legs of two devices, or one leg twice, are refused.
"""
import argparse
import collections
import json
import pathlib
import re
import sys
import tarfile
import tempfile
import types

ROOT = pathlib.Path(__file__).resolve().parents[2]
FORMAT = 1
# By their names among a leg's files, and behind DEVICE.
KEPT = (("sandbox.json", "sandbox.json"), ("first_light.json", "first_light.json"), ("edit_latency.json", "edit_latency.json"),
        ("bench/bench.json", "bench.json"), ("bench/bench.csv", "bench.csv"),
        ("papers/papers.json", "papers.json"), ("papers/papers.csv", "papers.csv"))
LOGS = ("slice_overhead", "ray_device")


def fail(message):
    sys.exit(f"collect: {message}")


def find_legs(folder):
    """[(result, folder)], in the order of their paths."""
    found = []
    for path in sorted(folder.rglob("result.json")):
        try:
            result = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as fault:
            fail(f"{path}: {fault}")
        if result.get("format") != FORMAT or "leg" not in result:
            fail(f"{path}: no leg's result of format {FORMAT}")
        found.append((result, path.parent))
    if not found:
        fail(f"{folder}: no result.json in it")
    twice = [leg for leg, n in collections.Counter(r["leg"] for r, _ in found).items() if n > 1]
    if twice:
        fail(f"{folder}: leg {twice[0]} is there more than once")
    return found


def used_device(result):
    """The device that `auto` takes: hardware before software."""
    working = [d for d in result["devices"] if "class" in d]
    return next((d for d in working if not d["software"]), working[0] if working else None)


def device_name(result):
    device = used_device(result)
    if device is None:
        return "none"
    if device["software"]:
        return "software"
    return re.match(r"[a-z0-9]*", device["name"].lower())[0] or "hardware"


def one_name(found):
    names = {device_name(result) for result, _ in found}
    if len(names) > 1:
        fail(f"legs of different devices: {', '.join(sorted(names))}")
    return names.pop()


def summary(found):
    """DEVICE.txt"""
    first = found[0][0]
    device = used_device(first) or {"name": "no device"}
    machine = first["machine"]
    lines = [f"{device['name']}; {machine['cpu']}, {machine['cores']} cores; {machine['system']}; "
             f"{first['build']}", ""]
    for result, _ in found:
        counts = collections.Counter(step["result"] for step in result["steps"])
        took_s = sum(step.get("took_s", 0) for step in result["steps"])
        lines.append(f"{result['leg']:10}" + ", ".join(f"{n} {what}" for what, n in counts.items())
                     + f"; {took_s:.0f} s of work")
    for result, _ in found:
        for step in result["steps"]:
            if step["result"] == "passed":
                continue
            lines += ["", f"{step['result']}: {result['leg']}, {step['suite']}/{step['name']}"]
            lines += [f"    {line}" for line in step.get("said", "").splitlines()[-20:]]
    return "\n".join(lines) + "\n"


def unpack(folder, into):
    """A leg that was ended from outside has no files."""
    path = folder / "files.tar.gz"
    if not path.is_file():
        return
    with tarfile.open(path) as tar:
        for entry in tar:
            # Plain files in plain folders; a name that leads out of here is nobody's of ours.
            if entry.isfile() and ".." not in pathlib.PurePath(entry.name).parts:
                target = into / entry.name.lstrip("/")
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(tar.extractfile(entry).read())


def keep_files(files, write):
    for name, kept in KEPT:
        if (files / name).is_file():
            write(kept, (files / name).read_bytes())
    for path in sorted((files / "logs").glob("*.txt")):
        if path.name.startswith(LOGS):
            write(path.name, path.read_bytes())


def draw_pages(files, write):
    """Without pictures, which did not come along."""
    # What draws is slow to load, and a day without benches needs none of it.
    sys.path.insert(0, str(ROOT / "clients"))
    if (files / "bench/bench.json").is_file():
        from harness.bench import figures
        result = json.loads((files / "bench/bench.json").read_text(encoding="utf-8"))
        held = types.SimpleNamespace(held=lambda path, settings: None)
        bench = types.SimpleNamespace(
            result=result, references=held, store=types.SimpleNamespace(folder=files / "bench"),
            paths={scene["name"]: None for scene in result["scenes"]})
        if figures.write_page(bench) == 0:
            write("bench.html", (files / "bench/bench.html").read_bytes())
            write("bench.svg", (files / "bench/bench.svg").read_bytes())
    if (files / "papers/papers.json").is_file():
        from harness.bench.papers import page, store
        asked = types.SimpleNamespace(figures=(), output=files / "papers", title="Papers, redrawn")
        if page.write_page(asked, store.Store(files / "papers"), lambda line: None) == 0:
            write("papers.html", (files / "papers/papers.html").read_bytes())


def main(words):
    parser = argparse.ArgumentParser(prog="deploy/gpu_day collect", description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=ROOT / "tests/bench/results")
    options = parser.parse_args(words)
    if not options.output.is_dir():
        parser.error(f"-o: there is no folder {options.output}")
    found = find_legs(options.folder)
    name = one_name(found)

    def write(kept, content):
        path = options.output / f"{name}.{kept}"
        path.write_bytes(content)
        print(path)

    write("json", (json.dumps({"legs": [result for result, _ in found]}, indent=1) + "\n").encode())
    write("txt", summary(found).encode())
    with tempfile.TemporaryDirectory() as scratch:
        files = pathlib.Path(scratch)
        for _, folder in found:
            unpack(folder, files)
        keep_files(files, write)
        draw_pages(files, write)
    sys.stdout.write(summary(found))
    bad = any(step["result"] in ("failed", "late") for result, _ in found for step in result["steps"])
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
