// The one shape that every GI technique has.
//
// A technique declares what it is (its model of light transport), which inputs the frame must
// build for it, and which parameters it reads; then it turns those inputs into indirect light. It
// never sees a socket, a file, the scene store or a sibling technique. The frame builds the inputs
// that it names and nothing else.
//
// Thread: render thread, context current.

#ifndef BD_TECHNIQUE_TECHNIQUE_H
#define BD_TECHNIQUE_TECHNIQUE_H

#include <stdbool.h>
#include <stdint.h>

#include "pass/gather.h"
#include "technique/params.h"

enum bd_frame_input {
    BD_INPUT_VPL_GRID = 1u << 0, // a list of VPLs for each light, from its reflective shadow map
};

// What a technique's light transport leaves out by design: its errors against the whole
// rendering equation that no parameter removes.
struct bd_model {
    uint32_t indirect_bounces;
    bool indirect_visibility; // occlusion between VPL and receiver
    bool emissive_surfaces;   // light others
};

struct bd_technique_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_params *params;
    const struct bd_vpl_list *const *vpl_lists; // BD_INPUT_VPL_GRID; one a light
    uint32_t light_count;
    bool glossy_receivers;
};

struct bd_technique {
    const char *name; // on the wire, in logs, in file names
    const char *summary;
    struct bd_model model;
    uint32_t inputs;      // BD_INPUT_*
    uint64_t params_read; // bits 1 << enum bd_param
    // Indirect light of one frame; NULL if the technique has none. Not called without lights.
    enum bd_err (*indirect)(const struct bd_pass_context *context,
                            const struct bd_technique_inputs *inputs, struct bd_indirect **out,
                            struct bd_fault *fault);
};

extern const struct bd_technique bd_technique_direct;
extern const struct bd_technique bd_technique_rsm;

// By name; NULL and a fault that lists the names if there is none.
const struct bd_technique *bd_technique_find(const char *name, struct bd_fault *fault);
// All of them, in order; NULL past the last.
const struct bd_technique *bd_technique_at(uint32_t index);

#endif
