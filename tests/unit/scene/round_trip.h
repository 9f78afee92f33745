// A snapshot through a .glb and back, for the tests of the export.

#ifndef BD_TESTS_UNIT_SCENE_ROUND_TRIP_H
#define BD_TESTS_UNIT_SCENE_ROUND_TRIP_H

#include "scene/gltf/gltf_write.h"
#include "scene/import/import.h"
#include "tests/unit/scene/snapshots.h"

struct round_trip {
    struct bd_bytes file;
    struct bd_scene_flags notes;
    struct bd_scene *scene; // what the file is
};

static inline struct round_trip round_trip_of(const struct bd_scene *scene)
{
    struct round_trip out = {0};
    struct bd_err_detail detail = {0};
    if (bd_gltf_write(scene, BD_GLB_BYTES_MAX, &out.file, &out.notes, &detail) != BD_ERR_OK)
        fail_msg("export: %s: %s", detail.field, detail.message);
    const struct bd_import_file input = {"export", out.file.data, out.file.size_bytes};
    if (bd_gltf_read(&input, 1, &bd_import_default_limits, &out.scene, &detail) != BD_ERR_OK ||
        bd_scene_finish(out.scene, &detail) != BD_ERR_OK)
        fail_msg("import of the export: %s: %s", detail.field, detail.message);
    bd_scene_set_hash(out.scene);
    return out;
}

static inline void end_round_trip(struct round_trip *trip)
{
    bd_bytes_finish(&trip->file);
    bd_scene_release(&trip->scene);
}

// The hash without the flags of the import that the scene came by.
static inline void hash_without_flags(const struct bd_scene *scene, uint8_t sha256[32])
{
    const struct bd_scene_counts none = {0};
    struct bd_scene *copy = bd_scene_copy(scene, &none);
    assert_non_null(copy);
    copy->flags.count = 0;
    bd_scene_set_hash(copy);
    memcpy(sha256, copy->content_sha256, 32);
    bd_scene_release(&copy);
}

static inline bool has_note(const struct bd_scene_flags *notes, const char *name)
{
    for (uint32_t i = 0; i < notes->count; i++)
        if (strncmp(notes->text[i], name, strlen(name)) == 0) return true;
    return false;
}

// What can be seen is in its place: instances that show something, lights, cameras, bounds.
static inline void assert_looks_alike(const struct bd_scene *a, const struct bd_scene *b)
{
    assert_int_equal(a->features.triangle_count, b->features.triangle_count);
    assert_int_equal(a->placed_light_count, b->placed_light_count);
    for (uint32_t i = 0; i < a->placed_light_count; i++) {
        assert_memory_equal(&a->placed_lights[i].position, &b->placed_lights[i].position,
                            4 * sizeof a->placed_lights->position);
        assert_same_light(&a->lights[a->placed_lights[i].object],
                          &b->lights[b->placed_lights[i].object]);
    }
    assert_int_equal(a->placed_camera_count, b->placed_camera_count);
    for (uint32_t i = 0; i < a->placed_camera_count; i++)
        assert_memory_equal(&a->placed_cameras[i].position, &b->placed_cameras[i].position,
                            4 * sizeof a->placed_cameras->position);
    assert_memory_equal(&a->features.bounds_min, &b->features.bounds_min, sizeof(bd_dvec3));
    assert_memory_equal(&a->features.bounds_max, &b->features.bounds_max, sizeof(bd_dvec3));
    assert_true(a->features.punctual_flux_lm == b->features.punctual_flux_lm);
}

// The import of an export looks like the scene, has nothing to be repaired, and its own export is
// the same file.
static inline void assert_settles(const struct bd_scene *scene)
{
    struct round_trip first = round_trip_of(scene), second = round_trip_of(first.scene);
    if (!has_note(&first.notes, "left_out_degenerate_triangles"))
        assert_looks_alike(scene, first.scene);
    if (first.scene->authored_flag_count) fail_msg("flag: %s", first.scene->flags.text[0]);
    if (second.notes.count) fail_msg("second export: %s", second.notes.text[0]);
    assert_int_equal(first.file.size_bytes, second.file.size_bytes);
    assert_memory_equal(first.file.data, second.file.data, first.file.size_bytes);
    assert_memory_equal(first.scene->content_sha256, second.scene->content_sha256, 32);
    end_round_trip(&first), end_round_trip(&second);
}

#endif
