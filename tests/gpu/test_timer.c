#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

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

// What one pass alone took, between two waits: by the wall clock, by all of this process's threads
// together, and by its timer.
struct times {
    double wall_ms, processors_ms, timer_ms;
};

static double processors_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

static struct times time_alone(void (*pass)(const struct work *, uint32_t), const struct work *work,
                               uint32_t rounds)
{
    struct bd_gpu_pass_time time;
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    const uint64_t start_ns = bd_clock_ns();
    const double before_ms = processors_ms();
    pass(work, rounds);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    struct times times = {.wall_ms = bd_ms_since(start_ns)};
    times.processors_ms = processors_ms() - before_ms;
    assert_int_equal(bd_gpu_take_pass_times(gpu, &time, 1), 1);
    times.timer_ms = time.ms;
    return times;
}

// On a busy machine any wall clock may be interrupted between two readings, but whatever else runs:
// no timer is longer than the wall clock around it, and none shorter than the processors' time that
// a software device's threads spent, side by side. On an idle machine the two are close.
static bool holds_for(double timer_ms, const struct times *around)
{
    const double side_by_side = (double)sysconf(_SC_NPROCESSORS_ONLN);
    return timer_ms <= 1.02 * around->wall_ms &&
           timer_ms >= 0.8 * around->processors_ms / side_by_side;
}

// A GPU leaves the processors alone: there the wall clock has to do, and is read again when it was
// interrupted.
static bool is_close(double timer_ms, const struct times *around)
{
    return bd_gpu_caps(gpu)->software || fabs(timer_ms - around->wall_ms) <= 0.2 * around->wall_ms;
}

static double shortest_ms(void (*pass)(const struct work *, uint32_t), const struct work *work,
                          uint32_t rounds)
{
    double ms = INFINITY;
    for (int i = 0; i < 3; i++) ms = fmin(ms, time_alone(pass, work, rounds).timer_ms);
    return ms;
}

// Rounds that take about `ms`, found by doubling: devices differ by a factor of a thousand. And eight
// times what a pass takes with next to none: where that is much of it, four times the rounds hardly
// show.
static uint32_t rounds_for(void (*pass)(const struct work *, uint32_t), const struct work *work,
                           double ms)
{
    const double least_ms = fmax(ms, 8 * shortest_ms(pass, work, 1));
    for (uint32_t rounds = 64;; rounds *= 2)
        if (shortest_ms(pass, work, rounds) >= least_ms || rounds >= 1u << 24) return rounds;
}

#define ATTEMPTS 6

// The shortest of a few: what was interrupted least.
static struct times least(void (*pass)(const struct work *, uint32_t), const struct work *work,
                          uint32_t rounds, const char *name)
{
    struct times best = {.timer_ms = INFINITY};
    bool close = false;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        const struct times times = time_alone(pass, work, rounds);
        print_message("%s: timer %.2f ms, wall %.2f ms, processors %.2f ms\n", name, times.timer_ms,
                      times.wall_ms, times.processors_ms);
        assert_true(holds_for(times.timer_ms, &times));
        close = close || is_close(times.timer_ms, &times);
        if (times.timer_ms < best.timer_ms) best = times;
    }
    assert_true(close);
    return best;
}

// Once, and with four times the work: a timer that reads a constant would not tell.
static void timers_agree_with_the_clocks(void **state)
{
    (void)state;
    struct work work = make_work();
    void (*const passes[])(const struct work *, uint32_t) = {compute_pass, raster_pass};
    for (size_t i = 0; i < COUNT(passes); i++) {
        const char *name = i ? "raster" : "compute";
        const uint32_t rounds = rounds_for(passes[i], &work, 10);
        const struct times once = least(passes[i], &work, rounds, name);
        const struct times more = least(passes[i], &work, 4 * rounds, name);
        assert_true(more.timer_ms > 1.5 * once.timer_ms);
    }
    destroy_work(&work);
}

