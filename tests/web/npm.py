"""What of the viewer's tests needs npm's packages; exits 77 (skipped) where these are not installed.

usage: npm.py dist|types|units FOLDER

dist: what is committed is what the sources build.
"""

import filecmp
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile


def missing(folder):
    if not shutil.which("node") or not shutil.which("protoc"):
        return "node or protoc is not here"
    if not (folder / "node_modules/.package-lock.json").exists():
        return "npm's packages are not installed (npm ci in clients/web)"
    held = json.loads((folder / "node_modules/.package-lock.json").read_text())["packages"]
    wanted = json.loads((folder / "package-lock.json").read_text())["packages"]
    for name, package in held.items():
        if wanted.get(name, {}).get("version") != package["version"]:
            return f"{name} is of another version than in package-lock.json (npm ci in clients/web)"
    return None


def dist(folder):
    with tempfile.TemporaryDirectory() as built:
        subprocess.run(["node", "build.js", built], cwd=folder, check=True)
        names = sorted({*os.listdir(built), *os.listdir(folder / "dist")})
        _, differ, lacking = filecmp.cmpfiles(built, folder / "dist", names, shallow=False)
    if differ or lacking:
        print("clients/web/dist is not what its sources build (npm run build):", *differ, *lacking)
        return 1
    print(len(names), "files are as they are built")
    return 0


def main():
    what, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    reason = missing(folder)
    if reason:
        print("skipped:", reason)
        return 77
    if what == "dist":
        return dist(folder)
    if what == "units":
        return subprocess.run(["node", "test.js"], cwd=folder, check=False).returncode
    subprocess.run(["node", "generate.js"], cwd=folder, check=True)
    return subprocess.run(["node_modules/.bin/tsc", "--noEmit"], cwd=folder, check=False).returncode


sys.exit(main())
