// What rays find beside what is drawn: the G-buffer, shadow maps and reflective shadow maps of
// scenes by either. Triangles differ at edges alone, and what pixels of one triangle say differs by
// rounding. Scenes of the scene lists, and some made by hand.
//
// usage: pass_traced [SCENE.glb]...

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "frame/sub_frames.h"
#include "kernel/octahedral.h"
#include "pass/gbuffer.h"
#include "pass/rsm.h"
#include "pass/shadow_map.h"
#include "picture.h"
#include "tests/reference/stage.h"
#include "tests/tools/load_scene.h"

#define WIDTH       192u
#define HEIGHT      128u
#define SHADOW_SIDE 128u
#define RSM_SIDE    64u
#define LIGHTS_MAX  2u
#define CAMERAS_MAX 3u

enum way { DRAWN, TRACED, WAY_COUNT };

// A scene on the device, and rays in it.
struct place {
    const char *name;
    struct bd_uploader uploader;
    struct bd_gpu_scene *scene;
    struct bd_rays *rays;
    struct bd_tracer tracer;
};

static struct place enter(const char *name, struct bd_scene *scene, uint64_t repeated_max,
                          uint32_t threads)
{
    struct place place = {.name = name, .uploader = {.gpu = context.gpu}};
    struct bd_err_detail detail = {0};
    const struct bd_rays_build build = {.repeated_max = repeated_max};
    if (bd_gpu_scene_create(&place.uploader, scene, &place.scene, &detail) ||
        bd_rays_create(scene, &build, &place.rays, &detail))
        fail_msg("%s: %s", name, detail.message);
    place.tracer = (struct bd_tracer){place.rays, bd_pool_create(threads)};
    return place;
}

static void leave(struct place *place)
{
    bd_pool_destroy(&place->tracer.pool);
    bd_rays_destroy(&place->rays);
    bd_gpu_scene_destroy(&place->uploader, &place->scene);
}

static const struct bd_tracer *tracer_of(const struct place *place, enum way way)
{
    return way == TRACED ? &place->tracer : NULL;
}

// --- what a pixel says ------------------------------------------------------------------------

// Depth; the shading and the geometric normal; base colour; material. Of a light's map its place in
// render space, without a depth.
#define VALUES_MAX 20u

struct value_group {
    uint32_t first, count;
    float tolerance;
    bool is_relative; // to the first value
};

static const struct value_group gbuffer_groups[] = {
    {0, 1, 2e-5f, true}, {1, 6, 2e-3f, false}, {7, 8, 4e-3f, false}};
static const struct value_group rsm_groups[] = {
    {0, 4, 2e-5f, false}, {4, 6, 4e-3f, false}, {10, 4, 4e-3f, false}};

struct look {
    uint32_t width, height;
    uint32_t *ids;               // of each pixel: triangle + 1
    float (*values)[VALUES_MAX]; // NULL: none
};

static void finish_look(struct look *look)
{
    free(look->ids);
    free(look->values);
}

static void *read_layer(const struct bd_tex *tex, uint32_t layer, size_t texel_bytes)
{
    const struct bd_tex_desc *desc = bd_tex_desc(tex);
    const size_t bytes = (size_t)desc->width_px * desc->height_px * texel_bytes;
    void *texels = allocate(1, bytes);
    if (bd_tex_read_rows(context.gpu, tex, layer, 0, desc->height_px, texels, bytes))
        fail_msg("%s cannot be read", desc->name);
    return texels;
}

static void set_unit(float to[3], float x, float y)
{
    const f3 n = unit_of_octahedral(x, y);
    to[0] = n.x, to[1] = n.y, to[2] = n.z;
}

