#include <string.h>

#include "gpu_test.h"

#define SIDE 16

// A triangle that covers the upper left half of the picture, counter-clockwise as seen.
static const float upper_left[3][4] = {{-1, 1, 0.5f, 1}, {-1, -1, 0.5f, 1}, {1, 1, 0.5f, 1}};
static const uint32_t in_order[3] = {0, 1, 2}, turned[3] = {0, 2, 1};

struct raster {
    struct bd_tex *color, *depth;
    struct bd_buf *vertices, *indices;
};

static struct raster make_raster(const float (*vertices)[4], size_t vertex_count,
                                 const uint32_t *indices, size_t index_count)
{
    return (struct raster){
        .color = make_tex(BD_FORMAT_RGBA32F, SIDE, SIDE, 0),
        .depth = make_tex(BD_FORMAT_DEPTH32F, SIDE, SIDE, 0),
        .vertices = make_buf(vertex_count * sizeof *vertices, vertices),
        .indices = make_buf(index_count * sizeof *indices, indices),
    };
}

static void destroy_raster(struct raster *raster)
{
    bd_buf_destroy(gpu, &raster->indices);
    bd_buf_destroy(gpu, &raster->vertices);
    bd_tex_destroy(gpu, &raster->depth);
    bd_tex_destroy(gpu, &raster->color);
}

static struct bd_draw draw_of(const struct raster *raster, uint32_t index_count)
{
    struct bd_defines defines = {0};
    bd_define(&defines, "VALUE", 1);
    return (struct bd_draw){
        .program = raster_program("test/place.vert", "test/one.frag", &defines),
        .attributes[0] = {.buf = raster->vertices, .stride_bytes = 16, .component_count = 4},
        .indices = raster->indices,
        .index_count = index_count,
        .instance_count = 1,
    };
}

static void render(const struct raster *raster, const struct bd_draw *draws, size_t count)
{
    const struct bd_target target = {.color[0].tex = raster->color, .depth.tex = raster->depth};
    bd_gpu_target_begin(gpu, &target);
    for (size_t i = 0; i < count; i++) bd_gpu_draw(gpu, &draws[i]);
    bd_gpu_target_end(gpu);
}

typedef float pixels[SIDE][SIDE][4];

static size_t covered(pixels found)
{
    size_t count = 0;
    for (int i = 0; i < SIDE * SIDE; i++) count += found[i / SIDE][i % SIDE][3] > 0;
    return count;
}

static void row_zero_is_the_top(void **state)
{
    (void)state;
    struct raster raster = make_raster(upper_left, 3, in_order, 3);
    const struct bd_draw draw = draw_of(&raster, 3);
    render(&raster, &draw, 1);
    pixels found;
    read_tex(raster.color, 0, found, sizeof found);
    assert_true(found[0][0][3] == 1);                                      // top left: covered
    assert_true(found[SIDE - 1][0][3] == 1 || found[SIDE - 2][0][3] == 1); // left edge
    assert_true(found[0][SIDE - 2][3] == 1);                               // top edge
    assert_true(found[SIDE - 1][SIDE - 1][3] == 0);                        // bottom right: not
    assert_true(found[0][0][2] == 0.5f); // clip depth is window depth
    destroy_raster(&raster);
}

// Facing by what the viewer sees, with and without a mirrored transform.
static void back_faces_are_culled(void **state)
{
    (void)state;
    static const struct {
        const uint32_t *indices;
        bool mirrored, visible;
    } cases[] = {{in_order, false, true},
                 {turned, false, false},
                 {in_order, true, false},
                 {turned, true, true}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        struct raster raster = make_raster(upper_left, 3, cases[i].indices, 3);
        struct bd_draw draw = draw_of(&raster, 3);
        draw.cull = BD_CULL_BACK;
        draw.mirrored = cases[i].mirrored;
        render(&raster, &draw, 1);
        pixels found;
        read_tex(raster.color, 0, found, sizeof found);
        assert_int_equal(covered(found) > 0, cases[i].visible);
        draw.cull = BD_CULL_NONE;
        render(&raster, &draw, 1);
        read_tex(raster.color, 0, found, sizeof found);
        assert_true(covered(found) > 0);
        destroy_raster(&raster);
    }
}

