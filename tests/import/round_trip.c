#include "tests/import/round_trip.h"

#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "scene/gltf/gltf.h"
#include "scene/gltf/gltf_write.h"
#include "scene/import/import.h"
#include "scene/model/derive.h"
#include "scene/model/flat.h"

struct trip {
    struct bd_bytes file;
    struct bd_scene_flags notes;
    struct bd_scene *scene;
    double export_ms;
};

static enum bd_err go(const struct bd_scene *scene, struct trip *out, struct bd_err_detail *detail)
{
    uint64_t start_ns = bd_clock_ns();
    *out = (struct trip){0};
    enum bd_err err = bd_gltf_write(scene, BD_GLB_BYTES_MAX, &out->file, &out->notes, detail);
    out->export_ms = bd_ms_since(start_ns);
    if (err) return err;
    const struct bd_import_file input = {"export", out->file.data, out->file.size_bytes};
    err = bd_gltf_read(&input, 1, &bd_import_default_limits, &out->scene, detail);
    if (!err) err = bd_scene_finish(out->scene, detail);
    return err;
}

static void end(struct trip *trip)
{
    bd_bytes_finish(&trip->file);
    bd_scene_release(&trip->scene);
}

static bool have_same_hash(const struct bd_scene *a, const struct bd_scene *b)
{
    const struct bd_scene_counts none = {0};
    struct bd_scene *copies[2] = {bd_scene_copy(a, &none), bd_scene_copy(b, &none)};
    for (int i = 0; i < 2; i++) {
        copies[i]->flags.count = 0;
        bd_scene_set_hash(copies[i]);
    }
    bool same = memcmp(copies[0]->content_sha256, copies[1]->content_sha256, 32) == 0;
    bd_scene_release(&copies[0]), bd_scene_release(&copies[1]);
    return same;
}

static bool look_alike(const struct bd_scene *a, const struct bd_scene *b)
{
    const struct bd_features *f = &a->features, *g = &b->features;
    return f->triangle_count == g->triangle_count &&
           memcmp(f->light_count, g->light_count, sizeof f->light_count) == 0 &&
           memcmp(&f->bounds_min, &g->bounds_min, sizeof f->bounds_min) == 0 &&
           memcmp(&f->bounds_max, &g->bounds_max, sizeof f->bounds_max) == 0 &&
           f->punctual_flux_lm == g->punctual_flux_lm && f->emissive_flux_lm == g->emissive_flux_lm;
}

static json_t *texts(const struct bd_scene_flags *flags, uint32_t count)
{
    json_t *list = json_array();
    for (uint32_t i = 0; i < count; i++) json_array_append_new(list, json_string(flags->text[i]));
    return list;
}

static json_t *result(const struct bd_scene *scene, const struct trip *first,
                      const struct trip *second)
{
    bool stable = second->notes.count == 0 && second->file.size_bytes == first->file.size_bytes &&
                  memcmp(second->file.data, first->file.data, first->file.size_bytes) == 0;
    return json_pack("{s:o,s:o,s:b,s:b,s:b,s:I,s:f}", "notes",
                     texts(&first->notes, first->notes.count), "flags",
                     texts(&first->scene->flags, first->scene->authored_flag_count), "same",
                     have_same_hash(scene, first->scene), "stable", stable, "alike",
                     look_alike(scene, first->scene), "bytes", (json_int_t)first->file.size_bytes,
                     "export_ms", first->export_ms);
}

json_t *round_trip_json(const struct bd_scene *scene)
{
    struct trip first, second = {0};
    struct bd_err_detail detail = {0};
    enum bd_err err = go(scene, &first, &detail);
    if (!err) err = go(first.scene, &second, &detail);
    json_t *json = err ? json_pack("{s:s,s:s}", "fault", detail.message, "field", detail.field)
                       : result(scene, &first, &second);
    end(&first), end(&second);
    return json;
}
