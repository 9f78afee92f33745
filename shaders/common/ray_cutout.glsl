// Whether a triangle that is not opaque is there for a ray: as rays/cutout.c, from the tables of
// shared/rays.h. `args` is a bd_ray_walk_args.
layout(std430, binding = BD_STORAGE_RAY_CUTOUTS) readonly buffer cutout_block { uvec4 cutouts[]; };
layout(std430, binding = BD_STORAGE_RAY_TEXELS) readonly buffer texel_block { uint texels[]; };

const float COORDINATE_MOST = 1e9; // larger ones name no texel

int wrapped(int texel, int size, uint how)
{
    if (how == BD_CUTOUT_WRAP_REPEAT) return texel < 0 ? texel + size : texel % size;
    if (how == BD_CUTOUT_WRAP_MIRROR) {
        texel = texel < 0 ? texel + 2 * size : texel % (2 * size);
        return texel < size ? texel : 2 * size - 1 - texel;
    }
    return clamp(texel, 0, size - 1);
}

// Two texels along an axis and the share of the second. Whole periods are left out first.
ivec2 texels_of(float coordinate, uint size, uint how, bool nearest, out float share)
{
    precise float where = abs(coordinate) < COORDINATE_MOST ? coordinate : 0.0;
    if (how == BD_CUTOUT_WRAP_REPEAT) where -= floor(where);
    if (how == BD_CUTOUT_WRAP_MIRROR) where -= 2.0 * floor(where * 0.5);
    if (how == BD_CUTOUT_WRAP_CLAMP) where = clamp(where, -1.0, 2.0);
    precise float texel = where * float(size);
    precise float rest = fma(where, float(size), -texel);
    texel -= nearest ? 0.0 : 0.5;
    float below = floor(texel + rest);
    share = nearest ? 0.0 : texel - below + rest;
    return ivec2(wrapped(int(below), int(size), how), wrapped(int(below) + 1, int(size), how));
}

float texel_at(uint first, uint width, int x, int y)
{
    uint at = first + uint(y) * width + uint(x);
    return float(texels[at / 4u] >> at % 4u * 8u & 255u);
}

float alpha_of_map(uint material, vec2 uv)
{
    uvec4 head = cutouts[material], size = cutouts[material + 1u], rows = cutouts[material + 2u];
    precise float u = uintBitsToFloat(size.z) * uv.x + uintBitsToFloat(size.w) * uv.y +
                      uintBitsToFloat(rows.x);
    precise float v = uintBitsToFloat(rows.y) * uv.x + uintBitsToFloat(rows.z) * uv.y +
                      uintBitsToFloat(rows.w);
    bool nearest = (head.x & BD_CUTOUT_NEAREST) != 0u;
    float share_x, share_y;
    ivec2 x = texels_of(u, size.x, head.x / BD_CUTOUT_WRAP_S & 3u, nearest, share_x);
    ivec2 y = texels_of(v, size.y, head.x / BD_CUTOUT_WRAP_T & 3u, nearest, share_y);
    vec2 near_row = vec2(texel_at(head.w, size.x, x.x, y.x), texel_at(head.w, size.x, x.y, y.x));
    vec2 far_row = vec2(texel_at(head.w, size.x, x.x, y.y), texel_at(head.w, size.x, x.y, y.y));
    vec2 weights = vec2(1.0 - share_x, share_x);
    return ((1.0 - share_y) * dot(weights, near_row) + share_y * dot(weights, far_row)) / 255.0;
}

float alpha_of(uvec4 a, uvec4 b, uvec4 c, vec2 at)
{
    precise vec3 corners = uintBitsToFloat(a.xyz) * (1.0 - at.x - at.y) +
                           uintBitsToFloat(b.xyz) * at.x + uintBitsToFloat(c.xyz) * at.y;
    float alpha = uintBitsToFloat(cutouts[a.w].z);
    if (b.w != 0u) alpha *= alpha_of_map(a.w, corners.xy);
    return c.w != 0u ? alpha * corners.z : alpha;
}

// Jarzynski and Olano 2020: PCG in one dimension.
uint stir(uint x)
{
    x = x * 747796405u + 2891336453u;
    x = ((x >> ((x >> 28u) + 4u)) ^ x) * 277803737u;
    return x >> 22u ^ x;
}

// A number in [0, 1) that a ray and a triangle have together.
float chance_of(vec3 from, vec3 along, uint number)
{
    uint hash = stir(number);
    for (int c = 0; c < 3; c++) hash = stir(hash ^ floatBitsToUint(from[c]));
    for (int c = 0; c < 3; c++) hash = stir(hash ^ floatBitsToUint(along[c]));
    return float(hash >> 8u) * 5.9604645e-8;
}

bool is_there_by_alpha(uint cutout, uint number, vec3 from, vec3 along, vec2 at)
{
    uint first = args.first_cutout_triangle + cutout * BD_CUTOUT_TRIANGLE_UVEC4S;
    uvec4 a = cutouts[first];
    float alpha = alpha_of(a, cutouts[first + 1u], cutouts[first + 2u], at);
    uvec4 material = cutouts[a.w];
    if ((material.x & BD_CUTOUT_BLENDS) != 0u && args.alpha_is_coverage == 1u)
        return chance_of(from, along, number) < alpha;
    return alpha >= uintBitsToFloat(material.y);
}
