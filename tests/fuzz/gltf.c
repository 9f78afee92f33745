// glTF from strangers, read as the import child does, then through the flat form as the daemon
// does.

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "scene/model/flat.h"

#include "target.h"

#define FLAT_BYTES_MAX (64u << 20)

struct text {
    uint8_t *bytes;
    size_t size;
};

static bool keep(void *user, const void *bytes, size_t size)
{
    struct text *text = user;
    if (size > FLAT_BYTES_MAX - text->size) return false;
    if (size == 0) return true;
    uint8_t *grown = realloc(text->bytes, text->size + size);
    BD_ASSERT(grown);
    memcpy(grown + text->size, bytes, size);
    text->bytes = grown;
    text->size += size;
    return true;
}

// What the child says, the parent understands.
static void check_flat(const struct bd_scene *scene)
{
    struct text flat = {0};
    struct bd_err_detail detail = {0};
    struct bd_scene *read = NULL;
    if (bd_flat_write(scene, keep, &flat)) {
        enum bd_err err = bd_flat_read(flat.bytes, flat.size, &read, &detail);
        BD_ASSERT_CMP(err, ==, BD_ERR_OK);
        err = bd_scene_finish(read, &detail);
        BD_ASSERT_CMP(err, ==, BD_ERR_OK);
        BD_ASSERT_CMP(read->placed_camera_count, >, 0);
        bd_scene_release(&read);
    }
    free(flat.bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    struct bd_import_limits limits = bd_import_default_limits;
    limits.scene_bytes = FLAT_BYTES_MAX;
    limits.triangle_count = 100000;
    limits.picture_side_px = 1024;
    limits.picture_texels = 1u << 20;
    const struct bd_import_file file = {"fuzz.glb", bytes, size};
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_gltf_read(&file, 1, &limits, &scene, &detail);
    if (err) {
        BD_ASSERT(detail.message[0]);
        return 0;
    }
    check_flat(scene);
    bd_scene_release(&scene);
    return 0;
}
