#include "world.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/hash.h"

// --- the world ------------------------------------------------------------------------------

static void open_device(struct world *world)
{
    const struct bd_gpu_options options = {.device = "auto", .debug = true};
    struct bd_err_detail detail = {0};
    if (bd_gpu_create(&options, &world->gpu, &detail)) {
        fprintf(stderr, "skipped: %s\n", detail.message);
        exit(77);
    }
    bd_renderer_init(&world->renderer, world->gpu, UINT64_C(1) << 30);
}

static void close_device(struct world *world)
{
    bd_renderer_finish(&world->renderer);
    bd_gpu_destroy(&world->gpu);
}

struct world *world_create(void)
{
    struct world *world = calloc(1, sizeof *world);
    open_device(world);
    world->scene = bd_scene_create();
    return world;
}

void world_reopen_device(struct world *world)
{
    close_device(world);
    open_device(world);
}

void world_destroy(struct world **world)
{
    struct world *w = *world;
    close_device(w);
    bd_scene_release(&w->scene);
    free(w);
    *world = NULL;
}

int world_open(void **state)
{
    *state = world_create();
    return 0;
}

int world_close(void **state)
{
    world_destroy((struct world **)state);
    return 0;
}

void world_clear(struct world *world)
{
    bd_scene_release(&world->scene);
    world->scene = bd_scene_create();
    world->finished = false;
}

// --- building -------------------------------------------------------------------------------

// Grows an array of the scene, which nobody else does before it is finished, by one zeroed element
// and returns it. There is room for a power of two of them.
static void *append(void **array, uint32_t *count, size_t element_bytes)
{
    if ((*count & (*count - 1)) == 0)
        *array = realloc(*array, (*count ? 2 * (size_t)*count : 1) * element_bytes);
    void *element = (char *)*array + *count * element_bytes;
    memset(element, 0, element_bytes);
    ++*count;
    return element;
}

static const struct bd_texture_ref no_texture = {BD_NONE, 0, {1, 0, 0, 0, 1, 0}};

int32_t world_add_material(struct world *world, float albedo)
{
    struct bd_scene *s = world->scene;
    struct bd_material *m = append((void **)&s->materials, &s->material_count, sizeof *m);
    *m = (struct bd_material){
        .base_color = {albedo, albedo, albedo, 1},
        .roughness = 1,
        .normal_scale = 1,
        .ior = 1.5f,
        .attenuation_distance_m = INFINITY,
        .alpha_cutoff = 0.5f,
        .base_color_map = no_texture,
        .metallic_roughness_map = no_texture,
        .normal_map = no_texture,
        .emissive_map = no_texture,
        .transmission_map = no_texture,
    };
    return (int32_t)s->material_count - 1;
}

static struct bd_node *add_node(struct bd_scene *s)
{
    struct bd_node *node = append((void **)&s->nodes, &s->node_count, sizeof *node);
    snprintf(node->name, sizeof node->name, "node%u", s->node_count - 1);
    node->parent = node->mesh = node->camera = node->light = BD_NONE;
    node->parent_from_node = bd_dmat4_identity();
    return node;
}

static float *copy_floats(const float *from, size_t count)
{
    float *to = malloc(count * sizeof *to);
    memcpy(to, from, count * sizeof *to);
    return to;
}

static void measure_bounds(struct bd_primitive *p)
{
    for (int a = 0; a < 3; a++) {
        p->bounds_min[a] = p->bounds_max[a] = p->position[a];
        for (uint32_t v = 1; v < p->vertex_count; v++) {
            p->bounds_min[a] = fminf(p->bounds_min[a], p->position[3 * v + a]);
            p->bounds_max[a] = fmaxf(p->bounds_max[a], p->position[3 * v + a]);
        }
    }
}

int32_t world_add_mesh(struct world *world, int32_t material, const float *positions,
                       const float *normals, uint32_t vertex_count, const uint32_t *indices,
                       uint32_t index_count)
{
    struct bd_scene *s = world->scene;
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    mesh->reference_count = 1;
    mesh->primitive_count = 1;
    mesh->primitives = calloc(1, sizeof *mesh->primitives);
    struct bd_primitive *p = mesh->primitives;
    p->vertex_count = vertex_count;
    p->index_count = index_count;
    p->material = material;
    p->position = copy_floats(positions, 3 * (size_t)vertex_count);
    p->normal = copy_floats(normals, 3 * (size_t)vertex_count);
    p->index = malloc(index_count * sizeof *p->index);
    memcpy(p->index, indices, index_count * sizeof *p->index);
    measure_bounds(p);
    mesh->content_hash = bd_hash64(p->position, 3 * sizeof(float) * vertex_count, (uint64_t)material);
    struct bd_mesh **slot = append((void **)&s->meshes, &s->mesh_count, sizeof *slot);
    *slot = mesh;
    add_node(s)->mesh = (int32_t)s->mesh_count - 1;
    return (int32_t)s->node_count - 1;
}

