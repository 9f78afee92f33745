"""How well the house is kept: lines, homes of a fact, circles of files, the longest README.

usage: house.py SOURCE_ROOT [-o RESULT.json]

Exits 1 if files of several rooms include each other in a circle.

*Homes* of a fact are the files of server/, clients/ and protocol/ that name it, less documents, what is made from others,
and the rooms that compute with it. A *circle* is a set of modules (a .c and its .h) that include each other, directly or
round about; one across rooms has modules of two folders. What a request enters: entered.py.
"""
import argparse
import json
import os
import pathlib
import re
import sys

SOURCES = (".c", ".h", ".cc", ".py", ".ts", ".js", ".comp", ".glsl", ".vert", ".frag")
MADE = ("node_modules", "dist", "gen", "__pycache__")
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)
BY_HAND = "not to be changed by hand"  # in the first lines of what is made
# What a fact is called, and the rooms that compute with it.
FACTS = {
    # The scene decides with it which parts are there; the harness makes scenes of its tests.
    "material property (alpha_cutoff)": (r"alpha_?cutoff", ("server/upload", "server/pass", "server/lights", "server/rays",
                                                              "server/reference", "server/technique", "server/scene/model/aspects.c",
                                                              "clients/harness", "shaders")),
    # The command line's exit code says that the target was missed.
    "frame option (target_error)": (r"target[_-]error", ("server/frame", "server/sched", "server/technique", "clients/cli/cmd_render.c")),
    "command (scene_log)": (r"scene_?log(_reply)?", ()),
    # Techniques light the blocks that it makes.
    "pass (discontinuity)": (r"discontinuity", ("server/pass", "server/technique", "shaders")),
}


def sources(root):
    """Their paths, from the root on."""
    for room in ("server", "clients", "protocol", "shaders"):
        for folder, below, names in os.walk(root / room):
            below[:] = sorted(set(below) - set(MADE))
            yield from (os.path.relpath(os.path.join(folder, name), root) for name in sorted(names) if name.endswith((*SOURCES, ".proto")))


def homes(texts, pattern, computing):
    named = re.compile(rf"(?<![a-z0-9_]){pattern}|_{pattern}|{pattern}(?![a-z0-9_])", re.I)
    return sorted(name for name, text in texts.items()
                  if not name.startswith((*computing, "shaders")) and BY_HAND not in text[:300] and named.search(text))


def modules(texts):
    """Of each module, a path without its ending, the modules that it includes."""
    known = {name.rsplit(".", 1)[0] for name in texts if name.endswith((".c", ".h", ".cc"))}
    edges = {module: set() for module in known}
    for name, text in texts.items():
        module = name.rsplit(".", 1)[0]
        if module not in known:
            continue
        for included in INCLUDE.findall(text):
            stem = included.rsplit(".", 1)[0]
            edges[module] |= {place for place in (f"server/{stem}", stem, f"shaders/{stem}") if place in known and place != module}
    return edges


def circles(edges):
    """Strongly connected components of more than one module (Tarjan 1972), largest first."""
    order, low, stack, found = {}, {}, [], []

    def visit(root):
        work = [(root, iter(sorted(edges[root])))]
        order[root] = low[root] = len(order)
        stack.append(root)
        while work:
            module, left = work[-1]
            for other in left:
                if other not in order:
                    order[other] = low[other] = len(order)
                    stack.append(other)
                    work.append((other, iter(sorted(edges[other]))))
                    break
                if other in stack:
                    low[module] = min(low[module], order[other])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[module])
                if low[module] == order[module]:
                    at = stack.index(module)
                    found.append(sorted(stack[at:]))
                    del stack[at:]

    for module in sorted(edges):
        if module not in order:
            visit(module)
    return sorted((circle for circle in found if len(circle) > 1), key=len, reverse=True)


def spans(circle):
    return len({module.rsplit("/", 1)[0] for module in circle}) > 1


def readmes(root):
    """(words, path), longest first; what builds leave in the tree has none of ours."""
    found = [path for path in root.rglob("README.md") if not any(part in MADE or part.startswith("build") for part in path.relative_to(root).parts)]
    return sorted(((len(path.read_text().split()), str(path.relative_to(root))) for path in found), reverse=True)


def figures(root):
    texts = {name: (root / name).read_text(encoding="utf-8", errors="replace") for name in sources(root)}
    lines = {folder: sum(text.count("\n") for name, text in texts.items() if name.startswith(folder + "/")) for folder in ("server", "clients")}
    found = circles(modules(texts))
    named = {fact: homes(texts, *how) for fact, how in FACTS.items()}
    words = readmes(root)
    return {"lines": lines,
            "homes": {fact: {"count": len(files), "files": files} for fact, files in named.items()},
            "circles": {"across_rooms": [circle for circle in found if spans(circle)], "sizes_within": [len(c) for c in found if not spans(c)]},
            "readmes": {"longest": words[0], "over_900_words": [name for count, name in words if count > 900]}}


def main():
    made = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    made.add_argument("root", type=pathlib.Path)
    made.add_argument("-o", "--output", type=pathlib.Path)
    options = made.parse_args()
    result = figures(options.root.resolve())
    if options.output:
        options.output.write_text(json.dumps(result, indent=1) + "\n")
    print("lines", result["lines"])
    for fact, row in result["homes"].items():
        print("homes of a", fact, row["count"])
    print("circles across rooms", len(result["circles"]["across_rooms"]), "within", result["circles"]["sizes_within"])
    print("longest README", *result["readmes"]["longest"], "over 900 words", len(result["readmes"]["over_900_words"]))
    return 1 if result["circles"]["across_rooms"] or result["lines"]["server"] < 1000 else 0


if __name__ == "__main__":
    sys.exit(main())
