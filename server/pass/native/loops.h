// The loops by width. Private to pass/native/.

#ifndef BD_PASS_NATIVE_LOOPS_H
#define BD_PASS_NATIVE_LOOPS_H

#include "pass/native/native.h"

#define BD_NATIVE_LOOPS_OF(width)                                                                  \
    void bd_native_make_leaves_##width(const struct bd_native_leaves *leaves,                      \
                                       struct bd_vec4 *nodes);                                     \
    void bd_native_join_nodes_##width(const struct bd_vec4 *children, uint32_t count,              \
                                      struct bd_vec4 *nodes);                                      \
    void bd_native_gather_##width(                                                                 \
        const struct bd_receivers *receivers, const struct bd_native_vpls *vpls,                   \
        const struct bd_native_hidden *hidden, const struct bd_native_wishes *wishes,              \
        struct bd_receiver_light *light);                                                          \
    void bd_native_gather_glossy_##width(                                                          \
        const struct bd_receivers *receivers, const struct bd_glossy_receivers *surfaces,          \
        const struct bd_native_vpls *vpls, const struct bd_native_hidden *hidden,                  \
        const struct bd_native_wishes *wishes, struct bd_lanes3 *light);                           \
    void bd_native_gather_tree_##width(                                                            \
        const struct bd_receivers *receivers, const struct bd_native_tree *tree,                   \
        const struct bd_native_wishes *wishes, const uint32_t steps[BD_LANES],                     \
        struct bd_receiver_light *light);                                                          \
    void bd_native_weigh_##width(                                                                  \
        const struct bd_receivers *receivers, const struct bd_native_choice *choice,               \
        const struct bd_native_wishes *wishes, const struct bd_native_part *groups, float *sums,   \
        struct bd_receiver_light *light);                                                          \
    void bd_native_choose_##width(                                                                 \
        const struct bd_receivers *receivers, const struct bd_ray_starts *starts,                  \
        const struct bd_native_choice *choice, const struct bd_native_wishes *wishes,              \
        const struct bd_native_part *rays, const float *sums, struct bd_native_pick *picks,        \
        struct bd_segment *segments);                                                              \
    void bd_native_sum_picks_##width(const struct bd_receivers *receivers,                         \
                                     const struct bd_native_pick *picks, uint32_t rays,            \
                                     const uint32_t *occluded, struct bd_receiver_light *light);   \
    void bd_native_estimate_##width(const struct bd_receivers *receivers,                          \
                                    const struct bd_native_tree *tree, uint32_t steps[BD_LANES])

BD_NATIVE_LOOPS_OF(baseline);
BD_NATIVE_LOOPS_OF(avx2);
BD_NATIVE_LOOPS_OF(avx512);

#endif
