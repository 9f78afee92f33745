#include "picture.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct bd_pass_context context;
static struct bd_slicer slicer;

int open_device(void **state)
{
    (void)state;
    const struct bd_gpu_options options = {.device = "auto", .debug = true};
    struct bd_fault fault = {0};
    if (bd_gpu_create(&options, &context.gpu, &fault)) {
        fprintf(stderr, "skipped: %s\n", fault.message);
        exit(77);
    }
    bd_slicer_init(&slicer, context.gpu, NULL, NULL);
    context.slicer = &slicer;
    return 0;
}

int close_device(void **state)
{
    (void)state;
    bd_gpu_destroy(&context.gpu);
    return 0;
}

// --- what is seen -------------------------------------------------------------------------

float noise(uint32_t x, uint32_t y, uint32_t stream)
{
    uint32_t h = x * 0x9e3779b1u ^ (y * 0x85ebca77u + stream * 0xc2b2ae3du);
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (float)((h ^ h >> 15) >> 8) / 16777216.0f;
}

static float whole_steps(float e)
{
    return roundf(e * 32767) / 32767;
}

void set_normal(struct pixel *pixel, float x, float y, float z)
{
    float sum = fabsf(x) + fabsf(y) + fabsf(z);
    float u = x / sum, v = y / sum;
    if (z < 0) {
        float folded = (1 - fabsf(v)) * (u >= 0 ? 1 : -1);
        v = (1 - fabsf(u)) * (v >= 0 ? 1 : -1);
        u = folded;
    }
    pixel->normal[0] = whole_steps(u);
    pixel->normal[1] = whole_steps(v);
}

static struct pixel look_at_noise(uint32_t x, uint32_t y, struct picture_size size)
{
    (void)size;
    struct pixel p = {.cover = noise(x, y, 0) < 0.6f   ? COVER_LIT
                               : noise(x, y, 1) < 0.5f ? COVER_UNLIT
                                                       : COVER_NOTHING,
                      .depth = 0.5f + 4 * noise(x, y, 2)};
    set_normal(&p, noise(x, y, 3) - 0.5f, noise(x, y, 4) - 0.5f, noise(x, y, 5) - 0.5f);
    return p;
}

// A bent wall, with a box before it whose left edge is on the border of a block and whose right one
// is not.
static struct pixel look_at_box(uint32_t x, uint32_t y, struct picture_size size)
{
    float u = (float)x / (float)size.width, v = (float)y / (float)size.height;
    struct pixel p = {.cover = COVER_LIT, .depth = 2 + 0.05f * sinf(3 * u) + 0.03f * v};
    set_normal(&p, 0.3f * u, 0.1f, 1);
    if (x >= size.width / 32 * 16 && u < 0.8f && v > 0.3f && v < 0.7f) {
        p.depth = 1.2f + 0.01f * u;
        set_normal(&p, 1, 0.2f * v, 0.5f);
    }
    return p;
}

static struct pixel look_at_dust(uint32_t x, uint32_t y, struct picture_size size)
{
    struct pixel p = look_at_noise(x, y, size);
    p.cover = noise(x, y, 6) < 0.01f ? COVER_LIT : COVER_NOTHING;
    return p;
}

static struct pixel look_at_one_pixel(uint32_t x, uint32_t y, struct picture_size size)
{
    struct pixel p = look_at_noise(x, y, size);
    bool is_it = x == size.width * 2 / 3 && y == size.height * 3 / 4;
    p.cover = is_it ? COVER_LIT : COVER_NOTHING;
    return p;
}

static struct pixel look_at_lit_checkers(uint32_t x, uint32_t y, struct picture_size size)
{
    struct pixel p = look_at_box(x, y, size);
    p.cover = (x + y) % 2 ? COVER_LIT : COVER_UNLIT;
    return p;
}

static struct pixel look_at_checkers(uint32_t x, uint32_t y, struct picture_size size)
{
    (void)size;
    uint32_t cell = x / 3 + y / 5;
    struct pixel p = {.cover = COVER_LIT, .depth = cell % 2 ? 1 : 1.2f};
    set_normal(&p, cell % 3 ? 0.1f : -0.4f, 0, 1);
    return p;
}

static struct pixel look_at_nothing(uint32_t x, uint32_t y, struct picture_size size)
{
    struct pixel p = look_at_noise(x, y, size);
    if (p.cover == COVER_LIT) p.cover = COVER_NOTHING;
    return p;
}

