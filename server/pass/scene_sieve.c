#include "pass/scene_sieve.h"

#include <math.h>
#include <string.h>

// How far a corner may be from where it is thought to be: the device's grid of a 256th, and what
// shaders and this file round, which CERTAIN_PX bounds.
#define MARGIN_PX  (1.f / 32)
#define CERTAIN_PX (1.0 / 64)
// As in upload/view_bounds.c.
#define ROUNDING      0x1p-20
#define DEPTH_PADDING 1e-4

static void combine(float to[4], const float rows[12], double scale, int row, double by_depth,
                    double offset, bool orthographic)
{
    for (int c = 0; c < 4; c++) {
        double depth = orthographic ? c == 3 : -(double)rows[8 + c];
        to[c] = (float)(scale * rows[4 * row + c] + (by_depth + offset) * depth);
    }
}

// What the products in a row of rows may add up to, over the box.
static double size_of(const float rows[12], int row, const struct bd_box *box)
{
    double size = fabs(rows[4 * row + 3]);
    for (int c = 0; c < 3; c++)
        size += fabs(rows[4 * row + c]) * fmax(fabs(box->min[c]), fabs(box->max[c]));
    return size;
}

struct bd_sieve bd_sieve_of(const struct bd_viewpoint *viewpoint,
                            const struct bd_render_space *space, const float rows[12],
                            const struct bd_box *box)
{
    const bool orthographic = viewpoint->orthographic;
    const double extent = orthographic ? space->render_per_m : 1;
    const double half_x_px = 0.5 * viewpoint->width_px, half_y_px = 0.5 * viewpoint->height_px;
    const double scale_x = half_x_px / (viewpoint->half_width * extent);
    const double scale_y = half_y_px / (viewpoint->half_height * extent);
    struct bd_sieve sieve = {
        .width_px = (float)viewpoint->width_px,
        .height_px = (float)viewpoint->height_px,
    };
    combine(sieve.x, rows, scale_x, 0, half_x_px, -viewpoint->sample_x_px, orthographic);
    combine(sieve.y, rows, -scale_y, 1, half_y_px, -viewpoint->sample_y_px, orthographic);
    combine(sieve.depth, rows, 0, 0, 1, 0, orthographic);
    const double depth_size = orthographic ? 1 : size_of(rows, 2, box);
    double error = fmax(scale_x * size_of(rows, 0, box) + (half_x_px + 1) * depth_size,
                        scale_y * size_of(rows, 1, box) + (half_y_px + 1) * depth_size);
    sieve.depth_least = (float)(ROUNDING / CERTAIN_PX * error);
    sieve.depth_near = -INFINITY; // orthographic: there is no such thing as a depth here
    if (orthographic) return sieve;
    double near = viewpoint->near_m * space->render_per_m;
    sieve.depth_near = (float)(near * (1 - DEPTH_PADDING) - ROUNDING * depth_size);
    sieve.depth_least = fmaxf(sieve.depth_least, (float)near);
    return sieve;
}

static float least(float a, float b)
{
    return a < b ? a : b;
}

static float most(float a, float b)
{
    return a > b ? a : b;
}

#define BATCH 128u

// Corners of a batch, a list for each: loops over it are packed.
struct batch {
    float x[3][BATCH], y[3][BATCH],
        z[3][BATCH]; // of the mesh, then places in the picture and depth
    int32_t left[BATCH], right[BATCH], top[BATCH], bottom[BATCH];
    int32_t is_behind[BATCH], is_uncertain[BATCH];
};

static void fetch(struct batch *batch, const float *position, const uint32_t *index, uint32_t count)
{
    for (uint32_t t = 0; t < count; t++)
        for (int k = 0; k < 3; k++) {
            const float *p = position + 3 * (size_t)index[3 * (size_t)t + k];
            batch->x[k][t] = p[0], batch->y[k][t] = p[1], batch->z[k][t] = p[2];
        }
}

