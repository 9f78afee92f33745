"""Frames: what is asked for, and what comes back."""
from __future__ import annotations

import io
import os
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Integral, Real
from typing import Any, cast

import numpy
from numpy.typing import NDArray

from . import due, exr
from .errors import BadInput, Error, Unreachable
from .fields import OPTION_LENGTHS, FrameOptions
from .files import PathLike, open_regular
from .messages import add_pairs, as_dict, pb
from .types import Report, Vector


@dataclass(frozen=True)
class Pose:
    """A viewpoint that the scene need not hold, in world space.

    eye     metres
    target  metres: a point in the middle of the picture, not the eye
    up      not along the line of sight; +y where None
    yfov    vertical angle in radians, ]0, pi[; that of the scene's first camera where None
    """

    eye: Vector
    target: Vector
    up: Vector | None = None
    yfov: float | None = None

    def fill(self, message: Any) -> None:
        for name in ("eye", "target", "up"):
            values = getattr(self, name)
            if values is not None or name != "up":
                getattr(message, name).extend(due.row(f"pose.{name}", values, length=3))
        if self.yfov is not None:
            message.yfov = due.number("pose.yfov", self.yfov)


def _camera(value: Any) -> str:
    if isinstance(value, str):
        return value
    if not isinstance(value, Integral) or isinstance(value, bool):
        due.wrong_kind("camera", "a name or an index", value)
    return str(int(value))


def _exposure(value: Any) -> str:
    if isinstance(value, str):
        return value
    if not isinstance(value, Real) or isinstance(value, bool):
        due.wrong_kind("exposure", '"auto" or stops', value)
    return str(float(value))


def _fill_pose(request: Any, value: Any) -> None:
    if not isinstance(value, Pose):
        due.wrong_kind("pose", "a bounced.Pose", value)
    value.fill(request.pose)


def fill_request(request: Any, options: FrameOptions, encoding: str = "exr") -> None:
    """Fills a FrameRequest. TypeError for an option that there is none of, or of another kind."""
    unknown = options.keys() - FrameOptions.__annotations__.keys()
    if unknown:
        raise TypeError(f"no such option of a frame: {', '.join(sorted(unknown))}")
    if options.get("pose") is not None and options.get("camera") is not None:
        raise TypeError("a camera or a pose, not both")
    request.encoding = encoding
    for name, value in options.items():
        if value is None:
            continue
        if name == "parameters":
            add_pairs(request.parameters, due.table(name, value))
        elif name == "pose":
            _fill_pose(request, value)
        elif name == "camera":
            request.camera = _camera(value)
        elif name == "exposure":
            request.exposure = _exposure(value)
        else:
            due.put(request, name, value, OPTION_LENGTHS.get(name))
    if "exr_raw" not in options:  # read at once, so that compression would only cost time
        request.exr_raw = request.encoding == "exr"


@dataclass(frozen=True)
class Frame:
    """One picture and its report. The pixels are decoded when they are first asked for.

    report    see `Report`
    encoding  of `data`: "exr", "half", "png", "jpeg"; "" where there is no picture
    data      the encoded picture as it came
    """

    report: Report
    encoding: str
    data: bytes = field(repr=False)

    @property
    def width(self) -> int:
        """Pixels."""
        return self.report["size"][0]

    @property
    def height(self) -> int:
        """Pixels."""
        return self.report["size"][1]

    @cached_property
    def layers(self) -> dict[str, NDArray[numpy.float32]]:
        """All layers by name, float32, rows from the top.

        "beauty", "direct", "indirect", "emission" are H x W x 3 (beauty x 4 with coverage),
        outgoing radiance in cd/m^2, scene-linear; "albedo" H x W x 3; "normal" H x W x 3, unit
        vectors in world space; "depth" H x W, metres along the view axis, infinite where nothing
        is. PNG and JPEG hold no such layers: Error "usage".
        """
        if self.encoding == "exr":
            return exr.layers(exr.read(self.data)[0])
        if self.encoding == "half":
            return {"beauty": self._half()}
        raise Error(f"a frame in {self.encoding or 'no encoding'} has no layers: ask for exr",
                    "encoding", "usage")

    @cached_property
    def rgba(self) -> NDArray[Any]:
        """H x W x 4, rows from the top.

        From "exr" and "half" float32: scene-linear radiance in cd/m^2, and coverage. From "png"
        and "jpeg" uint8: tone-mapped sRGB (Debian's python3-pil decodes those).
        """
        if self.encoding in ("png", "jpeg"):
            return self._picture()
        beauty = self.layers["beauty"]
        if beauty.shape[-1] == 4:
            return beauty
        return numpy.concatenate([beauty, numpy.ones_like(beauty[..., :1])], axis=-1)

    @cached_property
    def attributes(self) -> dict[str, str]:
        """The manifest inside an EXR: what reproduces the picture. Empty for other encodings."""
        return exr.read(self.data)[1] if self.encoding == "exr" else {}

    def save(self, path: PathLike) -> None:
        """Writes `data`, whole or not at all."""
        name = due.path("path", path)
        beside = f"{name}.{os.getpid()}.part"
        try:
            with open(beside, "wb") as file:
                file.write(self.data)
            os.replace(beside, name)
        except BaseException:
            if os.path.exists(beside):
                os.unlink(beside)
            raise

    def _half(self) -> NDArray[numpy.float32]:
        if len(self.data) != self.width * self.height * 8:
            raise Unreachable(f"the daemon sent {len(self.data)} bytes for {self.width} x "
                              f"{self.height} pixels of 8")
        halves = numpy.frombuffer(self.data, "<f2").reshape(self.height, self.width, 4)
        return halves.astype(numpy.float32)

    def _picture(self) -> NDArray[numpy.uint8]:
        try:
            from PIL import Image
        except ImportError as error:
            raise Error("PNG and JPEG are decoded by Debian's python3-pil; exr and half need none",
                        "encoding", "unsupported") from error
        with Image.open(io.BytesIO(self.data)) as image:
            return numpy.asarray(image.convert("RGBA"))


def report_of(message: Any) -> Report:
    return cast(Report, as_dict(message))


def encoding_of(message: Any, payload: memoryview) -> str:
    """In the words of a request: what is asked for as "jpeg" comes back as "jpg"."""
    if not len(payload):
        return ""
    return "jpeg" if message.encoding == "jpg" else str(message.encoding)


def read_frame(envelope: Any, payload: memoryview) -> Frame:
    """The answer to a render request."""
    if envelope.WhichOneof("body") != "render_reply":
        raise Unreachable(f"render was answered by {envelope.WhichOneof('body')}")
    reply = envelope.render_reply
    return Frame(report_of(reply.report), encoding_of(reply, payload), bytes(payload))


def render_request(options: FrameOptions, progress: bool) -> Any:
    """A Render without its scene."""
    request = pb.Render(progress=progress)
    fill_request(request.frame, options)
    return request


def read_exr(path: PathLike) -> dict[str, NDArray[numpy.float32]]:
    """The layers of an EXR that `Frame.save` wrote, as `Frame.layers` gives them. Other files, the
    compressed ones of `bounce render` too, are BadInput."""
    with open_regular(due.path("path", path)) as file:
        data = file.read()
    try:
        return exr.layers(exr.read(data)[0])
    except Unreachable as error:
        raise BadInput(f"{os.fspath(path)}: {error.message}", os.fspath(path)) from error
