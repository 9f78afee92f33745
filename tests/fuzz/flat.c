// The flat form, as a broken or taken-over import child might send it.

#include "scene/model/flat.h"
#include "base/assert.h"

#include "target.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    struct bd_scene *scene = NULL;
    struct bd_fault fault = {0};
    if (bd_flat_read(bytes, size, &scene, &fault)) {
        BD_ASSERT(fault.message[0]);
        return 0;
    }
    enum bd_err err = bd_scene_finish(scene, &fault);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    bd_scene_release(&scene);
    return 0;
}
