"""What edits and frames can say. Made by make_fields.py from the daemon's table: not to be changed by hand."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any, Sequence, TypedDict

from .types import Vector

if TYPE_CHECKING:
    from .edit import Reference
    from .frame import Pose

REFERENCES = frozenset(['base_color_texture', 'camera', 'emissive_texture', 'environment', 'light', 'material', 'mesh', 'metallic_roughness_texture', 'node', 'normal_texture', 'parent', 'texture', 'transmission_texture'])
LENGTHS = {'base_color': 4, 'emissive': 3, 'attenuation_color': 3, 'color': 3, 'radiance': 3, 'rotation': 4}  # of lists of numbers


class TextureFields(TypedDict, total=False):
    wrap_s: str  # repeat, clamp or mirror: beyond its sides
    wrap_t: str  # repeat, clamp or mirror: beyond top and bottom
    nearest: bool  # true or false: magnified without interpolation


class MaterialFields(TypedDict, total=False):
    name: str  # text, up to 63 bytes: for people
    base_color: Vector  # 4 numbers from 0 to 1: linear RGBA
    metallic: float  # a number from 0 to 1: 0: dielectric, 1: metal
    roughness: float  # a number from 0 to 1: its square is the lobe's width
    emissive: Vector  # 3 numbers from 0 to 1e+30: linear RGB, cd/m^2
    normal_scale: float  # a number from -1e+06 to 1e+06: of the normal map's x and y
    ior: float  # a number from 1 to 1e+06, or 0: index of refraction; 0: reflects as a mirror does
    transmission: float  # a number from 0 to 1: share of the light that is not reflected
    thickness: float  # a number from 0 to 1e+15: metres; 0: a thin wall
    attenuation_distance: float  # a number from 0 to 3.40282e+38: metres; 0: clear
    attenuation_color: Vector  # 3 numbers from 0 to 1: what is left after that distance, linear RGB
    alpha_mode: str  # opaque, mask or blend: which parts of the surface are there
    alpha_cutoff: float  # a number from 0 to 1e+06: of a mask: what has less alpha is not there
    double_sided: bool  # true or false: seen from behind, too
    unlit: bool  # true or false: shows its base colour, whatever light falls on it
    base_color_texture: Reference  # a texture's id, or -1: sRGB, alpha in A
    metallic_roughness_texture: Reference  # a texture's id, or -1: G roughness, B metallic
    normal_texture: Reference  # a texture's id, or -1: in tangent space; shows where a mesh has tangents
    emissive_texture: Reference  # a texture's id, or -1: sRGB
    transmission_texture: Reference  # a texture's id, or -1: in R


class LightFields(TypedDict, total=False):
    name: str  # text, up to 63 bytes: for people
    kind: str  # directional, point or spot: shines along -z of the node that holds it
    color: Vector  # 3 numbers from 0 to 1e+30: linear RGB
    intensity: float  # a number from 0 to 1e+30: cd for point and spot, lux for directional
    range: float  # a number from 0 to 1e+15: metres; 0: unlimited
    cone_outer: float  # a number from 0.0001 to 1.5708: half-angle of a spot, radians
    cone_inner: float  # a number from 0 to 1.5708: below cone_outer: where the light begins to fade


class CameraFields(TypedDict, total=False):
    name: str  # text, up to 63 bytes: frames can ask for it by this
    orthographic: bool  # true or false: looks along -z of the node that holds it
    yfov: float  # a number from 0.001 to 3.11018: whole vertical angle, radians
    xmag: float  # a number from 1e-09 to 1e+15: half the width, metres
    ymag: float  # a number from 1e-09 to 1e+15: half the height, metres
    near: float  # a number from 0 to 1e+15: metres; with a perspective above 0
    far: float  # a number from 0 to 1e+15: metres, beyond near; 0: none


class NodeFields(TypedDict, total=False):
    name: str  # text, up to 63 bytes: frames can ask for its camera by this
    parent: Reference  # a node's id, or -1: -1: a root of the scene
    mesh: Reference  # a mesh's id, or -1: shown
    camera: Reference  # a camera's id, or -1: placed
    light: Reference  # a light's id, or -1: placed
    shown: bool  # true or false: with all that is below it


class FrameOptions(TypedDict, total=False):
    """What a frame can be asked to be. `encoding` is "exr" where it is not said, and then not compressed."""

    size: tuple[int, int]  # WxH: pixels (default 512x512)
    camera: str | int  # a node's name, a camera's, or its index (default the scene's first, or one that frames it)
    pose: Pose  # instead of a camera: 6, 7, 9 or 10 numbers, places in metres, the vertical angle in radians (default up +y, yfov that of the scene's first camera)
    technique: str  # NAME: `bounce techniques` lists them (default auto: many_light, in steps until its own estimate of the picture's error is below 5 %, or one that reads the parameters that are given)
    parameters: dict[str, Any]  # of the technique; repeatable: vpls=256
    aa: int  # a whole number from 1 to 4096: sub-frames averaged (default 1; by `bounce` 16 to PNG and JPEG)
    layers: Sequence[str]  # A,B,C: beauty,direct,indirect,emission,albedo,normal,depth,noise,blur: an EXR holds all of them, other pictures one (default beauty)
    exposure: str | float  # of PNG and JPEG: pixel = luminance * 2^stops (default auto)
    tonemap: str  # neutral, agx or linear: of PNG and JPEG (default neutral)
    encoding: str  # png, jpeg, jpg, exr, half or none: half: four 16-bit floats a pixel; none: the report alone (default png; of a view jpeg)
    jpeg_quality: int  # a whole number from 1 to 100: of JPEG (default 90)
    exr_half: bool  # 0 or 1: EXR with 16 bits a channel where these hold it (default 32 bits)
    exr_raw: bool  # 0 or 1: EXR that is not compressed, for who reads it at once (default compressed)
    seed: int  # a whole number: same seed, same bytes (default 0)
    deadline_ms: int  # a whole number: after this long what stands: the technique's cheapest settings (flag deadline_rung), with target_error the best so far (default 0: none)
    budget_ms: int  # a whole number: the best settings that so many milliseconds of rendering are good for (flag chosen_by_clock) (default 0: none)
    check: int  # a whole number from 16 to 65536, or 0: estimate the relative RMSE from N pixels that the reference traces: against the whole rendering equation and the technique's own model, which leaves out what no setting brings back (default 0: none)
    target_error: float  # a number from 1e-06 to 10000: per cent: better and better parameters until the error is below, from those that are given on, or a line with what reaches it (default none)
    against: str  # full or model: which of the two errors decides (default full)
    region: tuple[int, int, int, int]  # X,Y,WIDTH,HEIGHT: technique reference: trace only these pixels (default all)
    fresh: str  # none, camera or all: to time a frame: take nothing over from earlier ones of the camera's side, or nothing at all but the uploaded scene (default none)
    plan_only: bool  # 0 or 1: what would run and what is left out; nothing is rendered (default no)


OPTION_LENGTHS = {'size': 2, 'region': 4}
