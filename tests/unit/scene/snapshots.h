// Scenes of files for the tests of edits, what finds their content, and what compares snapshots.

#ifndef BD_TESTS_UNIT_SCENE_SNAPSHOTS_H
#define BD_TESTS_UNIT_SCENE_SNAPSHOTS_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/hash.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "scene/model/delta.h"
#include "scene/model/derive.h"
#include "tests/unit/cmocka_all.h"

struct bytes {
    uint8_t *data;
    size_t size;
};

static inline bool collect(void *user, const void *bytes, size_t size)
{
    struct bytes *out = user;
    out->data = realloc(out->data, out->size + size + 1);
    assert_non_null(out->data);
    memcpy(out->data + out->size, bytes, size);
    out->size += size;
    return true;
}

static inline struct bytes flat_of(const struct bd_scene *scene)
{
    struct bytes out = {0};
    assert_true(bd_flat_write(scene, collect, &out));
    return out;
}

// A finished scene with its hash; NULL if there is no such file.
static inline struct bd_scene *load(const char *folder, const char *name)
{
    char path[512];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "rb");
    if (!file) return NULL;
    fseek(file, 0, SEEK_END);
    size_t size = (size_t)ftell(file);
    rewind(file);
    void *bytes = malloc(size);
    assert_non_null(bytes);
    assert_int_equal(fread(bytes, 1, size, file), size);
    fclose(file);
    const struct bd_import_file input = {path, bytes, size};
    struct bd_scene *scene;
    struct bd_err_detail detail = {0};
    if (bd_gltf_read(&input, 1, &bd_import_default_limits, &scene, &detail) != BD_ERR_OK ||
        bd_scene_finish(scene, &detail) != BD_ERR_OK)
        fail_msg("%s: %s: %s", path, detail.field, detail.message);
    free(bytes);
    bd_scene_set_hash(scene);
    return scene;
}

// Content by its hash, as a journal would keep it; holds references.
struct shelf {
    struct bd_content *items;
    uint32_t count;
};

static inline bool find_on_shelf(void *user, const uint8_t sha256[32], struct bd_content *out)
{
    const struct shelf *shelf = user;
    for (uint32_t i = 0; i < shelf->count; i++) {
        const struct bd_content *item = &shelf->items[i];
        if (item->kind != out->kind || memcmp(bd_content_sha256(item), sha256, 32) != 0) continue;
        *out = bd_content_retain(item);
        return true;
    }
    return false;
}

static inline void keep_content(void *user, const struct bd_content *content)
{
    struct shelf *shelf = user;
    struct bd_content known = {.kind = content->kind};
    if (find_on_shelf(shelf, bd_content_sha256(content), &known)) {
        bd_content_release(&known);
        return;
    }
    shelf->items = realloc(shelf->items, (shelf->count + 1) * sizeof *shelf->items);
    assert_non_null(shelf->items);
    shelf->items[shelf->count++] = bd_content_retain(content);
}

static inline void clear_shelf(struct shelf *shelf)
{
    for (uint32_t i = 0; i < shelf->count; i++) bd_content_release(&shelf->items[i]);
    free(shelf->items);
    *shelf = (struct shelf){0};
}

static inline void assert_same_flags(const struct bd_scene *a, const struct bd_scene *b)
{
    assert_int_equal(a->flags.count, b->flags.count);
    for (uint32_t i = 0; i < a->flags.count; i++)
        assert_string_equal(a->flags.text[i], b->flags.text[i]);
}

// No struct compared as bytes has padding that a copy would lose.
static inline void assert_same_features(const struct bd_features *a, const struct bd_features *b)
{
#define SAME(field) assert_true(memcmp(&a->field, &b->field, sizeof a->field) == 0)
    SAME(triangle_count), SAME(instance_count), SAME(primitive_count), SAME(light_count);
    SAME(has_base_color_map), SAME(has_metallic_roughness_map), SAME(has_normal_map);
    SAME(has_emissive_map), SAME(has_vertex_color), SAME(has_uv1), SAME(has_mask), SAME(has_blend);
    SAME(has_single_sided), SAME(has_metal), SAME(has_glossy), SAME(has_mirror);
    SAME(has_transmissive), SAME(has_emissive), SAME(has_unlit), SAME(has_environment);
    SAME(punctual_flux_lm), SAME(emissive_flux_lm), SAME(bounds_min), SAME(bounds_max);
    SAME(diagonal_m);
#undef SAME
}

static inline void assert_same_placements(const struct bd_placement *a,
                                          const struct bd_placement *b, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        assert_int_equal(a[i].node, b[i].node);
        assert_memory_equal(&a[i].position, &b[i].position, 4 * sizeof a->position);
    }
}

static inline void assert_same_light(const struct bd_light *a, const struct bd_light *b)
{
    assert_string_equal(a->name, b->name);
    assert_int_equal(a->kind, b->kind);
    assert_memory_equal(a->color, b->color, sizeof a->color);
    assert_true(a->intensity == b->intensity && a->range_m == b->range_m &&
                a->cone_inner == b->cone_inner && a->cone_outer == b->cone_outer);
}

static inline void assert_same_camera(const struct bd_camera *a, const struct bd_camera *b)
{
    assert_string_equal(a->name, b->name);
    assert_true(a->orthographic == b->orthographic && a->yfov == b->yfov && a->xmag == b->xmag &&
                a->ymag == b->ymag && a->near_m == b->near_m && a->far_m == b->far_m);
}

// Everything that is derived. Empty slots at the end may be in one and not in the other, so that
// the objects of a default rig may have other numbers.
static inline void assert_same_derived(const struct bd_scene *a, const struct bd_scene *b)
{
    assert_int_equal(a->instance_count, b->instance_count);
    for (uint32_t i = 0; i < a->instance_count; i++) {
        assert_int_equal(a->instances[i].node, b->instances[i].node);
        assert_int_equal(a->instances[i].mesh, b->instances[i].mesh);
        assert_memory_equal(&a->instances[i].world_from_mesh, &b->instances[i].world_from_mesh,
                            sizeof(bd_dmat4));
    }
    assert_int_equal(a->placed_light_count, b->placed_light_count);
    assert_same_placements(a->placed_lights, b->placed_lights, a->placed_light_count);
    for (uint32_t i = 0; i < a->placed_light_count; i++)
        assert_same_light(&a->lights[a->placed_lights[i].object],
                          &b->lights[b->placed_lights[i].object]);
    assert_int_equal(a->placed_camera_count, b->placed_camera_count);
    assert_same_placements(a->placed_cameras, b->placed_cameras, a->placed_camera_count);
    for (uint32_t i = 0; i < a->placed_camera_count; i++)
        assert_same_camera(&a->cameras[a->placed_cameras[i].object],
                           &b->cameras[b->placed_cameras[i].object]);
    assert_same_features(&a->features, &b->features);
    assert_same_flags(a, b);
}

// The same snapshot, finished from nothing.
static inline void assert_as_from_scratch(const struct bd_scene *scene)
{
    const struct bd_scene_counts none = {0};
    struct bd_err_detail detail = {0};
    struct bd_scene *again = bd_scene_copy(scene, &none);
    assert_non_null(again);
    assert_int_equal(bd_scene_finish(again, &detail), BD_ERR_OK);
    assert_same_derived(scene, again);
    bd_scene_release(&again);
}

#endif
