// Trees of VPLs by the processor's loops (pass/native/build_tree.c): the same from every width,
// however many nodes are made at once.

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "shared/vpl_tree.h"
#include "tests/native/stage.h"
#include "tests/unit/cmocka_all.h"

#define LEAF_SIDE   32u
#define LEAVES      (LEAF_SIDE * LEAF_SIDE)
#define NODES       ((4 * LEAVES - 1) / 3)
#define NODE_BYTES  (BD_TREE_NODE_VEC4S * sizeof(struct bd_vec4))
#define NODE_AT(i)  ((size_t)(i)*BD_TREE_NODE_VEC4S)
#define DARK_PERIOD 7u // every so many leaves send nothing

// Level by level from the leaves, `at_once` nodes in a call.
static struct bd_vec4 *build_tree(const struct bd_native_loops *loops, const struct stage *s,
                                  uint32_t at_once, bool directional)
{
    struct bd_vec4 *nodes = malloc(NODES * NODE_BYTES);
    struct bd_native_leaves leaves = {.vpls = s->vpls,
                                      .quads = s->quads,
                                      .side = LEAF_SIDE,
                                      .light = {0.1f, 0.2f, 0.9f, 0},
                                      .directional = directional};
    assert_non_null(nodes);
    uint32_t level_nodes = LEAVES, first = NODES - LEAVES;
    for (uint32_t i = 0; i < LEAVES; i += at_once) {
        leaves.first = i;
        leaves.count = LEAVES - i < at_once ? LEAVES - i : at_once;
        loops->make_leaves(&leaves, &nodes[NODE_AT(first + i)]);
    }
    while (level_nodes > 1) {
        const uint32_t below = first;
        level_nodes /= 4;
        first -= level_nodes;
        for (uint32_t i = 0; i < level_nodes; i += at_once)
            loops->join_nodes(&nodes[NODE_AT(below + 4 * i)],
                              level_nodes - i < at_once ? level_nodes - i : at_once,
                              &nodes[NODE_AT(first + i)]);
    }
    return nodes;
}

static struct stage *set_dark_stage(void)
{
    struct stage *s = set_stage();
    for (uint32_t v = 0; v < VPLS; v += DARK_PERIOD)
        s->vpls[v * BD_VPL_VEC4S + 2] = (struct bd_vec4){0};
    return s;
}

static void every_width_builds_the_same_tree(void **unused)
{
    (void)unused;
    struct stage *s = set_dark_stage();
    const char *width;
    for (int directional = 0; directional < 2; directional++) {
        struct bd_vec4 *a = build_tree(bd_native_loops_at(0, &width), s, BD_LANES, directional);
        for (uint32_t w = 1; bd_native_loops_at(w, &width) || width; w++) {
            const struct bd_native_loops *loops = bd_native_loops_at(w, &width);
            if (!loops) continue;
            struct bd_vec4 *b = build_tree(loops, s, BD_LANES, directional);
            assert_memory_equal(a, b, NODES * NODE_BYTES);
            free(b);
        }
        free(a);
    }
    free(s);
}

// Nor does it matter how many nodes are made at once.
static void a_tree_in_parts_is_the_same_tree(void **unused)
{
    (void)unused;
    struct stage *s = set_dark_stage();
    struct bd_vec4 *a = build_tree(bd_native_loops(), s, BD_LANES, false);
    struct bd_vec4 *b = build_tree(bd_native_loops(), s, 37, false);
    assert_memory_equal(a, b, NODES * NODE_BYTES);
    free(a);
    free(b);
    free(s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_width_builds_the_same_tree),
        cmocka_unit_test(a_tree_in_parts_is_the_same_tree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