// A ball before nothing.
static struct pixel look_at_ball(uint32_t x, uint32_t y, struct picture_size size)
{
    float u = 2.6f * ((float)x + 0.5f) / (float)size.width - 1.3f;
    float v = 2.6f * ((float)y + 0.5f) / (float)size.height - 1.3f, r2 = u * u + v * v;
    struct pixel p = {.cover = r2 < 1 ? COVER_LIT : COVER_NOTHING, .depth = 1e4f};
    float w = sqrtf(fmaxf(1 - r2, 0));
    if (r2 < 1) p.depth = 5 - w;
    set_normal(&p, u, -v, fmaxf(w, 1e-3f));
    return p;
}

// Where the nearest pixel that can be lit is far from the middle, or in no whole quarter.
static struct pixel look_at_frame(uint32_t x, uint32_t y, struct picture_size size)
{
    struct pixel p = look_at_box(x, y, size);
    bool inside = x * 5 > size.width && x * 5 < size.width * 4 && y * 7 > size.height &&
                  y * 7 < size.height * 6;
    if (inside) p.cover = COVER_NOTHING;
    return p;
}

const struct picture_kind picture_kinds[] = {
    {"noise", look_at_noise},
    {"box", look_at_box},
    {"dust", look_at_dust},
    {"one pixel", look_at_one_pixel},
    {"lit checkers", look_at_lit_checkers},
    {"checkers", look_at_checkers},
    {"nothing", look_at_nothing},
    {"ball", look_at_ball},
    {"frame", look_at_frame},
};
const size_t picture_kind_count = COUNT(picture_kinds);

// --- upload -------------------------------------------------------------------------------

static struct bd_tex *make_tex(enum bd_format format, struct picture_size size, uint32_t layers)
{
    const struct bd_tex_desc desc = {.name = "test",
                                     .format = format,
                                     .width_px = size.width,
                                     .height_px = size.height,
                                     .layer_count = layers};
    struct bd_tex *tex;
    struct bd_fault fault = {0};
    if (bd_tex_create(context.gpu, &desc, &tex, &fault)) fail_msg("%s", fault.message);
    return tex;
}

static size_t pixel_count(struct picture_size size)
{
    return (size_t)size.width * size.height;
}

static void *allocate(size_t count, size_t bytes)
{
    void *memory = calloc(count ? count : 1, bytes);
    assert_non_null(memory);
    return memory;
}

// Far from the world's origin, turned, and at another scale: so that whoever forgets one sees it.
static void set_viewpoint(struct picture *p, bool orthographic)
{
    p->space = (struct bd_render_space){.origin_m = {1, 0, -1}, .render_per_m = 0.5};
    p->viewpoint = (struct bd_viewpoint){
        .position_m = {2, 2, 3},
        .axis_x = {0, 0, -1},
        .axis_y = {0, 1, 0},
        .axis_z = {1, 0, 0},
        .orthographic = orthographic,
        .half_width = orthographic ? 8 : 0.5,
        .half_height = orthographic ? 6 : 0.5,
        .width_px = p->size.width,
        .height_px = p->size.height,
        .sample_x_px = 0.5,
        .sample_y_px = 0.5,
    };
}

static struct picture look(const struct picture_kind *kind, struct picture_size size)
{
    struct picture p = {.size = size};
    p.pixels = allocate(pixel_count(size), sizeof *p.pixels);
    for (uint32_t y = 0; y < size.height; y++)
        for (uint32_t x = 0; x < size.width; x++)
            p.pixels[(size_t)y * size.width + x] = kind->look(x, y, size);
    return p;
}

static void upload(struct bd_tex *tex, uint32_t layer, const void *texels, size_t bytes)
{
    bd_tex_upload(context.gpu, tex, layer, texels, bytes);
}

