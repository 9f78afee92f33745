// The loops by width. Private to pass/native/.

#ifndef BD_PASS_NATIVE_LOOPS_H
#define BD_PASS_NATIVE_LOOPS_H

#include "pass/native/native.h"

// Fields of struct bd_native_loops: loop(field, width) of each.
// clang-format off
#define BD_NATIVE_EACH(loop, width)                                                                \
    loop(make_leaves, width) loop(join_nodes, width) loop(gather, width)                           \
    loop(gather_glossy, width) loop(estimate, width) loop(gather_tree, width) loop(weigh, width)   \
    loop(choose, width) loop(sum_picks, width) loop(aim, width) loop(ask, width)                  \
    loop(residual, width) loop(shadow, width) loop(weigh_points, width)                            \
    loop(project, width)
// clang-format on
#define BD_NATIVE_DECLARE(field, width)                                                            \
    __typeof__(*((struct bd_native_loops *)0)->field) bd_native_##field##_##width;

BD_NATIVE_EACH(BD_NATIVE_DECLARE, baseline)
BD_NATIVE_EACH(BD_NATIVE_DECLARE, avx2)
BD_NATIVE_EACH(BD_NATIVE_DECLARE, avx512)

#endif
