"""Closed forms of light transport: algorithms.md D. Pure numbers; lengths in any one unit."""
import numpy as np

UNLIMITED = 0xFFFFFFFF


def bounce_sum(rho, bounces, first=1):
    """rho^first + ... + rho^bounces."""
    if bounces == UNLIMITED:
        return rho ** first / (1 - rho)
    return sum(rho ** k for k in range(first, bounces + 1))


# --- D4: point light of intensity I over a floor, light at h, ceiling at H --------------------


def floor_irradiance(intensity, height, x):
    return intensity * height / (height ** 2 + np.square(x)) ** 1.5


def _psi(w, b):
    return (-1 / (b ** 4 * w) - np.arctan(w / b) / b ** 5
            - (np.arctan(w / b) / (2 * b ** 3) + w / (2 * b * b * (w * w + b * b))) / (b * b))


def disc_to_ceiling(a, reach):
    """M of D4 for a floor disc of radius `reach` (both in units of H), a = h / H < 1; the ceiling
    above the light gets rho Phi / (4 pi H^2) M."""
    b = np.sqrt(1 - a * a)
    return 2 * a * (_psi(np.sqrt(a * a + reach * reach), b) - _psi(a, b))


# --- D5 -------------------------------------------------------------------------------------

# Residual fraction E_r / (pi L) of an infinite perpendicular wall under the bound b, by
# u = d sqrt(b): what the bound takes away. +-2e-4.
WALL_RESIDUAL = {0.02: .4214, 0.06: .3384, 0.10: .2762, 0.20: .1615, 0.30: .0831, 0.40: .0322,
                 0.50: .0054}


# --- D6: from a point to a patch; irradiance = radiosity of the patch times this --------------


def coaxial_disc(radius, distance):
    return radius ** 2 / (radius ** 2 + distance ** 2)


def offset_disc(radius, distance, offset):
    """Parallel, off the axis by `offset` > 0."""
    a = np.maximum(np.abs(offset), 1e-9)
    z = 1 + (distance / a) ** 2 + (radius / a) ** 2
    return 0.5 * (1 - (z - 2 * (radius / a) ** 2) / np.sqrt(z * z - 4 * (radius / a) ** 2))


def rectangle_over_corner(a, b, c):
    """A parallel rectangle a x b at distance c, one corner over the point."""
    a, b = a / c, b / c
    return (a / np.sqrt(1 + a * a) * np.arctan(b / np.sqrt(1 + a * a))
            + b / np.sqrt(1 + b * b) * np.arctan(a / np.sqrt(1 + b * b))) / (2 * np.pi)


def wall_from_corner(height, width, distance):
    """A perpendicular wall that stands on the point's plane, its corner straight ahead."""
    c, slant = distance, np.sqrt(np.square(height) + np.square(distance))
    return (np.arctan(width / c) - c / slant * np.arctan(width / slant)) / (2 * np.pi)


def wall(height, half_width, distance, aside=0.0):
    """The same wall seen from `aside` of its middle, |aside| < half_width."""
    return (wall_from_corner(height, half_width - aside, distance)
            + wall_from_corner(height, half_width + aside, distance))


# --- D7: between patches ----------------------------------------------------------------------

UNIT_SQUARES = {"parallel, distance 1": 0.1998248957, "sharing an edge": 0.2000437761}


# --- D8: cube room [-1,1]^3, 1 cd in the middle -----------------------------------------------

CUBE_POINTS = ((0.0, 0.0), (0.5, 0.0), (0.5, 0.5))
CUBE_FIRST = (.590616, .579682, .552789)  # E_1 / rho
CUBE_TOTAL = {0.5: (1.56316, 1.27288, 1.08611), 0.8: (3.1662, 2.8720, 2.6730)}


def cube_direct(u, v):
    return (1 + np.square(u) + np.square(v)) ** -1.5


# --- D10 ---------------------------------------------------------------------------------------


def slab_transmittance(ior):
    """Of a clear slab at normal incidence, all inner reflections counted."""
    r = ((ior - 1) / (ior + 1)) ** 2
    return (1 - r) / (1 + r)


# --- D11: reflectance of white GGX under uniform light, by (alpha, cosine of the view) ----------

GGX_ALBEDO = {(0.1, 1.0): .98831, (0.1, 0.5): .96914, (0.5, 1.0): .68785, (0.5, 0.5): .69825,
              (1.0, 1.0): .30685, (1.0, 0.5): .45069}


# --- D12 ---------------------------------------------------------------------------------------


def concentric_spheres(inner, outer, rho_inner, rho_outer, emitted):
    """(B_inner, B_outer) where the outer sphere emits the exitance `emitted`."""
    seen = (inner / outer) ** 2
    outer_b = emitted / (1 - rho_outer * (1 - seen) - rho_outer * seen * rho_inner)
    return rho_inner * outer_b, outer_b


def floor_under_a_ball(radius, height, aside):
    """E / (pi L) of a floor under a uniform sky, a black ball's centre `height` above it."""
    return 1 - radius ** 2 * height / (height ** 2 + np.square(aside)) ** 1.5
