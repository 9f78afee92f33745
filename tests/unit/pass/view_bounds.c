// What a viewpoint is said not to see has no point in its picture, as a shader works it out.

#include <math.h>

#include "tests/unit/cmocka_all.h"
#include "upload/view_bounds.h"

#define CASES   4000
#define POINTS  200
#define SIDE_PX 64u

static uint64_t state_of_random;

static double uniform(double low, double high)
{
    state_of_random =
        state_of_random * UINT64_C(6364136223846793005) + UINT64_C(1442695040888963407);
    return low + (high - low) * (double)(state_of_random >> 33) / 0x1p31;
}

static const struct bd_render_space space = {.render_per_m = 0.25};

static struct bd_viewpoint some_viewpoint(bool orthographic)
{
    return (struct bd_viewpoint){
        .orthographic = orthographic,
        .half_width = uniform(0.1, 2),
        .half_height = uniform(0.1, 2),
        .near_m = orthographic ? 0 : uniform(1e-4, 1),
        .far_m = 12,
        .width_px = SIDE_PX,
        .height_px = SIDE_PX,
        .sample_x_px = uniform(0, 1),
        .sample_y_px = uniform(0, 1),
    };
}

// Any matrix, and an origin of its own that may be far off.
static void set_rows(float rows[12], double offset)
{
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) rows[4 * r + c] = (float)uniform(-1, 1);
        rows[4 * r + 3] = (float)uniform(-3, 3);
        for (int c = 0; c < 3; c++) rows[4 * r + 3] -= (float)(rows[4 * r + c] * offset);
    }
}

static struct bd_box some_box(double offset)
{
    struct bd_box box;
    double size = pow(10, uniform(-3, 0.5));
    for (int c = 0; c < 3; c++) {
        box.min[c] = (float)(offset + uniform(-2, 2));
        box.max[c] = box.min[c] + (float)(size * uniform(0, 1));
    }
    return box;
}

// clip_from_view of pass/gbuffer/scene.vert, and GL's clip volume.
static bool is_in_picture(const struct bd_viewpoint *v, const float rows[12], const float p[3])
{
    float at[3], clip[4];
    for (int r = 0; r < 3; r++)
        at[r] =
            rows[4 * r] * p[0] + rows[4 * r + 1] * p[1] + rows[4 * r + 2] * p[2] + rows[4 * r + 3];
    const float scale = v->orthographic ? (float)space.render_per_m : 1;
    const float near = (float)(v->near_m * space.render_per_m);
    const float far = (float)(v->far_m * space.render_per_m);
    clip[3] = v->orthographic ? 1 : -at[2];
    clip[2] = v->orthographic ? (far + at[2]) / (far - near) : near;
    clip[0] = at[0] / ((float)v->half_width * scale) +
              (float)((0.5 - v->sample_x_px) * 2 / SIDE_PX) * clip[3];
    clip[1] = at[1] / ((float)v->half_height * scale) -
              (float)((0.5 - v->sample_y_px) * 2 / SIDE_PX) * clip[3];
    return fabsf(clip[0]) <= clip[3] && fabsf(clip[1]) <= clip[3] && clip[2] >= 0 &&
           clip[2] <= clip[3];
}

static uint32_t points_seen(const struct bd_viewpoint *v, const float rows[12],
                            const struct bd_box *box)
{
    uint32_t seen = 0;
    for (int i = 0; i < POINTS; i++) {
        float p[3];
        for (int c = 0; c < 3; c++) p[c] = (float)uniform(box->min[c], box->max[c]);
        seen += is_in_picture(v, rows, p);
    }
    return seen;
}

static void check_views(bool orthographic, double offset)
{
    uint32_t count[3] = {0}, in_vain = 0, all_but_some = 0;
    for (int i = 0; i < CASES; i++) {
        const struct bd_viewpoint v = some_viewpoint(orthographic);
        const struct bd_view_bounds of_view = bd_view_bounds_of(&v, &space);
        float rows[12];
        set_rows(rows, offset);
        const struct bd_box box = some_box(offset);
        const struct bd_view_bounds bounds = bd_view_bounds_in_mesh(&of_view, rows, &box);
        enum bd_view_share share = bd_view_bounds_share(&bounds, &box);
        uint32_t seen = points_seen(&v, rows, &box);
        if (share == BD_VIEW_NONE) assert_int_equal(seen, 0);
        count[share]++;
        in_vain += share != BD_VIEW_NONE && seen == 0;
        all_but_some += share == BD_VIEW_ALL && seen < POINTS;
    }
    // That it tells them apart at all: most of what is not seen is known not to be.
    assert_true(count[BD_VIEW_NONE] > CASES / 8);
    if (offset != 0) return;
    assert_true(count[BD_VIEW_NONE] > CASES / 4);
    assert_true(count[BD_VIEW_ALL] > CASES / 400);
    assert_true(in_vain < CASES / 10);
    assert_true(all_but_some < CASES / 40); // in the padding
}

static void a_camera(void **state)
{
    (void)state;
    state_of_random = 1;
    check_views(false, 0);
}

static void a_light_of_parallel_rays(void **state)
{
    (void)state;
    state_of_random = 2;
    check_views(true, 0);
}

// Where a shader's sums cancel, its pixels may be anywhere near.
static void a_mesh_far_from_its_own_origin(void **state)
{
    (void)state;
    state_of_random = 3;
    check_views(false, 1e6);
}

// Of coordinates that are no numbers nothing is known.
static void no_numbers(void **state)
{
    (void)state;
    state_of_random = 4;
    const struct bd_viewpoint v = some_viewpoint(false);
    const struct bd_view_bounds of_view = bd_view_bounds_of(&v, &space);
    const struct bd_box box = {{-1, -1, -1}, {1, 1, 1}};
    float rows[12];
    for (int i = 0; i < 12; i++) rows[i] = NAN;
    const struct bd_view_bounds bounds = bd_view_bounds_in_mesh(&of_view, rows, &box);
    assert_int_equal(bd_view_bounds_share(&bounds, &box), BD_VIEW_SOME);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_camera),
        cmocka_unit_test(a_light_of_parallel_rays),
        cmocka_unit_test(a_mesh_far_from_its_own_origin),
        cmocka_unit_test(no_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
