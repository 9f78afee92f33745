// Levels of multiresolution images: sizes from the definition, and that the stack holds them.

#include <stdbool.h>

#include "pass/multires_layout.h"
#include "tests/unit/cmocka_all.h"

static uint32_t max_of(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

// ceil(size / 2^k)
static uint32_t blocks_of(uint32_t size_px, uint32_t k)
{
    return (uint32_t)(((uint64_t)size_px + (1ull << k) - 1) >> k);
}

static void assert_levels(const struct bd_multires_layout *layout, uint32_t width, uint32_t height,
                          uint32_t coarsest_side)
{
    uint32_t count = layout->level_count;
    assert_int_equal(layout->width_px, width);
    assert_int_equal(layout->height_px, height);
    assert_in_range(count, 1, BD_MULTIRES_LEVEL_MAX);
    for (uint32_t k = 0; k < count; k++) {
        assert_int_equal(layout->levels[k].columns, blocks_of(width, k));
        assert_int_equal(layout->levels[k].rows, blocks_of(height, k));
        // The last level and no other is as coarse as was asked for.
        bool coarse = max_of(blocks_of(width, k), blocks_of(height, k)) <= coarsest_side;
        assert_int_equal(coarse, k + 1 == count);
    }
}

static void assert_stack(const struct bd_multires_layout *layout)
{
    uint32_t width, height, rows = 0;
    uint64_t blocks = (uint64_t)layout->width_px * layout->height_px;
    bd_multires_stack_size(layout, &width, &height);
    for (uint32_t k = 1; k < layout->level_count; k++) {
        assert_int_equal(layout->levels[k].first_row, rows);
        assert_true(layout->levels[k].columns <= width);
        rows += layout->levels[k].rows;
        blocks += (uint64_t)layout->levels[k].columns * layout->levels[k].rows;
    }
    assert_int_equal(layout->levels[0].first_row, 0);
    assert_int_equal(height, max_of(rows, 1));
    assert_int_equal(width, layout->level_count > 1 ? layout->levels[1].columns : 1);
    assert_in_range(height, 1, 16384);
    assert_true(bd_multires_block_count(layout) == blocks);
}

static void check(uint32_t width, uint32_t height, uint32_t coarsest_side)
{
    struct bd_multires_layout layout = bd_multires_layout_of(width, height, coarsest_side);
    assert_levels(&layout, width, height, coarsest_side);
    assert_stack(&layout);
}

static void every_size_has_its_levels(void **state)
{
    (void)state;
    static const uint32_t sides[] = {1, 2, 3, 8, 16, 100, 1024, 20000};
    for (size_t s = 0; s < sizeof sides / sizeof *sides; s++) {
        for (uint32_t height = 1; height <= 769; height += 1 + height / 7)
            for (uint32_t width = 1; width <= 1023; width += 1 + width / 5)
                check(width, height, sides[s]);
        check(1023, 769, sides[s]);
        check(16384, 16384, sides[s]);
        check(16384, 1, sides[s]);
        check(1, 16384, sides[s]);
        check(16383, 16383, sides[s]);
        check(8193, 16384, sides[s]);
    }
}

static void the_largest_picture_is_as_on_paper(void **state)
{
    (void)state;
    uint32_t width, height;
    struct bd_multires_layout layout = bd_multires_layout_of(16384, 16384, 1);
    bd_multires_stack_size(&layout, &width, &height);
    assert_int_equal(layout.level_count, 15);
    assert_int_equal(width, 8192);
    assert_int_equal(height, 16383);
    assert_true(bd_multires_block_count(&layout) == 357913941); // (4^15 - 1) / 3
}

static void fragments_are_packed_without_loss(void **state)
{
    (void)state;
    static const uint32_t at[] = {0, 1, 8191, 16383};
    for (uint32_t level = 0; level < BD_MULTIRES_LEVEL_MAX; level++)
        for (int i = 0; i < 16; i++) {
            uint32_t x = at[i % 4], y = at[i / 4];
            uint32_t packed = BD_FRAGMENT_PACK(level, x, y);
            assert_int_equal(BD_FRAGMENT_LEVEL(packed), level);
            assert_int_equal(BD_FRAGMENT_X(packed), x);
            assert_int_equal(BD_FRAGMENT_Y(packed), y);
            assert_int_equal(BD_PIXEL_X(BD_PIXEL_PACK(x, y)), x);
            assert_int_equal(BD_PIXEL_Y(BD_PIXEL_PACK(x, y)), y);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_size_has_its_levels),
        cmocka_unit_test(the_largest_picture_is_as_on_paper),
        cmocka_unit_test(fragments_are_packed_without_loss),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
