#include "scene/model/delta.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/model/delta_parts.h"
#include "scene/model/derive.h"

bool bd_change_is_removal(const struct bd_change *change)
{
    switch (change->kind) {
    case BD_OBJECT_PICTURE:
        return change->picture->is_removed;
    case BD_OBJECT_TEXTURE:
        return change->texture.is_removed;
    case BD_OBJECT_MATERIAL:
        return change->material.is_removed;
    case BD_OBJECT_LIGHT:
        return change->light.is_removed;
    case BD_OBJECT_CAMERA:
        return change->camera.is_removed;
    case BD_OBJECT_MESH:
        return change->mesh->is_removed;
    case BD_OBJECT_NODE:
        return change->node.is_removed;
    case BD_OBJECT_ENVIRONMENT:
    case BD_OBJECT_KIND_COUNT:
        break;
    }
    return false;
}

uint32_t *bd_slots_of(struct bd_scene_counts *counts, enum bd_object_kind kind)
{
    switch (kind) {
    case BD_OBJECT_PICTURE:
        return &counts->pictures;
    case BD_OBJECT_TEXTURE:
        return &counts->textures;
    case BD_OBJECT_MATERIAL:
        return &counts->materials;
    case BD_OBJECT_LIGHT:
        return &counts->lights;
    case BD_OBJECT_CAMERA:
        return &counts->cameras;
    case BD_OBJECT_MESH:
        return &counts->meshes;
    case BD_OBJECT_NODE:
        return &counts->nodes;
    case BD_OBJECT_ENVIRONMENT:
    case BD_OBJECT_KIND_COUNT:
        break;
    }
    return NULL;
}

// --- one change -----------------------------------------------------------------------------

void bd_change_finish(struct bd_change *change)
{
    if (change->kind == BD_OBJECT_PICTURE) bd_picture_release(&change->picture);
    if (change->kind == BD_OBJECT_MESH) bd_mesh_release(&change->mesh);
    if (change->kind == BD_OBJECT_ENVIRONMENT) bd_sky_map_release(&change->environment.map);
}

void bd_change_retain(const struct bd_change *change)
{
    if (change->kind == BD_OBJECT_PICTURE) bd_picture_retain(change->picture);
    if (change->kind == BD_OBJECT_MESH) bd_mesh_retain(change->mesh);
    if (change->kind == BD_OBJECT_ENVIRONMENT && change->environment.map)
        bd_sky_map_retain(change->environment.map);
}

static int compare_places(const struct bd_change *a, enum bd_object_kind kind, uint32_t id)
{
    if (a->kind != kind) return a->kind < kind ? -1 : 1;
    return (a->id > id) - (a->id < id);
}

// The derived fields of a node mean nothing in a delta; zero, so that equal deltas are equal bytes.
static struct bd_node authored_node(const struct bd_node *node)
{
    struct bd_node authored = *node;
    memset(&authored.world_from_node, 0, sizeof authored.world_from_node);
    authored.in_scene = false;
    return authored;
}

// Fills the state with one more reference to what is heavy. False without memory.
static bool state_of(const struct bd_scene *scene, struct bd_change *out)
{
    const struct bd_scene_counts n = bd_scene_slots(scene);
    const uint32_t id = out->id;
    switch (out->kind) {
    case BD_OBJECT_PICTURE:
        out->picture =
            id < n.pictures ? bd_picture_retain(scene->pictures[id]) : bd_picture_create_removed();
        return out->picture != NULL;
    case BD_OBJECT_TEXTURE:
        out->texture = id < n.textures ? scene->textures[id] : bd_texture_removed;
        return true;
    case BD_OBJECT_MATERIAL:
        out->material = id < n.materials ? scene->materials[id] : bd_material_removed;
        return true;
    case BD_OBJECT_LIGHT:
        out->light = id < n.lights ? scene->lights[id] : bd_light_removed;
        return true;
    case BD_OBJECT_CAMERA:
        out->camera = id < n.cameras ? scene->cameras[id] : bd_camera_removed;
        return true;
    case BD_OBJECT_MESH:
        out->mesh = id < n.meshes ? bd_mesh_retain(scene->meshes[id]) : bd_mesh_create_removed();
        return out->mesh != NULL;
    case BD_OBJECT_NODE:
        out->node = id < n.nodes ? authored_node(&scene->nodes[id]) : bd_node_removed;
        return true;
    case BD_OBJECT_ENVIRONMENT:
        out->environment = scene->environment;
        if (out->environment.map) bd_sky_map_retain(out->environment.map);
        return true;
    case BD_OBJECT_KIND_COUNT:
        break;
    }
    return false;
}

