"""Writes how Schlick's grazing term shifts albedo between glTF's lobes, as a C table by quadrature.

usage: bsdf_albedo.py > bsdf_albedo_table.h

With F = f0 + (1 - f0) g, g = (1 - o.h)^5, the albedo of the GGX lobe seen under a cosine is at most
f0 + (1 - f0) x specular, where `specular` bounds the lobe's albedo for F = g; and that of a white
diffuse lobe is (1 - f0) x (1 - diffuse). Nodes: cosine = (i / (NODES - 1))^2 and roughness =
j / (NODES - 1).
"""

import math

NODES = 24
SAMPLES = 32  # a side; midpoints of a square


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def visible_normal(o, alpha, u0, u1):
    """Heitz 2018; `o` lies in the x-z plane, so that the frame is plain."""
    v = unit([alpha * o[0], 0.0, o[2]])
    r, phi = math.sqrt(u0), 2 * math.pi * u1
    p1, p2 = r * math.cos(phi), r * math.sin(phi)
    s = 0.5 * (1 + v[2])
    p2 = (1 - s) * math.sqrt(max(1 - p1 * p1, 0)) + s * p2
    p3 = math.sqrt(max(1 - p1 * p1 - p2 * p2, 0))
    # Axes across v: y, and v x y.
    h = [-p2 * v[2] + p3 * v[0], p1, p2 * v[0] + p3 * v[2]]
    return unit([alpha * h[0], alpha * h[1], max(h[2], 1e-9)])


def midpoints():
    return [((i + 0.5) / SAMPLES, (j + 0.5) / SAMPLES)
            for i in range(SAMPLES) for j in range(SAMPLES)]


def specular(cosine, roughness):
    """Mean of (1 - o.h)^5 over the visible normals: an upper bound, since masking is left out. It
    is smooth where the albedo itself has a valley that no coarse table can follow."""
    if roughness == 0:
        return (1 - cosine) ** 5
    alpha = roughness * roughness
    o = [math.sqrt(1 - cosine * cosine), 0.0, cosine]
    total = 0.0
    for u0, u1 in midpoints():
        h = visible_normal(o, alpha, u0, u1)
        o_h = o[0] * h[0] + o[2] * h[2]
        if 2 * o_h * h[2] > o[2]:
            total += (1 - o_h) ** 5
    return total / SAMPLES ** 2


def diffuse(cosine):
    """What Schlick's grazing term takes from a white diffuse lobe."""
    o = [math.sqrt(1 - cosine * cosine), 0.0, cosine]
    total = 0.0
    for u0, u1 in midpoints():
        r, phi = math.sqrt(u0), 2 * math.pi * u1
        i = [r * math.cos(phi), r * math.sin(phi), math.sqrt(1 - u0)]
        o_i = o[0] * i[0] + o[2] * i[2]
        total += (1 - math.sqrt(max(0.5 * (1 + o_i), 0))) ** 5  # o.h = cos of half the angle
    return total / SAMPLES ** 2


def cosine_at(i):
    return max((i / (NODES - 1)) ** 2, 1e-4)


def row_of(values):
    return '{' + ', '.join(f'{v:.6f}f' for v in values) + '}'


def main():
    cosines = [cosine_at(i) for i in range(NODES)]
    print('// Made by bsdf_albedo.py. Rows: roughness; columns: square root of the cosine.')
    print(f'#define BD_ALBEDO_NODES {NODES}')
    print('static const float bd_albedo_specular[BD_ALBEDO_NODES][BD_ALBEDO_NODES] = {')
    for j in range(NODES):
        print('    ' + row_of(specular(c, j / (NODES - 1)) for c in cosines) + ',')
    print('};')
    plain = [min((1 - specular(c, j / (NODES - 1))) / (1 - diffuse(c)) for c in cosines)
             for j in range(NODES)]
    print('// By roughness: a base colour up to this never gives more than it gets.')
    print('static const float bd_albedo_plain[BD_ALBEDO_NODES] = ' + row_of(plain) + ';')
    flat = max(specular(c, j / (NODES - 1)) for c in cosines if c >= 0.45 for j in range(NODES))
    print('// The most of all roughnesses for cosines from a half on.')
    print(f'#define BD_ALBEDO_SPECULAR_FLAT {flat:.6f}f')
    print('static const float bd_albedo_diffuse[BD_ALBEDO_NODES] = '
          + row_of(diffuse(c) for c in cosines) + ';')


main()
