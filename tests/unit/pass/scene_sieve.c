// Triangles that the sieve drops cover no sample: corners as a shader works them out, on a grid of
// a 256th of a pixel, against every sample of the picture.

#include <math.h>
#include <stdlib.h>

#include "pass/scene_sieve.h"
#include "tests/unit/cmocka_all.h"

#define VIEWS     300
#define TRIANGLES 300u // more than a batch, and no multiple of one
#define WIDTH_PX  24u
#define HEIGHT_PX 17u
#define GRID      256.0

static uint64_t state_of_random;

static double uniform(double low, double high)
{
    state_of_random =
        state_of_random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(state_of_random >> 33) / 0x1p31;
}

struct stage {
    struct bd_viewpoint viewpoint;
    struct bd_render_space space;
    float rows[12];
    struct bd_box box;
    float position[9 * TRIANGLES];
    uint32_t index[3 * TRIANGLES];
};

static void set_view(struct stage *s, bool orthographic, double offset)
{
    s->space = (struct bd_render_space){.render_per_m = 0.5};
    s->viewpoint = (struct bd_viewpoint){
        .orthographic = orthographic,
        .half_width = uniform(0.3, 2),
        .half_height = uniform(0.3, 2),
        .near_m = orthographic ? 0 : uniform(1e-3, 1),
        .far_m = 12,
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .sample_x_px = uniform(0, 1),
        .sample_y_px = uniform(0, 1),
    };
    for (int i = 0; i < 12; i++) s->rows[i] = (float)uniform(-1, 1);
    s->rows[11] -= 1; // more before it than behind
    for (int i = 0; i < 12; i++)
        if (i % 4 < 3) s->rows[i / 4 * 4 + 3] -= (float)(s->rows[i] * offset);
}

// Of the size of a pixel, now and then of several.
static void set_triangles(struct stage *s, double offset)
{
    s->box = (struct bd_box){{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};
    for (uint32_t t = 0; t < TRIANGLES; t++) {
        double centre[3], size = pow(10, uniform(-3, 0));
        for (int c = 0; c < 3; c++) centre[c] = uniform(-1.5, 1.5);
        for (uint32_t k = 3 * t; k < 3 * t + 3; k++) {
            s->index[k] = 3 * TRIANGLES - 1 - k; // not in order
            float *p = s->position + 3 * (size_t)s->index[k];
            for (int c = 0; c < 3; c++) {
                p[c] = (float)(offset + centre[c] + size * uniform(-1, 1));
                s->box.min[c] = fminf(s->box.min[c], p[c]);
                s->box.max[c] = fmaxf(s->box.max[c], p[c]);
            }
        }
    }
}

// As pass/gbuffer/scene.vert and GL have it, samples at whole numbers; returns the depth.
static float place_of(const struct stage *s, const float *p, double at_px[2])
{
    const struct bd_viewpoint *v = &s->viewpoint;
    const float scale = v->orthographic ? (float)s->space.render_per_m : 1;
    float at[3];
    for (int r = 0; r < 3; r++) {
        const float *row = s->rows + (size_t)4 * r;
        at[r] = row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
    }
    float w = v->orthographic ? 1 : -at[2];
    float shift_x = (0.5f - (float)v->sample_x_px) * 2 / WIDTH_PX;
    float shift_y = (0.5f - (float)v->sample_y_px) * -2 / HEIGHT_PX;
    float x = (at[0] / ((float)v->half_width * scale) + shift_x * w) / w;
    float y = (at[1] / ((float)v->half_height * scale) + shift_y * w) / w;
    at_px[0] = round(((x * 0.5 + 0.5) * WIDTH_PX - 0.5) * GRID);
    at_px[1] = round(((0.5 - y * 0.5) * HEIGHT_PX - 0.5) * GRID);
    return w;
}

// With its border. The numbers are whole; a triangle without area covers nothing.
static bool covers(double at[3][2], double x, double y)
{
    double area = (at[1][0] - at[0][0]) * (at[2][1] - at[0][1]) -
                  (at[1][1] - at[0][1]) * (at[2][0] - at[0][0]);
    if (area == 0) return false;
    int positive = 0, negative = 0;
    for (int k = 0; k < 3; k++) {
        const double *a = at[k], *b = at[(k + 1) % 3];
        double side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
        positive += side > 0, negative += side < 0;
    }
    return positive == 0 || negative == 0;
}

static bool covers_a_sample(double at[3][2])
{
    for (uint32_t y = 0; y < HEIGHT_PX; y++)
        for (uint32_t x = 0; x < WIDTH_PX; x++)
            if (covers(at, x * GRID, y * GRID)) return true;
    return false;
}

// Whether the triangle must be kept.
static bool is_needed(const struct stage *s, uint32_t t)
{
    double at[3][2];
    int before = 0;
    for (int k = 0; k < 3; k++) {
        const float *p = s->position + 3 * (size_t)s->index[3 * t + k];
        float depth = place_of(s, p, at[k]);
        before += depth >= (float)(s->viewpoint.near_m * s->space.render_per_m);
    }
    return before == 3 ? covers_a_sample(at) : before > 0;
}

struct sums {
    uint32_t needed, kept;
};

static void check_view(struct stage *s, struct sums *sums)
{
    static uint32_t kept_index[3 * TRIANGLES];
    static float kept_number[TRIANGLES];
    const uint32_t first = 5;
    struct bd_sieve sieve = bd_sieve_of(&s->viewpoint, &s->space, s->rows, &s->box);
    uint32_t kept = bd_sieve_triangles(&sieve, s->position, s->index, first, TRIANGLES - first,
                                       kept_index, kept_number);
    uint32_t next = 0;
    for (uint32_t t = first; t < TRIANGLES; t++) {
        const bool is_kept = next < kept && kept_number[next] == (float)t;
        const bool needed = is_needed(s, t);
        if (needed) assert_true(is_kept);
        sums->needed += needed;
        if (!is_kept) continue;
        assert_memory_equal(kept_index + 3 * (size_t)next, s->index + 3 * (size_t)t,
                            3 * sizeof *kept_index);
        next++;
    }
    assert_int_equal(next, kept);
    sums->kept += kept;
}

static struct sums check_views(bool orthographic, double offset)
{
    static struct stage stage;
    struct sums sums = {0};
    for (int i = 0; i < VIEWS; i++) {
        set_view(&stage, orthographic, offset);
        set_triangles(&stage, offset);
        check_view(&stage, &sums);
    }
    return sums;
}

static void a_camera(void **state)
{
    (void)state;
    state_of_random = 1;
    struct sums sums = check_views(false, 0);
    assert_true(sums.kept < 2 * sums.needed);
    assert_true(sums.needed < 0.5 * VIEWS * TRIANGLES);
}

static void a_light_of_parallel_rays(void **state)
{
    (void)state;
    state_of_random = 2;
    struct sums sums = check_views(true, 0);
    assert_true(sums.kept < 2 * sums.needed);
    assert_true(sums.needed < 0.5 * VIEWS * TRIANGLES);
}

static void a_mesh_far_from_its_own_origin(void **state)
{
    (void)state;
    state_of_random = 3;
    check_views(false, 1e3);
    check_views(true, 1e5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_camera),
        cmocka_unit_test(a_light_of_parallel_rays),
        cmocka_unit_test(a_mesh_far_from_its_own_origin),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
