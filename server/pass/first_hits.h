// What a viewpoint sees at each sample of its picture, found by rays: where triangles outnumber
// samples, most cover none, and a ray passes by nearly all of them.
//
// What raster passes draw, but at edges: a device keeps corners to a 256th of a pixel, a ray to a
// few units in the last place; and where two surfaces are one, as near as rounding, each has its
// own first.
//
// Thread: render thread.

#ifndef BD_PASS_FIRST_HITS_H
#define BD_PASS_FIRST_HITS_H

#include "pass/slicer.h"
#include "rays/rays.h"
#include "upload/viewpoint.h"

// Who is asked.
struct bd_tracer {
    const struct bd_rays *rays;
    struct bd_pool *pool;
};

// Places in the viewpoint's own space (x right, y up, z backwards, render units from its position):
// the ray through a pixel's sample.
struct bd_sample_ray {
    double origin[3], direction[3]; // of a length of 1 along the view's axis
};
struct bd_sample_ray bd_sample_ray_of(const struct bd_viewpoint *viewpoint,
                                      const struct bd_render_space *space, uint32_t x, uint32_t y);

// Fills `numbers`, of all pixels row by row: triangles, or BD_NO_TRIANGLE where nothing is. What is
// cut out of a surface is not there; with `passes_backs` neither are back faces of single-sided
// materials, which a camera's picture culls. In slices of their own; errors are the slicer's.
BD_MUST_CHECK
enum bd_err bd_first_hits(const struct bd_tracer *tracer, const struct bd_viewpoint *viewpoint,
                          const struct bd_render_space *space, bool passes_backs,
                          struct bd_slicer *slicer, uint32_t *numbers);

#endif