// Reversed depth: the larger value is nearer and wins, whichever comes first; the cleared depth
// is infinitely far.
static void nearer_wins(void **state)
{
    (void)state;
    static const float two[6][4] = {{-1, 3, 0.25f, 1}, {-1, -1, 0.25f, 1}, {3, -1, 0.25f, 1},
                                    {-1, 3, 0.75f, 1}, {-1, -1, 0.75f, 1}, {3, -1, 0.75f, 1}};
    static const uint32_t near_last[6] = {0, 1, 2, 3, 4, 5}, near_first[6] = {3, 4, 5, 0, 1, 2};
    const uint32_t *orders[] = {near_last, near_first};
    for (size_t i = 0; i < COUNT(orders); i++) {
        struct raster raster = make_raster(two, 6, orders[i], 6);
        const struct bd_draw draw = draw_of(&raster, 6);
        render(&raster, &draw, 1);
        pixels found;
        float depth[SIDE][SIDE];
        read_tex(raster.color, 0, found, sizeof found);
        read_tex(raster.depth, 0, depth, sizeof depth);
        for (int at = 0; at < SIDE * SIDE; at++) {
            assert_true(found[at / SIDE][at % SIDE][2] == 0.75f);
            assert_true(depth[at / SIDE][at % SIDE] == 0.75f);
        }
        render(&raster, NULL, 0);
        read_tex(raster.depth, 0, depth, sizeof depth);
        assert_true(depth[3][3] == 0);
        destroy_raster(&raster);
    }
}

static void without_depth_the_last_wins(void **state)
{
    (void)state;
    struct raster raster = make_raster(upper_left, 3, in_order, 3);
    struct bd_draw draws[2] = {draw_of(&raster, 3), draw_of(&raster, 3)};
    struct bd_defines defines = {0};
    bd_define(&defines, "VALUE", 2);
    draws[1].program = raster_program("test/place.vert", "test/one.frag", &defines);
    assert_ptr_not_equal(draws[0].program, draws[1].program);
    const struct bd_target target = {.color[0].tex = raster.color};
    bd_gpu_target_begin(gpu, &target);
    bd_gpu_draw(gpu, &draws[0]);
    bd_gpu_draw(gpu, &draws[1]);
    bd_gpu_target_end(gpu);
    pixels found;
    read_tex(raster.color, 0, found, sizeof found);
    assert_true(found[0][0][0] == 2);
    destroy_raster(&raster);
}

// Two triangles into four formats at once, one of them a layer of an array.
static void every_format_takes_what_is_drawn(void **state)
{
    (void)state;
    static const float quad[4][4] = {
        {-1, 1, 0.5f, 1}, {-1, -1, 0.5f, 1}, {1, 1, 0.5f, 1}, {1, -1, 0.5f, 1}};
    static const uint32_t indices[6] = {0, 1, 2, 2, 1, 3}, tags[4] = {7, 7, 7, 7};
    struct raster raster = make_raster(quad, 4, indices, 6);
    struct bd_buf *tag_buf = make_buf(sizeof tags, tags);
    struct bd_tex *primitive = make_tex(BD_FORMAT_R32UI, SIDE, SIDE, 0);
    struct bd_tex *pair = make_tex(BD_FORMAT_RG32UI, SIDE, SIDE, 3);
    struct bd_tex *narrow = make_tex(BD_FORMAT_RGBA16, SIDE, SIDE, 0);
    const struct bd_target target = {
        .color = {{primitive, 0}, {pair, 1}, {raster.color, 0}, {narrow, 0}},
        .depth.tex = raster.depth,
    };
    struct bd_draw draw = draw_of(&raster, 6);
    draw.program = raster_program("test/place.vert", "test/formats.frag", NULL);
    draw.attributes[1] = (struct bd_attribute){
        .buf = tag_buf, .stride_bytes = 4, .component_count = 1, .is_uint = true};
    bd_tex_clear(gpu, pair, (const float[4]){5, 6, 0, 0});
    bd_gpu_target_begin(gpu, &target);
    bd_gpu_draw(gpu, &draw);
    bd_gpu_target_end(gpu);

    uint32_t ids[SIDE][SIDE], pairs[SIDE][SIDE][2];
    pixels wide;
    uint16_t shorts[SIDE][SIDE][4];
    read_tex(primitive, 0, ids, sizeof ids);
    read_tex(pair, 1, pairs, sizeof pairs);
    read_tex(raster.color, 0, wide, sizeof wide);
    read_tex(narrow, 0, shorts, sizeof shorts);
    assert_int_equal(ids[0][0], 1);               // first triangle: top left
    assert_int_equal(ids[SIDE - 1][SIDE - 1], 2); // second: bottom right
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            assert_int_equal(pairs[y][x][0], 7);
            assert_int_equal(pairs[y][x][1], 1); // counter-clockwise: front
            assert_memory_equal(wide[y][x],
                                ((float[4]){(float)x + 0.5f, (float)y + 0.5f, 0.5f, -1.5f}),
                                sizeof wide[y][x]);
            assert_memory_equal(shorts[y][x], ((uint16_t[4]){16384, 32768, 65535, 65535}),
                                sizeof shorts[y][x]);
        }
    read_tex(pair, 2, pairs, sizeof pairs); // a layer that was not drawn to
    assert_int_equal(pairs[4][4][0], 5);
    assert_int_equal(pairs[4][4][1], 6);
    bd_tex_destroy(gpu, &narrow);
    bd_tex_destroy(gpu, &pair);
    bd_tex_destroy(gpu, &primitive);
    bd_buf_destroy(gpu, &tag_buf);
    destroy_raster(&raster);
}

