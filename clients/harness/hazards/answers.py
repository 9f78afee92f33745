"""Closed forms and quadratures: what pictures are held to. Light of 1 cd unless said otherwise."""
import math

import numpy as np

# Cube room [-1,1]^3, 1 cd in the middle (D8): floor point -> (E_d, E_1 / albedo).
CUBE_ROOM = {(0.0, 0.0): (1.0, 0.590616), (0.5, 0.0): (0.715542, 0.579682),
             (0.5, 0.5): (0.544331, 0.552789)}


def lamp_over_floor(height, lateral):
    """Direct E below a point light (D4)."""
    return height / (height * height + lateral * lateral) ** 1.5


def floor_bounce(a):
    """M(a): E on a ceiling at H above the light is albedo M(a) / H^2, a = height of the light / H
    (D4)."""
    b = 1 - a * a
    return (2 + a * a) / b ** 2 - 3 * a * math.acos(a) / b ** 2.5


def disk_kernel_factor(count):
    """Share of E in a sphere that `count` equal virtual lights with the disk kernel give (D3)."""
    return 1 - math.log(1 + count) / count


def wall_bounce(height, distance):
    """E / (albedo E0) on a floor `distance` before an endless wall lit evenly by E0 (D6)."""
    return 0.5 * (1 - distance / math.hypot(height, distance))


def bounces_in_sphere(albedo, count, direct):
    """Indirect E in a closed sphere (D3); `count` None for all bounces."""
    if count is None:
        return direct * albedo / (1 - albedo)
    return direct * sum(albedo ** n for n in range(1, count + 1))


def bounce_off_floor(at, normal, half, albedo, direct, grain=1.0, nodes=200):
    """E at a point from the square floor [-half, half]^2 at y = 0, which receives direct(x, z):
    Gauss's quadrature, with nodes that crowd where |x| and |z| are below `grain`."""
    end = math.asinh(half / grain)
    u, weight = np.polynomial.legendre.leggauss(nodes)
    x, weight = grain * np.sinh(u * end), weight * end * grain * np.cosh(u * end)
    px, pz = np.meshgrid(x, x)
    d = np.stack([px - at[0], np.full_like(px, -at[1]), pz - at[2]], -1)
    r2 = (d * d).sum(-1)
    cos_floor = -d[..., 1] / np.sqrt(r2)
    cos_here = np.maximum(d @ np.asarray(normal, float), 0) / np.sqrt(r2)
    radiance = albedo * direct(px, pz) / np.pi
    return float((radiance * cos_floor * cos_here / r2 * np.outer(weight, weight)).sum())


def cone(cosine, inner, outer):
    """Intensity of a glTF spot relative to its axis."""
    share = (cosine - math.cos(outer)) / (math.cos(inner) - math.cos(outer))
    return np.clip(share, 0, 1) ** 2


def cone_flux(inner, outer):
    """Flux of such a spot of 1 cd, lm."""
    c = np.linspace(math.cos(outer), math.cos(inner), 20001)
    ring = cone(c, inner, outer)
    return 2 * math.pi * (((ring[1:] + ring[:-1]) / 2 * np.diff(c)).sum() + 1 - math.cos(inner))


def metal_lobe(roughness, half_angle, to_light):
    """GGX with height-correlated Smith, F = 1, looked at along the normal; `half_angle` between
    normal and half vector, `to_light` between normal and light."""
    a2 = max(roughness * roughness, 1e-3) ** 2
    d = a2 / (math.pi * (math.sin(half_angle) ** 2 + a2 * math.cos(half_angle) ** 2) ** 2)
    n_l = math.cos(to_light)
    return d * 0.5 / (n_l + math.sqrt(n_l * n_l * (1 - a2) + a2))
