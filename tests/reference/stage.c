#include "stage.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#define REPLICATES 32

struct stage *stage_create(void)
{
    struct stage *stage = calloc(1, sizeof *stage);
    stage->scene = bd_scene_create();
    return stage;
}

void stage_destroy(struct stage **stage)
{
    bd_reference_destroy(&(*stage)->reference);
    bd_scene_release(&(*stage)->scene);
    free(*stage);
    *stage = NULL;
}

void stage_finish(struct stage *stage, uint32_t thread_count)
{
    struct bd_err_detail detail = {0};
    if (stage->reference) return;
    if (bd_scene_finish(stage->scene, &detail)) fail_msg("finish: %s", detail.message);
    if (bd_reference_create(stage->scene, thread_count, NULL, NULL, &stage->reference, &detail))
        fail_msg("reference: %s", detail.message);
}

// --- building -----------------------------------------------------------------------------------

// Grows an array of the scene by one zeroed element and returns it.
static void *append(void **array, uint32_t *count, size_t element_bytes)
{
    *array = realloc(*array, (*count + 1) * element_bytes);
    void *element = (char *)*array + *count * element_bytes;
    memset(element, 0, element_bytes);
    ++*count;
    return element;
}

int32_t stage_material(struct stage *stage, float albedo)
{
    static const struct bd_texture_ref none = {BD_NONE, 0, {1, 0, 0, 0, 1, 0}};
    struct bd_scene *s = stage->scene;
    struct bd_material *m = append((void **)&s->materials, &s->material_count, sizeof *m);
    *m = (struct bd_material){
        .base_color = {albedo, albedo, albedo, 1},
        .roughness = 1,
        .normal_scale = 1,
        .ior = 1.5f,
        .attenuation_distance_m = INFINITY,
        .attenuation_color = {1, 1, 1},
        .alpha_cutoff = 0.5f,
        .double_sided = true,
        .base_color_map = none,
        .metallic_roughness_map = none,
        .normal_map = none,
        .emissive_map = none,
        .transmission_map = none,
    };
    return (int32_t)s->material_count - 1;
}

struct bd_material *stage_material_at(struct stage *stage, int32_t material)
{
    return &stage->scene->materials[material];
}

void stage_emission(struct stage *stage, int32_t material, float cd_m2)
{
    for (int k = 0; k < 3; k++) stage_material_at(stage, material)->emissive[k] = cd_m2;
}

static struct bd_node *add_node(struct bd_scene *s)
{
    struct bd_node *node = append((void **)&s->nodes, &s->node_count, sizeof *node);
    node->parent = node->mesh = node->camera = node->light = BD_NONE;
    node->parent_from_node = bd_dmat4_identity();
    return node;
}

// Every triangle with vertices of its own: normals are those of the triangles.
static void fill_triangle(struct bd_primitive *p, uint32_t first, const float *positions,
                          const float *uv, const uint32_t *indices)
{
    double normal[3], length = 0, edge[2][3];
    for (uint32_t c = 0; c < 3; c++) {
        p->index[first + c] = first + c;
        memcpy(p->position + 3 * (first + c), positions + 3 * indices[c], 3 * sizeof(float));
        if (uv) memcpy(p->uv[0] + 2 * (first + c), uv + 2 * indices[c], 2 * sizeof(float));
    }
    const float *at = p->position + 3 * (size_t)first;
    for (int k = 0; k < 3; k++) edge[0][k] = at[3 + k] - at[k], edge[1][k] = at[6 + k] - at[k];
    for (int k = 0; k < 3; k++) {
        int i = (k + 1) % 3, j = (k + 2) % 3;
        normal[k] = edge[0][i] * edge[1][j] - edge[0][j] * edge[1][i];
        length += normal[k] * normal[k];
    }
    for (uint32_t i = 0; i < 9; i++)
        p->normal[3 * first + i] = (float)(normal[i % 3] / sqrt(length));
}

int32_t stage_triangles(struct stage *stage, int32_t material, const float *positions,
                        const float *uv, const uint32_t *indices, uint32_t index_count)
{
    struct bd_scene *s = stage->scene;
    struct bd_mesh *mesh = calloc(1, sizeof *mesh);
    mesh->reference_count = 1;
    mesh->primitive_count = 1;
    struct bd_primitive *p = mesh->primitives = calloc(1, sizeof *p);
    p->vertex_count = p->index_count = index_count;
    p->material = material;
    p->position = calloc(3 * (size_t)index_count, sizeof(float));
    p->normal = calloc(3 * (size_t)index_count, sizeof(float));
    if (uv) p->uv[0] = calloc(2 * (size_t)index_count, sizeof(float));
    p->index = calloc(index_count, sizeof *p->index);
    for (uint32_t t = 0; t < index_count; t += 3) fill_triangle(p, t, positions, uv, indices + t);
    bd_mesh_seal(mesh);
    struct bd_mesh **slot = append((void **)&s->meshes, &s->mesh_count, sizeof *slot);
    *slot = mesh;
    add_node(s)->mesh = (int32_t)s->mesh_count - 1;
    return (int32_t)s->node_count - 1;
}

