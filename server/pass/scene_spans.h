// The triangles that a viewpoint can see, as spans to be drawn: instances of a run that follow each
// other, and triangles of each of them that do.
//
// Spans stand in the order of the scene's triangles, since of surfaces in one place the first is
// seen.
//
// Thread: any.

#ifndef BD_PASS_SCENE_SPANS_H
#define BD_PASS_SCENE_SPANS_H

#include "upload/seen.h"

struct bd_scene_span {
    uint32_t run;                            // of the scene's
    uint32_t first_instance, instance_count; // of those that are seen
    uint32_t first_triangle, triangle_count; // of the primitive's, in each of those instances
    bool is_listed;                          // one instance, and those triangles are the list's
};

struct bd_scene_spans {
    uint32_t count, count_max;
    struct bd_scene_span *spans;
    // Triangles that were sieved out of the others: three indices and the number of each.
    uint32_t listed, listed_max;
    uint32_t *index;
    float *number;
};

// `pause`, as the uploader's, is asked every few thousand boxes. The caller finishes it, also after
// an error.
BD_MUST_CHECK
enum bd_err bd_scene_spans_init(struct bd_scene_spans *spans, const struct bd_gpu_scene *scene,
                                const struct bd_viewpoint *viewpoint, const struct bd_seen *seen,
                                enum bd_err (*pause)(void *user), void *user);

double bd_scene_spans_triangles(const struct bd_scene_spans *spans);

// Sieves the triangles of spans of large primitives (pass/scene_sieve.h): for a software device,
// where triangles are many. Inputs and errors as above.
BD_MUST_CHECK
enum bd_err bd_scene_spans_sieve(struct bd_scene_spans *spans, const struct bd_gpu_scene *scene,
                                 const struct bd_viewpoint *viewpoint, const struct bd_seen *seen,
                                 enum bd_err (*pause)(void *user), void *user);

void bd_scene_spans_finish(struct bd_scene_spans *spans);

#endif
