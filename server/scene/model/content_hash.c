// What meshes, pictures, maps of the sky and scenes are called by their content.

#include <float.h>
#include <math.h>
#include <stddef.h>

#include "base/assert.h"
#include "base/hash.h"
#include "scene/model/content.h"
#include "scene/model/scene.h"

static void bound(struct bd_primitive *primitive)
{
    for (int axis = 0; axis < 3; axis++) {
        float least = FLT_MAX, most = -FLT_MAX;
        for (uint32_t i = 0; i < primitive->index_count; i++) {
            float value = primitive->position[3 * (size_t)primitive->index[i] + axis];
            least = fminf(least, value);
            most = fmaxf(most, value);
        }
        primitive->bounds_min[axis] = least <= most ? least : 0;
        primitive->bounds_max[axis] = least <= most ? most : 0;
    }
}

static void name_content(const struct bd_content *content, uint8_t sha256[32])
{
    struct bd_sha256 *sha = bd_sha256_create();
    bool written = bd_content_write(content, bd_flat_to_sha256, sha);
    BD_ASSERT(written); // the sink refuses nothing
    bd_sha256_finish(&sha, sha256);
}

// A missing stream is hashed too, so that streams of the same bytes under other names differ.
static uint64_t hash_stream(const void *stream, size_t item_count, size_t item_bytes, uint64_t seed)
{
    size_t bytes = stream ? item_count * item_bytes : 0;
    uint64_t head[2] = {stream != NULL, bytes};
    return bd_hash64(stream ? stream : "", bytes, bd_hash64(head, sizeof head, seed));
}

static uint64_t hash_primitive(const struct bd_primitive *primitive, uint64_t seed)
{
    size_t count = primitive->vertex_count;
    uint64_t hash = hash_stream(primitive->position, count, 3 * sizeof(float), seed);
    hash = hash_stream(primitive->normal, count, 3 * sizeof(float), hash);
    hash = hash_stream(primitive->tangent, count, 4 * sizeof(float), hash);
    hash = hash_stream(primitive->uv[0], count, 2 * sizeof(float), hash);
    hash = hash_stream(primitive->uv[1], count, 2 * sizeof(float), hash);
    hash = hash_stream(primitive->color, count, 4 * sizeof(float), hash);
    return hash_stream(primitive->index, primitive->index_count, sizeof(uint32_t), hash);
}

void bd_mesh_seal(struct bd_mesh *mesh)
{
    mesh->content_hash = 0;
    for (uint32_t i = 0; i < mesh->primitive_count; i++) {
        bound(&mesh->primitives[i]);
        mesh->content_hash = hash_primitive(&mesh->primitives[i], mesh->content_hash);
    }
    name_content(&(struct bd_content){.kind = BD_CONTENT_MESH, .mesh = mesh}, mesh->sha256);
}

void bd_picture_seal(struct bd_picture *picture)
{
    uint32_t size[2] = {picture->width_px, picture->height_px};
    size_t bytes = (size_t)picture->width_px * picture->height_px * 4;
    picture->content_hash = bd_hash64(picture->rgba, bytes, bd_hash64(size, sizeof size, 0));
    name_content(&(struct bd_content){.kind = BD_CONTENT_PICTURE, .picture = picture},
                 picture->sha256);
}

void bd_sky_map_seal(struct bd_sky_map *map)
{
    uint32_t size[2] = {map->width_px, map->height_px};
    size_t bytes = (size_t)map->width_px * map->height_px * 3 * sizeof *map->rgb;
    map->content_hash = bd_hash64(map->rgb, bytes, bd_hash64(size, sizeof size, 0));
    name_content(&(struct bd_content){.kind = BD_CONTENT_SKY_MAP, .sky_map = map}, map->sha256);
}

void bd_scene_seal(struct bd_scene *scene)
{
    for (uint32_t i = 0; i < scene->mesh_count; i++) bd_mesh_seal(scene->meshes[i]);
    for (uint32_t i = 0; i < scene->picture_count; i++) bd_picture_seal(scene->pictures[i]);
    if (scene->environment.map) bd_sky_map_seal(scene->environment.map);
}
