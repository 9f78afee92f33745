"""Edits of a scene: a batch that is collected here and applied there, wholly or not at all."""
from __future__ import annotations

import os
import secrets
from dataclasses import dataclass, field
from numbers import Integral
from types import TracebackType
from typing import Any, Union, Unpack

import numpy
from numpy.typing import ArrayLike

from . import due, fields as rows
from .conn import Connection
from .fields import CameraFields, LightFields, MaterialFields
from .files import Content, PathLike, content_of, file_content, scene_contents, upload
from .frame import FrameOptions, fill_request
from .messages import pb
from .payload import Payload, float_array, index_array
from .types import Vector

NONE = -1  # as a reference: no object


class Handle:
    """What an operation adds. Names it in the same batch at once, and anywhere once the batch was
    applied; `id` is the daemon's number for it then."""

    def __init__(self, edit: Edit, operation: int) -> None:
        self._edit = edit
        self._operation = operation
        self._id: int | None = None

    @property
    def id(self) -> int:
        """The object's id. ValueError before the batch was applied."""
        if self._id is None:
            raise ValueError("it is not there yet: its batch was not applied")
        return self._id

    def reference(self, edit: Edit) -> int:
        """The number that means it in a batch."""
        if self._id is None and edit is self._edit:
            return -2 - self._operation
        return self.id

    def __repr__(self) -> str:
        return f"<object {self._id}>" if self._id is not None else "<object to be added>"


Reference = Union[int, Handle]  # NONE for none


class NodeFields(rows.NodeFields, total=False):
    translation: Vector    # parent_from_node, metres
    rotation: Vector       # quaternion x y z w
    scale: Vector
    matrix: ArrayLike      # instead of the three: 4 x 4, affine, translation in the last column


class TextureFields(rows.TextureFields, total=False):
    image: PathLike | bytes  # a PNG or JPEG file, or its bytes


@dataclass
class Primitive:
    """A list of triangles. What is missing is made as for glTF.

    positions  n x 3, metres            uv0, uv1  n x 2
    indices    m x 3, whole numbers     colors    n x 4, linear
    normals    n x 3                    tangents  n x 4
    material   a reference; a white one where None
    """

    positions: ArrayLike
    indices: ArrayLike | None = None
    normals: ArrayLike | None = None
    tangents: ArrayLike | None = None
    uv0: ArrayLike | None = None
    uv1: ArrayLike | None = None
    colors: ArrayLike | None = None
    material: Reference | None = None


_WIDTHS = {"positions": 3, "normals": 3, "tangents": 4, "uv0": 2, "uv1": 2, "colors": 4}
_LENGTHS = {"translation": 3, "scale": 3, **rows.LENGTHS}
_TRANSFORM = ("translation", "rotation", "scale", "matrix")


@dataclass(frozen=True)
class EditResult:
    """What became of a batch.

    revision     the scene's, after it; of a transient batch the one beneath it
    transient    not 0: so many transient batches lie on that revision
    ids          of what each operation added, else -1
    hash         "sha256:HEX" of the snapshot
    repeated_id  whether this is the first answer to the same client_edit_id, said again
    invalidates  of a dry run: passes that `frame` would run again
    keeps        and those that it would not
    flags        what was repaired
    author       whose it is: the token or user and, behind a space, `by`
    of           the revision that an undo, redo or revert is about, else 0
    """

    revision: int
    transient: int = 0
    ids: list[int] = field(default_factory=list)
    hash: str = ""
    repeated_id: bool = False
    invalidates: list[str] = field(default_factory=list)
    keeps: list[str] = field(default_factory=list)
    flags: list[str] = field(default_factory=list)
    author: str = ""
    of: int = 0


def new_edit_id() -> str:
    """For a durable change without an id of its own: the connection may break and send it again
    although the daemon had it, and an id makes it count once."""
    return "py-" + secrets.token_hex(12)


def result_of(reply: Any) -> EditResult:
    return EditResult(reply.revision, reply.transient, list(reply.ids), reply.hash,
                      reply.repeated_id, list(reply.invalidates), list(reply.keeps),
                      list(reply.flags), reply.author, reply.of)


