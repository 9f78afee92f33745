"""bench --figures from end to end: figures to groups, groups to papers.json and a page."""
import datetime
import shlex
import sys
import time

from ... import techniques
from .. import measure
from ..options import refuse
from ..store import machine, settings_text
from ...daemon import Daemon, RenderError

from . import load_figure, measured, options, page, scenes
from .store import Store

EXIT_INTERRUPTED, EXIT_FAILED = 130, 5


def main(words):
    asked = options.parse(words)
    _check_scenes(asked)
    with Daemon(device=asked.device, timeout_s=measure.FRAME_SECONDS) as daemon:
        session = Session(daemon, asked, words)
        try:
            session.run()
            code = EXIT_FAILED if session.failed else 0
        except KeyboardInterrupt:
            say("interrupted; what there is stays")
            code = EXIT_INTERRUPTED
    return page.write_page(asked, session.store, say) or code


def _check_scenes(asked):
    """A folder without any of the scenes is a mistake; what it lacks of them is skipped."""
    wanted = {scene for name in asked.figures for group in load_figure(name).groups() for run in group.runs
              for scene in run.scenes}
    if not any(not scene.file or (asked.scenes / scene.file).is_file() for scene in wanted):
        refuse(f"--scenes {asked.scenes}: has none of the scenes of these figures, as {min(s.file for s in wanted)}")


def say(text):
    print(f"bench: {text}", file=sys.stderr, flush=True)


def shown(asked, words):
    """What was typed, without this machine's folders."""
    places = {str(asked.scenes): "$S", str(asked.output): asked.output.name or "."}

    def word(text):
        option, equals, value = text.partition("=") if text.startswith("--") else ("", "", text)
        return option + equals + places[value] if value in places else shlex.quote(text)
    return " ".join(["bounce bench", *map(word, words)])


class Session:
    """One run of the command, over some figures."""

    def __init__(self, daemon, asked, words):
        self.asked = asked
        self.stage = measure.Stage(daemon, (64, 64), None)
        self.techniques = {t.name: t for t in techniques.registered(daemon)}
        self.store = Store(asked.output)
        self.figures = [load_figure(name) for name in asked.figures]
        self.origin = {"command": shown(asked, words), "machine": machine(), "shrink": asked.shrink}
        self.device = None  # what reports say of it, and of the build; the first scene asks
        self.failed = False

    def run(self):
        for item in self.figures:
            plan = item.groups()
            self.store.keep_only(item.name, {group.name for group in plan})
            for group in plan:
                self._group(item, group)
            self.store.save()

    def _group(self, item, group):
        label = f"{item.name}, {group.name}"
        lacking = self._lacking(group)
        if lacking:
            self._note(item, group, lacking)
            return
        try:
            paths = {scene: self._open(scene) for run in group.runs for scene in run.scenes}
            key = self._key(group, paths)
            if self.store.holds(item.name, group.name, key):
                say(f"{label}: measured before")
                return
            self.store.forget(item.name, group.name)
            start = time.monotonic()
            points = measured.of_group(self.stage, group, paths, self.asked.shrink, self.asked.runs)
        except scenes.Missing as fault:
            self._note(item, group, f"skipped: {fault}")
        except RenderError as fault:
            self.failed = True
            self._note(item, group, f"failed: {fault} ({fault.command})")
        else:
            seconds = time.monotonic() - start
            say(f"{label}: {len(points)} points in {seconds:.1f} s")
            self.store.put({"figure": item.name, "name": group.name, "key": key, **self.origin,
                            **self.device, "date": _now(), "seconds": seconds, "points": points})

    def _lacking(self, group):
        """What of the techniques that a group needs this build has not; "" if nothing."""
        wanted = {(run.technique, None) for run in group.runs} | set(group.needs)
        for name, parameter in sorted(wanted, key=str):
            technique = self.techniques.get(name)
            if not technique:
                return f"skipped: this build has no technique {name}"
            if parameter and not technique.has(parameter):
                return f"skipped: {name} of this build has no parameter {parameter}"
        return ""

    def _note(self, item, group, text):
        say(f"{item.name}, {group.name}: {text}")
        self.store.notes.append({"figure": item.name, "group": group.name, "text": text})

    def _open(self, scene):
        path = scene.open(self.asked.scenes, self.stage.daemon.folder / "made")
        self.stage.scene(path)
        if not self.device:
            report = self.stage.ask(self.stage.daemon.report, path, "direct", {}, extra=("--plan",))
            self.device = {"device": report["device"], "build": report["build"]}
        return path

    def _key(self, group, paths):
        """Of all that the points depend on, but the machine: a faster one is asked in another DIR."""
        def film(run):
            return [*(self.stage.scene(paths[scene]).hash for scene in run.film), run.moves_as] if run.film else []

        frames = [(run.label, self.stage.scene(paths[run.scene]).hash, run.technique,
                   settings_text(run.all_settings), measured.size_px(run, self.asked.shrink),
                   run.camera, run.against, run.timed, *([run.aa] if run.aa > 1 else []), *film(run)) for run in group.runs]
        return measure.digest(*frames, self.asked.runs, self.device["device"]["class"],
                              self.device["build"])


def _now():
    return datetime.datetime.now().astimezone().isoformat(timespec="seconds")
