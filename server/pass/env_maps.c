#include "pass/env_maps.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "pass/env_choice.h"
#include "pass/receivers.h"
#include "pass/shadow_map.h"

// Of the slicer, one for each evaluation of a VPL.
#define UNITS_PER_TEXEL 10.0
#define ROWS_AT_ONCE    64u
#define MASKED          (UINT32_C(1) << 31)

// --- a cube -------------------------------------------------------------------------------------

f3 bd_env_texel_direction(uint32_t side_px, uint32_t texel)
{
    const uint32_t face = texel / (side_px * side_px);
    const float x = (float)(texel % side_px) + 0.5f, y = (float)(texel / side_px % side_px) + 0.5f;
    const f3 seen = f3_of(2 * x / (float)side_px - 1, 1 - 2 * y / (float)side_px, 1);
    return f3_of(f3_dot(seen, seen_from_face(f3_of(1, 0, 0), face)),
                 f3_dot(seen, seen_from_face(f3_of(0, 1, 0), face)),
                 f3_dot(seen, seen_from_face(f3_of(0, 0, 1), face)));
}

// Looks all ways from there, along the world's axes.
static struct bd_light_setup setup_of(const struct bd_gpu_scene *scene, const struct bd_light *eye,
                                      f3 centre)
{
    const bd_dvec3 at = {centre.x, centre.y, centre.z};
    const struct bd_render_space *space = &scene->space;
    return (struct bd_light_setup){
        .light = eye,
        .placement = {.position = bd_dvec3_add(space->origin_m,
                                               bd_dvec3_scale(at, 1 / space->render_per_m)),
                      .axis_x = {1, 0, 0},
                      .axis_y = {0, 1, 0},
                      .axis_z = {0, 0, 1}},
        .face_count = BD_ENV_FACES,
        .half_width = 1,
        .half_height = 1,
        .depth_m = scene->scene->features.diagonal_m,
    };
}

struct measuring {
    const struct bd_surface_hits *hits;
    struct bd_env_map *map;
    uint32_t side_px;
};

// To the triangle's plane; neighbours name the same one.
static void measure_row(void *user, uint32_t row)
{
    const struct measuring *m = user;
    struct bd_hit_triangle triangle = {0};
    uint32_t known = BD_NO_TRIANGLE;
    for (uint32_t i = row * m->side_px; i < (row + 1) * m->side_px; i++) {
        const uint32_t id = m->map->triangles[i] & ~MASKED, number = id - 1;
        m->map->triangles[i] = id == 0 ? BD_NO_TRIANGLE : number;
        m->map->distances[i] = INFINITY;
        if (id == 0) continue;
        if (number != known && !bd_surface_hit_triangle(m->hits, number, &triangle)) continue;
        known = number;
        const f3 d = bd_env_texel_direction(m->side_px, i);
        const float along = f3_dot(triangle.normal, d);
        const float off = f3_dot(triangle.normal, f3_sub(triangle.corner[0], m->map->centre));
        const float depth = off / along;
        if (depth > 0 && isfinite(depth)) m->map->distances[i] = depth * f3_length(d);
    }
}

static enum bd_err read_ids(const struct bd_pass_context *context, const struct bd_tex *ids,
                            uint32_t side_px, uint32_t *out)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t face = 0; face < BD_ENV_FACES; face++)
        for (uint32_t row = 0; !err && row < side_px; row += ROWS_AT_ONCE) {
            const uint32_t left = side_px - row, rows = left < ROWS_AT_ONCE ? left : ROWS_AT_ONCE;
            err = bd_tex_read_rows(context->gpu, ids, face, row, rows,
                                   out + ((size_t)face * side_px + row) * side_px,
                                   (size_t)rows * side_px * sizeof *out);
            if (!err) err = bd_slicer_pause(context->slicer);
        }
    return err;
}

enum bd_err bd_env_map_look(const struct bd_pass_context *context, const struct bd_gpu_scene *scene,
                            const struct bd_surface_hits *hits, const struct bd_tracer *tracer,
                            f3 centre, uint32_t side_px, struct bd_env_map *out,
                            struct bd_err_detail *detail)
{
    static const struct bd_light eye = {.kind = BD_LIGHT_POINT, .range_m = INFINITY};
    const struct bd_light_setup setup = setup_of(scene, &eye, centre);
    const size_t texels = bd_env_map_texels(side_px);
    struct bd_shadow_map *seen = NULL;
    *out = (struct bd_env_map){centre, malloc(texels * sizeof *out->distances),
                               malloc(texels * sizeof *out->triangles)};
    if (!out->distances || !out->triangles)
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "env_map_size", "no memory for %zu texels",
                          texels);
    enum bd_err err = bd_shadow_map_render(context, scene, &setup, side_px, tracer, &seen, detail);
    if (!err) err = read_ids(context, seen->ids, side_px, out->triangles);
    if (seen) bd_shadow_map_destroy(context->gpu, &seen);
    if (err) return err;
    struct measuring measuring = {hits, out, side_px};
    bd_slicer_work(context->slicer, "environment maps");
    return bd_receivers_each(context, BD_ENV_FACES * side_px, UNITS_PER_TEXEL * side_px,
                             measure_row, &measuring);
}

