#include "tests/tools/load_scene.h"

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"

// `*bytes` is the caller's to free.
static enum bd_err read_file(const char *path, void **bytes, size_t *size,
                             struct bd_err_detail *detail)
{
    FILE *file = fopen(path, "rb");
    if (!file) return bd_err_set(detail, BD_ERR_IO, path, "cannot be opened");
    fseek(file, 0, SEEK_END);
    size_t end = (size_t)ftell(file);
    rewind(file);
    *bytes = malloc(end + 1);
    BD_ASSERT(*bytes);
    *size = fread(*bytes, 1, end, file);
    fclose(file);
    return BD_ERR_OK;
}

enum bd_err load_scene(const char *path, struct bd_scene **out, struct bd_err_detail *detail)
{
    struct bd_import_file source = {.uri = path};
    void *bytes;
    enum bd_err err = read_file(path, &bytes, &source.size_bytes, detail);
    if (err) return err;
    source.bytes = bytes;
    err = bd_gltf_read(&source, 1, &bd_import_default_limits, out, detail);
    free(bytes);
    return err ? err : bd_scene_finish(*out, detail);
}

enum bd_err import_scene(const char *path, struct bd_scene **out, struct bd_err_detail *detail)
{
    struct bd_import_file source = {.uri = path};
    void *bytes;
    enum bd_err err = read_file(path, &bytes, &source.size_bytes, detail);
    if (err) return err;
    source.bytes = bytes;
    struct bd_import_pool *pool = bd_import_pool_create(getenv("BOUNCED"), 0);
    err = bd_import(pool, &source, 1, &bd_import_default_limits, out, detail);
    bd_import_pool_destroy(&pool);
    free(bytes);
    return err;
}