int32_t stage_quad(struct stage *stage, int32_t material, const double corners[4][3])
{
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    static const float uv[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    float positions[12];
    for (int i = 0; i < 12; i++) positions[i] = (float)corners[i / 3][i % 3];
    return stage_triangles(stage, material, positions, uv, indices, 6);
}

int32_t stage_floor(struct stage *stage, int32_t material, double half, double y, int front)
{
    double z = front > 0 ? half : -half;
    const double corners[4][3] = {{-half, y, z}, {half, y, z}, {half, y, -z}, {-half, y, -z}};
    return stage_quad(stage, material, corners);
}

int32_t stage_disc(struct stage *stage, int32_t material, double radius, double y, int front,
                   uint32_t corner_count)
{
    float *positions = calloc(3 * ((size_t)corner_count + 1), sizeof *positions);
    uint32_t *indices = calloc(3 * (size_t)corner_count, sizeof *indices);
    // As large as the circle, not inscribed in it.
    double step = 2 * M_PI / corner_count, r = radius * sqrt(step / sin(step));
    positions[1] = (float)y;
    for (uint32_t i = 0; i < corner_count; i++) {
        float *p = positions + 3 * (i + 1);
        p[0] = (float)(r * cos(i * step)), p[1] = (float)y, p[2] = (float)(r * sin(i * step));
        uint32_t here = i + 1, there = (i + 1) % corner_count + 1;
        indices[3 * i + 1] = front > 0 ? there : here;
        indices[3 * i + 2] = front > 0 ? here : there;
    }
    int32_t node = stage_triangles(stage, material, positions, NULL, indices, 3 * corner_count);
    free(positions), free(indices);
    return node;
}

// An octahedron's faces cut in rows, pushed out to the sphere.
int32_t stage_sphere(struct stage *stage, int32_t material, const double centre[3], double radius,
                     uint32_t subdivisions, bool inward)
{
    uint32_t n = 1u << subdivisions, side = n + 1, vertex_count = 8 * side * side, at = 0;
    float *positions = calloc(3 * (size_t)vertex_count, sizeof *positions);
    uint32_t *indices = calloc(8 * 6 * (size_t)n * n, sizeof *indices);
    for (uint32_t octant = 0; octant < 8; octant++) {
        double sign[3] = {octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1};
        bool turned = (sign[0] * sign[1] * sign[2] < 0) != inward;
        uint32_t base = octant * side * side;
        for (uint32_t i = 0; i <= n; i++)
            for (uint32_t j = 0; j <= n - i; j++) {
                double d[3] = {i, j, n - i - j}, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
                for (int k = 0; k < 3; k++)
                    positions[3 * (base + i * side + j) + (uint32_t)k] =
                        (float)(centre[k] + radius * sign[k] * d[k] / length);
                for (int down = 0; down < 2; down++) {
                    if (i + j + 1 + (uint32_t)down > n) continue;
                    uint32_t a = base + i * side + j + (down ? side + 1 : 0);
                    uint32_t b = base + i * side + j + (down ? 1 : side);
                    uint32_t c = base + i * side + j + (down ? side : 1);
                    indices[at] = a;
                    indices[at + 1] = turned ? c : b;
                    indices[at + 2] = turned ? b : c;
                    at += 3;
                }
            }
    }
    int32_t node = stage_triangles(stage, material, positions, NULL, indices, at);
    free(positions), free(indices);
    return node;
}

void stage_box(struct stage *stage, int32_t material, const double low[3], const double high[3])
{
    for (int face = 0; face < 6; face++) {
        int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
        bool is_high = face % 2;
        double corners[4][3];
        for (int k = 0; k < 4; k++) {
            int from = is_high ? 3 - k : k; // counter-clockwise seen from inside
            corners[k][axis] = is_high ? high[axis] : low[axis];
            corners[k][u] = from == 1 || from == 2 ? high[u] : low[u];
            corners[k][v] = from >= 2 ? high[v] : low[v];
        }
        stage_quad(stage, material, (const double (*)[3])corners);
    }
}

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

struct bd_light *stage_light(struct stage *stage, enum bd_light_kind kind, double x, double y,
                             double z, const double direction[3], float intensity)
{
    struct bd_scene *s = stage->scene;
    struct bd_light *light = append((void **)&s->lights, &s->light_count, sizeof *light);
    *light = (struct bd_light){
        .kind = kind,
        .color = {1, 1, 1},
        .intensity = intensity,
        .range_m = INFINITY,
        .cone_inner = (float)(M_PI / 18),
        .cone_outer = (float)(M_PI / 6),
    };
    struct bd_node *node = add_node(s);
    const double position[3] = {x, y, z};
    node->parent_from_node =
        look_along(position, direction ? (bd_dvec3){direction[0], direction[1], direction[2]}
                                       : (bd_dvec3){0, -1, 0});
    node->light = (int32_t)s->light_count - 1;
    return light;
}

uint32_t stage_camera(struct stage *stage, const double position[3], const double target[3],
                      double yfov)
{
    struct bd_scene *s = stage->scene;
    struct bd_camera *camera = append((void **)&s->cameras, &s->camera_count, sizeof *camera);
    *camera = (struct bd_camera){.near_m = 1e-4f, .far_m = INFINITY, .yfov = (float)yfov};
    struct bd_node *node = add_node(s);
    node->parent_from_node = look_along(
        position, (bd_dvec3){target[0] - position[0], target[1] - position[1],
                             target[2] - position[2]});
    node->camera = (int32_t)s->camera_count - 1;
    return s->camera_count - 1;
}

// --- asking -------------------------------------------------------------------------------------

static struct estimate estimate_of(const double means[REPLICATES])
{
    double sum = 0, square = 0;
    for (int i = 0; i < REPLICATES; i++) sum += means[i];
    double mean = sum / REPLICATES;
    for (int i = 0; i < REPLICATES; i++) square += (means[i] - mean) * (means[i] - mean);
    return (struct estimate){mean, sqrt(square / (REPLICATES - 1) / REPLICATES)};
}

static double value_of(const struct bd_reference_pixel *pixel, uint32_t half,
                       enum bd_reference_part part)
{
    double sum = 0;
    for (int p = 0; p < BD_PART_COUNT; p++)
        if (part == BD_PART_COUNT || part == (enum bd_reference_part)p) sum += pixel->sum[half][p][0];
    assert_int_equal(pixel->nonfinite_count, 0);
    return sum / pixel->sample_count[half];
}

struct estimate stage_irradiance(struct stage *stage, const struct bd_integrand *integrand,
                                 enum bd_reference_part part, double x, double y, double z,
                                 double nx, double ny, double nz, uint32_t sample_count)
{
    const double point[3] = {x, y, z}, normal[3] = {nx, ny, nz};
    double means[REPLICATES];
    stage_finish(stage, 1);
    for (int r = 0; r < REPLICATES; r += 2) {
        struct bd_reference_pixel pixel = {0};
        bd_reference_irradiance(stage->reference, integrand, point, normal, stage->asked++, 0,
                                sample_count / REPLICATES, &pixel);
        for (int half = 0; half < 2; half++)
            means[r + half] = value_of(&pixel, (uint32_t)half, part);
    }
    return estimate_of(means);
}

struct estimate stage_radiance(struct stage *stage, const struct bd_integrand *integrand,
                               uint32_t camera, enum bd_reference_part part, uint32_t size,
                               uint32_t sample_count)
{
    const struct bd_reference_view view = {.width_px = size, .height_px = size, .camera = camera};
    double means[REPLICATES];
    stage_finish(stage, 1);
    for (int r = 0; r < REPLICATES; r += 2) {
        uint64_t seed = stage->asked++;
        means[r] = means[r + 1] = 0;
        for (uint32_t i = 0; i < size * size; i++) {
            struct bd_reference_pixel pixel = {0};
            bd_reference_trace(stage->reference, integrand, &view, seed, i % size, i / size, 0,
                               sample_count / REPLICATES, &pixel);
            for (int half = 0; half < 2; half++)
                means[r + half] += value_of(&pixel, (uint32_t)half, part) / (size * size);
        }
    }
    return estimate_of(means);
}

void check_estimate(const char *file, int line, const char *what, struct estimate estimate,
                    double expected, double relative)
{
    double off = estimate.mean - expected;
    double allowed = 4 * estimate.error + relative * fabs(expected);
    print_message("    %.60s = %.6g, expected %.6g: off by %+.2g %%, %+.1f sigma of %.2g %%\n", what,
                  estimate.mean, expected, 100 * off / (expected != 0 ? expected : 1),
                  estimate.error > 0 ? off / estimate.error : 0,
                  100 * estimate.error / (expected != 0 ? expected : 1));
    if (fabs(off) <= allowed) return;
    print_error("%s:%d: %s = %.9g, expected %.9g within %g\n", file, line, what, estimate.mean,
                expected, allowed);
    _fail(file, line);
}

void check_same(const char *file, int line, const char *what, struct estimate a, struct estimate b,
                double relative)
{
    double off = a.mean - b.mean, error = sqrt(a.error * a.error + b.error * b.error);
    print_message("    %.60s = %.6g and %.6g: %+.1f sigma, errors %.2g and %.2g %%\n", what, a.mean,
                  b.mean, error > 0 ? off / error : 0, 100 * a.error / a.mean,
                  100 * b.error / b.mean);
    bool is_sharp = error <= relative * fabs(b.mean);
    if (is_sharp && fabs(off) <= 4 * error) return;
    print_error("%s:%d: %s: %.9g and %.9g, errors %g and %g%s\n", file, line, what, a.mean, b.mean,
                a.error, b.error, is_sharp ? "" : ": too coarse to tell");
    _fail(file, line);
}
