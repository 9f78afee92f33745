"""The table of lights/sent.h: what a GGX lobe returns of light under an angle to its normal.

usage: sent_albedo.py > sent_albedo.h

With a Fresnel term of 1, and with (1 - v.h)^5: means over visible half vectors (Heitz 2018) of the height-correlated shadowing that
is left, for each roughness k / 8 and each cosine (k / 8)^2.
"""
import numpy

STEPS, SAMPLES = 8, 1 << 20


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


def main():
    # A lattice of rank 1: as even as any for so smooth an integrand.
    index = numpy.arange(SAMPLES)
    numbers = (index + .5) / SAMPLES, (index * .6180339887498949) % 1
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
    main()
