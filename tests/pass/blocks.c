#include "blocks.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct bd_discontinuity *discontinuity_of(const struct picture *p,
                                          const struct bd_discontinuity_settings *settings)
{
    const struct bd_discontinuity_inputs inputs = picture_inputs(p, settings);
    struct bd_discontinuity *d = NULL;
    struct bd_err_detail detail = {0};
    if (bd_discontinuity_run(&context, &inputs, &d, &detail)) fail_msg("%s", detail.message);
    return d;
}

// --- blocks -------------------------------------------------------------------------------

uint32_t block_index(const struct blocks *b, uint32_t level, uint32_t x, uint32_t y)
{
    return b->first[level] + y * b->layout.levels[level].columns + x;
}

static struct blocks create_blocks(struct bd_multires_layout layout)
{
    struct blocks b = {.layout = layout};
    for (uint32_t k = 1; k < layout.level_count; k++)
        b.first[k] = b.first[k - 1] + layout.levels[k - 1].columns * layout.levels[k - 1].rows;
    size_t count = bd_multires_block_count(&layout);
    b.flags = allocate(count, sizeof *b.flags);
    b.representatives = allocate(count, sizeof *b.representatives);
    return b;
}

void blocks_destroy(struct blocks *b)
{
    free(b->flags);
    free(b->representatives);
}

static const struct pixel *lit_pixel(const struct picture *p, int64_t x, int64_t y)
{
    if (x < 0 || y < 0 || x >= p->size.width || y >= p->size.height) return NULL;
    const struct pixel *pixel = &p->pixels[(size_t)y * p->size.width + (size_t)x];
    return pixel->cover == COVER_LIT ? pixel : NULL;
}

static void fill_pixels(const struct picture *p, struct blocks *b)
{
    for (uint32_t y = 0; y < p->size.height; y++)
        for (uint32_t x = 0; x < p->size.width; x++) {
            uint32_t i = block_index(b, 0, x, y);
            b->flags[i] = lit_pixel(p, x, y) ? BD_BLOCK_SMOOTH : BD_BLOCK_EMPTY;
            b->representatives[i] = BD_PIXEL_PACK(x, y);
        }
}

static void read_stack(const struct bd_tex *tex, const struct blocks *b, uint32_t *out)
{
    const struct bd_tex_desc *desc = bd_tex_desc(tex);
    size_t bytes = (size_t)desc->width_px * desc->height_px * sizeof(uint32_t);
    uint32_t *stack = allocate(bytes, 1);
    struct bd_readback *readback;
    assert_int_equal(bd_gpu_readback_start(context.gpu, tex, 0, &readback, NULL), BD_ERR_OK);
    assert_int_equal(bd_gpu_readback_finish(context.gpu, &readback, stack, bytes), BD_ERR_OK);
    for (uint32_t k = 1; k < b->layout.level_count; k++) {
        const struct bd_multires_level *level = &b->layout.levels[k];
        for (uint32_t y = 0; y < level->rows; y++)
            memcpy(out + block_index(b, k, 0, y),
                   stack + (size_t)(level->first_row + y) * desc->width_px,
                   level->columns * sizeof *out);
    }
    free(stack);
}

uint32_t *stack_of_device(const struct blocks *b, const struct bd_tex *stack)
{
    uint32_t *words = allocate(bd_multires_block_count(&b->layout), sizeof *words);
    read_stack(stack, b, words);
    return words;
}

static uint32_t children_of(const struct blocks *b, uint32_t level, uint32_t x, uint32_t y)
{
    const struct bd_multires_level *finer = &b->layout.levels[level - 1];
    uint32_t children = 0;
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t cx = 2 * x + i % 2, cy = 2 * y + i / 2;
        if (cx >= finer->columns || cy >= finer->rows) continue;
        if (b->flags[block_index(b, level - 1, cx, cy)] != BD_BLOCK_EMPTY) children |= 1u << i;
    }
    return children;
}

// Of a word its kind is kept; what it tells of the children is held to what those are.
static void take_kinds(struct blocks *b, uint32_t level)
{
    for (uint32_t y = 0; y < b->layout.levels[level].rows; y++)
        for (uint32_t x = 0; x < b->layout.levels[level].columns; x++) {
            uint32_t *word = &b->flags[block_index(b, level, x, y)];
            assert_int_equal(BD_BLOCK_CHILDREN(*word), children_of(b, level, x, y));
            *word = BD_BLOCK_KIND(*word);
        }
}

struct blocks blocks_of_device(const struct picture *p, const struct bd_discontinuity *d)
{
    struct blocks b = create_blocks(d->layout);
    fill_pixels(p, &b);
    read_stack(d->flags, &b, b.flags);
    for (uint32_t k = 1; k < b.layout.level_count; k++) take_kinds(&b, k);
    read_stack(d->representative, &b, b.representatives);
    return b;
}

