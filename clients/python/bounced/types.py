"""Shapes of the dictionaries that the daemon answers with: the protocol's JSON form. A field that
the daemon did not set is not in them."""
from __future__ import annotations

from typing import Any, Sequence, TypedDict

Vector = Sequence[float]


class Report(TypedDict, total=False):
    """What a frame was, and what it cost (times in milliseconds, pass by pass)."""

    scene: str                    # "sha256:HEX" of the snapshot
    revision: int
    size: list[int]               # width, height in pixels
    camera: str
    technique: str
    parameters: dict[str, Any]
    seed: int
    aa: int
    device: dict[str, Any]        # name, class, software
    build: str
    time_ms: dict[str, float]     # total, load, compile, gpu, check, readback, encode
    passes: list[dict[str, Any]]  # name, ms, state: ran | reused | planned
    omitted: list[dict[str, str]]  # pass, reason
    counts: dict[str, int]        # lights, vpls, fragments, triangles, ...
    memory_mib: dict[str, float]  # gpu, gpu_peak
    flags: list[str]              # less quality than asked, and repairs
    nonfinite_pixels: int
    exposure_stops: float
    own_estimate: float           # relative RMSE of beauty as the frame itself knows it
    shown_estimate: float         # the same of light up to white
    error: list[dict[str, Any]]   # metric, value, low, high, samples, against
    stopped: str                  # complete | target | floor | deadline | cancelled


class SceneInfo(TypedDict, total=False):
    id: str
    name: str
    revision: int
    hash: str                     # "sha256:HEX" of the snapshot
    cameras: list[str]
    lights: list[str]
    flags: list[str]              # what was repaired or could not be honoured
    counts: dict[str, int]        # triangles, nodes, meshes, materials, textures, lights, cameras
    bounds_min: list[float]       # metres
    bounds_max: list[float]
    transient: int                # batches that lie on the revision


class SceneObject(TypedDict, total=False):
    """One object that edits can name."""

    kind: str                     # node | mesh | material | texture | light | camera
    id: int
    name: str
    node: dict[str, Any]          # its state, in the words of the edit that would make it
    material: dict[str, Any]
    light: dict[str, Any]
    camera: dict[str, Any]
    texture: dict[str, Any]
    world_from_node: list[float]  # of nodes: 16, column-major
    bounds_min: list[float]       # of meshes, in their own space
    bounds_max: list[float]


class LogEntry(TypedDict, total=False):
    revision: int
    kind: str                     # import | edit | undo | redo | revert
    client_edit_id: str
    message: str
    time_ms: int                  # since 1970
    changes: list[str]            # "light 0", "node 12 removed", ...
    hash: str
    names: list[str]
    of: int                       # the revision that an undo, redo or revert is about
    author: str                   # the token or user, and behind a space who of them


class SceneEvent(TypedDict, total=False):
    scene: str                    # its id
    kind: str                     # added | edited | transient | removed | missed
    revision: int
    transient: int
    hash: str
    changes: list[str]
    author: str                   # of edited and transient
    batch: str                    # of edited: edit | undo | redo | revert
    of: int                       # the revision that an undo, redo or revert is about
