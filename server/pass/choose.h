// Which VPLs receivers ask about: segments to all of a range, or to a few of them in proportion to
// what they would give if nothing stood between, and the answers (pass/visibility.h).
//
// Unbiased for what a ray to every VPL would give, which it becomes as rays become as many. Noise
// falls with rays^-.8 or so: VPLs are in order (pass/vpl_order.h). Cost: that of a gather, and as
// many rays a receiver.
// Madow 1949 (systematic sampling); Walter, Arbree, Bala, Greenberg 2006 (few of many lights).
//
// Thread: render thread.

#ifndef BD_PASS_CHOOSE_H
#define BD_PASS_CHOOSE_H

#include "pass/fragments.h"
#include "pass/gbuffer.h"
#include "pass/visibility.h"
#include "pass/vpl_grid.h"
#include "shared/choose.h"

// More would not fit beside one another in a slice; ask all VPLs then.
#define BD_RAYS_CHOSEN_MAX 16384u

// Receivers that ask, in slices: pixels of a picture, or fragments of a list.
struct bd_askers {
    const struct bd_viewpoint *viewpoint;
    const struct bd_render_space *space;
    const struct bd_gbuffer *gbuffer;
    bool near_patches; // some VPL asks for the exact near field
    bool lobes_alone;  // receivers without a specular lobe ask nothing
    // NULL: pixels.
    const struct bd_fragments *fragments;
    const struct bd_discontinuity *discontinuity; // of the fragments
    uint32_t finest_level;                        // as bd_gather_fragments_inputs
    bool vector;                                  // the irradiance vector is asked for, too
};

// What choices go by of a frame's seed.
static inline uint32_t bd_askers_seed(uint64_t seed)
{
    return (uint32_t)(seed ^ seed >> 32);
}

// How a list is divided for running sums. The groups of a long list (pass/vpl_groups.h) count as one
// VPL each where they are far (`as_one`); not for specular lobes, whose reflection of a whole group
// is not known.
struct bd_list_groups {
    uint32_t vpls, count;
    bool as_one;
};
struct bd_list_groups bd_list_groups_of(const struct bd_vpl_list *list, bool glossy);

// Fragments of a slice stand in rows of so many: a work group across.
#define BD_ASKERS_ROW 64u

// A slice of them: pixels of the tile, or `count` fragments from `first` on, in rows as wide as the
// tile.
struct bd_askers_slice {
    struct bd_tile tile;
    uint32_t first, count;
};

struct bd_askers_slice bd_askers_of_list(uint32_t first, uint32_t count);
// How many receivers those are, and how many there are.
size_t bd_askers_count(const struct bd_askers *askers, const struct bd_askers_slice *slice);
uint64_t bd_askers_count_all(const struct bd_askers *askers);

// The largest coordinate of the view's position, for lifts (kernel/lift.h); 0 without a view.
float bd_askers_reach(const struct bd_askers *askers);

// What is bound for a shader whose askers they are (shaders/common/asker.glsl), and its dispatch.
// `bindings` keep pointers into `args`.
struct bd_asking {
    struct bd_view view;
    struct bd_choose_args args;
    struct bd_bindings bindings;
};
void bd_askers_bind(const struct bd_askers *askers, const struct bd_askers_slice *slice,
                    struct bd_asking *out);
void bd_askers_set_uniforms(struct bd_asking *asking); // before a dispatch of one's own
void bd_askers_dispatch(struct bd_gpu *gpu, const struct bd_program *program,
                        struct bd_asking *asking);
// For segments to a list's VPLs, where maps are asked.
void bd_asking_set_maps(const struct bd_visibility_inputs *visibility,
                        const struct bd_vpl_list *list, struct bd_asking *asking);
// For a program whose askers they are.
void bd_askers_define(const struct bd_askers *askers, struct bd_defines *defines);

// --- all ----------------------------------------------------------------------------------------

// Receivers of a slice whose segments to so many VPLs fit; at least 64.
uint32_t bd_choose_all_max(uint32_t vpl_count);

// Room for what slices of them ask about ranges of lists, BD_VPLS_PER_SUM VPLs at most: as much as
// fits, and no more than all of them ask for.
BD_MUST_CHECK
enum bd_err bd_choose_all_room(struct bd_gpu *gpu, const struct bd_askers *askers,
                               const struct bd_vpl_list *const *lists, uint32_t list_count,
                               struct bd_segments **out, struct bd_err_detail *detail);

// Every receiver of the slice asks about every VPL of the range, and is answered. Of each, in rows,
// 32 segments for each word of answers, VPLs in order.
BD_MUST_CHECK
enum bd_err bd_choose_all(const struct bd_pass_context *context, const struct bd_askers *askers,
                          const struct bd_askers_slice *slice, const struct bd_vpl_list *list,
                          uint32_t first_vpl, uint32_t vpl_count,
                          const struct bd_visibility_inputs *visibility,
                          struct bd_segments *segments, struct bd_err_detail *detail);

// --- a few --------------------------------------------------------------------------------------

// Another way to choose than over a list: over cuts of trees (pass/choose_tree.h).
struct bd_choice {
    uint32_t sum_count;  // floats a receiver that it keeps in the buffer of sums
    uint32_t spread_row; // of them, where the spread of light is
    double units;        // of its work a receiver, for slices
    // Leaves segments and picks of the slice, to which all buffers are bound.
    enum bd_err (*run)(void *user, const struct bd_askers_slice *slice, struct bd_asking *asking,
                       struct bd_err_detail *detail);
    void *user;
};

struct bd_chooser_inputs {
    struct bd_askers askers;
    const struct bd_vpl_list *list; // of all lights, in order (pass/vpl_order.h); not empty
    const struct bd_choice *choice; // or this, instead of the list
    uint32_t rays;                  // a receiver, at most BD_RAYS_CHOSEN_MAX
    uint64_t seed;
    bool glossy; // VPLs are chosen by what the whole BRDF makes of them, and lobes are asked for
    bool spread; // how far off interpolated light may be, too; wants `askers.vector`
    const struct bd_visibility_inputs *visibility;
};

struct bd_chooser;

BD_MUST_CHECK
enum bd_err bd_chooser_create(const struct bd_pass_context *context,
                              const struct bd_chooser_inputs *inputs, struct bd_chooser **out,
                              struct bd_err_detail *detail);
void bd_chooser_destroy(struct bd_gpu *gpu, struct bd_chooser **chooser);

// What is done with the chosen VPLs of each slice: a program with shaders/common/chosen_light.glsl,
// in a pass of that name, with what `bind` adds of its outputs.
struct bd_chosen_use {
    const char *pass;
    const struct bd_program *program;
    void (*bind)(const void *user, struct bd_bindings *bindings);
    const void *user;
};
// Chooses and has the answers, a slice after the other.
BD_MUST_CHECK
enum bd_err bd_chooser_run(struct bd_chooser *chooser, const struct bd_chosen_use *use,
                           struct bd_err_detail *detail);
struct bd_ray_counts bd_chooser_rays(const struct bd_chooser *chooser);

#endif
