// What happens to a fragment: sums, depth, and points to make it.

#include <string.h>

#include "gpu_test.h"

#define SIDE 16

static const float everywhere[3][4] = {{-1, 3, 0.5f, 1}, {-1, -1, 0.5f, 1}, {3, -1, 0.5f, 1}};

struct canvas {
    struct bd_tex *color, *alone, *depth;
    struct bd_buf *vertices, *weights;
};

static struct canvas make_canvas(const float *weights, size_t weight_count)
{
    return (struct canvas){
        .color = make_tex(BD_FORMAT_RGBA32F, SIDE, SIDE, 0),
        .alone = make_tex(BD_FORMAT_R32F, SIDE, SIDE, 0),
        .depth = make_tex(BD_FORMAT_DEPTH32F, SIDE, SIDE, 0),
        .vertices = make_buf(sizeof everywhere, everywhere),
        .weights = make_buf(weight_count * sizeof *weights, weights),
    };
}

static void destroy_canvas(struct canvas *canvas)
{
    bd_buf_destroy(gpu, &canvas->weights);
    bd_buf_destroy(gpu, &canvas->vertices);
    bd_tex_destroy(gpu, &canvas->depth);
    bd_tex_destroy(gpu, &canvas->alone);
    bd_tex_destroy(gpu, &canvas->color);
}

// Instances `first` and `count - 1` more, each over the whole target with its own weight.
static struct bd_draw draw_of(const struct canvas *canvas, uint32_t first, uint32_t count,
                              enum bd_blend blend)
{
    return (struct bd_draw){
        .program = raster_program("test/weigh.vert", "test/weigh.frag", NULL),
        .attributes = {{.buf = canvas->vertices, .stride_bytes = 16, .component_count = 4},
                       {.buf = canvas->weights,
                        .stride_bytes = 4,
                        .component_count = 1,
                        .per_instance = true}},
        .index_count = 3,
        .instance_count = count,
        .base_instance = first,
        .blend = blend,
    };
}

static void render(const struct canvas *canvas, bool with_depth, const struct bd_draw *draws,
                   size_t count)
{
    const struct bd_target target = {
        .color = {{canvas->color, 0}, {canvas->alone, 0}},
        .depth.tex = with_depth ? canvas->depth : NULL,
    };
    bd_gpu_target_begin(gpu, &target);
    for (size_t i = 0; i < count; i++) bd_gpu_draw(gpu, &draws[i]);
    bd_gpu_target_end(gpu);
}

typedef float pixels[SIDE][SIDE][4];

static void expect(const struct canvas *canvas, float weight, float count)
{
    pixels color;
    float alone[SIDE][SIDE];
    read_tex(canvas->color, 0, color, sizeof color);
    read_tex(canvas->alone, 0, alone, sizeof alone);
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            assert_true(color[y][x][0] == weight && alone[y][x] == weight);
            assert_true(color[y][x][3] == count);
        }
}

// Sums that 32 bits round differently in another order, over instances and over draws. The first
// draw is also the one that is warmed up: that must add nothing.
static void sums_are_of_32_bits_in_the_order_of_drawing(void **state)
{
    (void)state;
    static const float weights[4] = {1e8f, 1, -1e8f, 0.5f};
    struct canvas canvas = make_canvas(weights, COUNT(weights));
    struct bd_draw draw = draw_of(&canvas, 0, 4, BD_BLEND_ADD);
    render(&canvas, false, &draw, 1);
    expect(&canvas, 0.5f, 4);
    const struct bd_draw parts[2] = {draw_of(&canvas, 2, 2, BD_BLEND_ADD),
                                     draw_of(&canvas, 0, 2, BD_BLEND_ADD)};
    render(&canvas, false, parts, 2);
    expect(&canvas, 1, 4);
    destroy_canvas(&canvas);
}

static void what_does_not_blend_replaces(void **state)
{
    (void)state;
    static const float weights[3] = {3, 5, 7};
    struct canvas canvas = make_canvas(weights, COUNT(weights));
    const struct bd_draw draws[3] = {draw_of(&canvas, 0, 2, BD_BLEND_ADD),
                                     draw_of(&canvas, 1, 1, BD_BLEND_REPLACE),
                                     draw_of(&canvas, 2, 1, BD_BLEND_ADD)};
    render(&canvas, false, draws, 1);
    expect(&canvas, 8, 2);
    render(&canvas, false, draws, 2);
    expect(&canvas, 5, 1);
    render(&canvas, false, draws, 3);
    expect(&canvas, 12, 2);
    destroy_canvas(&canvas);
}

