// Small glTF documents written in the test itself: JSON with ' for ", and one buffer "b.bin".

#ifndef BD_TESTS_UNIT_SCENE_READ_TEXT_H
#define BD_TESTS_UNIT_SCENE_READ_TEXT_H

#include <stdlib.h>
#include <string.h>

#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "tests/unit/cmocka_all.h"

static char *quoted(const char *text)
{
    char *json = strdup(text);
    assert_non_null(json);
    for (char *c = json; *c; c++)
        if (*c == '\'') *c = '"';
    return json;
}

static enum bd_err try_text(const char *text, const void *bin, size_t bin_bytes,
                            struct bd_scene **scene, struct bd_err_detail *detail)
{
    char *json = quoted(text);
    struct bd_import_file files[] = {{"t.gltf", json, strlen(json)}, {"b.bin", bin, bin_bytes}};
    *detail = (struct bd_err_detail){0};
    enum bd_err err = bd_gltf_read(files, bin ? 2 : 1, &bd_import_default_limits, scene, detail);
    if (err == BD_ERR_OK) err = bd_scene_finish(*scene, detail);
    free(json);
    return err;
}

// The finished scene, which the caller releases.
static inline struct bd_scene *read_text(const char *text, const void *bin, size_t bin_bytes)
{
    struct bd_scene *scene;
    struct bd_err_detail detail;
    if (try_text(text, bin, bin_bytes, &scene, &detail) != BD_ERR_OK)
        fail_msg("%s: %s", detail.field, detail.message);
    return scene;
}

static inline void assert_refused(const char *text, const void *bin, size_t bin_bytes,
                                  enum bd_err err, const char *field)
{
    struct bd_scene *scene;
    struct bd_err_detail detail;
    assert_int_equal(try_text(text, bin, bin_bytes, &scene, &detail), err);
    assert_null(scene);
    assert_string_equal(detail.field, field);
}

// True if some flag is exactly that.
static inline bool has_flag(const struct bd_scene *scene, const char *flag)
{
    for (uint32_t i = 0; i < scene->flags.count; i++)
        if (strcmp(scene->flags.text[i], flag) == 0) return true;
    return false;
}

#endif
