#include "scene/model/content.h"

const uint8_t *bd_content_sha256(const struct bd_content *content)
{
    if (content->mesh) return content->mesh->sha256;
    if (content->picture) return content->picture->sha256;
    return content->sky_map ? content->sky_map->sha256 : NULL;
}

struct bd_content bd_content_retain(const struct bd_content *content)
{
    if (content->mesh) bd_mesh_retain(content->mesh);
    if (content->picture) bd_picture_retain(content->picture);
    if (content->sky_map) bd_sky_map_retain(content->sky_map);
    return *content;
}

void bd_content_release(struct bd_content *content)
{
    bd_mesh_release(&content->mesh);
    bd_picture_release(&content->picture);
    bd_sky_map_release(&content->sky_map);
}

void bd_content_of_scene(const struct bd_scene *scene, bd_content_visit each, void *user)
{
    for (uint32_t i = 0; i < scene->mesh_count; i++)
        if (scene->meshes[i]->primitive_count > 0)
            each(user, &(struct bd_content){.kind = BD_CONTENT_MESH, .mesh = scene->meshes[i]});
    for (uint32_t i = 0; i < scene->picture_count; i++)
        if (!scene->pictures[i]->is_removed)
            each(user,
                 &(struct bd_content){.kind = BD_CONTENT_PICTURE, .picture = scene->pictures[i]});
    if (scene->environment.map)
        each(user,
             &(struct bd_content){.kind = BD_CONTENT_SKY_MAP, .sky_map = scene->environment.map});
}

static uint64_t primitive_bytes(const struct bd_primitive *primitive)
{
    const uint32_t floats = 3 + 3 + (primitive->tangent ? 4 : 0) + (primitive->uv[0] ? 2 : 0) +
                            (primitive->uv[1] ? 2 : 0) + (primitive->color ? 4 : 0);
    return 4 * ((uint64_t)floats * primitive->vertex_count + primitive->index_count);
}

uint64_t bd_mesh_bytes(const struct bd_mesh *mesh)
{
    uint64_t bytes = 0;
    for (uint32_t p = 0; p < mesh->primitive_count; p++)
        bytes += primitive_bytes(&mesh->primitives[p]);
    return bytes;
}

uint64_t bd_scene_bytes(const struct bd_scene *scene)
{
    uint64_t bytes = sizeof *scene;
    bytes += scene->node_count * (uint64_t)sizeof *scene->nodes;
    bytes += scene->material_count * (uint64_t)sizeof *scene->materials;
    for (uint32_t m = 0; m < scene->mesh_count; m++) bytes += bd_mesh_bytes(scene->meshes[m]);
    for (uint32_t i = 0; i < scene->picture_count; i++)
        bytes += 4 * (uint64_t)scene->pictures[i]->width_px * scene->pictures[i]->height_px;
    const struct bd_sky_map *map = scene->environment.map;
    if (map) bytes += 3 * sizeof(float) * (uint64_t)map->width_px * map->height_px;
    return bytes;
}