// Takes over the change's references.
static void store_state(struct bd_scene *scene, struct bd_change change)
{
    switch (change.kind) {
    case BD_OBJECT_PICTURE:
        bd_picture_release(&scene->pictures[change.id]);
        scene->pictures[change.id] = change.picture;
        break;
    case BD_OBJECT_TEXTURE:
        scene->textures[change.id] = change.texture;
        break;
    case BD_OBJECT_MATERIAL:
        scene->materials[change.id] = change.material;
        break;
    case BD_OBJECT_LIGHT:
        scene->lights[change.id] = change.light;
        break;
    case BD_OBJECT_CAMERA:
        scene->cameras[change.id] = change.camera;
        break;
    case BD_OBJECT_MESH:
        bd_mesh_release(&scene->meshes[change.id]);
        scene->meshes[change.id] = change.mesh;
        break;
    case BD_OBJECT_NODE:
        scene->nodes[change.id] = change.node;
        break;
    case BD_OBJECT_ENVIRONMENT:
        bd_sky_map_release(&scene->environment.map);
        scene->environment = change.environment;
        break;
    case BD_OBJECT_KIND_COUNT:
        break;
    }
}

// --- lists ----------------------------------------------------------------------------------

void bd_delta_finish(struct bd_delta *delta)
{
    for (uint32_t i = 0; i < delta->count; i++) bd_change_finish(&delta->changes[i]);
    free(delta->changes);
    *delta = (struct bd_delta){0};
}

static bool make_room(struct bd_delta *delta)
{
    if (delta->count < delta->room) return true;
    uint32_t room = delta->room ? delta->room * 2 : 4;
    struct bd_change *changes = realloc(delta->changes, room * sizeof *changes);
    if (!changes) return false;
    delta->changes = changes;
    delta->room = room;
    return true;
}

bool bd_delta_append(struct bd_delta *delta, const struct bd_change *change)
{
    if (!make_room(delta)) return false;
    delta->changes[delta->count++] = *change;
    return true;
}

