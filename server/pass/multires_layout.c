#include "pass/multires_layout.h"

#include <stdbool.h>

#include "base/assert.h"

#define SIDE_MAX_PX 16384u

static uint32_t halved(uint32_t blocks)
{
    return (blocks + 1) / 2;
}

static uint32_t longer(uint32_t width, uint32_t height)
{
    return width > height ? width : height;
}

struct bd_multires_layout bd_multires_layout_of(uint32_t width_px, uint32_t height_px,
                                                uint32_t coarsest_side)
{
    BD_ASSERT_CMP(width_px, >=, 1);
    BD_ASSERT_CMP(height_px, >=, 1);
    BD_ASSERT_CMP(longer(width_px, height_px), <=, SIDE_MAX_PX);
    BD_ASSERT_CMP(coarsest_side, >=, 1);
    struct bd_multires_layout layout = {
        .width_px = width_px,
        .height_px = height_px,
        .level_count = 1,
        .levels[0] = {width_px, height_px, 0, 0},
    };
    const struct bd_multires_level *finer = &layout.levels[0];
    for (uint32_t row = 0; longer(finer->columns, finer->rows) > coarsest_side; finer++) {
        struct bd_multires_level *level = &layout.levels[layout.level_count++];
        *level = (struct bd_multires_level){halved(finer->columns), halved(finer->rows), row, 0};
        row += level->rows;
    }
    return layout;
}

uint64_t bd_multires_block_count(const struct bd_multires_layout *layout)
{
    uint64_t blocks = 0;
    for (uint32_t k = 0; k < layout->level_count; k++)
        blocks += (uint64_t)layout->levels[k].columns * layout->levels[k].rows;
    return blocks;
}

struct bd_multires_level bd_multires_level(const struct bd_multires_layout *layout, uint32_t level)
{
    struct bd_multires_level found = {0};
    if (level < layout->level_count) found = layout->levels[level];
    found.number = level;
    return found;
}

void bd_multires_stack_size(const struct bd_multires_layout *layout, uint32_t *width_px,
                            uint32_t *height_px)
{
    const struct bd_multires_level *last = &layout->levels[layout->level_count - 1];
    bool stacked = layout->level_count > 1;
    *width_px = stacked ? layout->levels[1].columns : 1;
    *height_px = stacked ? last->first_row + last->rows : 1;
}