// Draws at one depth each, in a target that has 0.5 already.
static void depth_is_tested_written_or_neither(void **state)
{
    (void)state;
    static const struct {
        float at;
        enum bd_draw_depth use;
        bool passes;
        float depth_after;
    } cases[] = {
        {0.75f, BD_DRAW_DEPTH_WRITE, true, 0.75f}, {0.25f, BD_DRAW_DEPTH_WRITE, false, 0.5f},
        {0.75f, BD_DRAW_DEPTH_TEST, true, 0.5f},   {0.25f, BD_DRAW_DEPTH_TEST, false, 0.5f},
        {0.75f, BD_DRAW_DEPTH_IGNORE, true, 0.5f}, {0.25f, BD_DRAW_DEPTH_IGNORE, true, 0.5f},
    };
    static const float weights[2] = {1, 2};
    struct canvas canvas = make_canvas(weights, COUNT(weights));
    for (size_t i = 0; i < COUNT(cases); i++) {
        float moved[3][4];
        memcpy(moved, everywhere, sizeof moved);
        for (int v = 0; v < 3; v++) moved[v][2] = cases[i].at;
        struct bd_buf *vertices = make_buf(sizeof moved, moved);
        struct bd_draw draws[2] = {draw_of(&canvas, 0, 1, BD_BLEND_REPLACE),
                                   draw_of(&canvas, 1, 1, BD_BLEND_REPLACE)};
        draws[1].attributes[0].buf = vertices;
        draws[1].depth = cases[i].use;
        render(&canvas, true, draws, 2);
        expect(&canvas, cases[i].passes ? 2 : 1, 1);
        float depth[SIDE][SIDE];
        read_tex(canvas.depth, 0, depth, sizeof depth);
        assert_true(depth[3][5] == cases[i].depth_after);
        // Whatever the last draw did, the next target begins infinitely far.
        render(&canvas, true, NULL, 0);
        read_tex(canvas.depth, 0, depth, sizeof depth);
        assert_true(depth[3][5] == 0);
        bd_buf_destroy(gpu, &vertices);
    }
    destroy_canvas(&canvas);
}

// A point in each second pixel, wherever in it; one is beyond each side of the target.
static void a_point_colours_its_pixel(void **state)
{
    (void)state;
    enum { POINTS = SIDE * SIDE / 2 };
    static const float inside[4] = {0.5f, 0.25f, 0.75f, 0.4f};
    float positions[POINTS + 4][4], weights[POINTS + 4];
    for (int i = 0; i < POINTS + 4; i++) {
        float x = (float)(2 * i % SIDE) + inside[i % 4],
              y = (float)(2 * i / SIDE) + inside[i / 8 % 4];
        memcpy(positions[i], ((float[4]){2 * x / SIDE - 1, 1 - 2 * y / SIDE, 0.5f, 1}),
               sizeof positions[i]);
        weights[i] = (float)(i + 1);
    }
    for (int side = 0; side < 4; side++)
        positions[POINTS + side][side / 2] = side % 2 ? 1.2f : -1.2f;
    struct canvas canvas = make_canvas(weights, COUNT(weights));
    struct bd_buf *vertices = make_buf(sizeof positions, positions);
    struct bd_draw draw = draw_of(&canvas, 0, 2, BD_BLEND_ADD); // each point twice
    draw.attributes[0].buf = vertices;
    draw.attributes[1].per_instance = false;
    draw.topology = BD_TOPOLOGY_POINTS;
    draw.index_count = POINTS + 4;
    render(&canvas, false, &draw, 1);
    pixels color;
    read_tex(canvas.color, 0, color, sizeof color);
    for (int i = 0; i < SIDE * SIDE; i++) {
        const float *found = color[i / SIDE][i % SIDE];
        assert_true(found[0] == (i % 2 ? 0 : 2 * (float)(i / 2 + 1)));
        assert_true(found[3] == (i % 2 ? 0 : 2));
    }
    bd_buf_destroy(gpu, &vertices);
    destroy_canvas(&canvas);
}

// Software drivers generate code for each combination of states: each is warmed up once, and
// counts as compilation.
static void each_state_is_warmed_up_once(void **state)
{
    (void)state;
    if (!bd_gpu_caps(gpu)->software) skip();
    static const float weights[1] = {1};
    struct canvas canvas = make_canvas(weights, 1);
    struct bd_defines defines = {0};
    bd_define(&defines, "UNUSED", 1); // a program that nobody else has drawn with
    struct bd_draw draws[4];
    for (int i = 0; i < 4; i++) {
        draws[i] = draw_of(&canvas, 0, 1, i == 1 ? BD_BLEND_ADD : BD_BLEND_REPLACE);
        draws[i].program = raster_program("test/weigh.vert", "test/weigh.frag", &defines);
    }
    draws[2].depth = BD_DRAW_DEPTH_TEST;
    draws[3].topology = BD_TOPOLOGY_POINTS;
    for (int i = 0; i < 4; i++) {
        double before_ms = bd_gpu_compile_ms(gpu);
        render(&canvas, true, &draws[i], 1);
        double first_ms = bd_gpu_compile_ms(gpu);
        assert_true(first_ms > before_ms);
        render(&canvas, true, &draws[i], 1);
        assert_true(bd_gpu_compile_ms(gpu) == first_ms);
    }
    destroy_canvas(&canvas);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sums_are_of_32_bits_in_the_order_of_drawing),
        cmocka_unit_test(what_does_not_blend_replaces),
        cmocka_unit_test(depth_is_tested_written_or_neither),
        cmocka_unit_test(a_point_colours_its_pixel),
        cmocka_unit_test(each_state_is_warmed_up_once),
    };
    gpu_test_open();
    return gpu_test_close(cmocka_run_group_tests(tests, NULL, NULL));
}