// The first change at or behind a place.
static uint32_t find(const struct bd_delta *delta, enum bd_object_kind kind, uint32_t id)
{
    uint32_t low = 0, high = delta->count;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        if (compare_places(&delta->changes[middle], kind, id) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

struct bd_change *bd_delta_find(struct bd_delta *delta, enum bd_object_kind kind, uint32_t id)
{
    uint32_t at = find(delta, kind, id);
    if (at == delta->count || compare_places(&delta->changes[at], kind, id) != 0) return NULL;
    return &delta->changes[at];
}

const struct bd_change *bd_delta_get(const struct bd_delta *delta, enum bd_object_kind kind,
                                     uint32_t id)
{
    return bd_delta_find((struct bd_delta *)delta, kind, id); // which changes nothing
}

bool bd_delta_take(struct bd_delta *delta, const struct bd_scene *scene, enum bd_object_kind kind,
                   uint32_t id)
{
    struct bd_change change;
    memset(&change, 0, sizeof change);
    change.kind = kind;
    change.id = id;
    if (!make_room(delta) || !state_of(scene, &change)) return false;
    uint32_t at = find(delta, kind, id);
    struct bd_change *slot = &delta->changes[at];
    if (at < delta->count && compare_places(slot, kind, id) == 0) {
        bd_change_finish(slot);
    } else {
        memmove(slot + 1, slot, (delta->count - at) * sizeof *slot);
        delta->count++;
    }
    *slot = change;
    return true;
}

bool bd_delta_invert(const struct bd_scene *base, const struct bd_delta *delta,
                     struct bd_delta *out)
{
    *out = (struct bd_delta){0};
    for (uint32_t i = 0; i < delta->count; i++)
        if (!bd_delta_take(out, base, delta->changes[i].kind, delta->changes[i].id)) {
            bd_delta_finish(out);
            return false;
        }
    return true;
}

static bool append_shared(struct bd_delta *out, const struct bd_change *change)
{
    if (!bd_delta_append(out, change)) return false;
    bd_change_retain(change);
    return true;
}

bool bd_delta_merge(const struct bd_delta *first, const struct bd_delta *second,
                    struct bd_delta *out)
{
    *out = (struct bd_delta){0};
    bool ok = true;
    for (uint32_t i = 0, k = 0; ok && (i < first->count || k < second->count);) {
        const struct bd_change *a = i < first->count ? &first->changes[i] : NULL;
        const struct bd_change *b = k < second->count ? &second->changes[k] : NULL;
        int order = !a ? 1 : !b ? -1 : compare_places(a, b->kind, b->id);
        ok = append_shared(out, order < 0 ? a : b);
        i += order <= 0;
        k += order >= 0;
    }
    if (!ok) bd_delta_finish(out);
    return ok;
}

// --- applying -------------------------------------------------------------------------------

// How many slots there have to be. False if an id is beyond what there may be.
static bool count_slots(const struct bd_delta *delta, struct bd_scene_counts *slots,
                        struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < delta->count; i++) {
        const struct bd_change *change = &delta->changes[i];
        uint32_t *count = bd_slots_of(slots, change->kind);
        if (!count) continue;
        if (change->id >= BD_OBJECT_ID_END) {
            (void)bd_err_set(detail, BD_ERR_LIMIT, bd_object_kind_name(change->kind),
                             "id %u, limit %u", change->id, BD_OBJECT_ID_END - 1);
            return false;
        }
        if (change->id >= *count) *count = change->id + 1;
    }
    return true;
}

uint32_t bd_delta_growth(const struct bd_scene *base, const struct bd_delta *delta)
{
    struct bd_scene_counts slots = bd_scene_slots(base);
    uint32_t most = 0;
    for (uint32_t i = 0; i < delta->count; i++) {
        const struct bd_change *change = &delta->changes[i];
        const uint32_t *count = bd_slots_of(&slots, change->kind);
        if (count && change->id >= *count && change->id - *count >= most)
            most = change->id - *count + 1;
    }
    return most;
}

enum bd_err bd_delta_apply(const struct bd_scene *base, const struct bd_delta *delta,
                           struct bd_scene **out, struct bd_err_detail *detail)
{
    struct bd_scene_counts slots = {0};
    *out = NULL;
    if (!count_slots(delta, &slots, detail)) return BD_ERR_LIMIT;
    struct bd_scene *scene = bd_scene_copy(base, &slots);
    if (!scene) return bd_err_set(detail, BD_ERR_NO_MEMORY, "scene", "no memory for the scene");
    for (uint32_t i = 0; i < delta->count; i++) {
        bd_change_retain(&delta->changes[i]);
        store_state(scene, delta->changes[i]);
    }
    enum bd_err err = bd_scene_check_references(scene, detail);
    if (err == BD_ERR_OK) err = bd_derive_from(scene, base, detail);
    if (err != BD_ERR_OK) {
        bd_scene_release(&scene);
        return err;
    }
    bd_scene_set_hash(scene);
    *out = scene;
    return BD_ERR_OK;
}

// --- saying it ------------------------------------------------------------------------------

static void describe(const struct bd_change *change, char entry[BD_DELTA_ENTRY_BYTES])
{
    const char *kind = bd_object_kind_name(change->kind);
    if (change->kind == BD_OBJECT_ENVIRONMENT)
        snprintf(entry, BD_DELTA_ENTRY_BYTES, "%s", kind);
    else
        snprintf(entry, BD_DELTA_ENTRY_BYTES, "%s %u%s", kind, change->id,
                 bd_change_is_removal(change) ? " removed" : "");
}

uint32_t bd_delta_describe(const struct bd_delta *delta, char (*entries)[BD_DELTA_ENTRY_BYTES],
                           uint32_t entry_max)
{
    if (entry_max == 0) return 0;
    bool fits = delta->count <= entry_max;
    uint32_t count = fits ? delta->count : entry_max - 1;
    for (uint32_t i = 0; i < count; i++) describe(&delta->changes[i], entries[i]);
    if (fits) return count;
    snprintf(entries[count], BD_DELTA_ENTRY_BYTES, "and %u more", delta->count - count);
    return count + 1;
}