// --- the definition -----------------------------------------------------------------------

struct vec {
    float x, y, z;
};

static struct vec normal_of(const struct pixel *p)
{
    float x = p->normal[0], y = p->normal[1], z = 1 - fabsf(x) - fabsf(y), t = fmaxf(-z, 0);
    x += x >= 0 ? -t : t;
    y += y >= 0 ? -t : t;
    float length = sqrtf(x * x + y * y + z * z);
    return (struct vec){x / length, y / length, z / length};
}

static float chord(const struct pixel *p, const struct pixel *q)
{
    struct vec a = normal_of(p), b = normal_of(q);
    float x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
    return sqrtf(x * x + y * y + z * z);
}

static float rise(const struct pixel *p, const struct pixel *before, const struct pixel *behind)
{
    float a = before ? fabsf(before->depth - p->depth) : 0;
    float b = behind ? fabsf(behind->depth - p->depth) : 0;
    return fmaxf(a, b);
}

static float depth_unit(const struct picture *p, float depth)
{
    return p->viewpoint.orthographic
               ? (float)(p->space.render_per_m *
                         fmax(p->viewpoint.half_width, p->viewpoint.half_height))
               : depth;
}

// How far the middle of three is from where a plane through the others would be, as a part of its
// depth: 1 / z is affine over a plane, z itself in an orthographic view. Nothing without all three.
static float step_at(const struct picture *p, const struct pixel *at, const struct pixel *before,
                     const struct pixel *behind)
{
    if (!before || !behind) return 0;
    if (!p->viewpoint.orthographic)
        return fabsf(at->depth / before->depth + at->depth / behind->depth - 2);
    float unit = depth_unit(p, at->depth);
    return fabsf((before->depth - at->depth) / unit + (behind->depth - at->depth) / unit);
}

struct extremes {
    float z_min, z_max, slope, step, chord;
    struct vec n_min, n_max;
    bool lit, unlit;
};

static void widen(struct extremes *e, const struct picture *p, uint32_t x, uint32_t y)
{
    const struct pixel *at = lit_pixel(p, x, y);
    const struct pixel *around[4] = {lit_pixel(p, (int64_t)x - 1, y), lit_pixel(p, x + 1, y),
                                     lit_pixel(p, x, (int64_t)y - 1), lit_pixel(p, x, y + 1)};
    *(at ? &e->lit : &e->unlit) = true;
    if (!at) return;
    struct vec n = normal_of(at);
    e->z_min = fminf(e->z_min, at->depth);
    e->z_max = fmaxf(e->z_max, at->depth);
    e->n_min = (struct vec){fminf(e->n_min.x, n.x), fminf(e->n_min.y, n.y), fminf(e->n_min.z, n.z)};
    e->n_max = (struct vec){fmaxf(e->n_max.x, n.x), fmaxf(e->n_max.y, n.y), fmaxf(e->n_max.z, n.z)};
    float slope = hypotf(rise(at, around[0], around[1]), rise(at, around[2], around[3]));
    e->slope = fmaxf(e->slope, slope / depth_unit(p, at->depth));
    e->step = fmaxf(
        e->step, fmaxf(step_at(p, at, around[0], around[1]), step_at(p, at, around[2], around[3])));
    for (int i = 0; i < 4; i++)
        if (around[i]) e->chord = fmaxf(e->chord, chord(at, around[i]));
}

static struct extremes extremes_of(const struct picture *p, uint32_t level, uint32_t bx,
                                   uint32_t by)
{
    struct extremes e = {
        .z_min = INFINITY, .z_max = -INFINITY, .n_min = {9, 9, 9}, .n_max = {-9, -9, -9}};
    for (uint32_t y = by << level; y < (by + 1) << level && y < p->size.height; y++)
        for (uint32_t x = bx << level; x < (bx + 1) << level && x < p->size.width; x++)
            widen(&e, p, x, y);
    return e;
}

static bool depth_jumps(const struct picture *p, const struct extremes *e,
                        const struct bd_discontinuity_settings *s)
{
    float threshold = (float)s->depth_threshold;
    if (s->depth_test == BD_DEPTH_TEST_OFF || isinf(threshold)) return false;
    if (e->unlit) return true;
    if (s->depth_test == BD_DEPTH_TEST_DERIVATIVE) return e->slope > threshold;
    if (s->depth_test == BD_DEPTH_TEST_STEP) return e->step > threshold;
    return e->z_max - e->z_min > threshold * depth_unit(p, e->z_min);
}