void world_add_placements(struct world *world, int32_t mesh, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) add_node(world->scene)->mesh = mesh;
}

static void set_normal(float to[3], const double corners[4][3])
{
    double u[3], v[3], n[3], length = 0;
    for (int a = 0; a < 3; a++) u[a] = corners[1][a] - corners[0][a];
    for (int a = 0; a < 3; a++) v[a] = corners[3][a] - corners[0][a];
    for (int a = 0; a < 3; a++) n[a] = u[(a + 1) % 3] * v[(a + 2) % 3] - u[(a + 2) % 3] * v[(a + 1) % 3];
    for (int a = 0; a < 3; a++) length += n[a] * n[a];
    for (int a = 0; a < 3; a++) to[a] = (float)(n[a] / sqrt(length));
}

int32_t world_add_quad(struct world *world, int32_t material, const double corners[4][3],
                       uint32_t cells)
{
    uint32_t side = cells + 1, vertex_count = side * side, index_count = 6 * cells * cells;
    float *positions = malloc(vertex_count * 3 * sizeof *positions);
    float *normals = malloc(vertex_count * 3 * sizeof *normals);
    uint32_t *indices = malloc(index_count * sizeof *indices), *next = indices;
    for (uint32_t i = 0; i < vertex_count; i++) {
        double s = (double)(i % side) / cells, t = (double)(i / side) / cells;
        for (int a = 0; a < 3; a++)
            positions[3 * i + a] =
                (float)((1 - t) * ((1 - s) * corners[0][a] + s * corners[1][a]) +
                        t * ((1 - s) * corners[3][a] + s * corners[2][a]));
        set_normal(normals + 3 * i, corners);
    }
    for (uint32_t c = 0; c < cells * cells; c++) {
        uint32_t a = c / cells * side + c % cells, quad[6] = {a, a + 1, a + side + 1,
                                                              a, a + side + 1, a + side};
        memcpy(next, quad, sizeof quad);
        next += 6;
    }
    int32_t node = world_add_mesh(world, material, positions, normals, vertex_count, indices,
                                  index_count);
    free(positions), free(normals), free(indices);
    return node;
}

void world_add_box_room(struct world *world, int32_t material, const double centre[3], double half)
{
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        double side = face % 2 ? 1 : -1, corners[4][3];
        const double at[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
        for (int k = 0; k < 4; k++) {
            // The face at -half looks along +axis: counter-clockwise there; mirrored at +half.
            int from = side < 0 ? k : 3 - k;
            corners[k][axis] = centre[axis] + side * half;
            corners[k][u] = centre[u] + half * at[from][0];
            corners[k][v] = centre[v] + half * at[from][1];
        }
        world_add_quad(world, material, (const double (*)[3])corners, 1);
    }
}

// --- the sphere -----------------------------------------------------------------------------

struct sphere {
    float *directions; // unit
    uint32_t vertex_count;
    uint32_t *indices;
    uint32_t index_count;
};

static void push_direction(struct sphere *s, const double d[3])
{
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (int a = 0; a < 3; a++) s->directions[3 * s->vertex_count + a] = (float)(d[a] / length);
    s->vertex_count++;
}

static uint32_t push_midpoint(struct sphere *s, uint32_t i, uint32_t j)
{
    double d[3];
    for (int a = 0; a < 3; a++) d[a] = (double)s->directions[3 * i + a] + s->directions[3 * j + a];
    push_direction(s, d);
    return s->vertex_count - 1;
}

