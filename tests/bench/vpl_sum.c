#include "vpl_sum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "shared/vpl.h"

// The limits of shaders/common/vpl_gather.glsl: they are part of what is summed.
#define COINCIDENT_SQUARED 1e-12
#define COPLANAR_SQUARED   4e-8
#define COPLANAR_HEIGHT    1e-5

// VPLs at a time: what is known of them stays in the nearest cache while receivers take turns.
#define CHUNK 256

// --- the set ------------------------------------------------------------------------------------

static void grow(struct vpl_set *set, size_t capacity)
{
    float **const columns[] = {&set->position[0], &set->position[1], &set->position[2],
                               &set->normal[0],   &set->normal[1],   &set->normal[2],
                               &set->flux[0],     &set->flux[1],     &set->flux[2],
                               &set->area,        &set->near2};
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++) {
        *columns[i] = realloc(*columns[i], capacity * sizeof **columns[i]);
        BD_ASSERT(*columns[i]);
    }
    set->quads = realloc(set->quads, capacity * sizeof *set->quads);
    BD_ASSERT(set->quads);
    set->capacity = capacity;
}

void vpl_set_append(struct vpl_set *set, const float *vpls, const float *quads, size_t count)
{
    if (set->count + count > set->capacity) grow(set, set->count + count);
    for (size_t i = 0; i < count; i++) {
        const float *vpl = vpls + i * 4 * BD_VPL_VEC4S;
        const float *flux = vpl + 8;
        if (flux[0] == 0 && flux[1] == 0 && flux[2] == 0) continue;
        size_t at = set->count++;
        for (int c = 0; c < 3; c++) {
            set->position[c][at] = vpl[c];
            set->normal[c][at] = vpl[4 + c];
            set->flux[c][at] = flux[c];
        }
        set->area[at] = vpl[3];
        set->near2[at] = vpl[7];
        memcpy(set->quads[at], quads + i * 4 * BD_VPL_QUAD_VEC4S, sizeof set->quads[at]);
    }
}

void vpl_set_finish(struct vpl_set *set)
{
    for (int c = 0; c < 3; c++) {
        free(set->position[c]);
        free(set->normal[c]);
        free(set->flux[c]);
    }
    free(set->area);
    free(set->near2);
    free(set->quads);
    *set = (struct vpl_set){0};
}

// --- patches ------------------------------------------------------------------------------------

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

// The part of a convex polygon above the plane through the origin (Sutherland and Hodgman); so many
// corners are left.
static int clip(double (*corners)[3], int count, const double n[3], double (*out)[3])
{
    int left = 0;
    for (int k = 0; k < count; k++) {
        const double *a = corners[k], *b = corners[(k + 1) % count];
        double height_a = dot(a, n), height_b = dot(b, n);
        if (height_a > 0) memcpy(out[left++], a, 3 * sizeof(double));
        if ((height_a > 0) == (height_b > 0)) continue;
        double share = height_a / (height_a - height_b);
        for (int i = 0; i < 3; i++) out[left][i] = a[i] + share * (b[i] - a[i]);
        left++;
    }
    return left;
}

double vpl_patch_form_factor(const double centre[3], const double u[3], const double v[3],
                             const double n[3])
{
    double corners[4][3], above[8][3], sum = 0;
    for (int i = 0; i < 3; i++) {
        corners[0][i] = centre[i] - u[i] - v[i];
        corners[1][i] = centre[i] + u[i] - v[i];
        corners[2][i] = centre[i] + u[i] + v[i];
        corners[3][i] = centre[i] - u[i] + v[i];
    }
    int count = clip(corners, 4, n, above);
    // Lambert's formula: angles seen between neighbouring corners, each along its edge's normal.
    for (int k = 0; k < count; k++) {
        const double *a = above[k], *b = above[(k + 1) % count];
        double across[3];
        cross(a, b, across);
        double sine = sqrt(dot(across, across));
        if (sine > 0) sum += atan2(sine, dot(a, b)) * dot(n, across) / sine;
    }
    return fabs(sum) / (2 * M_PI);
}

