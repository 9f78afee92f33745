// The order of instances and lights, by what they are and where: a file's order changes no picture.

#include <stdlib.h>
#include <string.h>

#include "scene/model/derive.h"

static int compare_nodes(int32_t left, int32_t right)
{
    return (left > right) - (left < right);
}

// What tells two instances apart but their places in the file: what they show, and where.
struct instance_key {
    uint64_t mesh_hash;
    struct bd_instance instance;
};

static int compare_instances(const void *a, const void *b)
{
    const struct instance_key *left = a, *right = b;
    if (left->mesh_hash != right->mesh_hash) return left->mesh_hash < right->mesh_hash ? -1 : 1;
    int matrix = memcmp(&left->instance.world_from_mesh, &right->instance.world_from_mesh,
                        sizeof left->instance.world_from_mesh);
    return matrix ? matrix : compare_nodes(left->instance.node, right->instance.node);
}

// Where two surfaces lie in one place, the first is seen.
bool bd_derive_instance_order(struct bd_scene *scene)
{
    struct instance_key *keys = calloc((size_t)scene->instance_count + 1, sizeof *keys);
    if (!keys) return false;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct bd_instance *instance = &scene->instances[i];
        keys[i] = (struct instance_key){scene->meshes[instance->mesh]->content_hash, *instance};
    }
    qsort(keys, scene->instance_count, sizeof *keys, compare_instances);
    for (uint32_t i = 0; i < scene->instance_count; i++) scene->instances[i] = keys[i].instance;
    free(keys);
    return true;
}

#define LIGHT_NUMBERS 20

// All numbers of a placed light.
struct light_key {
    double numbers[LIGHT_NUMBERS];
    struct bd_placement placement;
};

static struct light_key light_key_of(const struct bd_scene *scene, const struct bd_placement *at)
{
    const struct bd_light *l = &scene->lights[at->object];
    return (struct light_key){
        {l->kind,        l->intensity,  l->color[0],   l->color[1],   l->color[2],
         l->range_m,     l->cone_inner, l->cone_outer, at->position.x, at->position.y,
         at->position.z, at->axis_x.x,  at->axis_x.y,  at->axis_x.z,  at->axis_y.x,
         at->axis_y.y,   at->axis_y.z,  at->axis_z.x,  at->axis_z.y,  at->axis_z.z},
        *at,
    };
}

static int compare_lights(const void *a, const void *b)
{
    const struct light_key *left = a, *right = b;
    for (int i = 0; i < LIGHT_NUMBERS; i++)
        if (left->numbers[i] != right->numbers[i])
            return left->numbers[i] < right->numbers[i] ? -1 : 1;
    return compare_nodes(left->placement.node, right->placement.node);
}

// Light is added up one light at a time, in numbers that round.
bool bd_derive_light_order(struct bd_scene *scene)
{
    struct light_key *keys = calloc((size_t)scene->placed_light_count + 1, sizeof *keys);
    if (!keys) return false;
    for (uint32_t i = 0; i < scene->placed_light_count; i++)
        keys[i] = light_key_of(scene, &scene->placed_lights[i]);
    qsort(keys, scene->placed_light_count, sizeof *keys, compare_lights);
    for (uint32_t i = 0; i < scene->placed_light_count; i++)
        scene->placed_lights[i] = keys[i].placement;
    free(keys);
    return true;
}