static struct look look_by_camera(const struct place *place, const struct bd_viewpoint *viewpoint,
                                  enum way way)
{
    const struct bd_gbuffer_inputs inputs = {
        .scene = place->scene, .viewpoint = viewpoint, .tracer = tracer_of(place, way)};
    struct bd_gbuffer *gbuffer;
    struct bd_err_detail detail = {0};
    if (bd_gbuffer_render(&context, &inputs, &gbuffer, &detail)) fail_msg("%s", detail.message);
    struct look look = {viewpoint->width_px, viewpoint->height_px, NULL, NULL};
    const size_t pixels = (size_t)look.width * look.height;
    look.ids = read_layer(gbuffer->triangle, 0, sizeof *look.ids);
    look.values = allocate(pixels, sizeof *look.values);
    float *depth = read_layer(gbuffer->depth, 0, sizeof *depth);
    float *normals = read_layer(gbuffer->normals, 0, 4 * sizeof *normals);
    uint16_t *albedo = read_layer(gbuffer->albedo, 0, 4 * sizeof *albedo);
    uint16_t *material = read_layer(gbuffer->material, 0, 4 * sizeof *material);
    for (size_t i = 0; i < pixels; i++) {
        float *values = look.values[i];
        values[0] = depth[i];
        set_unit(values + 1, normals[4 * i], normals[4 * i + 1]);
        set_unit(values + 4, normals[4 * i + 2], normals[4 * i + 3]);
        for (int c = 0; c < 4; c++) values[7 + c] = albedo[4 * i + c] / 65535.0f;
        for (int c = 0; c < 4; c++) values[11 + c] = material[4 * i + c] / 65535.0f;
        assert_int_equal(material[4 * i + 3] != 0, look.ids[i] != 0);
    }
    free(depth);
    free(normals);
    free(albedo);
    free(material);
    bd_gbuffer_destroy(context.gpu, &gbuffer);
    return look;
}

static struct look look_by_shadow_map(const struct place *place, const struct bd_light_setup *light,
                                      uint32_t face, uint32_t side_px, enum way way)
{
    struct bd_shadow_map *map;
    struct bd_err_detail detail = {0};
    if (bd_shadow_map_render(&context, place->scene, light, side_px, tracer_of(place, way), &map,
                             &detail))
        fail_msg("%s", detail.message);
    const struct look look = {side_px, side_px, read_layer(map->ids, face, sizeof(uint32_t)), NULL};
    bd_shadow_map_destroy(context.gpu, &map);
    return look;
}

static struct look look_by_rsm(const struct place *place, const struct bd_light_setup *light,
                               uint32_t face, uint32_t side_px, enum way way)
{
    const struct bd_rsm_inputs inputs = {
        .scene = place->scene, .light = light, .side_px = side_px, .tracer = tracer_of(place, way)};
    struct bd_rsm *rsm;
    struct bd_err_detail detail = {0};
    struct look look = look_by_shadow_map(place, light, face, side_px, way);
    if (bd_rsm_render(&context, &inputs, &rsm, &detail)) fail_msg("%s", detail.message);
    const size_t texels = (size_t)side_px * side_px;
    look.values = allocate(texels, sizeof *look.values);
    float *position = read_layer(rsm->position, face, 4 * sizeof *position);
    int16_t *normals = read_layer(rsm->normals, face, 4 * sizeof *normals);
    uint16_t *albedo = read_layer(rsm->albedo, face, 4 * sizeof *albedo);
    for (size_t i = 0; i < texels; i++) {
        float *values = look.values[i];
        memcpy(values, position + 4 * i, 4 * sizeof *values);
        set_unit(values + 4, normals[4 * i] / 32767.0f, normals[4 * i + 1] / 32767.0f);
        set_unit(values + 7, normals[4 * i + 2] / 32767.0f, normals[4 * i + 3] / 32767.0f);
        for (int c = 0; c < 4; c++) values[10 + c] = albedo[4 * i + c] / 65535.0f;
        assert_int_equal(position[4 * i + 3] != 0, look.ids[i] != 0);
    }
    free(position);
    free(normals);
    free(albedo);
    bd_rsm_destroy(context.gpu, &rsm);
    return look;
}

// --- comparing --------------------------------------------------------------------------------

static bool jumps_at(const struct look *look, uint32_t x, uint32_t y)
{
    const uint32_t own = look->ids[y * look->width + x];
    for (uint32_t j = y ? y - 1 : 0; j < look->height && j <= y + 1; j++)
        for (uint32_t i = x ? x - 1 : 0; i < look->width && i <= x + 1; i++)
            if (look->ids[j * look->width + i] != own) return true;
    return false;
}

struct count {
    uint32_t pixels, covered;
    uint32_t triangles; // that differ
    uint32_t off_edges; // of those
    uint32_t values;    // pixels of one triangle that say something else
    float largest[3];   // difference of each group
};

static bool say_the_same(const float *a, const float *b, const struct value_group *groups,
                         struct count *count)
{
    bool same = true;
    for (int g = 0; g < 3; g++) {
        float most = 0;
        for (uint32_t v = groups[g].first; v < groups[g].first + groups[g].count; v++)
            most = fmaxf(most, fabsf(a[v] - b[v]));
        if (groups[g].is_relative) most /= fabsf(a[0]);
        count->largest[g] = fmaxf(count->largest[g], most);
        same = same && most <= groups[g].tolerance;
    }
    return same;
}