void bd_env_map_free(struct bd_env_map *map)
{
    free(map->distances);
    free(map->triangles);
    *map = (struct bd_env_map){0};
}

// --- all ----------------------------------------------------------------------------------------

static enum bd_err look_from_all(const struct bd_pass_context *context,
                                 const struct bd_env_maps_inputs *inputs, struct bd_env_maps *maps,
                                 struct bd_err_detail *detail)
{
    struct bd_env_choice choice;
    enum bd_err err = bd_env_choose(context, inputs, &maps->hits, &choice, detail);
    maps->covered = choice.covered;
    for (uint32_t i = 0; !err && i < choice.count; i++) {
        err = bd_env_map_look(context, inputs->scene, &maps->hits, inputs->tracer,
                              choice.centres[i], inputs->side_px, &maps->maps[i], detail);
        maps->count++;
    }
    return err;
}

static f3 middle_of(const struct bd_surface_hits *hits, const struct bd_instance *instance,
                    const struct bd_primitive *primitive)
{
    const float *least = primitive->bounds_min, *most = primitive->bounds_max;
    const bd_dvec3 middle = {0.5 * ((double)least[0] + most[0]), 0.5 * ((double)least[1] + most[1]),
                             0.5 * ((double)least[2] + most[2])};
    const bd_dvec3 at =
        bd_render_from_world(&hits->space, bd_dmat4_point(&instance->world_from_mesh, middle));
    return f3_of((float)at.x, (float)at.y, (float)at.z);
}

// As many as there is room for, in the order of triangles.
static enum bd_err look_from_solids(const struct bd_pass_context *context,
                                    const struct bd_env_maps_inputs *inputs,
                                    struct bd_env_maps *maps, struct bd_err_detail *detail)
{
    const struct bd_triangle_order *order = &maps->hits.order;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t r = 0; r < order->run_count; r++) {
        const struct bd_triangle_run *run = &order->runs[r];
        const struct bd_primitive *primitive =
            &maps->scene->meshes[run->mesh]->primitives[run->primitive];
        if (!bd_material_is_solid(&maps->scene->materials[primitive->material])) continue;
        for (uint32_t i = 0; !err && i < run->instance_count; i++) {
            const uint32_t place = order->instances[run->first_instance + i];
            if (maps->count == BD_ENV_MAPS_MAX) return BD_ERR_OK;
            err = bd_env_map_look(context, inputs->scene, &maps->hits, inputs->tracer,
                                  middle_of(&maps->hits, &maps->scene->instances[place], primitive),
                                  inputs->side_px, &maps->maps[maps->count], detail);
            maps->count++;
        }
    }
    return err;
}

enum bd_err bd_env_maps_run(const struct bd_pass_context *context,
                            const struct bd_env_maps_inputs *inputs, struct bd_env_maps **out,
                            struct bd_err_detail *detail)
{
    struct bd_env_maps *maps = *out = calloc(1, sizeof *maps);
    BD_ASSERT(maps);
    BD_ASSERT_CMP(inputs->count, <=, BD_ENV_MAPS_MAX);
    maps->scene = bd_scene_retain(inputs->snapshot);
    maps->side_px = inputs->side_px;
    bd_surface_hits_init(&maps->hits, maps->scene);
    enum bd_err err = look_from_all(context, inputs, maps, detail);
    if (!err && inputs->solids) err = look_from_solids(context, inputs, maps, detail);
    if (err) bd_env_maps_destroy(context->gpu, out);
    return err;
}

void bd_env_maps_destroy(struct bd_gpu *gpu, struct bd_env_maps **maps)
{
    (void)gpu;
    if (!*maps) return;
    for (uint32_t i = 0; i < (*maps)->count; i++) bd_env_map_free(&(*maps)->maps[i]);
    bd_surface_hits_finish(&(*maps)->hits);
    bd_scene_release(&(*maps)->scene);
    free(*maps);
    *maps = NULL;
}

uint64_t bd_env_maps_bytes(const struct bd_env_maps *maps)
{
    const uint64_t texel = sizeof(float) + sizeof(uint32_t);
    return sizeof *maps + maps->count * texel * bd_env_map_texels(maps->side_px);
}
