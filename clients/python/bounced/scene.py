"""Scenes that the daemon holds."""
from __future__ import annotations

import os
from typing import Any, Callable, Iterator, Unpack, cast

from . import due
from .conn import Connection, Pending
from .edit import Edit, EditResult, new_edit_id, result_of
from .errors import Unreachable
from .files import Content, PathLike, file_content, scene_contents, upload
from .frame import Frame, FrameOptions, read_frame, render_request
from .messages import as_dict, pb
from .types import LogEntry, SceneInfo, SceneObject, Vector
from .view import View, Watch

# (stage, share): import | queue | render | check | encode, and how much of it is done, 0 to 1,
# where that can be told. Called on a thread of the client: keep it short.
OnProgress = Callable[[str, "float | None"], None]


def start_render(conn: Connection, request: Any, progress: OnProgress | None) -> Pending[Frame]:
    def on_event(envelope: Any, _: memoryview) -> None:
        if progress is not None and envelope.WhichOneof("body") == "progress":
            event = envelope.progress
            progress(event.stage, event.share if event.HasField("share") else None)

    return conn.start("render", request, read_frame, on_event=on_event)


class Environment:
    """Light from infinitely far away, over a scene from a file.

    radiance  RGB in cd/m^2; of a map, a factor on it
    map       an EXR or Radiance (.hdr) file: the whole sphere, zenith on top
    rotation  how the map is turned: quaternion x y z w
    """

    def __init__(self, radiance: Vector | None = None, map: PathLike | None = None,
                 rotation: Vector | None = None) -> None:
        self.radiance = None if radiance is None else due.row("radiance", radiance, length=3)
        self.rotation = None if rotation is None else due.row("rotation", rotation, length=4)
        self.content: Content | None = None if map is None else file_content(map)

    def fill(self, message: Any) -> None:
        message.SetInParent()
        if self.radiance is not None:
            message.radiance.extend(self.radiance)
        if self.rotation is not None:
            message.rotation.extend(self.rotation)
        if self.content is not None:
            message.map = self.content.blob


def send_file(conn: Connection, path: PathLike, environment: Environment | None,
              request: Any) -> None:
    """Uploads a scene's files and names them in a SceneAdd or a Render."""
    if environment is not None and not isinstance(environment, Environment):
        due.wrong_kind("environment", "a bounced.Environment", environment)
    contents = scene_contents(path)
    request.name = os.path.basename(os.fspath(path))
    request.blob = contents[0].blob
    for content in contents[1:]:
        request.files.add(key=content.uri, value=content.blob)
    if environment is not None:
        environment.fill(request.environment)
        contents += [environment.content] if environment.content else []
    upload(conn, contents)


def _fill_revision(request: Any, parameter: str, revision: Any) -> None:
    """By number or by name."""
    if isinstance(revision, str):
        request.name = revision
    elif revision is not None:
        request.revision = due.whole(parameter, revision)