// Two instances, shifted by a per-instance attribute that starts at the second element; the
// indices start at the second triangle, and count from the base vertex.
static void offsets_and_instances_are_honoured(void **state)
{
    (void)state;
    static const float vertices[4][4] = {
        {9, 9, 9, 1}, {-1, 1, 0.5f, 1}, {-1, 0, 0.5f, 1}, {0, 1, 0.5f, 1}};
    static const uint32_t indices[6] = {0, 0, 0, 0, 1, 2};
    static const float shifts[3][2] = {{50, 50}, {0, 0}, {1, -1}};
    struct raster raster = make_raster(vertices, 4, indices, 6);
    struct bd_buf *shift = make_buf(sizeof shifts, shifts);
    struct bd_draw draw = draw_of(&raster, 3);
    draw.index_offset_bytes = 12;
    draw.base_vertex = 1;
    draw.instance_count = 2;
    draw.base_instance = 1;
    draw.attributes[2] = (struct bd_attribute){
        .buf = shift, .stride_bytes = 8, .component_count = 2, .per_instance = true};
    render(&raster, &draw, 1);
    pixels found;
    read_tex(raster.color, 0, found, sizeof found);
    assert_true(found[0][0][3] == 1);
    assert_true(found[SIDE / 2][SIDE / 2][3] == 1);
    assert_true(found[SIDE / 2][0][3] == 0);
    assert_true(found[0][SIDE / 2][3] == 0);
    bd_buf_destroy(gpu, &shift);
    destroy_raster(&raster);
}

static void without_indices_vertices_come_in_order(void **state)
{
    (void)state;
    struct raster raster = make_raster(upper_left, 3, in_order, 3);
    struct bd_draw draw = draw_of(&raster, 3);
    draw.indices = NULL;
    render(&raster, &draw, 1);
    pixels found;
    read_tex(raster.color, 0, found, sizeof found);
    assert_true(found[0][0][3] == 1);
    assert_true(found[SIDE - 1][SIDE - 1][3] == 0);
    destroy_raster(&raster);
}

static void srgb_textures_are_encoded_and_decoded(void **state)
{
    (void)state;
    struct bd_tex *tex = make_tex(BD_FORMAT_RGBA8_SRGB, 1, 1, 0);
    const uint8_t texel[4] = {188, 0, 255, 255};
    bd_tex_upload(gpu, tex, 0, texel, sizeof texel);
    struct bd_tex *layers = make_tex(BD_FORMAT_R32F, 1, 1, 1);
    struct bd_buf *result = make_buf(2 * 4 * sizeof(float), NULL);
    const struct bd_bindings bindings = {
        .textures[0] = {.tex = tex},
        .textures[1] = {.tex = layers},
        .storage[0] = {.buf = result, .write = true},
    };
    bd_gpu_dispatch(gpu, compute_program("test/sample.comp"), &bindings, 1, 1, 1);
    float found[4];
    assert_int_equal(bd_buf_read(gpu, result, 0, found, sizeof found), BD_ERR_OK);
    assert_float_equal(found[0], 0.5029f, 2e-3f);
    assert_true(found[1] == 0 && found[2] == 1);
    bd_buf_destroy(gpu, &result);
    bd_tex_destroy(gpu, &layers);
    bd_tex_destroy(gpu, &tex);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(row_zero_is_the_top),
        cmocka_unit_test(back_faces_are_culled),
        cmocka_unit_test(nearer_wins),
        cmocka_unit_test(without_depth_the_last_wins),
        cmocka_unit_test(every_format_takes_what_is_drawn),
        cmocka_unit_test(offsets_and_instances_are_honoured),
        cmocka_unit_test(without_indices_vertices_come_in_order),
        cmocka_unit_test(srgb_textures_are_encoded_and_decoded),
    };
    gpu_test_open();
    return gpu_test_close(cmocka_run_group_tests(tests, NULL, NULL));
}
