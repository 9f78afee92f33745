// The flat form, as a broken or taken-over import child might send it.

#include "scene/model/flat.h"
#include "base/assert.h"

#include "target.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    struct bd_scene *scene = NULL;
    struct bd_err_detail detail = {0};
    if (bd_flat_read(bytes, size, &scene, &detail)) {
        BD_ASSERT(detail.message[0]);
        return 0;
    }
    enum bd_err err = bd_scene_finish(scene, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    bd_scene_release(&scene);
    return 0;
}
