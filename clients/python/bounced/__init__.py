"""Talks to bounced, the daemon that owns 3D scenes and answers with global illumination.

    import bounced

    with bounced.private() as daemon:             # or bounced.connect("tcp:host:7481", token)
        scene = daemon.scenes.add("room.glb")
        with scene.edit(message="a lamp over the table") as edit:
            lamp = edit.add_light(kind="spot", intensity=200, cone_outer=0.6)
            edit.add_node(light=lamp, translation=(0, 2, 0), rotation=(-0.7071, 0, 0, 0.7071))
        frame = scene.render(size=(640, 480), technique="hisr", layers=["indirect"])
        frame.rgba                                # 480 x 640 x 4 float32, scene-linear
        frame.layers["indirect"]                  # 480 x 640 x 3
        frame.report["time_ms"]["total"]

Faults are exceptions with `code`, `field` and `message`: `bounced.Error` and its subclasses.
"""
from .client import Client, connect, private
from .conn import Pending
from .edit import (NONE, CameraFields, Edit, EditResult, Handle, LightFields, MaterialFields,
                   NodeFields, Primitive, TextureFields)
from .errors import (BadInput, Cancelled, Conflict, Deadline, Error, NotFound, Unreachable,
                     Unsupported)
from .files import MissingFileWarning
from .frame import Frame, FrameOptions, Pose, read_exr
from .scene import Environment, Scene, Scenes
from .text import plain
from .types import LogEntry, Report, SceneEvent, SceneInfo, SceneObject
from .view import View, ViewFrame, Watch

__all__ = [
    "NONE", "BadInput", "CameraFields", "Cancelled", "Client", "Conflict", "Deadline", "Edit",
    "EditResult", "Environment", "Error", "Frame", "FrameOptions", "Handle", "LightFields",
    "LogEntry", "MaterialFields", "MissingFileWarning", "NodeFields", "NotFound", "Pending", "Pose",
    "Primitive", "Report", "Scene", "SceneEvent", "SceneInfo", "SceneObject", "Scenes",
    "TextureFields", "Unreachable", "Unsupported", "View", "ViewFrame", "Watch", "connect",
    "plain", "private", "read_exr",
]
