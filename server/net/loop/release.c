#include "net/loop/release.h"

#include <stdlib.h>
#include <uv.h>

#include "base/assert.h"
#include "net/loop/loop.h"

// Less is given up within a millisecond.
#define LARGE_BYTES (8u << 20)

struct release {
    uv_work_t work;
    struct bd_scene *scene;
};

static void release_on_pool(uv_work_t *work)
{
    struct release *release = work->data;
    bd_scene_release(&release->scene);
}

static void release_back(uv_work_t *work, int status)
{
    BD_ASSERT_CMP(status, ==, 0);
    free(work->data);
}

// A last reference cannot become another one meanwhile: it is ours.
static bool is_heavy(const struct bd_scene *scene)
{
    return __atomic_load_n(&scene->reference_count, __ATOMIC_RELAXED) == 1 &&
           bd_scene_bytes(scene) >= LARGE_BYTES;
}

void bd_release_scene(struct bd_loop *loop, struct bd_scene **scene)
{
    if (!*scene || !is_heavy(*scene)) {
        bd_scene_release(scene);
        return;
    }
    struct release *release = malloc(sizeof *release);
    BD_ASSERT(release);
    release->scene = *scene;
    release->work.data = release;
    *scene = NULL;
    int result = uv_queue_work(&loop->uv, &release->work, release_on_pool, release_back);
    BD_ASSERT_CMP(result, ==, 0);
}
