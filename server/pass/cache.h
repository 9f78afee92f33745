// A cache of irradiance where rays of a final gather end (lights/irradiance_cells.h): light that
// was reflected at least once before it comes there, of virtual lights and of what those leave out
// near them: a few rays of each place tell that by the other cells where they end, and light goes
// round between those until it changes no more.
//
// Rays go from a picture's pixels as its far ones do, as many as cells ask for: many of each pixel
// of a small picture, of a large one two of some. Cells divide what they meet, and one of its
// places is lit for each. A function of the scene, the view, these numbers and the seed: neither of
// what was rendered before nor of who comes first.
//
// Cost: a ray a place that is looked for, 20 to 40 us of one core a cell with 32 and 16 rays.
//
// Jensen 1996; Krivanek, Gautron, Pattanaik, Bouatouch 2005 (cached irradiance behind a gather).
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_CACHE_H
#define BD_PASS_CACHE_H

#include "pass/far.h"

struct bd_cache_inputs {
    const struct bd_gather_inputs *gather; // whose pixels they are
    // How its places are lit beside the list: without cells.
    struct bd_far_inputs far;
    const struct bd_vpl_list *list; // of all VPLs, first and walked, in order and soft
    uint32_t vpl_rays;              // of a place to those
    uint32_t cells;                 // at most
    // Where light is reflected any number of times. Else, and where a ray ends in no cell, what
    // virtual lights leave out near a place is told by `far.points`.
    bool goes_round;
    bool are_shown; // mirrors or glass show what lies between cells
};

BD_MUST_CHECK
enum bd_err bd_cache_run(const struct bd_pass_context *context,
                         const struct bd_cache_inputs *inputs, struct bd_irradiance_cells **out,
                         struct bd_ray_counts *traced, struct bd_err_detail *detail);

#endif