class Scene:
    """One scene, by its id. Asks the daemon for everything; keeps nothing but the id."""

    def __init__(self, conn: Connection, scene_id: str) -> None:
        self._conn = conn
        self.id = due.text("scene_id", scene_id)

    def __repr__(self) -> str:
        return f"<bounced scene {self.id}>"

    # --- what it is ---

    def info(self) -> SceneInfo:
        """Name, revision, cameras, lights, counts, bounds (metres), flags."""
        reply = self._conn.call("scene_get", pb.SceneGet(id=self.id), "scene")
        return cast(SceneInfo, as_dict(reply))

    @property
    def revision(self) -> int:
        """The current one, asked for anew."""
        return self.info().get("revision", 0)

    def objects(self, kind: str | None = None) -> list[SceneObject]:
        """What edits can name, each with its id and state; only the nodes, meshes, materials,
        textures, lights or cameras with a `kind`."""
        reply = self._conn.call("scene_get", pb.SceneGet(id=self.id, objects=True), "scene")
        found = [cast(SceneObject, as_dict(item)) for item in reply.objects]
        return [item for item in found if kind in (None, item.get("kind"))]

    def export(self, path: PathLike | None = None, revision: int | str | None = None) -> bytes:
        """The scene as it is, or as it was at a revision or a named one, as a .glb; written to
        `path` too, where one is given."""
        def read(envelope: Any, payload: memoryview) -> Frame:
            if envelope.WhichOneof("body") != "scene_export_reply":
                raise Unreachable(f"export was answered by {envelope.WhichOneof('body')}")
            return Frame({}, "glb", bytes(payload))

        if path is not None:
            due.path("path", path)
        request = pb.SceneExport(scene=self.id)
        _fill_revision(request, "revision", revision)
        exported = self._conn.start("scene_export", request, read).wait()
        if path is not None:
            exported.save(path)
        return exported.data

    def remove(self) -> None:
        """Takes it away, with its history."""
        self._conn.call("scene_remove", pb.SceneRemove(id=self.id), "done")

    # --- changing it ---

    def edit(self, *, transient: bool = False, dry_run: bool = False,
             frame: FrameOptions | None = None, message: str = "",
             base_revision: int | None = None, client_edit_id: str | None = None) -> Edit:
        """A batch of operations, applied at the end of a `with` block.

        transient       changes pixels at once and is not kept in the journal, until `commit`
        dry_run         is checked only; `result.invalidates` and `keeps` then say which passes of
                        `frame` would run again
        message         for the log, up to 256 bytes
        base_revision   Conflict unless it is the current one
        client_edit_id  up to 64 bytes; said again, it gets the first answer. A random one where a
                        durable batch has none
        """
        return Edit(self._conn, self.id, transient=transient, dry_run=dry_run, frame=frame,
                    message=message, base_revision=base_revision, client_edit_id=client_edit_id)

    def commit(self, client_edit_id: str | None = None) -> EditResult:
        """Makes one durable batch of what this client's author laid transient on the scene."""
        return self._ask_edit("edit_commit", pb.EditCommit(scene=self.id),
                              client_edit_id=client_edit_id)

    def undo(self, base_revision: int | None = None, scope: str = "mine") -> EditResult:
        """Takes back the last batch that is not taken back yet, as a new revision.

        scope  "mine": the last of this client's author, whatever others did since; Conflict, by a
               line that says who and what, where somebody changed the same property of the same
               object. "all": the last that anybody did
        """
        return self._ask_edit("edit_undo", pb.EditUndo(
            scene=self.id, scope=due.text("scope", scope)),
                              base_revision=base_revision)

    def redo(self, base_revision: int | None = None, scope: str = "mine") -> EditResult:
        """Takes back the last undo, of the same scopes."""
        return self._ask_edit("edit_undo", pb.EditUndo(
            scene=self.id, redo=True, scope=due.text("scope", scope)),
                              base_revision=base_revision)

    def revert(self, to: int | str, base_revision: int | None = None) -> EditResult:
        """Makes the scene what it was at a revision, or at a named one, as a new revision."""
        request = pb.EditRevert(scene=self.id)
        if to is None:
            due.wrong_kind("to", "a revision, by number or by name,", to)
        _fill_revision(request, "to", to)
        return self._ask_edit("edit_revert", request, base_revision=base_revision)

    def _ask_edit(self, name: str, request: Any, **fields: Any) -> EditResult:
        for key, value in fields.items():
            if value is not None:
                due.put(request, key, value)
        if self._conn.by is not None:
            request.by = self._conn.by
        if not request.HasField("client_edit_id"):
            request.client_edit_id = new_edit_id()
        return result_of(self._conn.call(name, request, "edit_reply"))

    # --- its history ---

    def name_revision(self, name: str, revision: int | None = None) -> None:
        """Names a revision, the current one by default: 1 to 64 bytes; one that is taken moves.
        The state that it names is kept as long as the scene."""
        request = pb.RevisionName(scene=self.id, name=due.text("name", name))
        if revision is not None:
            due.put(request, "revision", revision)
        self._conn.call("revision_name", request, "done")

    def forget_name(self, name: str) -> None:
        """Takes a revision's name away."""
        self._conn.call("revision_name", pb.RevisionName(
            scene=self.id, name=due.text("name", name), remove=True), "done")

    def log(self, after: int | None = None, limit: int | None = None) -> list[LogEntry]:
        """Revisions, the oldest first: those beyond `after`, at most the newest `limit` (100)."""
        request = pb.SceneLog(scene=self.id)
        if after is not None:
            due.put(request, "after", after)
        if limit is not None:
            due.put(request, "limit", limit)
        reply = self._conn.call("scene_log", request, "scene_log_reply")
        return [cast(LogEntry, as_dict(entry)) for entry in reply.entries]

    def watch(self) -> Watch:
        """Its events, from now on: `for event in scene.watch(): ...`"""
        return Watch(self._conn, self.id)

    # --- pictures of it ---

    def render(self, *, progress: OnProgress | None = None,
               **options: Unpack[FrameOptions]) -> Frame:
        """One frame, and waits for it; Ctrl-C cancels it. Options: `FrameOptions`."""
        return self.render_later(progress=progress, **options).wait()

    def render_later(self, *, progress: OnProgress | None = None,
                     **options: Unpack[FrameOptions]) -> Pending[Frame]:
        """The same without waiting: several frames may be under way."""
        request = render_request(options, progress is not None)
        request.scene = self.id
        return start_render(self._conn, request, progress)

    def view(self, *, credits: int = 2, frames_per_second: float | None = None,
             refine: bool = True, **options: Unpack[FrameOptions]) -> View:
        """A frame for each change, and of a still picture better and better ones: an iterator.

        credits            frames that may be under way
        frames_per_second  at most; None: as fast as they are taken
        refine             improve a still picture
        options            `FrameOptions`; encoding is "jpeg" by default
        """
        return View(self._conn, self.id, options, credits=credits,
                    frames_per_second=frames_per_second, refine=refine)


class Scenes:
    """The scenes of a daemon: `client.scenes`."""

    def __init__(self, conn: Connection) -> None:
        self._conn = conn

    def add(self, file: PathLike, name: str | None = None,
            environment: Environment | None = None) -> Scene:
        """Gives the daemon a .glb or .gltf.

        What its uris mean is resolved here and sent by content; BadInput for a uri that is
        absolute, has a scheme, or leaves the file's folder. A file that is not there is a
        MissingFileWarning.
        """
        request = pb.SceneAdd()
        send_file(self._conn, file, environment, request)
        if name is not None:
            due.put(request, "name", name)
        return Scene(self._conn, self._conn.call("scene_add", request, "scene").id)

    def list(self) -> list[SceneInfo]:
        reply = self._conn.call("scene_list", pb.SceneList(), "scene_list_reply")
        return [cast(SceneInfo, as_dict(scene)) for scene in reply.scenes]

    def get(self, scene_id: str) -> Scene:
        """The scene of that id; NotFound if the daemon holds none."""
        scene = Scene(self._conn, scene_id)
        scene.info()
        return scene

    def remove(self, scene_id: str) -> None:
        Scene(self._conn, scene_id).remove()

    def __iter__(self) -> Iterator[Scene]:
        return (Scene(self._conn, info["id"]) for info in self.list())
