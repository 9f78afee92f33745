"""bench from end to end: scenes, contestants and rungs to points, points to bench.json and a page."""
import datetime
import shlex
import sys

from .. import exr
from ..daemon import Daemon, RenderError
from ..techniques import registered
from . import compare, contestants, measure, options, rungs
from .cycles import Cycles
from .figures import write_page
from .papers import command as papers
from .papers.options import wanted as wants_papers
from .references import References
from .store import Store, machine, rung_text, settings_text
from .summary import LAYERS, summarize

EXIT_INTERRUPTED, EXIT_BUDGET = 130, 5


def main(words):
    if wants_papers(words):
        return papers.main(words)
    asked = options.parse(words)
    with Daemon(device=asked.device, timeout_s=measure.FRAME_SECONDS) as daemon:
        bench = Bench(daemon, asked, words)
        try:
            bench.run()
            code = EXIT_BUDGET if bench.failed() else 0
        except KeyboardInterrupt:
            say("interrupted; what there is stays")
            code = EXIT_INTERRUPTED
        return bench.finish() or code


def say(text):
    print(f"bench: {text}", file=sys.stderr, flush=True)


class Bench:
    """One run. `result` is what becomes bench.json."""

    def __init__(self, daemon, asked, words):
        self.asked = asked
        self.stage = measure.Stage(daemon, asked.size, asked.camera)
        self.contestants = contestants.chosen(daemon, asked.technique or ())
        self._check_settings()
        self.reference = _reference_of(daemon)
        common = {k: v for k, v in asked.settings.items() if self.reference.has(k)}
        error = asked.reference_error / 100 if asked.reference_error else None
        self.references = References(self.stage, asked.cache, common, asked.reference_spp, error,
                                     say)
        self.cycles = Cycles(self.stage, self.references)
        self.store = Store(asked.output, {
            "title": asked.title, "command": shlex.join(["bounce", "bench", *words]),
            "date": datetime.datetime.now().astimezone().isoformat(timespec="seconds"),
            "machine": machine(), "device": {}, "build": ""})
        self.result = self.store.result
        self.result["settings"] = asked.settings
        self.result["techniques"] = [
            {"name": c.name, "summary": c.summary, "is_reference": c.is_unbiased,
             "ladder": [settings_text(r) for r in self._ladder(c)]} for c in self.contestants]
        self.device = None
        self.paths = {}  # of scenes, by their name in the result

    def _check_settings(self):
        """A ladder or a setting that nothing here reads is a mistake, not a wish."""
        names = {c.name for c in self.contestants}
        for name in self.asked.ladders:
            if name not in names:
                options.refuse(f"--ladder {name}: no such technique in this run")
        for key in self.asked.settings:
            if not any(c.has(key) for c in self.contestants):
                options.refuse(f"--set {key}: no technique of this run reads it")

    def _ladder(self, contestant):
        return self.asked.ladders.get(contestant.name, contestant.ladder)

    def _common(self, contestant):
        common = {k: v for k, v in self.asked.settings.items() if contestant.has(k)}
        return {**common, **contestant.settings}

    def failed(self):
        return [p for p in self.result["points"] if p["state"] == "failed"]

    # --- scenes -----------------------------------------------------------------------------

    def run(self):
        for path in self.asked.scenes:
            try:
                scene = self._open(path)
            except RenderError as fault:
                self._failed_scene(path, fault)
                continue
            for contestant in self.contestants:
                self._run_contestant(scene, contestant)

    def _open(self, path):
        """A scene's entry in the result; the first frame of all says what the device is."""
        scene = self.stage.scene(path)
        asks = next((c.asked for c in self.contestants if c.asked), self.reference.name)
        report = self.stage.ask(self.stage.daemon.report, path, asks, {})
        self.device = self.device or report["device"]["class"]
        if not self.result["device"]:
            self.result.update(device=report["device"], build=report["build"])
        entry = {"name": self._free_name(scene.name), "file": path.name, "hash": scene.hash,
                 "size": list(self.asked.size), "camera": report["camera"],
                 "triangles": scene.answer["counts"]["triangles"]}
        self.result["scenes"].append(entry)
        self.paths[entry["name"]] = path
        return entry

    def _free_name(self, name):
        taken = {s["name"] for s in self.result["scenes"]}
        return next(n for n in (name, *(f"{name} ({i})" for i in range(2, 999))) if n not in taken)

    def _failed_scene(self, path, fault):
        say(f"{path.name}: {fault}")
        self.result["points"].append({"key": measure.digest(path), "scene": path.stem, "technique": "",
                                      "settings": {}, "state": "failed", "pictures": [],
                                      "fault": str(fault), "command": fault.command})
        self.store.save()

    # --- points -----------------------------------------------------------------------------

    def _run_contestant(self, scene, contestant):
        ladder = self._ladder(contestant)
        for number, rung in enumerate(ladder, 1):
            label = f"{scene['name']}, {contestant.name} {settings_text(rung)}"
            point = self._point(scene, contestant, rung)
            self.result["points"].append(point)
            self.store.save()
            say(f"{label} ({number} of {len(ladder)}): {_outcome(point)}")
        try:
            self._decompose(scene, contestant)
        except RenderError as fault:
            say(f"{scene['name']}, {contestant.name}: no steps: {fault}")
        self._note_references(scene)
        self.store.save()

    def _key(self, scene, contestant, settings):
        asked = self.asked
        return measure.digest(scene["hash"], contestant.name, settings_text(settings), asked.size,
                              scene["camera"], asked.runs, asked.seeds, asked.reference_spp,
                              asked.reference_error, self.device, self.result["build"])

    def _point(self, scene, contestant, rung):
        settings = {**self._common(contestant), **rung}
        key = self._key(scene, contestant, settings)
        earlier = self.store.taken_over(key)
        if earlier:
            return earlier
        command = self.stage.daemon.command(self.paths[scene["name"]], contestant.asked or contestant.name,
                                            settings, self.asked.size, self.asked.camera, measure.LAYERS)
        point = {"key": key, "scene": scene["name"], "technique": contestant.name,
                 "settings": settings, "rung": rung, "pictures": [], "command": shlex.join(command)}
        try:
            point.update(self._measured(scene, contestant, settings, key), state="done")
        except RenderError as fault:
            point.update(state="failed", fault=str(fault))
        return point

    def _measured(self, scene, contestant, settings, key):
        path, asked, report = self.paths[scene["name"]], self.asked, {}
        def keep(seed):
            return self.store.pictures / f"{key}-{seed}.exr"
        if contestant.asked:
            time, report = measure.timed(self.stage, path, contestant, settings, asked.runs, asked.seeds[0])
            seeds = measure.pictures(self.stage, path, contestant.asked, settings, asked.seeds, keep)
        else:
            seeds = asked.seeds
            time = self.cycles.measured(path, scene["camera"], contestant.is_filtered, settings, seeds, keep)
        files = [keep(seed).name for seed in seeds]
        return {"time_ms": time, "seeds": seeds, "pictures": files,
                "error": self._errors(path, contestant, files), "flags": report.get("flags", []),
                "counts": report.get("counts", {})}

    def _errors(self, path, contestant, files):
        """By reference and layer; over several seeds the root of the mean square."""
        model = rungs.limit_of(contestant.technique) if contestant.has_own_model else rungs.FULL
        truths = {"full": rungs.FULL, "model": model}
        found = {}
        for against, settings in truths.items():
            reference = self.references.get(path, settings)
            each = [compare.measured(self.stage.daemon, reference.path, self.store.pictures / file)
                    for file in files]
            found[against] = {layer: compare.over_seeds([e[layer] for e in each])
                              for layer in LAYERS if all(layer in e for e in each)}
        return found

    # --- references -------------------------------------------------------------------------

    def _decompose(self, scene, contestant):
        """The steps from the full reference to the technique's most exact picture."""
        done = [p for p in self.result["points"] if p["scene"] == scene["name"]
                and p["technique"] == contestant.name and p["state"] == "done"
                and p["error"]["model"]["beauty"]["value"] is not None]
        if not (contestant.has_own_model and done):
            return
        best = min(done, key=lambda p: p["error"]["model"]["beauty"]["value"])
        picture, _ = exr.read((self.store.pictures / best["pictures"][0]).read_bytes())
        ladder = rungs.rungs_of(contestant.technique)
        chain = [self.references.get(self.paths[scene["name"]], settings).planes for _, settings in ladder]
        names = [name for name, _ in ladder[1:]]
        names.append(f"settings: {rung_text(best)}")
        for layer in LAYERS:
            found = rungs.decomposition(names, chain, picture, layer)
            if found:
                self.result["decomposition"].append(
                    {"scene": scene["name"], "technique": contestant.name, **found})

    def _note_references(self, scene):
        known = {r["file"] for r in self.result["references"]}
        for reference in self.references.made.values():
            if reference.scene == self.paths[scene["name"]] and reference.path.name not in known:
                self.result["references"].append({"scene": scene["name"], **reference.summary()})

    # --- the end ----------------------------------------------------------------------------

    def finish(self):
        """Writes what there is; the exit code of the page, 0 if it could be made."""
        self.result["summary"] = summarize(self.result)
        self.store.save()
        for scene in self.result["scenes"]:
            say(f"{scene['name']}: {self.result['summary'][scene['name']]['advice']}")
        return write_page(self)


def _reference_of(daemon):
    found = [t for t in registered(daemon) if t.is_reference]
    if not found:
        raise SystemExit("this daemon has no reference to measure against")
    return found[0]


def _outcome(point):
    if point["state"] != "done":
        return f"failed: {point['fault']}"
    error = point["error"]["full"]["beauty"]["value"]
    text = "unknown" if error is None else f"{100 * error:.3g} %"
    return f"{point['time_ms']['frame']['median']:.4g} ms, error {text}"
