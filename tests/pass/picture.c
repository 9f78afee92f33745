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
    struct bd_err_detail detail = {0};
    if (bd_gpu_create(&options, &context.gpu, &detail)) {
        fprintf(stderr, "skipped: %s\n", detail.message);
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
    struct bd_err_detail detail = {0};
    if (bd_tex_create(context.gpu, &desc, &tex, &detail)) fail_msg("%s", detail.message);
    return tex;
}

static size_t pixel_count(struct picture_size size)
{
    return (size_t)size.width * size.height;
}

void *allocate(size_t count, size_t bytes)
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

struct picture_name picture_name(const struct picture *p, const struct bd_discontinuity_settings *s,
                                 const char *kind)
{
    struct picture_name name;
    snprintf(name.text, sizeof name.text,
             "%s %ux%u%s, depth test %d, normal test %d, neighbours %d", kind, p->size.width,
             p->size.height, p->is_light ? " (light)" : "", (int)s->depth_test, (int)s->normal_test,
             (int)s->neighbourhood);
    return name;
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

uint32_t check_in_slices(picture_check *check, const struct bd_discontinuity_settings *settings)
{
    struct picture p = picture_of_camera(&picture_kinds[0], (struct picture_size){100, 130});
    uint32_t slices = context.slicer->slice_count;
    context.slicer->forced_units = 20;
    check(&p, settings, "in slices");
    context.slicer->forced_units = 0;
    picture_destroy(&p);
    return context.slicer->slice_count - slices;
}
