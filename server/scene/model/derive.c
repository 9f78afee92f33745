#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "scene/model/derive.h"

uint64_t bd_derive_next_aspect(void)
{
    static _Atomic uint64_t last = 0;
    return atomic_fetch_add_explicit(&last, 1, memory_order_relaxed) + 1;
}

bool bd_derive_world_matrices(struct bd_scene *scene)
{
    if (scene->node_count == 0) return true;
    bool *done = calloc(scene->node_count, sizeof *done);
    uint32_t *path = malloc(scene->node_count * sizeof *path);
    for (uint32_t i = 0; done && path && i < scene->node_count; i++) {
        uint32_t length = 0;
        for (int32_t n = (int32_t)i; n != BD_NONE && !done[n]; n = scene->nodes[n].parent)
            path[length++] = (uint32_t)n;
        while (length > 0) {
            struct bd_node *node = &scene->nodes[path[--length]];
            node->in_scene = !node->is_hidden && !node->is_removed &&
                             (node->parent == BD_NONE || scene->nodes[node->parent].in_scene);
            node->world_from_node = node->parent == BD_NONE
                                        ? node->parent_from_node
                                        : bd_dmat4_mul(&scene->nodes[node->parent].world_from_node,
                                                       &node->parent_from_node);
            done[path[length]] = true;
        }
    }
    bool ok = done && path;
    free(done);
    free(path);
    return ok;
}

static bool matrix_is_usable(const bd_dmat4 *m)
{
    for (int i = 0; i < 16; i++)
        if (!(fabs(m->m[i]) <= BD_COORDINATE_MAX_M)) return false;
    return true;
}

// Rank below two: no triangle keeps an area. The cofactors of the upper 3x3, columns crossed
// pairwise, vanish relative to the columns themselves.
static bool matrix_collapses_areas(const bd_dmat4 *m)
{
    bd_dvec3 x = {m->m[0], m->m[1], m->m[2]};
    bd_dvec3 y = {m->m[4], m->m[5], m->m[6]};
    bd_dvec3 z = {m->m[8], m->m[9], m->m[10]};
    double size = bd_dvec3_dot(x, x) + bd_dvec3_dot(y, y) + bd_dvec3_dot(z, z);
    double area = bd_dvec3_length(bd_dvec3_cross(x, y)) + bd_dvec3_length(bd_dvec3_cross(y, z)) +
                  bd_dvec3_length(bd_dvec3_cross(z, x));
    return area <= 1e-12 * size;
}

bool bd_derive_instances(struct bd_scene *scene)
{
    uint32_t unusable = 0, collapsed = 0;
    scene->instances = calloc(scene->node_count ? scene->node_count : 1, sizeof *scene->instances);
    if (!scene->instances) return false;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct bd_node *node = &scene->nodes[i];
        if (!node->in_scene || node->mesh == BD_NONE) continue;
        bd_dmat4 world_from_mesh =
            node->mesh_is_world_space ? bd_dmat4_identity() : node->world_from_node;
        if (!matrix_is_usable(&world_from_mesh))
            unusable++;
        else if (matrix_collapses_areas(&world_from_mesh))
            collapsed++;
        else
            scene->instances[scene->instance_count++] =
                (struct bd_instance){(int32_t)i, node->mesh, world_from_mesh};
    }
    if (unusable) bd_scene_flag(scene, "instances_out_of_range: %u", unusable);
    if (collapsed) bd_scene_flag(scene, "collapsed_instances: %u", collapsed);
    return bd_derive_instance_order(scene);
}

