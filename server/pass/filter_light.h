// Smooths what few rays leave noisy, along surfaces and as far as its noise goes
// (image/light_filter.h): on the processor, whatever the device, whose texture it reads and writes.
//
// Cost: some 30 ns a pixel and core; 88 bytes a pixel of memory while it runs.
//
// Thread: render thread, and the pool's.

#ifndef BD_PASS_FILTER_LIGHT_H
#define BD_PASS_FILTER_LIGHT_H

#include "image/light_filter.h"
#include "pass/gather.h"

// Levels that light of a few of many VPLs is filtered in. Neighbours choose at other places of each
// part (pass/choose/choose.comp): what the pixels of one level's reach chose is all of it but for the
// fewest rays. Further levels only blur: 16 rays of 8,192 VPLs, 3.7, 4.7 and 7.1 % of the indirect
// mean with 1, 2 and 3; 2 rays 10.0, 9.9, 16.5.
static inline uint32_t bd_filter_levels_of_chosen(uint32_t rays)
{
    return rays < 4 ? 2 : 1;
}

// How the filter goes (image/light_filter.h).
struct bd_smoothing {
    uint32_t level_count;
    float variance_part;
    bool glossy_alone; // the rest was taken over, and is smoothed already
};

// `inputs` are those of what gathered. Of irradiance, and of what glossy and rough receivers have
// beyond it; each by its own noise, where it has one, whose place the doubt of what is left takes
// (image/light_filter.h); alpha of glossy noise is the part that edges may drown in.
// BD_ERR_NO_MEMORY leaves the light as it was.
BD_MUST_CHECK
enum bd_err bd_filter_light_run(const struct bd_pass_context *context,
                                const struct bd_gather_inputs *inputs,
                                const struct bd_smoothing *smoothing, struct bd_indirect *indirect,
                                struct bd_err_detail *detail);

// What the filter makes of halves in memory, in slices on the pool's threads: the light, which may
// go to one of them, and an image of 4 channels for its doubt (image/light_filter.h).
BD_MUST_CHECK
enum bd_err bd_filter_halves(const struct bd_pass_context *context, struct bd_pool *pool,
                             const struct bd_light_filter_inputs *inputs, struct bd_image *light,
                             struct bd_image *doubt, struct bd_err_detail *detail);

#endif