static void compare(const struct look looks[WAY_COUNT], const struct value_group *groups,
                    struct count *count)
{
    const struct look *drawn = &looks[DRAWN], *traced = &looks[TRACED];
    for (uint32_t y = 0; y < drawn->height; y++)
        for (uint32_t x = 0; x < drawn->width; x++) {
            const uint32_t at = y * drawn->width + x;
            count->pixels++;
            count->covered += drawn->ids[at] != 0;
            if (drawn->ids[at] != traced->ids[at]) {
                count->triangles++;
                count->off_edges += !jumps_at(drawn, x, y) && !jumps_at(traced, x, y);
            } else if (drawn->ids[at] && drawn->values) {
                count->values +=
                    !say_the_same(drawn->values[at], traced->values[at], groups, count);
            }
        }
}

static void finish_looks(struct look looks[WAY_COUNT])
{
    for (enum way way = 0; way < WAY_COUNT; way++) finish_look(&looks[way]);
}

static void see_by_camera(const struct place *place, uint32_t camera, struct count *count)
{
    for (uint32_t sub_frame = 0; sub_frame < 2; sub_frame++) {
        struct bd_viewpoint viewpoint =
            bd_viewpoint_of(place->scene->scene, &(struct bd_pose){0}, camera, WIDTH, HEIGHT);
        struct look looks[WAY_COUNT];
        bd_sub_frame_place(&viewpoint, sub_frame);
        for (enum way way = 0; way < WAY_COUNT; way++)
            looks[way] = look_by_camera(place, &viewpoint, way);
        compare(looks, gbuffer_groups, count);
        finish_looks(looks);
    }
}

static void see_by_light(const struct place *place, uint32_t placed_light, struct count *shadows,
                         struct count *reflections)
{
    const struct bd_light_setup light = bd_light_setup_of(place->scene->scene, placed_light);
    for (uint32_t face = 0; face < light.face_count; face++) {
        struct look looks[WAY_COUNT];
        for (enum way way = 0; way < WAY_COUNT; way++)
            looks[way] = look_by_shadow_map(place, &light, face, SHADOW_SIDE, way);
        compare(looks, NULL, shadows);
        finish_looks(looks);
        for (enum way way = 0; way < WAY_COUNT; way++)
            looks[way] = look_by_rsm(place, &light, face, RSM_SIDE, way);
        compare(looks, rsm_groups, reflections);
        finish_looks(looks);
    }
}

// What may be of another triangle, and say something else, as a part of what is covered.
struct bounds {
    double triangles, values;
};

static void check(const struct place *place, const char *what, const struct count *count,
                  struct bounds bounds)
{
    const double covered = count->covered;
    printf("%s, %s: %u of %u covered; %u are other triangles, %u say something else; %g %g %g\n",
           place->name, what, count->covered, count->pixels, count->triangles, count->values,
           (double)count->largest[0], (double)count->largest[1], (double)count->largest[2]);
    if (count->off_edges)
        fail_msg("%s, %s: %u other triangles off edges", place->name, what, count->off_edges);
    if (count->triangles > 8 + bounds.triangles * covered)
        fail_msg("%s, %s: %u other triangles", place->name, what, count->triangles);
    if (count->values > 2 + bounds.values * covered)
        fail_msg("%s, %s: %u say something else", place->name, what, count->values);
}

static void see(const char *name, struct bd_scene *scene, uint64_t repeated_max,
                struct bounds bounds)
{
    struct place place = enter(name, scene, repeated_max, 2);
    struct count camera = {0};
    for (uint32_t i = 0; i < scene->placed_camera_count && i < CAMERAS_MAX; i++)
        see_by_camera(&place, i, &camera);
    check(&place, "cameras", &camera, bounds);
    struct count shadows = {0}, reflections = {0};
    for (uint32_t i = 0; i < scene->placed_light_count && i < LIGHTS_MAX; i++)
        see_by_light(&place, i, &shadows, &reflections);
    check(&place, "shadow maps", &shadows, bounds);
    check(&place, "reflective shadow maps", &reflections, bounds);
    leave(&place);
}

// --- scenes -----------------------------------------------------------------------------------

static int file_count;
static char **files;

static void scenes_of_the_lists_are_seen_alike(void **unused)
{
    (void)unused;
    for (int i = 0; i < file_count; i++) {
        struct bd_scene *scene = NULL;
        struct bd_err_detail detail = {0};
        const char *slash = strrchr(files[i], '/');
        if (load_scene(files[i], &scene, &detail)) {
            printf("left out: %s\n", detail.message);
            continue;
        }
        // In a garden leaves are as small as pixels.
        see(slash ? slash + 1 : files[i], scene, BD_RAYS_REPEATED_MAX,
            (struct bounds){.triangles = 0.08, .values = 0.004});
        bd_scene_release(&scene);
    }
}