class Edit:
    """One batch, made by `Scene.edit`.

    As a context manager it is applied at the end of the block; nothing is sent if the block raises.
    Without one, `apply` does it. `result` is set then. Operations happen in the order in which they
    were called; what `add_...` and `import_file` return names the object in later operations.
    """

    def __init__(self, conn: Connection, scene: str, *, transient: bool = False,
                 dry_run: bool = False, frame: FrameOptions | None = None, message: str = "",
                 base_revision: int | None = None, client_edit_id: str | None = None) -> None:
        if frame is not None and not dry_run:
            raise TypeError("frame goes with dry_run")
        self._conn = conn
        self._batch = pb.EditBatch(scene=scene, by=conn.by)
        self._payload = Payload()
        self._contents: list[Content] = []
        self._handles: list[Handle] = []
        self.result: EditResult | None = None
        if transient:
            self._batch.durability = "transient"
        if dry_run:
            self._batch.dry_run = True
        if frame is not None:
            fill_request(self._batch.frame, frame)
        if message:
            due.put(self._batch, "message", message)
        if base_revision is not None:
            due.put(self._batch, "base_revision", base_revision)
        if client_edit_id is not None:
            due.put(self._batch, "client_edit_id", client_edit_id)
        elif not transient and not dry_run:
            self._batch.client_edit_id = new_edit_id()

    def __enter__(self) -> Edit:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        if kind is None:
            self.apply()

    def apply(self) -> EditResult | None:
        """Sends the batch and waits until it is applied: durably, unless it is transient. An empty
        batch is not sent, and gives None. Error, and nothing changed, if the daemon refuses it;
        `field` then says where: "ops[3].set_light.intensity"."""
        if self.result is not None:
            raise ValueError("this batch was applied already")
        if not self._batch.ops:
            return None
        pieces, contents = self._payload.place(self._room_bytes())
        upload(self._conn, [*self._contents, *contents])
        reply = self._conn.call("edit_batch", self._batch, "edit_reply", pieces)
        self.result = result_of(reply)
        if not self._batch.dry_run:
            for handle in self._handles:
                handle._id = self.result.ids[handle._operation]
        return self.result

    def _room_bytes(self) -> int:
        """What is left for a payload in one message."""
        # Places of arrays are numbers that the header gains, a few bytes each.
        header_bytes = self._batch.ByteSize() + 64 * (1 + len(self._payload))
        return max(0, self._conn.limits.get("message_bytes", 1 << 24) - header_bytes)

    # --- how operations are written down ---

    def _operation(self, name: str) -> Any:
        message = getattr(self._batch.ops.add(), name)
        message.SetInParent()
        return message

    def _added(self, name: str, fields: Any) -> Handle:
        handle = Handle(self, len(self._batch.ops))
        self._write(name, fields)
        self._handles.append(handle)
        return handle

    def _write(self, name: str, fields: Any) -> None:
        """One operation; none at all if something is wrong with the fields."""
        message = self._operation(name)
        try:
            self._fill(message, fields)
        except BaseException:
            del self._batch.ops[-1]
            raise

    def _fill(self, message: Any, fields: Any) -> None:
        transform = {key: fields[key] for key in _TRANSFORM if key in fields}
        known = message.DESCRIPTOR.fields_by_name
        for name, value in fields.items():
            if value is None:
                continue
            if name in transform and "transform" in known:
                continue
            if name not in known:
                raise TypeError(f"no such field of {message.DESCRIPTOR.name}: {name}")
            self._set(message, name, value)
        if transform and "transform" in known:
            self._fill(message.transform, transform)

    def _set(self, message: Any, name: str, value: Any) -> None:
        if name in rows.REFERENCES:
            setattr(message, name, self._reference(name, value))
        elif name == "matrix":
            message.matrix.extend(_column_major(value))
        else:
            due.put(message, name, value, _LENGTHS.get(name))

    def _reference(self, name: str, value: Reference) -> int:
        if isinstance(value, Handle):
            return value.reference(self)
        if not isinstance(value, Integral) or isinstance(value, bool):
            due.wrong_kind(name, "an object's id, NONE, or what an operation returned", value)
        return due.whole(name, value, NONE, (1 << 31) - 1)

    def _remove(self, name: str, value: Reference) -> None:
        reference = self._reference(name.removeprefix("remove_"), value)
        self._operation(name).id = reference

    # --- nodes ---

    def add_node(self, **fields: Unpack[NodeFields]) -> Handle:
        """A node; shown, and a root of the scene, unless said otherwise."""
        return self._added("add_node", fields)

    def set_node(self, node: Reference, **fields: Unpack[NodeFields]) -> None:
        """Changes what is named; the transform as a whole, if any part of it is."""
        self._write("set_node", {"node": node, **fields})

    def set_transform(self, node: Reference, *, translation: Vector | None = None,
                      rotation: Vector | None = None, scale: Vector | None = None,
                      matrix: ArrayLike | None = None) -> None:
        """Where a node lies in its parent. What is left out is no movement, rotation or scale."""
        self._write("set_transform", {"node": node, "translation": translation,
                                        "rotation": rotation, "scale": scale, "matrix": matrix})

    def remove_node(self, node: Reference) -> None:
        """And all below it."""
        self._remove("remove_node", node)

    # --- meshes ---

    def add_mesh(self, *primitives: Primitive, name: str | None = None) -> Handle:
        """A mesh of one primitive or more; a node shows it."""
        handle = Handle(self, len(self._batch.ops))
        self._write_mesh("add_mesh", {"name": name}, primitives)
        self._handles.append(handle)
        return handle

    def set_mesh(self, mesh: Reference, *primitives: Primitive, name: str | None = None) -> None:
        """All primitives anew."""
        self._write_mesh("set_mesh", {"mesh": mesh, "name": name}, primitives)

    def _write_mesh(self, operation: str, fields: Any, primitives: tuple[Primitive, ...]) -> None:
        for primitive in primitives:
            if not isinstance(primitive, Primitive):
                due.wrong_kind("primitives", "a bounced.Primitive", primitive)
        arrays = [_arrays_of(primitive) for primitive in primitives]
        materials = [None if primitive.material is None else self._reference("material", primitive.material)
                     for primitive in primitives]
        self._write(operation, fields)
        message = getattr(self._batch.ops[-1], operation)
        for material, named in zip(materials, arrays):
            entry = message.primitives.add()
            if material is not None:
                entry.material = material
            for name, array in named.items():
                self._payload.add(getattr(entry, name), array)

    def set_mesh_vertices(self, mesh: Reference, positions: ArrayLike,
                          normals: ArrayLike | None = None, primitive: int = 0) -> None:
        """New places for the vertices of one primitive, as many as it has.

        positions  n x 3, metres, in the mesh's own space
        normals    n x 3; made anew from the triangles where None
        """
        arrays = {"positions": float_array("positions", positions, 3)}
        if normals is not None:
            arrays["normals"] = float_array("normals", normals, 3)
        self._write("set_mesh_vertices", {"mesh": mesh, "primitive": primitive})
        message = self._batch.ops[-1].set_mesh_vertices
        for name, array in arrays.items():
            self._payload.add(getattr(message, name), array)

    def remove_mesh(self, mesh: Reference) -> None:
        """Refused while something uses it, as all below."""
        self._remove("remove_mesh", mesh)

    # --- materials and textures ---

    def add_material(self, **fields: Unpack[MaterialFields]) -> Handle:
        return self._added("add_material", fields)

    def set_material(self, material: Reference, **fields: Unpack[MaterialFields]) -> None:
        self._write("set_material", {"material": material, **fields})

    def remove_material(self, material: Reference) -> None:
        self._remove("remove_material", material)

    def add_texture(self, **fields: Unpack[TextureFields]) -> Handle:
        return self._added("add_texture", self._texture(fields))

    def set_texture(self, texture: Reference, **fields: Unpack[TextureFields]) -> None:
        self._write("set_texture", {"texture": texture, **self._texture(fields)})

    def _texture(self, fields: Any) -> dict[str, Any]:
        out = dict(fields)
        image = out.pop("image", None)
        if image is not None and not isinstance(image, (bytes, str, os.PathLike)):
            due.wrong_kind("image", "a path, or the bytes of a picture,", image)
        if image is not None:
            content = content_of(image) if isinstance(image, bytes) else file_content(image)
            self._contents.append(content)
            out["blob"] = content.blob
        return out

    def remove_texture(self, texture: Reference) -> None:
        self._remove("remove_texture", texture)

    # --- lights, cameras, sky ---

    def add_light(self, **fields: Unpack[LightFields]) -> Handle:
        """A light; a node holds it."""
        return self._added("add_light", fields)

    def set_light(self, light: Reference, **fields: Unpack[LightFields]) -> None:
        self._write("set_light", {"light": light, **fields})

    def remove_light(self, light: Reference) -> None:
        self._remove("remove_light", light)

    def add_camera(self, **fields: Unpack[CameraFields]) -> Handle:
        """A camera; a node holds it, and it looks along the node's -z."""
        return self._added("add_camera", fields)

    def set_camera(self, camera: Reference, **fields: Unpack[CameraFields]) -> None:
        self._write("set_camera", {"camera": camera, **fields})

    def remove_camera(self, camera: Reference) -> None:
        self._remove("remove_camera", camera)

    def set_environment(self, radiance: Vector | None = None, map: PathLike | None = None,
                        rotation: Vector | None = None) -> None:
        """Light from infinitely far away.

        radiance  RGB in cd/m^2; of a map, a factor on it
        map       an EXR or Radiance (.hdr) file: the whole sphere, zenith on top
        rotation  how the map is turned: quaternion x y z w; alone, it turns what is there
        """
        fields: dict[str, Any] = {"radiance": radiance}
        if radiance is not None:
            fields["radiance"] = due.row("radiance", radiance, length=3)
        if rotation is not None:
            fields["rotation"] = due.row("rotation", rotation, length=4)
        if map is not None:
            content = file_content(map)
            self._contents.append(content)
            fields["map"] = content.blob
        self._write("set_environment", fields)

    # --- whole files ---

    def import_file(self, path: PathLike, parent: Reference | None = None,
                    name: str | None = None) -> Handle:
        """A glTF file's default scene, as children of a new node under `parent`; its uris are
        resolved as `Scenes.add` does. Returns the new node."""
        reference = None if parent is None else self._reference("parent", parent)
        contents = scene_contents(path)
        handle = self._added("import", {"blob": contents[0].blob,
                                        "name": name or os.path.basename(os.fspath(path))})
        message = getattr(self._batch.ops[-1], "import")
        if reference is not None:
            message.parent = reference
        for content in contents[1:]:
            message.files.add(key=content.uri, value=content.blob)
        self._contents += contents
        return handle


