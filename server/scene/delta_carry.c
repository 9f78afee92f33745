// What a change did, done to an object that others have changed since: property by property, as
// the operations of an edit name them.

#include <stddef.h>
#include <string.h>

#include "image/bytes.h"
#include "scene/delta_parts.h"

// --- properties -----------------------------------------------------------------------------

// Where a property lies in a change. What means nothing without its neighbour is one property.
struct property {
    enum bd_object_kind kind;
    const char *name;
    size_t offset, size;
};

#define SIZE_OF(path) sizeof(((struct bd_change *)0)->path)
#define P(KIND, name, path)                                                                        \
    {                                                                                              \
        BD_OBJECT_##KIND, name, offsetof(struct bd_change, path), SIZE_OF(path)                    \
    }

static const struct property properties[] = {
    P(TEXTURE, "picture", texture.picture),
    P(TEXTURE, "wrap_s", texture.wrap_s),
    P(TEXTURE, "wrap_t", texture.wrap_t),
    P(TEXTURE, "nearest", texture.nearest),

    P(MATERIAL, "name", material.name),
    P(MATERIAL, "base_color", material.base_color),
    P(MATERIAL, "metallic", material.metallic),
    P(MATERIAL, "roughness", material.roughness),
    P(MATERIAL, "emissive", material.emissive),
    P(MATERIAL, "normal_scale", material.normal_scale),
    P(MATERIAL, "ior", material.ior),
    P(MATERIAL, "transmission", material.transmission),
    P(MATERIAL, "thickness", material.thickness_m),
    P(MATERIAL, "attenuation_distance", material.attenuation_distance_m),
    P(MATERIAL, "attenuation_color", material.attenuation_color),
    P(MATERIAL, "alpha_mode", material.alpha_mode),
    P(MATERIAL, "alpha_cutoff", material.alpha_cutoff),
    P(MATERIAL, "double_sided", material.double_sided),
    P(MATERIAL, "unlit", material.unlit),
    P(MATERIAL, "base_color_texture", material.base_color_map),
    P(MATERIAL, "metallic_roughness_texture", material.metallic_roughness_map),
    P(MATERIAL, "normal_texture", material.normal_map),
    P(MATERIAL, "emissive_texture", material.emissive_map),
    P(MATERIAL, "transmission_texture", material.transmission_map),

    P(LIGHT, "name", light.name),
    P(LIGHT, "kind", light.kind),
    P(LIGHT, "color", light.color),
    P(LIGHT, "intensity", light.intensity),
    P(LIGHT, "range", light.range_m),
    // The inner angle is never above the outer one.
    {BD_OBJECT_LIGHT, "cone", offsetof(struct bd_change, light.cone_inner), 2 * sizeof(float)},

    P(CAMERA, "name", camera.name),
    P(CAMERA, "orthographic", camera.orthographic),
    P(CAMERA, "yfov", camera.yfov),
    P(CAMERA, "xmag", camera.xmag),
    P(CAMERA, "ymag", camera.ymag),
    P(CAMERA, "near", camera.near_m),
    P(CAMERA, "far", camera.far_m),

    P(NODE, "name", node.name),
    P(NODE, "parent", node.parent),
    P(NODE, "mesh", node.mesh),
    P(NODE, "mesh", node.mesh_is_world_space),
    P(NODE, "camera", node.camera),
    P(NODE, "light", node.light),
    P(NODE, "shown", node.is_hidden),
    P(NODE, "transform", node.parent_from_node),

    P(ENVIRONMENT, "radiance", environment.radiance),
    P(ENVIRONMENT, "rotation", environment.rotation),
};

_Static_assert(offsetof(struct bd_light, cone_outer) ==
                   offsetof(struct bd_light, cone_inner) + sizeof(float),
               "a cone is one property");

#define PROPERTY_COUNT (sizeof properties / sizeof properties[0])

static const void *value_of(const struct bd_change *change, const struct property *property)
{
    return (const char *)change + property->offset;
}

static bool is_same(const struct property *property, const struct bd_change *a,
                    const struct bd_change *b)
{
    return memcmp(value_of(a, property), value_of(b, property), property->size) == 0;
}

static void set(const struct property *property, struct bd_change *to, const struct bd_change *from)
{
    memcpy((char *)to + property->offset, value_of(from, property), property->size);
}

// --- what is heavy --------------------------------------------------------------------------

static bool write_one(const struct bd_change *change, struct bd_bytes *out)
{
    struct bd_change copy = *change;
    const struct bd_delta delta = {.count = 1, .room = 1, .changes = &copy};
    return bd_delta_write(&delta, bd_flat_to_bytes, out);
}