static int is_above(double height, double r2)
{
    return (height > COPLANAR_HEIGHT) & (height * height > COPLANAR_SQUARED * r2);
}

static double patch_kernel(const struct vpl_set *set, size_t at, const struct vpl_receiver *r)
{
    double to_vpl[3], u[3], v[3];
    const float *quad = set->quads[at];
    for (int i = 0; i < 3; i++) {
        to_vpl[i] = set->position[i][at] - r->position[i];
        u[i] = quad[i];
        v[i] = quad[4 + i];
    }
    // A patch whose centre is not above the receiver's surface does not count, nor one with the
    // receiver behind its plane.
    const double r2 = dot(to_vpl, to_vpl);
    if (!is_above(dot(to_vpl, r->normal_geometric), r2)) return 0;
    double front[3];
    cross(u, v, front);
    if (!is_above(-dot(front, to_vpl) / sqrt(dot(front, front)), r2)) return 0;
    return vpl_patch_form_factor(to_vpl, u, v, r->normal) * quad[3];
}

// --- the sum ------------------------------------------------------------------------------------

// Kernels of `count` VPLs from `first` on, for one receiver; nonzero in `near` where it is to be
// that of the patch. No branch and no dependence between VPLs: this is nearly all of the time.
static int disk_kernels(const struct vpl_set *set, size_t first, size_t count,
                        const struct vpl_receiver *r, double *restrict kernels, int *restrict near)
{
    const float *px = set->position[0] + first, *py = set->position[1] + first;
    const float *pz = set->position[2] + first, *nx = set->normal[0] + first;
    const float *ny = set->normal[1] + first, *nz = set->normal[2] + first;
    const float *area = set->area + first, *near2 = set->near2 + first;
    const double x = r->position[0], y = r->position[1], z = r->position[2];
    const double rx = r->normal[0], ry = r->normal[1], rz = r->normal[2];
    const double gx = r->normal_geometric[0], gy = r->normal_geometric[1];
    const double gz = r->normal_geometric[2];
    int some_near = 0;
    for (size_t i = 0; i < count; i++) {
        double tx = px[i] - x, ty = py[i] - y, tz = pz[i] - z;
        double r2 = tx * tx + ty * ty + tz * tz;
        double receiver = rx * tx + ry * ty + rz * tz;
        double side = gx * tx + gy * ty + gz * tz;
        double sender = -(nx[i] * tx + ny[i] * ty + nz[i] * tz);
        int faces = is_above(sender, r2);
        int is_near = (r2 < near2[i]) & faces;
        int seen = (receiver > 0) & is_above(side, r2) & (r2 > COINCIDENT_SQUARED) & faces;
        double kernel = receiver * sender / (r2 * (M_PI * r2 + area[i]));
        kernels[i] = (seen & !is_near) ? kernel : 0;
        near[i] = is_near;
        some_near |= is_near;
    }
    return some_near;
}

static void add_chunk(const struct vpl_set *set, size_t first, size_t count,
                      const struct vpl_receiver *r, double irradiance[3])
{
    double kernels[CHUNK];
    int near[CHUNK];
    if (disk_kernels(set, first, count, r, kernels, near))
        for (size_t i = 0; i < count; i++)
            if (near[i]) kernels[i] = patch_kernel(set, first + i, r);
    for (int c = 0; c < 3; c++) {
        const float *flux = set->flux[c] + first;
        double sum = 0;
        for (size_t i = 0; i < count; i++) sum += kernels[i] * flux[i];
        irradiance[c] += sum;
    }
}

void vpl_sum(const struct vpl_set *set, const struct vpl_receiver *receivers, uint32_t count,
             double (*irradiance)[3])
{
    memset(irradiance, 0, count * sizeof *irradiance);
    for (size_t first = 0; first < set->count; first += CHUNK) {
        size_t left = set->count - first;
        for (uint32_t r = 0; r < count; r++)
            add_chunk(set, first, left < CHUNK ? left : CHUNK, &receivers[r], irradiance[r]);
    }
}
