// KHR_texture_transform has a rotation and two scales, a scene their matrix
//
//     | c sx   s sy |        c = cos(rotation), s = sin(rotation)
//     |-s sx   c sy |
//
// Forwards that is a formula. Backwards its entries were rounded to floats: each column is known to
// lie in a small box, which the true rotation and scales hit; any that hit all boxes round to the
// same floats.

#include <float.h>
#include <math.h>
#include <stddef.h>

#include "scene/gltf/gltf_reader.h"
#include "scene/gltf/gltf_write_parts.h"

// u' = R(rotation) S(scale) u + offset, where a positive rotation turns the coordinates
// counter-clockwise as one looks at a picture whose v runs down. The GLSL in the extension's own
// text turns the other way; its test scene, and Blender, turn this way.
void bd_gltf_uv_matrix(const double offset[2], double rotation, const double scale[2], float m[6])
{
    const double c = cos(rotation), s = sin(rotation);
    // 0 - x, since -x would make the entry of no rotation a negative zero.
    const double exact[6] = {c * scale[0],     s * scale[1], offset[0],
                             0 - s * scale[0], c * scale[1], offset[1]};
    const float identity[6] = {1, 0, 0, 0, 1, 0};
    for (int i = 0; i < 6; i++) m[i] = fabs(exact[i]) <= FLT_MAX ? (float)exact[i] : identity[i];
}

// --- backwards ------------------------------------------------------------------------------

// What a double is that rounds to this float, roughly: within these.
struct range {
    double least, most;
};

// A little less than half a unit in the last place, so that the ends are inside too.
static struct range rounding_of(float value)
{
    const double inside = 0.499;
    double up = (double)nextafterf(value, FLT_MAX) - (double)value;
    double down = (double)value - (double)nextafterf(value, -FLT_MAX);
    return (struct range){(double)value - inside * down, (double)value + inside * up};
}

static struct range both(struct range a, struct range b)
{
    return (struct range){fmax(a.least, b.least), fmin(a.most, b.most)};
}

static double middle(struct range r)
{
    return 0.5 * (r.least + r.most);
}

// The directions in which the box of (x, y) is seen from the origin, as angles around the one of
// its middle, so that no seam of atan2 lies between them.
static struct range angles_of(float x, float y, double around)
{
    const struct range in_x = rounding_of(x), in_y = rounding_of(y);
    const double corners[4][2] = {{in_x.least, in_y.least},
                                  {in_x.least, in_y.most},
                                  {in_x.most, in_y.least},
                                  {in_x.most, in_y.most}};
    const double c = cos(around), s = sin(around);
    struct range angles = {INFINITY, -INFINITY};
    for (size_t i = 0; i < 4; i++) {
        const double *p = corners[i];
        double angle = around + atan2(c * p[1] - s * p[0], c * p[0] + s * p[1]);
        angles.least = fmin(angles.least, angle);
        angles.most = fmax(angles.most, angle);
    }
    return angles;
}

// The scales by which `unit` comes into the box of `value`.
static struct range scales_of(double unit, float value)
{
    const struct range box = rounding_of(value);
    if (fabs(unit) < 1e-300) return (struct range){-INFINITY, INFINITY};
    double a = box.least / unit, b = box.most / unit;
    return (struct range){fmin(a, b), fmax(a, b)};
}

// Of the column (x, y) = scale (unit_x, unit_y).
static double scale_of(float x, float y, double unit_x, double unit_y)
{
    // The larger part alone says nearly all; the smaller one may be all rounding.
    const struct range larger = fabsf(x) >= fabsf(y) ? scales_of(unit_x, x) : scales_of(unit_y, y);
    const struct range common = both(scales_of(unit_x, x), scales_of(unit_y, y));
    return common.least <= common.most ? middle(common) : middle(larger);
}

static bool gives(const struct bd_gltf_uv_transform *transform, const float m[6])
{
    float again[6];
    bd_gltf_uv_matrix(transform->offset, transform->rotation, transform->scale, again);
    bool same = true;
    for (int i = 0; i < 6; i++) same &= again[i] == m[i];
    return same;
}

// With a rotation near `around`, both scales having its sign.
static struct bd_gltf_uv_transform solve(const float m[6], double around)
{
    const bool has_x = m[0] != 0 || m[3] != 0, has_y = m[1] != 0 || m[4] != 0;
    struct range angles = {-INFINITY, INFINITY};
    double c = cos(around), s = sin(around);
    const float x = c * (double)m[0] - s * (double)m[3] < 0 ? -1 : 1;
    const float y = s * (double)m[1] + c * (double)m[4] < 0 ? -1 : 1;
    if (has_x) angles = both(angles, angles_of(x * m[0], -x * m[3], around));
    if (has_y) angles = both(angles, angles_of(y * m[4], y * m[1], around));
    struct bd_gltf_uv_transform out = {.offset = {(double)m[2], (double)m[5]}, .rotation = around};
    if (angles.least <= angles.most) out.rotation = middle(angles);
    c = cos(out.rotation), s = sin(out.rotation);
    out.scale[0] = has_x ? scale_of(m[0], m[3], c, -s) : 0;
    out.scale[1] = has_y ? scale_of(m[1], m[4], s, c) : 0;
    return out;
}

// Half a turn more and both scales negative are the same matrix, but for entries that are all
// rounding: the cosine of what should be a quarter turn.
struct bd_gltf_uv_transform bd_gltf_uv_transform_of(const float m[6])
{
    const double pi = 3.14159265358979323846;
    struct bd_gltf_uv_transform out = {{(double)m[2], (double)m[5]}, 0, {m[0], m[4]}};
    if (m[1] == 0 && m[3] == 0) return out;
    double around = m[0] != 0 || m[3] != 0 ? atan2(-(double)m[3], (double)m[0])
                                           : atan2((double)m[1], (double)m[4]);
    out = solve(m, around);
    struct bd_gltf_uv_transform other = solve(m, around < 0 ? around + pi : around - pi);
    return !gives(&out, m) && gives(&other, m) ? other : out;
}