static void subdivide(struct sphere *s, uint32_t a, uint32_t b, uint32_t c, uint32_t levels)
{
    if (levels == 0) {
        uint32_t triangle[3] = {a, b, c};
        memcpy(s->indices + s->index_count, triangle, sizeof triangle);
        s->index_count += 3;
        return;
    }
    uint32_t ab = push_midpoint(s, a, b), bc = push_midpoint(s, b, c), ca = push_midpoint(s, c, a);
    subdivide(s, a, ab, ca, levels - 1);
    subdivide(s, ab, b, bc, levels - 1);
    subdivide(s, ca, bc, c, levels - 1);
    subdivide(s, ab, bc, ca, levels - 1);
}

static struct sphere make_sphere(uint32_t subdivisions)
{
    const double g = (1 + sqrt(5.0)) / 2;
    const double corners[12][3] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                   {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                   {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    const uint32_t faces[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                   {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                   {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                   {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
    uint32_t triangles = 20u << (2 * subdivisions);
    struct sphere s = {.directions = malloc((12 + 2 * (size_t)triangles) * 3 * sizeof(float)),
                       .indices = malloc(triangles * 3 * sizeof(uint32_t))};
    for (int i = 0; i < 12; i++) push_direction(&s, corners[i]);
    for (int f = 0; f < 20; f++) subdivide(&s, faces[f][0], faces[f][1], faces[f][2], subdivisions);
    return s;
}

void world_add_sphere_room(struct world *world, int32_t material, double radius,
                           uint32_t subdivisions)
{
    struct sphere s = make_sphere(subdivisions);
    float *positions = malloc(s.vertex_count * 3 * sizeof *positions);
    float *normals = malloc(s.vertex_count * 3 * sizeof *normals);
    for (uint32_t i = 0; i < 3 * s.vertex_count; i++) {
        positions[i] = (float)(radius * s.directions[i]);
        normals[i] = -s.directions[i];
    }
    // Inward: the outward winding turned round.
    for (uint32_t t = 0; t < s.index_count; t += 3) {
        uint32_t swap = s.indices[t + 1];
        s.indices[t + 1] = s.indices[t + 2];
        s.indices[t + 2] = swap;
    }
    world_add_mesh(world, material, positions, normals, s.vertex_count, s.indices, s.index_count);
    free(positions), free(normals), free(s.directions), free(s.indices);
}

// --- lights and cameras ---------------------------------------------------------------------

// Frame at `position` whose -z axis looks along `direction`.
static bd_dmat4 look_along(const double position[3], bd_dvec3 direction)
{
    bd_dvec3 z = bd_dvec3_normalize(bd_dvec3_scale(direction, -1), (bd_dvec3){0, 0, 1});
    bd_dvec3 up = fabs(z.y) > 0.9 ? (bd_dvec3){1, 0, 0} : (bd_dvec3){0, 1, 0};
    bd_dvec3 x = bd_dvec3_normalize(bd_dvec3_cross(up, z), (bd_dvec3){1, 0, 0});
    bd_dvec3 y = bd_dvec3_cross(z, x);
    return (bd_dmat4){{x.x, x.y, x.z, 0, y.x, y.y, y.z, 0, z.x, z.y, z.z, 0, position[0],
                       position[1], position[2], 1}};
}

int32_t world_add_light(struct world *world, enum bd_light_kind kind, const double position[3],
                        const double direction[3], float intensity)
{
    struct bd_scene *s = world->scene;
    struct bd_light *light = append((void **)&s->lights, &s->light_count, sizeof *light);
    *light = (struct bd_light){
        .kind = kind,
        .color = {1, 1, 1},
        .intensity = intensity,
        .range_m = INFINITY,
        .cone_inner = 0,
        .cone_outer = (float)(M_PI / 4),
    };
    struct bd_node *node = add_node(s);
    node->parent_from_node =
        look_along(position, (bd_dvec3){direction[0], direction[1], direction[2]});
    node->light = (int32_t)s->light_count - 1;
    return node->light;
}

static struct bd_camera *add_camera(struct world *world, const double position[3],
                                    bd_dvec3 direction)
{
    struct bd_scene *s = world->scene;
    struct bd_camera *camera = append((void **)&s->cameras, &s->camera_count, sizeof *camera);
    *camera = (struct bd_camera){.near_m = 1e-3f, .far_m = INFINITY};
    struct bd_node *node = add_node(s);
    node->parent_from_node = look_along(position, direction);
    node->camera = (int32_t)s->camera_count - 1;
    return camera;
}

int32_t world_add_camera(struct world *world, const double position[3], const double target[3],
                         double yfov)
{
    bd_dvec3 direction = {target[0] - position[0], target[1] - position[1],
                          target[2] - position[2]};
    add_camera(world, position, direction)->yfov = (float)yfov;
    return (int32_t)world->scene->camera_count - 1;
}

int32_t world_add_probe(struct world *world, const double at[3], const double normal[3],
                        double width_m)
{
    double position[3];
    for (int a = 0; a < 3; a++) position[a] = at[a] + 2 * width_m * normal[a];
    struct bd_camera *camera =
        add_camera(world, position, (bd_dvec3){-normal[0], -normal[1], -normal[2]});
    camera->orthographic = true;
    camera->xmag = camera->ymag = (float)(width_m / 2);
    camera->near_m = 0;
    camera->far_m = (float)(4 * width_m);
    return (int32_t)world->scene->camera_count - 1;
}

// --- rendering ------------------------------------------------------------------------------

void world_finish(struct world *world)
{
    struct bd_err_detail detail = {0};
    if (world->finished) return;
    if (bd_scene_finish(world->scene, &detail)) fail_msg("finish: %s", detail.message);
    world->finished = true;
}

void world_render(struct world *world, const char *technique, uint32_t camera, uint32_t width_px,
                  uint32_t height_px, uint32_t layers, const char *const *settings,
                  struct bd_image *out[BD_LAYER_COUNT])
{
    world_finish(world);
    struct bd_err_detail detail = {0};
    struct bd_frame_request request = bd_frame_request_default;
    snprintf(request.technique, sizeof request.technique, "%s", technique);
    snprintf(request.camera, sizeof request.camera, "%u", camera);
    request.width_px = width_px;
    request.height_px = height_px;
    request.layers = layers;
    request.fresh = world->fresh;
    for (; settings && *settings; settings++)
        if (bd_param_list_add(&request.params, *settings, &detail)) fail_msg("%s", detail.message);
    memset(out, 0, BD_LAYER_COUNT * sizeof *out);
    enum bd_err err = bd_frame_render(&world->renderer, world->scene, &request, NULL, NULL, out,
                                      &world->report, &detail);
    if (err) fail_msg("render: %s: %s", bd_err_name(err), detail.message);
}

void world_free_layers(struct bd_image *layers[BD_LAYER_COUNT])
{
    for (int l = 0; l < BD_LAYER_COUNT; l++) bd_image_destroy(&layers[l]);
}

struct world_picture world_picture_of(struct world *world, const struct bd_frame_request *request)
{
    struct world_picture picture = {0};
    struct bd_err_detail detail = {0};
    if (bd_frame_render(&world->renderer, world->scene, request, NULL, NULL, picture.layers,
                        &picture.report, &detail))
        fail_msg("%s: %s", detail.field, detail.message);
    return picture;
}

void world_picture_free(struct world_picture *picture)
{
    world_free_layers(picture->layers);
}

uint32_t world_times_run(const struct bd_report *report, const char *pass)
{
    for (uint32_t i = 0; i < report->pass_count; i++)
        if (strcmp(report->passes[i].name, pass) == 0) return report->passes[i].sub_frames;
    return 0;
}

void world_assert_same(const struct world_picture *a, const struct world_picture *b)
{
    for (uint32_t l = 0; l < BD_LAYER_COUNT; l++) {
        const struct bd_image *one = a->layers[l], *other = b->layers[l];
        assert_int_equal(one != NULL, other != NULL);
        if (!one) continue;
        assert_memory_equal(one->pixels, other->pixels,
                            sizeof(float) * one->width_px * one->height_px * one->channel_count);
    }
    assert_int_equal(a->report.counts.rays, b->report.counts.rays);
}

float world_probe(struct world *world, const char *technique, uint32_t camera, enum bd_layer layer,
                  const char *const *settings)
{
    struct bd_image *layers[BD_LAYER_COUNT];
    world_render(world, technique, camera, 1, 1, 1u << layer, settings, layers);
    float red = layers[layer]->pixels[0];
    world_free_layers(layers);
    return red;
}

void assert_relative(const char *file, int line, const char *what, double value, double expected,
                     double tolerance)
{
    double error = value / expected - 1;
    printf("    %s = %.7g, expected %.7g: %+.3g %%\n", what, value, expected, 100 * error);
    if (fabs(error) <= tolerance) return;
    print_error("%s:%d: %s = %.9g, expected %.9g within %g\n", file, line, what, value, expected,
                tolerance);
    _fail(file, line);
}
