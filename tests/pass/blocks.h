// Blocks of a picture as the device finds them, and straight from the definition
// (pass/discontinuity.h, algorithms.md A1), by which every block looks at each of its pixels.

#ifndef BD_TESTS_PASS_BLOCKS_H
#define BD_TESTS_PASS_BLOCKS_H

#include "picture.h"

struct blocks {
    struct bd_multires_layout layout;
    uint32_t first[BD_MULTIRES_LEVEL_MAX]; // of a level, in the arrays
    uint32_t *flags, *representatives;
};

// Fails the test on any error.
struct bd_discontinuity *discontinuity_of(const struct picture *picture,
                                          const struct bd_discontinuity_settings *settings);

struct blocks blocks_by_definition(const struct picture *picture,
                                   const struct bd_discontinuity_settings *settings);
// As the pass left them; level 0 is what can be lit.
struct blocks blocks_of_device(const struct picture *picture,
                               const struct bd_discontinuity *discontinuity);
// Of an R32UI stack, by block_index; undefined at level 0. Freed by the caller.
uint32_t *stack_of_device(const struct blocks *blocks, const struct bd_tex *stack);
void blocks_destroy(struct blocks *blocks);
uint32_t block_index(const struct blocks *blocks, uint32_t level, uint32_t x, uint32_t y);

#endif
