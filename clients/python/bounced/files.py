"""Files to the daemon: which ones a scene is made of, their names by content, and their upload.

The daemon opens no path that a request names, so a glTF's uris are resolved here, and strictly: a
scene from a stranger must not be able to send the reader's other files anywhere. Refused, with the
JSON path: absolute paths, schemes (data: stays inline), and whatever leaves the scene's folder
after percent-decoding and symbolic links. A file that is not there is left out with a warning:
whether the scene can do without it is the importer's decision.
"""
from __future__ import annotations

import hashlib
import json
import os
import re
import stat
import struct
import warnings
from dataclasses import dataclass
from typing import Any, Iterable, Iterator, Union

from . import due
from .conn import Connection
from .errors import BadInput, Error
from .messages import pb

PathLike = Union[str, "os.PathLike[str]"]
PIECE_BYTES = 1 << 20
JSON_BYTES_MAX = 1 << 30
_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:")
_ESCAPE = re.compile(rb"%([0-9A-Fa-f]{2})")


class MissingFileWarning(UserWarning):
    """A scene names a file that is not there."""


@dataclass(frozen=True)
class Content:
    """Bytes with a name: those of a file, or `data`. `uri` is how the scene spells it."""

    blob: str
    size_bytes: int
    path: str = ""
    data: bytes = b""
    uri: str = ""

    def pieces(self, size: int) -> Iterator[tuple[int, bytes]]:
        """(offset, bytes); an empty content is one empty piece."""
        if not self.path:
            for offset in range(0, max(self.size_bytes, 1), size):
                yield offset, self.data[offset:offset + size]
            return
        offset = 0
        with open_regular(self.path) as file:
            while offset < max(self.size_bytes, 1):
                piece = file.read(min(size, self.size_bytes - offset))
                if not piece and self.size_bytes:
                    raise Error(f"{self.path}: changed while it was read", self.path, "io")
                yield offset, piece
                offset += max(len(piece), 1)


def blob_name(data: bytes | memoryview) -> str:
    return "sha256:" + hashlib.sha256(data).hexdigest()


def content_of(data: bytes) -> Content:
    return Content(blob_name(data), len(data), data=data)


def open_regular(path: str) -> Any:
    """For reading; no FIFO or device, which could block or never end."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
    except OSError as error:
        raise Error(f"{path}: {error.strerror}", path, "io") from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise BadInput(f"{path}: not a regular file", path)
    return os.fdopen(descriptor, "rb")


def file_content(path: PathLike, uri: str = "") -> Content:
    """Reads and hashes one file, whatever is in it."""
    name = due.path("file", path)
    digest, size_bytes = hashlib.sha256(), 0
    with open_regular(name) as file:
        while piece := file.read(PIECE_BYTES):
            digest.update(piece)
            size_bytes += len(piece)
    return Content("sha256:" + digest.hexdigest(), size_bytes, path=name, uri=uri)


def _climbs_out(relative: bytes) -> bool:
    """Without asking the disk: a missing file outside is refused like one that is there."""
    depth = 0
    for part in relative.split(b"/"):
        if part == b"..":
            depth -= 1
        elif part not in (b"", b"."):
            depth += 1
        if depth < 0:
            return True
    return False


def resolve_uri(folder: str, uri: str) -> str | None:
    """The canonical path that a uri means inside `folder` (canonical too); None if nothing is
    there. BadInput if it may not be read. A percent sign that no two digits follow stands for
    itself, since exporters write such names."""
    decoded = _ESCAPE.sub(lambda found: bytes([int(found[1], 16)]), os.fsencode(uri))
    problem = ("empty uri" if not uri else
               "only files beside the scene are read" if _SCHEME.match(uri) else
               "a zero byte in a uri" if b"\0" in decoded else
               "absolute paths are refused" if decoded.startswith(b"/") else
               "leads out of the scene's folder" if _climbs_out(decoded) else None)
    if problem is None:
        try:
            real = os.path.realpath(os.path.join(os.fsencode(folder), decoded), strict=True)
        except (FileNotFoundError, NotADirectoryError):
            return None
        except OSError as error:
            raise BadInput(f"{uri}: {error.strerror}", "uri") from error
        if real.startswith(os.path.join(os.fsencode(folder), b"")):
            return os.fsdecode(real)
        problem = "leads out of the scene's folder"
    raise BadInput(f"{uri[:200]}: {problem}", "uri")


def _json_of(path: str) -> Any:
    """The JSON of a .gltf, or of a .glb's first chunk; None if there is none: the importer refuses
    such a file with the reason."""
    with open_regular(path) as file:
        head = file.read(20)
        size = os.fstat(file.fileno()).st_size
        if head[:4] == b"glTF" and len(head) == 20:
            size = struct.unpack_from("<I", head, 12)[0]
        else:
            file.seek(0)
        if size > JSON_BYTES_MAX:
            return None
        try:
            return json.loads(file.read(size))
        except (ValueError, RecursionError):
            return None


def _uris(root: Any) -> Iterator[tuple[str, str]]:
    """(JSON path, uri). Shapes that glTF does not allow are passed over, for the importer."""
    for kind in ("buffers", "images"):
        items = root.get(kind) if isinstance(root, dict) else None
        for index, item in enumerate(items if isinstance(items, list) else ()):
            uri = item.get("uri") if isinstance(item, dict) else None
            if isinstance(uri, str) and uri[:5].lower() != "data:":
                yield f"{kind}[{index}].uri", uri


def scene_contents(path: PathLike) -> list[Content]:
    """The files that a scene is made of, itself first."""
    name = due.path("file", path)
    contents: dict[str | None, Content] = {None: file_content(name)}
    folder = os.path.realpath(os.path.dirname(name) or ".")
    for place, uri in _uris(_json_of(name)):
        if uri in contents:
            continue
        try:
            found = resolve_uri(folder, uri)
        except BadInput as error:
            raise BadInput(f"{os.path.basename(name)}: {place}: {error.message}",
                           place) from error
        if found is None:
            warnings.warn(f"{uri}: no such file beside {name}", MissingFileWarning, stacklevel=4)
        else:
            contents[uri] = file_content(found, uri)
    return list(contents.values())


def _put(conn: Connection, content: Content, piece_bytes: int) -> None:
    while True:
        generation = conn.generation
        try:
            return _put_pieces(conn, content, piece_bytes)
        except Error:
            # Uploads begin anew on a connection that was taken up again.
            if conn.generation == generation:
                raise


def _put_pieces(conn: Connection, content: Content, piece_bytes: int) -> None:
    complete = False
    for offset, piece in content.pieces(piece_bytes):
        reply = conn.call("blob_put", pb.BlobPut(blob=content.blob, offset=offset,
                                                 size_bytes=content.size_bytes),
                          "blob_reply", (piece,), is_bound=True)
        complete = reply.complete
        if complete:
            return
    raise Error(f"{content.path or content.blob}: sent whole, and the daemon wants more",
                content.path)


def upload(conn: Connection, contents: Iterable[Content]) -> None:
    """Afterwards the daemon holds all of them; what it holds already is not sent."""
    wanted = {content.blob: content for content in contents}
    if not wanted:
        return
    have = conn.call("blob_have", pb.BlobHave(blobs=list(wanted)), "blob_reply").have
    # A header of a piece is some 100 bytes.
    message_bytes = conn.limits.get("message_bytes", PIECE_BYTES)
    piece_bytes = max(1, min(PIECE_BYTES, message_bytes - 512))
    for blob, content in wanted.items():
        if blob not in have:
            _put(conn, content, piece_bytes)
