// flat_seed FILE.glb > FLAT: the flat form of a scene, for the corpus of target `flat`.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "scene/gltf/gltf.h"
#include "scene/import/import.h"
#include "scene/model/flat.h"

static bool put(void *user, const void *bytes, size_t size)
{
    return fwrite(bytes, 1, size, user) == size;
}

int main(int argc, char **argv)
{
    static uint8_t bytes[1 << 20];
    FILE *file = argc == 2 ? fopen(argv[1], "rb") : NULL;
    BD_ASSERT(file);
    const struct bd_import_file input = {argv[1], bytes, fread(bytes, 1, sizeof bytes, file)};
    fclose(file);
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_gltf_read(&input, 1, &bd_import_default_limits, &scene, &detail);
    if (err) fprintf(stderr, "%s\n", detail.message);
    if (err || !bd_flat_write(scene, put, stdout)) return 1;
    bd_scene_release(&scene);
    return 0;
}