static bool normal_jumps(const struct extremes *e, const struct bd_discontinuity_settings *s)
{
    float threshold = (float)s->normal_threshold;
    if (s->normal_test == BD_NORMAL_TEST_OFF || isinf(threshold)) return false;
    if (s->normal_test == BD_NORMAL_TEST_CHORD) return e->chord > threshold;
    return e->n_max.x - e->n_min.x > threshold || e->n_max.y - e->n_min.y > threshold ||
           e->n_max.z - e->n_min.z > threshold;
}

// DISCONTINUOUS where the block's own test says so.
static uint32_t own_flag(const struct picture *p, const struct bd_discontinuity_settings *s,
                         uint32_t level, uint32_t x, uint32_t y)
{
    struct extremes e = extremes_of(p, level, x, y);
    if (!e.lit) return BD_BLOCK_EMPTY;
    return depth_jumps(p, &e, s) || normal_jumps(&e, s) ? BD_BLOCK_DISCONTINUOUS : BD_BLOCK_SMOOTH;
}

static bool neighbour_jumps(const struct blocks *own, enum bd_neighbourhood neighbourhood,
                            uint32_t level, uint32_t bx, uint32_t by)
{
    const struct bd_multires_level *size = &own->layout.levels[level];
    for (int64_t y = (int64_t)by - 1; y <= (int64_t)by + 1; y++)
        for (int64_t x = (int64_t)bx - 1; x <= (int64_t)bx + 1; x++) {
            bool corner = x != bx && y != by;
            if (!corner && neighbourhood == BD_NEIGHBOURHOOD_DIAGONAL) continue;
            if (x < 0 || y < 0 || x >= size->columns || y >= size->rows) continue;
            if (own->flags[block_index(own, level, (uint32_t)x, (uint32_t)y)] ==
                BD_BLOCK_DISCONTINUOUS)
                return true;
        }
    return false;
}

static bool child_jumps(const struct blocks *b, uint32_t level, uint32_t bx, uint32_t by)
{
    const struct bd_multires_level *finer = &b->layout.levels[level - 1];
    for (uint32_t y = 2 * by; y < 2 * by + 2 && y < finer->rows; y++)
        for (uint32_t x = 2 * bx; x < 2 * bx + 2 && x < finer->columns; x++)
            if (b->flags[block_index(b, level - 1, x, y)] == BD_BLOCK_DISCONTINUOUS) return true;
    return false;
}

static uint32_t nearest_lit(const struct picture *p, uint32_t level, uint32_t bx, uint32_t by)
{
    double best = INFINITY, side = (double)(1u << level);
    uint32_t nearest = 0;
    for (uint32_t y = by << level; y < (by + 1) << level && y < p->size.height; y++)
        for (uint32_t x = bx << level; x < (bx + 1) << level && x < p->size.width; x++) {
            double dx = x + 0.5 - (bx + 0.5) * side, dy = y + 0.5 - (by + 0.5) * side;
            if (!lit_pixel(p, x, y) || dx * dx + dy * dy >= best) continue;
            best = dx * dx + dy * dy;
            nearest = BD_PIXEL_PACK(x, y);
        }
    return nearest;
}

// The level's own tests are in `own` already.
static void settle_block(const struct picture *p, const struct blocks *own,
                         enum bd_neighbourhood neighbourhood, uint32_t level, uint32_t x,
                         uint32_t y, struct blocks *b)
{
    uint32_t i = block_index(b, level, x, y);
    b->flags[i] = own->flags[i];
    if (own->flags[i] == BD_BLOCK_EMPTY) return;
    b->representatives[i] = nearest_lit(p, level, x, y);
    bool asked = neighbourhood != BD_NEIGHBOURHOOD_PLAIN;
    if (child_jumps(b, level, x, y) || (asked && neighbour_jumps(own, neighbourhood, level, x, y)))
        b->flags[i] = BD_BLOCK_DISCONTINUOUS;
}

struct blocks blocks_by_definition(const struct picture *p,
                                   const struct bd_discontinuity_settings *s)
{
    struct bd_multires_layout layout =
        bd_multires_layout_of(p->size.width, p->size.height, s->coarsest_side);
    struct blocks own = create_blocks(layout), b = create_blocks(layout);
    fill_pixels(p, &b);
    for (uint32_t k = 1; k < layout.level_count; k++) {
        const struct bd_multires_level *level = &layout.levels[k];
        for (uint32_t y = 0; y < level->rows; y++)
            for (uint32_t x = 0; x < level->columns; x++)
                own.flags[block_index(&own, k, x, y)] = own_flag(p, s, k, x, y);
        for (uint32_t y = 0; y < level->rows; y++)
            for (uint32_t x = 0; x < level->columns; x++)
                settle_block(p, &own, s->neighbourhood, k, x, y, &b);
    }
    blocks_destroy(&own);
    return b;
}
