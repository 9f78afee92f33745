// Triangles in render space, and the frames of meshes that are kept once for many instances.

#include <math.h>
#include <stdlib.h>

#include "base/huge_pages.h"
#include "rays/structure.h"

// A mesh of fewer triangles costs more as an instance than placed.
#define KEPT_TRIANGLES_MIN 64u
// Between the largest and the smallest of a matrix's scales, roughly.
#define UNEVEN_MAX 8.0
// Of scales, so that products of three of them, and of their inverses, are within 32 bits.
#define SCALE_EXPONENT_MAX 30

struct bd_mesh_frame bd_mesh_frame_of(const struct bd_mesh *mesh)
{
    double least[3] = {INFINITY, INFINITY, INFINITY}, most[3] = {-INFINITY, -INFINITY, -INFINITY};
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        for (int c = 0; c < 3 && mesh->primitives[p].vertex_count; c++) {
            least[c] = fmin(least[c], mesh->primitives[p].bounds_min[c]);
            most[c] = fmax(most[c], mesh->primitives[p].bounds_max[c]);
        }
    const double half =
        0.5 * fmax(most[0] - least[0], fmax(most[1] - least[1], most[2] - least[2]));
    int exponent = 0;
    if (half > 0 && isfinite(half)) frexp(half, &exponent);
    if (!isfinite(half)) return (struct bd_mesh_frame){{0, 0, 0}, 1};
    return (struct bd_mesh_frame){
        {0.5 * (least[0] + most[0]), 0.5 * (least[1] + most[1]), 0.5 * (least[2] + most[2])},
        ldexp(1, -exponent)};
}

static bd_dvec3 column(const bd_dmat4 *m, int c)
{
    return (bd_dvec3){m->m[4 * c], m->m[4 * c + 1], m->m[4 * c + 2]};
}

// The products of lengths with those of the inverse's: 1 for what turns and scales evenly.
static bool is_even(const bd_dmat4 *matrix, double scale)
{
    bd_dmat4 inverse;
    if (!bd_dmat4_inverse_affine(matrix, &inverse)) return false;
    double there = 0, back = 0;
    for (int c = 0; c < 3; c++) {
        there += bd_dvec3_dot(column(matrix, c), column(matrix, c));
        back += bd_dvec3_dot(column(&inverse, c), column(&inverse, c));
    }
    const double size = sqrt(there / 3) * scale;
    return sqrt(there * back) / 3 <= UNEVEN_MAX && fabs(log2(size)) <= SCALE_EXPONENT_MAX;
}

bool bd_mesh_frame_matrix(const struct bd_mesh_frame *frame, const struct bd_render_space *space,
                          const struct bd_instance *instance, float matrix[12])
{
    const bd_dmat4 *m = &instance->world_from_mesh;
    const double scale = space->render_per_m / frame->scale;
    if (!is_even(m, scale)) return false;
    const bd_dvec3 offset = bd_render_from_world(space, bd_dmat4_point(m, frame->centre));
    for (int c = 0; c < 3; c++) {
        const bd_dvec3 axis = bd_dvec3_scale(column(m, c), scale);
        matrix[3 * c] = (float)axis.x, matrix[3 * c + 1] = (float)axis.y;
        matrix[3 * c + 2] = (float)axis.z;
    }
    matrix[9] = (float)offset.x, matrix[10] = (float)offset.y, matrix[11] = (float)offset.z;
    return true;
}

// --- what is placed and what is kept ----------------------------------------------------------

enum bd_placed bd_placed_kind(const struct bd_scene *scene, int32_t material)
{
    return scene->materials[material].alpha_mode == BD_ALPHA_OPAQUE ? BD_PLACED_OPAQUE
                                                                    : BD_PLACED_CUTOUT;
}

// Runs of one group: of one mesh with one winding.
uint32_t bd_rays_group_end(const struct bd_triangle_order *order, uint32_t first_run)
{
    const uint32_t instance = order->runs[first_run].first_instance;
    uint32_t end = first_run;
    while (end < order->run_count && order->runs[end].first_instance == instance) end++;
    return end;
}

static bool is_worth_keeping(const struct bd_triangle_order *order, uint32_t begin, uint32_t end)
{
    uint64_t triangles = 0;
    for (uint32_t r = begin; r < end; r++) triangles += order->runs[r].triangles_per_instance;
    return order->runs[begin].instance_count > 1 && triangles >= KEPT_TRIANGLES_MIN;
}

static bool is_kept(const struct bd_rays *rays, const struct bd_triangle_run *run, uint32_t place)
{
    float matrix[12];
    const struct bd_mesh_frame frame = bd_mesh_frame_of(rays->scene->meshes[run->mesh]);
    return bd_mesh_frame_matrix(&frame, &rays->space,
                                &rays->scene->instances[rays->order.instances[place]], matrix);
}

static uint64_t count_repeated(const struct bd_triangle_order *order)
{
    uint64_t triangles = 0;
    for (uint32_t begin = 0, end; begin < order->run_count; begin = end) {
        end = bd_rays_group_end(order, begin);
        for (uint32_t r = begin; r < end && is_worth_keeping(order, begin, end); r++)
            triangles +=
                (uint64_t)order->runs[r].triangles_per_instance * order->runs[r].instance_count;
    }
    return triangles;
}