def _column_major(matrix: Any) -> list[float]:
    if isinstance(matrix, (str, bytes)) or not hasattr(matrix, "__iter__"):
        due.wrong_kind("matrix", "a table of 4 x 4 numbers", matrix)
    given = matrix if isinstance(matrix, numpy.ndarray) else list(matrix)
    if len(given) != 4:
        raise ValueError(f"matrix: 4 x 4 numbers are due, not {len(given)} rows")
    rows = [due.row(f"matrix[{i}]", row, length=4) for i, row in enumerate(given)]
    return [rows[row][column] for column in range(4) for row in range(4)]


def _arrays_of(primitive: Primitive) -> dict[str, Any]:
    """Arrays by name, checked before anything is written down."""
    arrays = {name: float_array(name, values, width) for name, width in _WIDTHS.items()
              if (values := getattr(primitive, name)) is not None}
    count = len(arrays["positions"])
    for name, array in arrays.items():
        if len(array) != count:
            raise ValueError(f"{name}: {len(array)} rows beside {count} positions")
    if primitive.indices is not None:
        arrays["indices"] = index_array("indices", primitive.indices)
        if arrays["indices"].size and arrays["indices"].max() >= count:
            raise ValueError(f"indices: {arrays['indices'].max()} beside {count} positions")
    return arrays
