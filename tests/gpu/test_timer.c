#include <math.h>
#include <stdio.h>
#include <string.h>

#include "base/clock.h"
#include "gpu_test.h"

#define SIDE 256

struct work {
    struct bd_tex *color;
    struct bd_buf *vertices, *result;
};

static struct work make_work(void)
{
    static const float triangle[3][4] = {{-1, 3, 0.5f, 1}, {-1, -1, 0.5f, 1}, {3, -1, 0.5f, 1}};
    return (struct work){
        .color = make_tex(BD_FORMAT_RGBA32F, SIDE, SIDE, 0),
        .vertices = make_buf(sizeof triangle, triangle),
        .result = make_buf(4096 * sizeof(float), NULL),
    };
}

static void destroy_work(struct work *work)
{
    bd_buf_destroy(gpu, &work->result);
    bd_buf_destroy(gpu, &work->vertices);
    bd_tex_destroy(gpu, &work->color);
}

static void compute_pass(const struct work *work, uint32_t rounds)
{
    const struct bd_bindings bindings = {
        .storage[0] = {.buf = work->result, .write = true},
        .uniforms[0] = {&rounds, sizeof rounds},
    };
    bd_gpu_pass_begin(gpu, "compute");
    bd_gpu_dispatch(gpu, compute_program("test/work.comp"), &bindings, SIDE * SIDE / 64, 1, 1);
    bd_gpu_pass_end(gpu);
}

// Makes the program one that no driver's cache has seen, so that it has to be compiled.
static struct bd_defines salt(void)
{
    struct bd_defines defines = {0};
    bd_define(&defines, "SALT", (int32_t)(bd_clock_ns() & 0x7fffffff));
    return defines;
}

static struct bd_defines salted;

static void raster_pass(const struct work *work, uint32_t rounds)
{
    const struct bd_target target = {.color[0].tex = work->color};
    const struct bd_draw draw = {
        .program = raster_program("test/place.vert", "test/work.frag", &salted),
        .bindings.uniforms[0] = {&rounds, sizeof rounds},
        .attributes[0] = {.buf = work->vertices, .stride_bytes = 16, .component_count = 4},
        .attributes[1] = {.is_uint = true},
        .index_count = 3,
        .instance_count = 1,
    };
    bd_gpu_pass_begin(gpu, "raster");
    bd_gpu_target_begin(gpu, &target);
    bd_gpu_draw(gpu, &draw);
    bd_gpu_target_end(gpu);
    bd_gpu_pass_end(gpu);
}

// Wall clock of one pass alone, between two waits, and what its timer said.
static void time_alone(void (*pass)(const struct work *, uint32_t), const struct work *work,
                       uint32_t rounds, double *wall_ms, double *timer_ms)
{
    struct bd_gpu_pass_time time;
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    uint64_t start_ns = bd_clock_ns();
    pass(work, rounds);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    *wall_ms = bd_ms_since(start_ns);
    assert_int_equal(bd_gpu_take_pass_times(gpu, &time, 1), 1);
    *timer_ms = time.ms;
}

static bool within(double value, double of, double share)
{
    return fabs(value - of) <= share * of;
}

// Rounds that take about `ms`, found by doubling: devices differ by a factor of a thousand.
static uint32_t rounds_for(void (*pass)(const struct work *, uint32_t), const struct work *work,
                           double ms)
{
    for (uint32_t rounds = 64;; rounds *= 2) {
        double wall_ms, timer_ms;
        time_alone(pass, work, rounds, &wall_ms, &timer_ms);
        if (wall_ms >= ms || rounds >= 1u << 24) return rounds;
    }
}

// The machine runs other things too: a wall clock that was interrupted is measured again.
#define ATTEMPTS 6