void bd_rays_decide(struct bd_rays *rays, uint64_t repeated_max)
{
    const struct bd_triangle_order *order = &rays->order;
    const bool keeps = count_repeated(order) > repeated_max;
    for (uint32_t i = 0; i < rays->scene->instance_count; i++)
        rays->places[i] = (struct bd_instance_place){BD_NOWHERE, BD_NOWHERE, false};
    for (uint32_t begin = 0, end; begin < order->run_count; begin = end) {
        const struct bd_triangle_run *run = &order->runs[begin];
        end = bd_rays_group_end(order, begin);
        const bool worth = keeps && is_worth_keeping(order, begin, end);
        for (uint32_t i = 0; i < run->instance_count; i++) {
            const uint32_t place = run->first_instance + i;
            rays->places[order->instances[place]] =
                (struct bd_instance_place){begin, place, worth && is_kept(rays, run, place)};
        }
    }
}

// --- placing ----------------------------------------------------------------------------------

static const struct bd_primitive *primitive_of(const struct bd_rays *rays, uint32_t run)
{
    const struct bd_triangle_run *r = &rays->order.runs[run];
    return &rays->scene->meshes[r->mesh]->primitives[r->primitive];
}

// Counts what is placed, and says where each instance begins.
static void count(const struct bd_rays *rays, struct bd_rays_part *part)
{
    for (uint32_t s = 0; s < part->shown_count; s++) {
        struct bd_shown *shown = &part->shown[s];
        const struct bd_instance_place *at = &rays->places[shown->instance];
        const uint32_t end = bd_rays_group_end(&rays->order, at->first_run);
        shown->is_kept = at->is_kept;
        shown->first = at->is_kept ? part->kept_count++ : part->piece_count;
        for (uint32_t r = at->first_run; r < end; r++) {
            const struct bd_primitive *primitive = primitive_of(rays, r);
            part->triangle_count += primitive->index_count / 3;
            if (at->is_kept) continue;
            struct bd_placed_triangles *placed =
                &part->placed[bd_placed_kind(rays->scene, primitive->material)];
            placed->vertex_count += primitive->vertex_count;
            placed->triangle_count += primitive->index_count / 3;
            part->piece_count++;
        }
    }
}

struct cursor {
    size_t vertex, triangle;
};

static void place_primitive(const struct bd_rays *rays, const struct bd_primitive *primitive,
                            const bd_dmat4 *matrix, struct bd_placed_triangles *to,
                            struct cursor *at)
{
    for (uint32_t i = 0; i < primitive->index_count; i++)
        to->indices[3 * at->triangle + i] = (uint32_t)(at->vertex + primitive->index[i]);
    for (uint32_t v = 0; v < primitive->vertex_count; v++) {
        const float *p = primitive->position + 3 * (size_t)v;
        const bd_dvec3 placed = bd_render_from_world(
            &rays->space, bd_dmat4_point(matrix, (bd_dvec3){p[0], p[1], p[2]}));
        float *position = to->positions + 3 * (at->vertex + v);
        position[0] = (float)placed.x, position[1] = (float)placed.y;
        position[2] = (float)placed.z;
    }
    at->vertex += primitive->vertex_count;
    at->triangle += primitive->index_count / 3;
}

static void place_all(const struct bd_rays *rays, struct bd_rays_part *part)
{
    struct cursor cursors[BD_PLACED_COUNT] = {{0}};
    size_t *piece = part->pieces;
    for (uint32_t s = 0; s < part->shown_count; s++) {
        if (part->shown[s].is_kept) continue;
        const uint32_t instance = part->shown[s].instance;
        const uint32_t begin = rays->places[instance].first_run;
        const uint32_t end = bd_rays_group_end(&rays->order, begin);
        for (uint32_t r = begin; r < end; r++) {
            const struct bd_primitive *primitive = primitive_of(rays, r);
            const enum bd_placed kind = bd_placed_kind(rays->scene, primitive->material);
            *piece++ = cursors[kind].triangle;
            place_primitive(rays, primitive, &rays->scene->instances[instance].world_from_mesh,
                            &part->placed[kind], &cursors[kind]);
        }
    }
}

static bool make_room(struct bd_placed_triangles *placed)
{
    placed->positions = bd_huge_pages_alloc((3 * placed->vertex_count + 1) * sizeof(float));
    placed->indices = bd_huge_pages_alloc((3 * placed->triangle_count + 1) * sizeof(uint32_t));
    if (!placed->positions || !placed->indices) return false;
    placed->positions[3 * placed->vertex_count] = 0;
    return true;
}

enum bd_err bd_rays_place(const struct bd_rays *rays, struct bd_rays_part *part,
                          struct bd_err_detail *detail)
{
    count(rays, part);
    part->pieces = calloc((size_t)part->piece_count + 1, sizeof *part->pieces);
    if (!part->pieces)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for %u pieces",
                          part->piece_count);
    for (int k = 0; k < BD_PLACED_COUNT; k++) {
        const struct bd_placed_triangles *placed = &part->placed[k];
        if (placed->vertex_count > UINT32_MAX || placed->triangle_count >= BD_NO_TRIANGLE)
            return bd_err_set(detail, BD_ERR_LIMIT, "scene",
                              "rays take %u vertices and triangles at most; there are %zu and "
                              "%zu",
                              UINT32_MAX - 1, placed->vertex_count, placed->triangle_count);
        if (!make_room(&part->placed[k]))
            return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene",
                              "no memory for %zu vertices and %zu triangles", placed->vertex_count,
                              placed->triangle_count);
    }
    place_all(rays, part);
    return BD_ERR_OK;
}