// Two raster passes side by side would be one batch, if nothing parted them. The time of each, and
// of all.
static void time_four_passes(const struct work *work, uint32_t compute_rounds,
                             uint32_t raster_rounds, double ms[4], struct times *all)
{
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    const uint64_t start_ns = bd_clock_ns();
    const double before_ms = processors_ms();
    compute_pass(work, compute_rounds);
    raster_pass(work, raster_rounds);
    raster_pass(work, 4 * raster_rounds);
    compute_pass(work, compute_rounds);
    assert_int_equal(bd_gpu_wait(gpu), BD_ERR_OK);
    *all = (struct times){.wall_ms = bd_ms_since(start_ns),
                          .processors_ms = processors_ms() - before_ms};
    struct bd_gpu_pass_time times[8];
    // In two bites: what does not fit stays for the next call.
    assert_int_equal(bd_gpu_take_pass_times(gpu, times, 3), 3);
    assert_int_equal(bd_gpu_take_pass_times(gpu, times + 3, 5), 1);
    for (int i = 0; i < 4; i++) {
        assert_string_equal(times[i].name, i == 1 || i == 2 ? "raster" : "compute");
        ms[i] = times[i].ms;
        all->timer_ms += times[i].ms;
    }
}

static void passes_add_up_to_the_whole(void **state)
{
    (void)state;
    struct work work = make_work();
    const uint32_t compute_rounds = rounds_for(compute_pass, &work, 8);
    const uint32_t raster_rounds = rounds_for(raster_pass, &work, 8);
    double least_ms[4] = {INFINITY, INFINITY, INFINITY, INFINITY};
    bool close = false;
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        double ms[4];
        struct times all;
        time_four_passes(&work, compute_rounds, raster_rounds, ms, &all);
        print_message(
            "raster %.2f and %.2f ms, sum of passes %.2f ms, wall %.2f ms, processors %.2f ms\n",
            ms[1], ms[2], all.timer_ms, all.wall_ms, all.processors_ms);
        assert_true(holds_for(all.timer_ms, &all));
        close = close || is_close(all.timer_ms, &all);
        for (int i = 0; i < 4; i++) least_ms[i] = fmin(least_ms[i], ms[i]);
    }
    assert_true(close);
    // Four times the work, and not nothing beside all of it.
    assert_true(least_ms[2] > 1.5 * least_ms[1] && least_ms[2] < 20 * least_ms[1]);
    destroy_work(&work);
}

// Once with a program that nobody has seen, and once again.
static bool is_compiled_outside(const struct work *work)
{
    struct bd_gpu_pass_time first, second;
    salted = salt();
    const double before_ms = bd_gpu_compile_ms(gpu);
    raster_pass(work, 1);
    assert_int_equal(bd_gpu_take_pass_times(gpu, &first, 1), 1);
    const double compile_ms = bd_gpu_compile_ms(gpu) - before_ms;
    raster_pass(work, 1);
    assert_int_equal(bd_gpu_take_pass_times(gpu, &second, 1), 1);
    print_message("first %.3f ms, second %.3f ms, compile %.3f ms\n", first.ms, second.ms,
                  compile_ms);
    assert_true(compile_ms > 0);
    assert_true(bd_gpu_compile_ms(gpu) - before_ms == compile_ms);
    return first.ms < second.ms + 0.5 * compile_ms + 1.0;
}

// The first run of a program compiles it: that time is `compile`, not the pass. A busy machine may
// keep a pass waiting for as long as that once, not each time.
static void compilation_is_no_part_of_a_pass(void **state)
{
    (void)state;
    struct work work = make_work();
    bool is_outside = false;
    for (int attempt = 0; attempt < ATTEMPTS && !is_outside; attempt++)
        is_outside = is_compiled_outside(&work);
    assert_true(is_outside);
    destroy_work(&work);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(compilation_is_no_part_of_a_pass),
        cmocka_unit_test(timers_agree_with_the_clocks),
        cmocka_unit_test(passes_add_up_to_the_whole),
    };
    gpu_test_open();
    salted = salt();
    return gpu_test_close(cmocka_run_group_tests(tests, NULL, NULL));
}