static uint64_t state = 1;

static double chance(void)
{
    state ^= state << 13, state ^= state >> 7, state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

static struct bd_node *show_again(struct stage *stage, int32_t mesh)
{
    struct bd_scene *s = stage->scene;
    s->nodes = realloc(s->nodes, (s->node_count + 1) * sizeof *s->nodes);
    struct bd_node *node = &s->nodes[s->node_count++];
    *node = s->nodes[0];
    node->mesh = mesh;
    return node;
}

static bd_dmat4 somewhere(const double scale[3])
{
    const double at[3] = {1.6 * chance() - 0.8, 1.2 * chance() - 0.6, 1.6 * chance() - 0.8};
    const double turn[4] = {chance() - 0.5, chance() - 0.5, chance() - 0.5, chance()};
    return bd_dmat4_from_trs(at, turn, scale);
}

// Round, and of normals that are not its triangles'.
static int32_t add_ball(struct stage *stage, int32_t material)
{
    static const double centre[3] = {0};
    const int32_t node = stage_sphere(stage, material, centre, 1, 2, false);
    struct bd_mesh *mesh = stage->scene->meshes[stage->scene->nodes[node].mesh];
    struct bd_primitive *p = mesh->primitives;
    for (uint32_t v = 0; v < 3 * p->vertex_count; v++) p->normal[v] = p->position[v];
    bd_mesh_seal(mesh);
    return node;
}

// Of 5 x 3 texels, a third of them holes.
static void add_map(struct stage *stage, struct bd_material *material)
{
    static const float transform[6] = {1.7f, -0.4f, 0.1f, 0.3f, 2.1f, -0.6f};
    struct bd_scene *s = stage->scene;
    struct bd_picture *picture = calloc(1, sizeof *picture);
    *picture = (struct bd_picture){.reference_count = 1, .width_px = 5, .height_px = 3};
    picture->rgba = malloc(4 * 15);
    for (int i = 0; i < 60; i++)
        picture->rgba[i] = (uint8_t)(i % 4 < 3 ? 40 + 3 * i : i % 3 ? 255 : 0);
    bd_picture_seal(picture);
    s->pictures = calloc(1, sizeof *s->pictures);
    s->textures = calloc(1, sizeof *s->textures);
    s->pictures[0] = picture;
    s->textures[0] = (struct bd_texture){.wrap_s = BD_WRAP_MIRROR, .wrap_t = BD_WRAP_REPEAT};
    s->picture_count = s->texture_count = 1;
    memcpy(material->base_color_map.uv_transform, transform, sizeof transform);
    material->base_color_map.texture = 0;
}

// A room whose walls are seen from within alone, and cameras before them; balls, some of them
// squeezed, mirrored, or cut by a camera's near plane; a fence with holes, a pane.
static struct stage *create_workshop(double size, double offset)
{
    static const double low[3] = {-1, -0.8, -1}, high[3] = {1, 0.8, 1};
    static const double even[3] = {0.2, 0.2, 0.2}, uneven[3] = {0.35, 0.1, 0.2};
    static const double mirrored[3] = {-0.25, 0.25, 0.25}, squeezed_mirror[3] = {-0.1, 0.3, 0.2};
    static const double target[3] = {0}, before[3] = {0.4, 0.3, 2.6}, within[3] = {0.7, 0.2, 0.6};
    static const double fence[4][3] = {
        {-0.9, -0.7, -0.3}, {0.9, -0.7, -0.5}, {0.9, 0.5, -0.5}, {-0.9, 0.5, -0.3}};
    struct stage *stage = stage_create();
    const int32_t wall = stage_material(stage, 0.5f), ball = stage_material(stage, 0.8f);
    const int32_t holes = stage_material(stage, 0.9f), pane = stage_material(stage, 0.7f);
    stage_material_at(stage, wall)->double_sided = stage_material_at(stage, ball)->double_sided =
        false;
    stage_box(stage, wall, low, high);
    const int32_t first = add_ball(stage, ball), mesh = stage->scene->nodes[first].mesh;
    stage->scene->nodes[first].parent_from_node = somewhere(even);
    stage_quad(stage, holes, fence);
    stage_disc(stage, pane, 0.5, 0.1, 1, 7);
    stage_material_at(stage, pane)->alpha_mode = BD_ALPHA_BLEND;
    stage_material_at(stage, pane)->base_color[3] = 0.7f;
    struct bd_material *m = stage_material_at(stage, holes);
    m->alpha_mode = BD_ALPHA_MASK;
    m->alpha_cutoff = 0.5f;
    add_map(stage, m);
    stage_light(stage, BD_LIGHT_POINT, 0.1, 0.3, 0.5, NULL, 10);
    stage_light(stage, BD_LIGHT_DIRECTIONAL, 0, 0, 0, (const double[]){0.3, -1, -0.5}, 10);
    stage_camera(stage, before, target, 0.9);
    const uint32_t cut = stage_camera(stage, within, target, 1.2);
    stage->scene->cameras[cut].near_m = (float)(0.5 * size);
    const uint32_t last = stage_camera(stage, before, target, 1);
    struct bd_camera *flat = &stage->scene->cameras[last];
    flat->orthographic = true;
    flat->xmag = flat->ymag = (float)(1.2 * size);
    flat->near_m = 0;
    flat->far_m = (float)(3 * size);
    for (int i = 0; i < 4; i++) show_again(stage, mesh)->parent_from_node = somewhere(even);
    for (int i = 0; i < 2; i++) show_again(stage, mesh)->parent_from_node = somewhere(uneven);
    for (int i = 0; i < 2; i++) show_again(stage, mesh)->parent_from_node = somewhere(mirrored);
    for (int i = 0; i < 2; i++)
        show_again(stage, mesh)->parent_from_node = somewhere(squeezed_mirror);
    for (uint32_t n = 0; n < stage->scene->node_count; n++) {
        double *at = stage->scene->nodes[n].parent_from_node.m;
        const bool is_shape = stage->scene->nodes[n].mesh != BD_NONE;
        for (int i = 0; i < 15; i++) at[i] *= i % 4 == 3 || (i < 12 && !is_shape) ? 1 : size;
        at[12] += offset, at[13] -= offset, at[14] += 0.5 * offset;
    }
    struct bd_err_detail detail = {0};
    if (bd_scene_finish(stage->scene, &detail)) fail_msg("%s", detail.message);
    return stage;
}

static void a_workshop_is_seen_alike(void **unused)
{
    (void)unused;
    static const struct {
        double size, offset;
    } worlds[] = {{1, 0}, {1e-4, 0}, {1e6, 0}, {1, 1e6}, {1e3, -1e9}};
    for (size_t w = 0; w < COUNT(worlds); w++) {
        struct stage *stage = create_workshop(worlds[w].size, worlds[w].offset);
        char name[64];
        snprintf(name, sizeof name, "workshop of %g m at %g m", worlds[w].size, worlds[w].offset);
        see(name, stage->scene, w % 2 ? BD_RAYS_REPEATED_MAX : 0,
            (struct bounds){.triangles = 0.01, .values = 0.001});
        stage_destroy(&stage);
    }
}

// --- threads and slices -----------------------------------------------------------------------

static void threads_and_slices_change_no_byte(void **unused)
{
    (void)unused;
    struct stage *stage = create_workshop(1, 0);
    const struct bd_viewpoint viewpoint =
        bd_viewpoint_of(stage->scene, &(struct bd_pose){0}, 0, WIDTH, HEIGHT);
    struct look looks[3];
    for (uint32_t i = 0; i < 3; i++) {
        struct place place = enter("workshop", stage->scene, 0, 1 + 3 * i);
        context.slicer->forced_units = i == 1 ? 700 : 0;
        looks[i] = look_by_camera(&place, &viewpoint, TRACED);
        context.slicer->forced_units = 0;
        leave(&place);
    }
    const size_t pixels = (size_t)WIDTH * HEIGHT;
    for (uint32_t i = 1; i < 3; i++) {
        assert_memory_equal(looks[0].ids, looks[i].ids, pixels * sizeof *looks[0].ids);
        assert_memory_equal(looks[0].values, looks[i].values, pixels * sizeof *looks[0].values);
    }
    for (uint32_t i = 0; i < 3; i++) finish_look(&looks[i]);
    stage_destroy(&stage);
}

int main(int argc, char **argv)
{
    file_count = argc - 1;
    files = argv + 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_workshop_is_seen_alike),
        cmocka_unit_test(threads_and_slices_change_no_byte),
        cmocka_unit_test(scenes_of_the_lists_are_seen_alike),
    };
    return cmocka_run_group_tests(tests, open_device, close_device);
}