struct picture picture_of_camera(const struct picture_kind *kind, struct picture_size size)
{
    struct picture p = look(kind, size);
    size_t count = pixel_count(size);
    float *depth = allocate(count, sizeof *depth);
    float(*normals)[4] = allocate(count, sizeof *normals); // their bits are stored
    uint16_t(*material)[4] = allocate(count, sizeof *material);
    set_viewpoint(&p, false);
    for (size_t i = 0; i < count; i++) {
        depth[i] = p.pixels[i].depth;
        memcpy(normals[i], p.pixels[i].normal, sizeof p.pixels[i].normal);
        material[i][2] = p.pixels[i].cover == COVER_UNLIT ? 65535 : 0;
        material[i][3] = p.pixels[i].cover == COVER_NOTHING ? 0 : 65535;
    }
    p.gbuffer.depth = make_tex(BD_FORMAT_R32F, size, 0);
    p.gbuffer.normals = make_tex(BD_FORMAT_RGBA32UI, size, 0);
    p.gbuffer.material = make_tex(BD_FORMAT_RGBA16, size, 0);
    upload(p.gbuffer.depth, 0, depth, count * sizeof *depth);
    upload(p.gbuffer.normals, 0, normals, count * sizeof *normals);
    upload(p.gbuffer.material, 0, material, count * sizeof *material);
    free(depth);
    free(normals);
    free(material);
    return p;
}

static uint32_t packed_normal(const float normal[2])
{
    uint16_t u = (uint16_t)(int16_t)lrintf(normal[0] * 32767);
    uint16_t v = (uint16_t)(int16_t)lrintf(normal[1] * 32767);
    return (uint32_t)v << 16 | u;
}

static void upload_face(struct picture *p, const struct pixel *pixels, uint32_t face)
{
    size_t count = pixel_count(p->size);
    float(*position)[4] = allocate(count, sizeof *position);
    uint32_t(*normals)[2] = allocate(count, sizeof *normals);
    for (size_t i = 0; i < count; i++) {
        // The viewpoint is at (.5, 1, 2) of render space and looks along -x.
        position[i][0] = 0.5f - pixels[i].depth;
        position[i][1] = 1 + noise((uint32_t)i, face, 7);
        position[i][2] = 2 + noise((uint32_t)i, face, 8);
        position[i][3] = pixels[i].cover == COVER_LIT ? 1 : 0;
        normals[i][0] = packed_normal(pixels[i].normal);
    }
    upload(p->rsm.position, face, position, count * sizeof *position);
    upload(p->rsm.normals, face, normals, count * sizeof *normals);
    free(position);
    free(normals);
}

struct picture picture_of_light(const struct picture_kind *kind, uint32_t side_px,
                                bool orthographic)
{
    const struct picture_kind other_faces = {"noise", look_at_noise};
    const struct picture_size size = {side_px, side_px};
    struct picture p = look(kind, size), other = look(&other_faces, size);
    p.is_light = true;
    p.face = 2;
    p.rsm.side_px = side_px;
    p.rsm.face_count = 4;
    p.rsm.position = make_tex(BD_FORMAT_RGBA32F, size, p.rsm.face_count);
    p.rsm.normals = make_tex(BD_FORMAT_RG32UI, size, p.rsm.face_count);
    set_viewpoint(&p, orthographic);
    for (uint32_t face = 0; face < p.rsm.face_count; face++)
        upload_face(&p, face == p.face ? p.pixels : other.pixels, face);
    for (size_t i = 0; i < pixel_count(size); i++)
        p.pixels[i].depth = 0.5f - (0.5f - p.pixels[i].depth);
    free(other.pixels);
    return p;
}

void picture_destroy(struct picture *p)
{
    bd_tex_destroy(context.gpu, &p->gbuffer.depth);
    bd_tex_destroy(context.gpu, &p->gbuffer.normals);
    bd_tex_destroy(context.gpu, &p->gbuffer.material);
    bd_tex_destroy(context.gpu, &p->rsm.position);
    bd_tex_destroy(context.gpu, &p->rsm.normals);
    free(p->pixels);
    p->pixels = NULL;
}

struct bd_discontinuity_inputs picture_inputs(const struct picture *p,
                                              const struct bd_discontinuity_settings *settings)
{
    return (struct bd_discontinuity_inputs){
        .gbuffer = p->is_light ? NULL : &p->gbuffer,
        .rsm = p->is_light ? &p->rsm : NULL,
        .viewpoint = &p->viewpoint,
        .face = p->face,
        .space = &p->space,
        .settings = *settings,
    };
}

// --- blocks -------------------------------------------------------------------------------

uint32_t block_index(const struct blocks *b, uint32_t level, uint32_t x, uint32_t y)
{
    return b->first[level] + y * b->layout.levels[level].x + x;
}