// Right-handed whatever the matrix: z is where the node's z axis points, so that a lamp's mesh
// and its light agree even in a mirrored node; y is made square to it, and x follows.
static struct bd_placement place(const struct bd_node *node, uint32_t node_index, int32_t object)
{
    const double *m = node->world_from_node.m;
    bd_dvec3 z = bd_dvec3_normalize((bd_dvec3){m[8], m[9], m[10]}, (bd_dvec3){0, 0, 1});
    bd_dvec3 spare = fabs(z.y) < 0.9 ? (bd_dvec3){0, 1, 0} : (bd_dvec3){1, 0, 0};
    bd_dvec3 y = bd_dvec3_normalize((bd_dvec3){m[4], m[5], m[6]}, spare);
    bd_dvec3 x = bd_dvec3_cross(y, z);
    if (!(bd_dvec3_length(x) > 1e-9)) x = bd_dvec3_cross(spare, z);
    x = bd_dvec3_normalize(x, (bd_dvec3){1, 0, 0});
    return (struct bd_placement){(int32_t)node_index,  object, {m[12], m[13], m[14]}, x,
                                 bd_dvec3_cross(z, x), z};
}

bool bd_derive_placements(struct bd_scene *scene)
{
    uint32_t unusable = 0;
    size_t most = scene->node_count ? scene->node_count : 1;
    scene->placed_lights = calloc(most, sizeof *scene->placed_lights);
    scene->placed_cameras = calloc(most, sizeof *scene->placed_cameras);
    if (!scene->placed_lights || !scene->placed_cameras) return false;
    for (uint32_t i = 0; i < scene->node_count; i++) {
        const struct bd_node *node = &scene->nodes[i];
        if (!node->in_scene || (node->light == BD_NONE && node->camera == BD_NONE)) continue;
        if (!matrix_is_usable(&node->world_from_node)) {
            unusable++;
            continue;
        }
        if (node->light != BD_NONE)
            scene->placed_lights[scene->placed_light_count++] = place(node, i, node->light);
        if (node->camera != BD_NONE)
            scene->placed_cameras[scene->placed_camera_count++] = place(node, i, node->camera);
    }
    if (unusable) bd_scene_flag(scene, "placements_out_of_range: %u", unusable);
    return bd_derive_light_order(scene);
}

static bool is_alike(uint32_t same)
{
    return (same & BD_ASPECTS_SURFACES) == BD_ASPECTS_SURFACES;
}

// Bounds, surfaces and the sky, which nothing derived is needed for but the instances.
static void derive_surfaces(struct bd_scene *scene, const struct bd_scene *base,
                            uint32_t same)
{
    struct bd_features *features = &scene->features;
    if (is_alike(same)) {
        *features = base->features;
        features->punctual_flux_lm = 0;
        memset(features->light_count, 0, sizeof features->light_count);
    } else {
        bd_derive_bounds(scene);
        bd_derive_surface_features(scene);
    }
    features->has_environment = same & BD_ASPECT_BIT(ENVIRONMENT) ? base->features.has_environment
                                                  : bd_environment_shines(&scene->environment);
}

enum bd_err bd_derive_from(struct bd_scene *scene, const struct bd_scene *base,
                           struct bd_err_detail *detail)
{
    scene->authored_light_count = scene->light_count;
    scene->authored_camera_count = scene->camera_count;
    scene->authored_flag_count = scene->flags.count;
    uint32_t same = 0;
    if (!bd_derive_world_matrices(scene) || !bd_derive_instances(scene) ||
        !bd_derive_placements(scene))
        goto no_memory;
    if (base) same = bd_same_surfaces(base, scene);
    derive_surfaces(scene, base, same);
    const struct bd_scene *alike = is_alike(same) ? base : NULL;
    if (!bd_derive_default_camera(scene, alike) || !bd_derive_default_lights(scene)) goto no_memory;
    bd_derive_light_features(scene);
    bd_derive_aspects(scene, base, same);
    return BD_ERR_OK;

no_memory:
    return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for %u nodes",
                      scene->node_count);
}

enum bd_err bd_scene_finish(struct bd_scene *scene, struct bd_err_detail *detail)
{
    return bd_derive_from(scene, NULL, detail);
}