// Once, and with four times the work: a timer that reads a constant would not tell.
static bool agrees_at_two_costs(void (*pass)(const struct work *, uint32_t),
                                const struct work *work, uint32_t rounds, const char *name)
{
    double timer_ms[2] = {0}, wall_ms[2] = {0};
    for (int i = 0; i < 2; i++) time_alone(pass, work, rounds << 2 * i, &wall_ms[i], &timer_ms[i]);
    print_message("%s: timer %.2f and %.2f ms, wall %.2f and %.2f ms\n", name, timer_ms[0],
                  timer_ms[1], wall_ms[0], wall_ms[1]);
    return within(timer_ms[0], wall_ms[0], 0.2) && within(timer_ms[1], wall_ms[1], 0.2) &&
           timer_ms[1] > 2 * timer_ms[0] && timer_ms[1] < 8 * timer_ms[0];
}

static void timers_agree_with_the_wall_clock(void **state)
{
    (void)state;
    struct work work = make_work();
    void (*const passes[])(const struct work *, uint32_t) = {compute_pass, raster_pass};
    for (size_t i = 0; i < COUNT(passes); i++) {
        uint32_t rounds = rounds_for(passes[i], &work, 25);
        bool agreed = false;
        for (int attempt = 0; attempt < ATTEMPTS && !agreed; attempt++)
            agreed = agrees_at_two_costs(passes[i], &work, rounds, i ? "raster" : "compute");
        assert_true(agreed);
    }
    destroy_work(&work);
}

static void passes_add_up_to_the_whole(void **state)
{
    (void)state;
    struct work work = make_work();
    uint32_t compute_rounds = rounds_for(compute_pass, &work, 15);
    uint32_t raster_rounds = rounds_for(raster_pass, &work, 15);
    bool agreed = false;
    for (int attempt = 0; attempt < ATTEMPTS && !agreed; attempt++) {
        assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
        uint64_t start_ns = bd_clock_ns();
        compute_pass(&work, compute_rounds);
        raster_pass(&work, raster_rounds);
        raster_pass(&work,
                    4 * raster_rounds); // one batch with the one before, if nothing parts them
        compute_pass(&work, compute_rounds);
        assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
        double wall_ms = bd_ms_since(start_ns), sum_ms = 0;
        struct bd_gpu_pass_time times[8];
        // In two bites: what does not fit stays for the next call.
        assert_int_equal(bd_gpu_take_pass_times(gpu, times, 3), 3);
        assert_int_equal(bd_gpu_take_pass_times(gpu, times + 3, 5), 1);
        for (int i = 0; i < 4; i++) {
            assert_string_equal(times[i].name, i == 1 || i == 2 ? "raster" : "compute");
            sum_ms += times[i].ms;
        }
        print_message("raster %.2f and %.2f ms, sum of passes %.2f ms, wall %.2f ms\n", times[1].ms,
                      times[2].ms, sum_ms, wall_ms);
        agreed = within(sum_ms, wall_ms, 0.05) && times[2].ms > 2 * times[1].ms &&
                 times[2].ms < 8 * times[1].ms;
    }
    assert_true(agreed);
    destroy_work(&work);
}

// The first run of a program compiles it: that time is `compile`, not the pass.
static void compilation_is_no_part_of_a_pass(void **state)
{
    (void)state;
    struct work work = make_work();
    struct bd_gpu_pass_time first, second;
    double before_ms = bd_gpu_compile_ms(gpu);
    raster_pass(&work, 1);
    assert_int_equal(bd_gpu_take_pass_times(gpu, &first, 1), 1);
    double compile_ms = bd_gpu_compile_ms(gpu) - before_ms;
    raster_pass(&work, 1);
    assert_int_equal(bd_gpu_take_pass_times(gpu, &second, 1), 1);
    print_message("first %.3f ms, second %.3f ms, compile %.3f ms\n", first.ms, second.ms,
                  compile_ms);
    assert_true(compile_ms > 0);
    assert_true(bd_gpu_compile_ms(gpu) - before_ms == compile_ms);
    assert_true(first.ms < second.ms + 0.5 * compile_ms + 1.0);
    destroy_work(&work);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(compilation_is_no_part_of_a_pass),
        cmocka_unit_test(timers_agree_with_the_wall_clock),
        cmocka_unit_test(passes_add_up_to_the_whole),
    };
    gpu_test_open();
    salted = salt();
    return gpu_test_close(cmocka_run_group_tests(tests, NULL, NULL));
}