// By the written form, which has no pointers. Without memory: not the same, which refuses.
static bool is_same_whole(const struct bd_change *a, const struct bd_change *b)
{
    struct bd_bytes one = {0}, other = {0};
    const bool same = write_one(a, &one) && write_one(b, &other) &&
                      one.size_bytes == other.size_bytes &&
                      memcmp(one.data, other.data, one.size_bytes) == 0;
    bd_bytes_finish(&one);
    bd_bytes_finish(&other);
    return same;
}

static bool is_same_map(const struct bd_change *a, const struct bd_change *b)
{
    const struct bd_sky_map *one = a->environment.map, *other = b->environment.map;
    if (!one || !other) return one == other;
    return memcmp(one->sha256, other->sha256, sizeof one->sha256) == 0;
}

static void set_map(struct bd_change *to, const struct bd_change *from)
{
    struct bd_sky_map *map = from->environment.map;
    if (map) bd_sky_map_retain(map);
    bd_sky_map_release(&to->environment.map);
    to->environment.map = map;
}

// The same object as it is in another change, whole.
static void replace(struct bd_change *to, const struct bd_change *from)
{
    bd_change_retain(from);
    bd_change_finish(to);
    *to = *from;
}

// --- one object -----------------------------------------------------------------------------

static void clash(struct bd_clash *clash, const struct bd_change *change, const char *property)
{
    if (clash->is_there) return;
    *clash = (struct bd_clash){true, change->kind, change->id, property};
}

// All that can be told apart within an object that is in each of the three.
static void carry_properties(struct bd_change *onto, const struct bd_change *before,
                             const struct bd_change *after, struct bd_clash *found)
{
    for (size_t i = 0; i < PROPERTY_COUNT; i++) {
        const struct property *property = &properties[i];
        if (property->kind != onto->kind || is_same(property, before, after)) continue;
        if (!is_same(property, onto, before) && !is_same(property, onto, after))
            clash(found, onto, property->name);
        set(property, onto, after);
    }
    if (onto->kind != BD_OBJECT_ENVIRONMENT || is_same_map(before, after)) return;
    if (!is_same_map(onto, before) && !is_same_map(onto, after)) clash(found, onto, "map");
    set_map(onto, after);
}

// Meshes and pictures are one property each; so is whether an object is there at all.
static void carry_whole(struct bd_change *onto, const struct bd_change *before,
                        const struct bd_change *after, struct bd_clash *found)
{
    if (is_same_whole(before, after)) return;
    if (!is_same_whole(onto, before) && !is_same_whole(onto, after))
        clash(found, onto, bd_clash_whole);
    replace(onto, after);
}

const char bd_clash_whole[] = "";

void bd_change_carry(struct bd_change *onto, const struct bd_change *before,
                     const struct bd_change *after, struct bd_clash *found)
{
    const bool was = !bd_change_is_removal(before), will_be = !bd_change_is_removal(after);
    const bool is_heavy = onto->kind == BD_OBJECT_MESH || onto->kind == BD_OBJECT_PICTURE;
    if (was && will_be && bd_change_is_removal(onto))
        clash(found, onto, bd_clash_whole); // nothing is left that could be changed
    else if (was && will_be && !is_heavy)
        carry_properties(onto, before, after, found);
    else
        carry_whole(onto, before, after, found);
}

// --- lists ----------------------------------------------------------------------------------

bool bd_delta_carry(const struct bd_scene *onto, const struct bd_delta *before,
                    const struct bd_delta *after, struct bd_delta *out, struct bd_clash *found)
{
    bool ok = true;
    for (uint32_t i = 0; ok && i < after->count; i++) {
        const struct bd_change *to = &after->changes[i];
        const struct bd_change *from = bd_delta_get(before, to->kind, to->id);
        if (!bd_delta_get(out, to->kind, to->id)) ok = bd_delta_take(out, onto, to->kind, to->id);
        if (ok && from) bd_change_carry(bd_delta_find(out, to->kind, to->id), from, to, found);
    }
    if (!ok) bd_delta_finish(out);
    return ok;
}

bool bd_delta_touches(const struct bd_delta *before, const struct bd_delta *after,
                      const struct bd_clash *clash_of)
{
    const struct bd_change *from = bd_delta_get(before, clash_of->kind, clash_of->id);
    const struct bd_change *to = bd_delta_get(after, clash_of->kind, clash_of->id);
    if (!from || !to) return false;
    if (!clash_of->property[0] || bd_change_is_removal(from) != bd_change_is_removal(to))
        return true;
    if (clash_of->kind == BD_OBJECT_ENVIRONMENT && strcmp(clash_of->property, "map") == 0)
        return !is_same_map(from, to);
    for (size_t i = 0; i < PROPERTY_COUNT; i++)
        if (properties[i].kind == clash_of->kind &&
            strcmp(properties[i].name, clash_of->property) == 0 &&
            !is_same(&properties[i], from, to))
            return true;
    return false;
}