static struct blocks create_blocks(struct bd_multires_layout layout)
{
    struct blocks b = {.layout = layout};
    for (uint32_t k = 1; k < layout.size_px.z; k++)
        b.first[k] = b.first[k - 1] + layout.levels[k - 1].x * layout.levels[k - 1].y;
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

static void read_stack(const struct bd_tex *tex, struct blocks *b, uint32_t *out)
{
    const struct bd_tex_desc *desc = bd_tex_desc(tex);
    size_t bytes = (size_t)desc->width_px * desc->height_px * sizeof(uint32_t);
    uint32_t *stack = allocate(bytes, 1);
    struct bd_readback *readback;
    assert_int_equal(bd_gpu_readback_start(context.gpu, tex, 0, &readback, NULL), BD_ERR_OK);
    assert_int_equal(bd_gpu_readback_finish(context.gpu, &readback, stack, bytes), BD_ERR_OK);
    for (uint32_t k = 1; k < b->layout.size_px.z; k++) {
        const struct bd_uvec4 *level = &b->layout.levels[k];
        for (uint32_t y = 0; y < level->y; y++)
            memcpy(out + block_index(b, k, 0, y), stack + (size_t)(level->z + y) * desc->width_px,
                   level->x * sizeof *out);
    }
    free(stack);
}

struct blocks blocks_of_device(const struct picture *p, const struct bd_discontinuity *d)
{
    struct blocks b = create_blocks(d->layout);
    fill_pixels(p, &b);
    read_stack(d->flags, &b, b.flags);
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
    const struct bd_uvec4 *size = &own->layout.levels[level];
    for (int64_t y = (int64_t)by - 1; y <= (int64_t)by + 1; y++)
        for (int64_t x = (int64_t)bx - 1; x <= (int64_t)bx + 1; x++) {
            bool corner = x != bx && y != by;
            if (!corner && neighbourhood == BD_NEIGHBOURHOOD_DIAGONAL) continue;
            if (x < 0 || y < 0 || x >= size->x || y >= size->y) continue;
            if (own->flags[block_index(own, level, (uint32_t)x, (uint32_t)y)] ==
                BD_BLOCK_DISCONTINUOUS)
                return true;
        }
    return false;
}

static bool child_jumps(const struct blocks *b, uint32_t level, uint32_t bx, uint32_t by)
{
    const struct bd_uvec4 *finer = &b->layout.levels[level - 1];
    for (uint32_t y = 2 * by; y < 2 * by + 2 && y < finer->y; y++)
        for (uint32_t x = 2 * bx; x < 2 * bx + 2 && x < finer->x; x++)
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
    for (uint32_t k = 1; k < layout.size_px.z; k++) {
        const struct bd_uvec4 *level = &layout.levels[k];
        for (uint32_t y = 0; y < level->y; y++)
            for (uint32_t x = 0; x < level->x; x++)
                own.flags[block_index(&own, k, x, y)] = own_flag(p, s, k, x, y);
        for (uint32_t y = 0; y < level->y; y++)
            for (uint32_t x = 0; x < level->x; x++)
                settle_block(p, &own, s->neighbourhood, k, x, y, &b);
    }
    blocks_destroy(&own);
    return b;
}

// --- sweeps -------------------------------------------------------------------------------

static void sweep_settings(const struct picture_sweep *sweep, const struct picture *picture,
                           const char *name, uint32_t *turn)
{
    for (int i = 0; i < sweep->turns; i++, (*turn)++) {
        const struct bd_discontinuity_settings settings = sweep->settings_of(sweep->step * *turn);
        sweep->check(picture, &settings, name);
    }
}

void sweep_cameras(const struct picture_sweep *sweep, const struct picture_size *sizes,
                   size_t size_count)
{
    uint32_t turn = 0;
    for (size_t kind = 0; kind < picture_kind_count; kind++)
        for (size_t size = 0; size < size_count; size++) {
            struct picture p = picture_of_camera(&picture_kinds[kind], sizes[size]);
            sweep_settings(sweep, &p, picture_kinds[kind].name, &turn);
            picture_destroy(&p);
        }
}

void sweep_lights(const struct picture_sweep *sweep, bool orthographic)
{
    uint32_t turn = 0;
    for (size_t kind = 0; kind < picture_kind_count; kind++) {
        struct picture p = picture_of_light(&picture_kinds[kind], kind % 2 ? 64 : 33,
                                            orthographic && kind % 3 == 0);
        sweep_settings(sweep, &p, picture_kinds[kind].name, &turn);
        picture_destroy(&p);
    }
}
