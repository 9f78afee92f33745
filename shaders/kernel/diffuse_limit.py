"""Makes the coefficients of diffuse_limit.h, and says how far they are from the integrals.

usage: diffuse_limit.py

glTF's dielectric (Appendix B) mixes its lobes by F = f0 + (1 - f0) g, g = (1 - o.h)^5. Divided by
1 - f0, the furnace leaves 1 - S to the diffuse lobe, S = the mean of g over the normals of GGX that
are visible from o, and a white diffuse lobe takes 1 - D, D = the mean of g over its own directions.
Their ratio is the brightest diffuse colour that gains nothing. Fitted are t = 1 - S^(1/5), which is
the cosine itself where the surface is smooth, and 1 / (1 - D).

The fit is minimax in the ratio (Lawson's weights, denominators held as in Sanathanan and Koerner
1963) over all roughnesses and cosines from .01 on. Where the ratio is 1 or more, only that counts.
"""
import numpy as np

COSINE_MIN = 0.01  # below, the horizon of the reflected direction cuts through the lobe
# Powers of cosine and roughness: what is left of all up to the third and the second degree when
# those go, one after the other, without which the error hardly grows.
NUMERATOR = [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (3, 0)]
DENOMINATOR = [(0, 1), (0, 2), (1, 0)]
ITERATIONS = 600


def midpoints(count):
    x = (np.arange(count) + 0.5) / count
    return np.meshgrid(x, x, indexing="ij")


U, PHI = midpoints(256)
PHI = 2 * np.pi * PHI


def specular(cosine, roughness):
    """S. Normals are drawn from D(h) n.h; G1 o.h / (n.o n.h) makes visible ones of them."""
    if roughness == 0:
        return (1 - cosine) ** 5
    alpha2 = roughness ** 4
    sine2 = 1 - cosine ** 2
    tan_h = np.sqrt(alpha2) * U / (1 - U)  # reaches the tail with few samples
    chance = 2 * U * (1 - U) / (U ** 2 + (1 - U) ** 2) ** 2
    h_z = 1 / np.sqrt(1 + tan_h ** 2)
    o_h = (np.sqrt(sine2) * tan_h * np.cos(PHI) + cosine) * h_z
    g1 = 2 * cosine / (cosine + np.sqrt(cosine ** 2 + alpha2 * sine2))
    weight = np.where(2 * o_h * h_z > cosine, chance * g1 * o_h / (cosine * h_z), 0)
    return np.mean(weight * (1 - o_h) ** 5)


def diffuse(cosine):
    """D, by o.h = cos of half the angle between the two directions."""
    o_i = np.sqrt(1 - cosine ** 2) * np.sqrt(U) * np.cos(PHI) + cosine * np.sqrt(1 - U)
    return np.mean((1 - np.sqrt(np.maximum(0.5 * (1 + o_i), 0))) ** 5)


def terms(powers, cosine, roughness):
    return np.stack([cosine ** i * roughness ** j for i, j in powers], -1)


def ratio(t, brightening):
    return (1 - np.clip(1 - t, 0, 1) ** 5) * brightening


def fitted_offset(cosine, roughness, s, exact, brightening):
    """Coefficients of t^2 - cosine^2 = roughness x numerator / (1 + denominator)."""
    t = 1 - np.maximum(s, 1e-12) ** 0.2
    offset = t ** 2 - cosine ** 2
    top = roughness[:, None] * terms(NUMERATOR, cosine, roughness)
    bottom = terms(DENOMINATOR, cosine, roughness)
    gain = (5 * (1 - t) ** 4 + 1e-4) / (2 * np.maximum(t, 0.02))  # of the ratio, by t^2
    free = exact >= 1
    lawson, below, target = np.ones_like(t), np.ones_like(t), offset
    best = (np.inf, None)
    for _ in range(ITERATIONS):
        weight = gain * lawson / below
        rows = np.concatenate([top, -target[:, None] * bottom], 1) * weight[:, None]
        x = np.linalg.lstsq(rows, target * weight, rcond=None)[0]
        below = np.maximum(1 + bottom @ x[len(NUMERATOR):], 0.02)
        found = top @ x[:len(NUMERATOR)] / below
        t_found = np.sqrt(np.maximum(cosine ** 2 + found, 0))
        error = np.abs(np.minimum(ratio(t_found, brightening), 1) - np.minimum(exact, 1))
        if error.max() < best[0]:
            best = (error.max(), x)
        target = np.where(free, np.maximum(found, offset), offset)
        lawson *= 0.7 + 0.6 * error / error.max()
        lawson /= lawson.mean()
    return best


def show(name, powers, values):
    for (i, j), value in zip(powers, values):
        print(f"{name}: {value:.5f} cosine^{i} roughness^{j}")


def main():
    cosines = np.linspace(np.sqrt(COSINE_MIN), 1, 56) ** 2
    roughnesses = np.concatenate([np.arange(0.01, 0.1, 0.01), np.linspace(0.1, 1, 37)])
    d = np.array([diffuse(c) for c in cosines])
    cubic = np.polynomial.polynomial.polyfit(cosines, 1 / (1 - d), 3)
    cosine, roughness = (a.ravel() for a in np.meshgrid(cosines, roughnesses))
    s = np.array([specular(c, r) for c, r in zip(cosine, roughness)])
    exact = (1 - s) / (1 - np.tile(d, len(roughnesses)))
    brightening = np.polynomial.polynomial.polyval(cosine, cubic)
    error, x = fitted_offset(cosine, roughness, s, exact, brightening)
    show("numerator", NUMERATOR, x[:len(NUMERATOR)])
    show("1 + denominator", DENOMINATOR, x[len(NUMERATOR):])
    show("1 / (1 - D)", [(i, 0) for i in range(4)], cubic)
    print(f"largest error of the ratio, up to 1: {error:.5f}")


main()