static void project(struct batch *batch, const struct bd_sieve *sieve)
{
    const struct bd_sieve s = *sieve;
    for (int k = 0; k < 3; k++)
        for (uint32_t t = 0; t < BATCH; t++) {
            const float x = batch->x[k][t], y = batch->y[k][t], z = batch->z[k][t];
            const float depth = s.depth[0] * x + s.depth[1] * y + s.depth[2] * z + s.depth[3];
            const float inverse = 1 / depth;
            batch->x[k][t] = (s.x[0] * x + s.x[1] * y + s.x[2] * z + s.x[3]) * inverse;
            batch->y[k][t] = (s.y[0] * x + s.y[1] * y + s.y[2] * z + s.y[3]) * inverse;
            batch->z[k][t] = depth;
        }
}

// Rounds a range of places down to whole numbers, counted from -4, within a row of `count` samples:
// samples are those above the first and up to the second.
static void find_ranges(float (*at)[BATCH], float count, int32_t *from, int32_t *to)
{
    for (uint32_t t = 0; t < BATCH; t++) {
        const float low = least(at[0][t], least(at[1][t], at[2][t])) - MARGIN_PX;
        const float high = most(at[0][t], most(at[1][t], at[2][t])) + MARGIN_PX;
        from[t] = (int32_t)(most(-1, least(low, count)) + 4);
        to[t] = (int32_t)(most(-1, least(high, count)) + 4);
    }
}

// Behind the near distance as a whole; or with a corner whose place is not certain.
static void look_at_depths(struct batch *batch, const struct bd_sieve *sieve)
{
    const float near = sieve->depth_near, certain = sieve->depth_least;
    for (uint32_t t = 0; t < BATCH; t++) {
        const float a = batch->z[0][t], b = batch->z[1][t], c = batch->z[2][t];
        batch->is_behind[t] = (a < near) & (b < near) & (c < near);
        batch->is_uncertain[t] = !((a >= certain) & (b >= certain) & (c >= certain));
    }
}

// Whether a sample lies farther than the margin outside one of the edges.
static bool is_outside(const struct batch *batch, uint32_t t, float x_px, float y_px)
{
    float x[3], y[3];
    for (int k = 0; k < 3; k++) x[k] = batch->x[k][t], y[k] = batch->y[k][t];
    float area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
    for (int k = 0; k < 3; k++) {
        const int next = k == 2 ? 0 : k + 1;
        float dx = x[next] - x[k], dy = y[next] - y[k];
        float side = dx * (y_px - y[k]) - dy * (x_px - x[k]);
        float margin = 2 * MARGIN_PX * (fabsf(dx) + fabsf(dy));
        if (area > 0 ? side < -margin : side > margin) return true;
    }
    return false;
}

static bool is_kept(const struct batch *b, uint32_t t)
{
    if (b->is_behind[t]) return false;
    if (b->is_uncertain[t]) return true;
    const int32_t columns = b->right[t] - b->left[t], rows = b->bottom[t] - b->top[t];
    if (columns == 0 || rows == 0) return false;
    if (columns > 1 || rows > 1) return true;
    return !is_outside(b, t, (float)(b->right[t] - 4), (float)(b->bottom[t] - 4));
}

uint32_t bd_sieve_triangles(const struct bd_sieve *sieve, const float *position,
                            const uint32_t *index, uint32_t first, uint32_t count,
                            uint32_t *kept_index, float *kept_number)
{
    struct batch batch = {0};
    uint32_t kept = 0;
    for (uint32_t at = first; at < first + count; at += BATCH) {
        const uint32_t left = first + count - at, size = left < BATCH ? left : BATCH;
        const uint32_t *of = index + 3 * (size_t)at;
        fetch(&batch, position, of, size);
        project(&batch, sieve);
        find_ranges(batch.x, sieve->width_px, batch.left, batch.right);
        find_ranges(batch.y, sieve->height_px, batch.top, batch.bottom);
        look_at_depths(&batch, sieve);
        for (uint32_t t = 0; t < size; t++) {
            if (!is_kept(&batch, t)) continue;
            memcpy(kept_index + 3 * (size_t)kept, of + 3 * (size_t)t, 3 * sizeof *of);
            kept_number[kept++] = (float)(at + t);
        }
    }
    return kept;
}
