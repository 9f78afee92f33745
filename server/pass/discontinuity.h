// Discontinuity pyramids: in which blocks of a picture, or of a light's map, something jumps, so
// that one evaluation cannot stand for the whole block (Nichols and Wyman 2010, D1 to D4 of
// algorithms.md A1; Nichols, Shopf and Wyman 2009).
//
// A block's own test looks at its pixels that can be lit, at the block's own level. A block is
// discontinuous if its own test says so, or a neighbour's where neighbours are asked, or if any of
// its children is: so the property is monotone up the pyramid, and every pixel has exactly one
// coarsest smooth block (errata N5). Level 0 is never discontinuous: a pixel is lit as it is.
//
// Where depth is tested, a block that has both pixels that can be lit and others is discontinuous:
// a silhouette (hazard 30). Normals are shading normals: what light over a block varies with
// (shaders/pass/discontinuity/measures.glsl). In an orthographic view depth says nothing about
// scale: the tests relate it to half the longer side of the frame, which is what depth itself is to
// a view of 90 degrees.

#ifndef BD_PASS_DISCONTINUITY_H
#define BD_PASS_DISCONTINUITY_H

#include "pass/gbuffer.h"
#include "pass/multires_layout.h"
#include "pass/rsm.h"

enum bd_depth_test {
    BD_DEPTH_TEST_MINMAX, // D1: zmax - zmin > T zmin
    // D2: the largest slope of a pixel, |grad z| / z, per pixel, > T. Along each axis the larger
    // difference to its two neighbours, so that a jump between two blocks belongs to both.
    BD_DEPTH_TEST_DERIVATIVE,
    BD_DEPTH_TEST_OFF, // no pyramid of depths is made
    // The second difference of 1 / z along each axis, times z, > T (orthographic: of z itself): 0
    // on any plane, however slanted; the relative jump of depth where there is one.
    BD_DEPTH_TEST_STEP,
};

enum bd_normal_test {
    BD_NORMAL_TEST_MINMAX, // D3: the range of any component > T, T in [0, 2]
    BD_NORMAL_TEST_CHORD, // D4: the largest |n1 - n2| between neighbouring pixels > T ("curvature")
    BD_NORMAL_TEST_OFF,   // no pyramid of normals is made
};

// Whose own tests count for a block, beside its own and its children's.
enum bd_neighbourhood {
    BD_NEIGHBOURHOOD_PLAIN,
    BD_NEIGHBOURHOOD_DIAGONAL, // the 4 blocks that touch its corners
    BD_NEIGHBOURHOOD_ADJACENT, // all 8 around it
};

struct bd_discontinuity_settings {
    enum bd_depth_test depth_test;
    enum bd_normal_test normal_test;
    enum bd_neighbourhood neighbourhood;
    double depth_threshold;  // >= 0; infinite: the same as OFF
    double normal_threshold; // >= 0; infinite: the same as OFF
    // The camera's alone: by the geometric normal instead of the shading one, for whoever brings in
    // each pixel's shading normal afterwards. A normal map then costs no blocks.
    bool geometric_normals;
    uint32_t coarsest_side; // blocks along the longer side of the coarsest level, at most
    // Level whose blocks are fragments even where they are discontinuous (pass/fragments.h): none
    // is finer, but for lone pixels. Held to the coarsest.
    uint32_t finest_level;
    // The camera's alone: what lies in a discontinuous block of the finest level, and is of one
    // surface neither with that nor with most of the blocks around it whose light it would get, or
    // whose normal is far from those, is a fragment of its own.
    bool lone_pixels;
};

// One of two: what the camera sees, or one face of what a light sees. The depth of the latter is
// the distance along the face's axis (directional: along the light).
struct bd_discontinuity_inputs {
    const struct bd_gbuffer *gbuffer;
    const struct bd_viewpoint *viewpoint; // of either
    const struct bd_rsm *rsm;             // NULL for the camera's
    uint32_t face;
    const struct bd_render_space *space;
    struct bd_discontinuity_settings settings;
};

struct bd_discontinuity {
    struct bd_multires_layout layout;
    // R32UI, levels from 1 on, stacked (shared/multires.h).
    struct bd_tex *flags; // BD_BLOCK_*: kind, and children that are not empty
    // BD_PIXEL_PACK; undefined where the block is empty. NULL of glossy receivers.
    struct bd_tex *representative;
    bool glossy; // of glossy receivers alone (pass/glossy_blocks.h)
    // NULL, or of those pixels alone whose alpha is 0 there (pass/shared_light.h); borrowed
    const struct bd_tex *lit;
};

BD_MUST_CHECK
enum bd_err bd_discontinuity_run(const struct bd_pass_context *context,
                                 const struct bd_discontinuity_inputs *inputs,
                                 struct bd_discontinuity **out, struct bd_err_detail *detail);
void bd_discontinuity_destroy(struct bd_gpu *gpu, struct bd_discontinuity **discontinuity);
uint64_t bd_discontinuity_bytes(const struct bd_discontinuity *discontinuity);

#endif
