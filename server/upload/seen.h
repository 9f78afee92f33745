// The instances that a viewpoint can see, on the device: all others are left out of its draws.
//
// Thread: render thread, context current.

#ifndef BD_UPLOAD_SEEN_H
#define BD_UPLOAD_SEEN_H

#include "upload/gpu_scene.h"
#include "upload/view_bounds.h"

struct bd_seen_instance {
    uint32_t place;   // in the scene's order
    bool is_all_seen; // nothing of it lies outside the picture
};

// The instances of one run that are seen, in its order.
struct bd_seen_run {
    uint32_t first, count;
};

struct bd_seen {
    uint32_t count;
    struct bd_seen_instance *instances; // ascending
    struct bd_seen_run *runs;           // by the scene's
    float *rows;                        // what the device's array holds: shared/instance.h
    struct bd_buf *array, *attribute;   // shared/instance.h
};

// The caller finishes it, also after an error. `pause`, as the uploader's, is asked every few
// thousand instances.
BD_MUST_CHECK
enum bd_err bd_seen_init(struct bd_seen *seen, struct bd_gpu *gpu, const struct bd_gpu_scene *scene,
                         const struct bd_viewpoint *viewpoint, enum bd_err (*pause)(void *user),
                         void *user, struct bd_err_detail *detail);
void bd_seen_finish(struct bd_seen *seen, struct bd_gpu *gpu);

#endif
