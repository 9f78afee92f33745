"""What edits can say of objects. Made by make_fields.py from the daemon's table: not to be changed by hand."""
from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

from .types import Vector

if TYPE_CHECKING:
    from .edit import Reference

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
