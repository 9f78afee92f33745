#include "scene/model/triangle_order.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

static bool is_mirrored(const struct bd_instance *instance)
{
    return bd_dmat4_determinant3(&instance->world_from_mesh) < 0;
}

// Meshes in the order in which the scene's instances, ordered by content, come to them. Those that
// no instance shows keep UINT32_MAX. Returns how many there are.
static uint32_t rank_meshes(const struct bd_scene *scene, uint32_t *rank_of_mesh,
                            uint32_t *mesh_of_rank)
{
    uint32_t count = 0;
    for (uint32_t m = 0; m < scene->mesh_count; m++) rank_of_mesh[m] = UINT32_MAX;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        uint32_t mesh = (uint32_t)scene->instances[i].mesh;
        if (rank_of_mesh[mesh] != UINT32_MAX) continue;
        mesh_of_rank[count] = mesh;
        rank_of_mesh[mesh] = count++;
    }
    return count;
}

// Counting sort of the instances by (mesh's rank, winding), stable, so that each group is one
// range. `group_begin` has 2 * mesh_count + 1 entries.
static void order_instances(const struct bd_scene *scene, const uint32_t *rank_of_mesh,
                            uint32_t *instances, uint32_t *group_begin)
{
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_instance *instance = &scene->instances[i];
        group_begin[2 * rank_of_mesh[instance->mesh] + is_mirrored(instance) + 1]++;
    }
    for (uint32_t g = 0; g < 2 * scene->mesh_count; g++) group_begin[g + 1] += group_begin[g];
    uint32_t *next = malloc((2 * (size_t)scene->mesh_count + 1) * sizeof *next);
    BD_ASSERT(next);
    memcpy(next, group_begin, (2 * (size_t)scene->mesh_count + 1) * sizeof *next);
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_instance *instance = &scene->instances[i];
        instances[next[2 * rank_of_mesh[instance->mesh] + is_mirrored(instance)]++] = i;
    }
    free(next);
}

static void append_runs(struct bd_triangle_order *to, const struct bd_scene *scene, uint32_t mesh,
                        const uint32_t group[2], bool mirrored)
{
    for (uint32_t p = 0; group[0] < group[1] && p < scene->meshes[mesh]->primitive_count; p++) {
        const uint32_t triangles = scene->meshes[mesh]->primitives[p].index_count / 3;
        if (triangles == 0) continue;
        struct bd_triangle_run *run = &to->runs[to->run_count++];
        *run = (struct bd_triangle_run){
            .mesh = mesh,
            .primitive = p,
            .first_instance = group[0],
            .instance_count = group[1] - group[0],
            .first_triangle = to->triangle_count,
            .triangles_per_instance = triangles,
            .mirrored = mirrored,
        };
        to->triangle_count += (uint64_t)triangles * run->instance_count;
    }
}

void bd_triangle_order_init(struct bd_triangle_order *order, const struct bd_scene *scene)
{
    *order = (struct bd_triangle_order){.instance_count = scene->instance_count};
    uint32_t *group_begin = calloc(2 * (size_t)scene->mesh_count + 1, sizeof *group_begin);
    uint32_t *ranks = calloc(2 * (size_t)scene->mesh_count + 1, sizeof *ranks);
    order->instances = calloc(scene->instance_count + 1, sizeof *order->instances);
    BD_ASSERT(group_begin && ranks && order->instances);
    uint32_t *mesh_of_rank = ranks + scene->mesh_count;
    const uint32_t rank_count = rank_meshes(scene, ranks, mesh_of_rank);
    order_instances(scene, ranks, order->instances, group_begin);
    size_t runs_max = 0;
    for (uint32_t m = 0; m < scene->mesh_count; m++)
        runs_max += 2 * (size_t)scene->meshes[m]->primitive_count;
    order->runs = calloc(runs_max + 1, sizeof *order->runs);
    BD_ASSERT(order->runs);
    for (uint32_t g = 0; g < 2 * rank_count; g++)
        append_runs(order, scene, mesh_of_rank[g / 2], group_begin + g, g % 2 == 1);
    free(group_begin);
    free(ranks);
}

void bd_triangle_order_finish(struct bd_triangle_order *order)
{
    free(order->runs);
    free(order->instances);
    *order = (struct bd_triangle_order){0};
}

uint32_t bd_triangle_order_run(const struct bd_triangle_order *order, uint64_t number)
{
    uint32_t begin = 0, end = order->run_count;
    while (end - begin > 1) {
        const uint32_t middle = begin + (end - begin) / 2;
        *(order->runs[middle].first_triangle <= number ? &begin : &end) = middle;
    }
    return begin;
}
