"""The table of lights/sent.h: what a GGX lobe returns of light under an angle to its normal.

usage: sent_albedo.py > sent_albedo.h
       sent_albedo.py fits: the polynomials of rough_sent_white and rough_sent_grazing (kernel/sent.h)

With a Fresnel term of 1, and with (1 - v.h)^5: means over visible half vectors (Heitz 2018) of the height-correlated shadowing that
is left, for each roughness k / 8 and each cosine (k / 8)^2.
"""
import sys

import numpy

STEPS, SAMPLES = 8, 1 << 20
FIT_SAMPLES, ROUGH = 1 << 16, numpy.linspace(.6, 1, 9)
COSINES = numpy.concatenate([[.002, .005, .01, .02, .035], numpy.linspace(.05, 1, 24)])


def visible_normals(incoming, alpha, numbers):
    stretched = incoming * [alpha, alpha, 1]
    stretched /= numpy.linalg.norm(stretched)
    flat = numpy.hypot(*stretched[:2])
    across = numpy.array([-stretched[1], stretched[0], 0]) / flat if flat > 1e-9 else numpy.array([1., 0, 0])
    along = numpy.cross(stretched, across)
    radius, angle = numpy.sqrt(numbers[0]), 2 * numpy.pi * numbers[1]
    x, y, lean = radius * numpy.cos(angle), radius * numpy.sin(angle), .5 * (1 + stretched[2])
    y = (1 - lean) * numpy.sqrt(1 - x * x) + lean * y
    up = numpy.sqrt(numpy.maximum(0, 1 - x * x - y * y))
    normal = x[:, None] * across + y[:, None] * along + up[:, None] * stretched
    normal *= [alpha, alpha, 1]
    return normal / numpy.linalg.norm(normal, axis=1, keepdims=True)


def smith_lambda(cosine, alpha):
    return (numpy.sqrt(1 + alpha * alpha * (1 / (cosine * cosine) - 1)) - 1) / 2


def returned(roughness, cosine, numbers):
    alpha, cosine = roughness * roughness, max(cosine, 1e-4)
    if alpha == 0:
        return 1, (1 - cosine) ** 5
    incoming = numpy.array([numpy.sqrt(1 - cosine * cosine), 0, cosine])
    normal = visible_normals(incoming, alpha, numbers)
    met = normal @ incoming
    outgoing = 2 * met * normal[:, 2] - cosine
    own, other = smith_lambda(cosine, alpha), smith_lambda(numpy.maximum(outgoing, 1e-6), alpha)
    left = numpy.where(outgoing > 0, (1 + own) / (1 + own + other), 0)
    return left.mean(), (left * (1 - numpy.clip(met, 0, 1)) ** 5).mean()


def lattice(samples):
    """Of rank 1: as even as any for so smooth an integrand."""
    index = numpy.arange(samples)
    return (index + .5) / samples, (index * .6180339887498949) % 1


def fit(values, of_roughness, of_root):
    """Coefficients by powers of the cosine's root, then of roughness: squares weighed again and again, until the largest error is small."""
    powers = [numpy.outer(ROUGH ** i, numpy.sqrt(COSINES) ** j).ravel() for j in range(of_root + 1) for i in range(of_roughness + 1)]
    terms, wanted, weight = numpy.array(powers).T, values.ravel(), numpy.ones(values.size)
    for _ in range(60):
        root = numpy.sqrt(weight)
        found = numpy.linalg.lstsq(terms * root[:, None], wanted * root, rcond=None)[0]
        off = abs(terms @ found - wanted)
        weight *= numpy.sqrt(off / off.max() + 1e-3)
        weight /= weight.mean()
    found = found.round(4)
    print(found.reshape(of_root + 1, of_roughness + 1), "within", abs(terms @ found - wanted).max().round(5))


def print_fits():
    pairs = numpy.array([[returned(r, c, lattice(FIT_SAMPLES)) for c in COSINES] for r in ROUGH])
    fit(pairs[..., 0], 1, 3)
    fit(pairs[..., 1], 2, 4)


def main():
    numbers = lattice(SAMPLES)
    print("// Made by sent_albedo.py: by roughness k / 8 and cosine (k / 8)^2 what a GGX lobe returns, with a")
    print("// Fresnel term of 1 and with (1 - v.h)^5.")
    print("// clang-format off")
    print(f"#define BD_SENT_STEPS {STEPS}")
    print("static const float bd_sent_albedo[BD_SENT_STEPS + 1][BD_SENT_STEPS + 1][2] = {")
    for r in range(STEPS + 1):
        pairs = [returned(r / STEPS, (c / STEPS) ** 2, numbers) for c in range(STEPS + 1)]
        print("    {" + ", ".join(f"{{{a:.4f}f, {b:.4f}f}}" for a, b in pairs) + "},")
    print("};")
    print("// clang-format on")


if __name__ == "__main__":
    if sys.argv[1:] == ["fits"]:
        print_fits()
    else:
        main()
