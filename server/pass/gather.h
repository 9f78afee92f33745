// Full-resolution gather: every pixel sums every VPL (algorithms.md A0.7 N1), in compute; or those
// that it sees, by a ray to each.
//
// Exact as the VPLs become many and small; without rays, for a scene without occlusion between VPL
// and receiver. Cost: pixels x VPLs evaluations, about 24 instruction slots each, and as many rays
// as VPLs face the receiver.

#ifndef BD_PASS_GATHER_H
#define BD_PASS_GATHER_H

#include <stdbool.h>

#include "lights/irradiance_cells.h"
#include "pass/choose.h"
#include "pass/gbuffer.h"
#include "pass/pass.h"
#include "pass/visibility.h"
#include "pass/vpl_grid.h"

struct bd_gather_inputs {
    const struct bd_gpu_scene *scene;
    const struct bd_viewpoint *viewpoint;
    const struct bd_gbuffer *gbuffer;
    const struct bd_vpl_list *const *lists; // one a light, in the order that they are summed in
    uint32_t list_count;
    bool near_patches; // some VPL asks for the exact near field
    bool glossy;       // receivers have a specular lobe worth its price
    bool lobes_alone;  // of which the others are left out, in a pass "glossy"
    const struct bd_visibility_inputs *visibility; // NULL: nothing hides any of it
};

// Of blocks that a VPL's glossy lobe is splatted to (pass/subsplats.h), summed over VPLs; 0 where
// there are none.
struct bd_subsplat_counts {
    uint64_t tested, split, drawn;
    bool is_limited; // a list was full: some blocks are coarser than the threshold asks for
};

// Indirect light, in the frame's light unit.
struct bd_indirect {
    struct bd_tex *irradiance; // RGBA32F, without receiver albedo
    // RGBA32F, what the whole BRDF reflects beyond the diffuse albedo / pi x irradiance: can be
    // negative; NULL if not asked for.
    struct bd_tex *glossy;
    // RGBA32F, or both NULL: irradiance before the pixel's own normal had its say, and the
    // irradiance vector, for other normals (pass/shared_light.h).
    struct bd_tex *gathered, *vector;
    // RGBA32F, or NULL: half the difference of the halves whose mean the irradiance is, and glossy;
    // behind the filter the doubt of what is left (image/light_filter.h). Alpha of noise_glossy
    // tells the filter which part of that noise edges may drown in.
    struct bd_tex *noise, *noise_glossy;
    // RGBA32F, or both NULL: what the specular lobes of rough dielectrics reflect, beside what the
    // whole BRDF's diffuse part makes of the irradiance; a = 0 where it is not known, as that of a
    // sub-frame that took nothing over there. Its noise as above.
    struct bd_tex *rough, *noise_rough;
    struct bd_irradiance_cells *cells; // or NULL: what its rays ended in (pass/cache.h)
    uint64_t fragment_count; // places where light was gathered, or to which it was splatted
    struct bd_subsplat_counts subsplats;
    uint64_t screen_parts; // looked at for what a clamp takes off (pass/residual.h)
    struct bd_ray_counts rays;
};

// In the report.
static inline const char *bd_gather_pass(const struct bd_gather_inputs *inputs)
{
    return inputs->lobes_alone ? "glossy" : "gather";
}

// Its pixels, as those who ask what they see.
struct bd_askers bd_gather_askers(const struct bd_gather_inputs *inputs);

BD_MUST_CHECK
enum bd_err bd_gather_run(const struct bd_pass_context *context,
                          const struct bd_gather_inputs *inputs, struct bd_indirect **out,
                          struct bd_err_detail *detail);
// Its textures, for whoever fills them; a fragment a pixel.
BD_MUST_CHECK
enum bd_err bd_indirect_create(struct bd_gpu *gpu, const struct bd_viewpoint *viewpoint,
                               bool glossy, struct bd_indirect **out, struct bd_err_detail *detail);
void bd_indirect_destroy(struct bd_gpu *gpu, struct bd_indirect **indirect);
uint64_t bd_indirect_bytes(const struct bd_indirect *indirect);

#endif
