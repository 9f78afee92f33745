// What the picture gives back of a clamp (pass/residual.h) against closed forms (algorithms.md D5):
// surfaces that send an even radiance of 1, those that receive none.

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "pass/f3_arrays.h"
#include "pass/residual.h"
#include "view.h"

#define SIDE 256u
// b = 4 / m^2: half a metre around.
#define CLAMP_PER_M2 4.0

// --- what is given back -------------------------------------------------------------------------

struct asked {
    uint32_t levels, iterations;
    float smooth_sr, edge_sr;
    double clamp_per_m2;
    bool printed;
};

static const struct asked usual = {6, 1, 0.02f, 0.02f, CLAMP_PER_M2, false};

static struct bd_tex *even_texture(const struct view *view, float value)
{
    const struct bd_tex_desc desc = {.name = "even light",
                                     .format = BD_FORMAT_RGBA32F,
                                     .width_px = view->viewpoint.width_px,
                                     .height_px = view->viewpoint.height_px};
    struct bd_err_detail detail = {0};
    struct bd_tex *tex;
    if (bd_tex_create(view->world->gpu, &desc, &tex, &detail)) fail_msg("%s", detail.message);
    bd_tex_clear(view->world->gpu, tex, (const float[4]){value, value, value, 1});
    return tex;
}

static struct bd_residual_inputs inputs_of(const struct view *view, const struct asked *asked)
{
    const double per_m = view->scene->space.render_per_m;
    return (struct bd_residual_inputs){
        .clamp = (float)(asked->clamp_per_m2 / (per_m * per_m)),
        .iterations = asked->iterations,
        .smooth_sr = asked->smooth_sr,
        .edge_sr = asked->edge_sr,
    };
}

// Irradiance of each pixel, where every surface got pi: four floats each, the caller's.
static float *given_by(struct view *view, const struct asked *asked, bool on_device, double *looked)
{
    struct bd_gpu *gpu = view->world->gpu;
    const size_t bytes = (size_t)view->viewpoint.width_px * view->viewpoint.height_px * 16;
    const struct bd_gather_inputs gather = {
        .scene = view->scene, .viewpoint = &view->viewpoint, .gbuffer = view->gbuffer};
    struct bd_tex *direct = even_texture(view, (float)M_PI);
    struct bd_indirect indirect = {.irradiance = even_texture(view, 0)};
    struct bd_pool *pool = bd_pool_create(0);
    const struct bd_processor processor = {pool, bd_native_loops()};
    struct bd_pass_context context = view->context;
    struct bd_residual_inputs inputs = inputs_of(view, asked);
    struct bd_err_detail detail = {0};
    float *rgba = malloc(bytes);
    assert_non_null(rgba);
    if (!on_device) context.processor = &processor;
    const struct bd_screen_inputs screen = {.gather = &gather,
                                            .pool = pool,
                                            .lambert = true,
                                            .printed = asked->printed,
                                            .levels = asked->levels};
    if (bd_screen_create(&context, &screen, &inputs.screen, &detail))
        fail_msg("screen: %s", detail.message);
    inputs.pool = pool;
    inputs.direct = direct;
    if (bd_residual_run(&context, &inputs, &indirect, &detail))
        fail_msg("residual: %s", detail.message);
    view_read(view, indirect.irradiance, rgba, bytes);
    *looked = (double)indirect.screen_parts / ((double)bytes / 16 * asked->iterations);
    bd_tex_destroy(gpu, &direct);
    bd_tex_destroy(gpu, &indirect.irradiance);
    bd_screen_destroy(&inputs.screen);
    bd_pool_destroy(&pool);
    return rgba;
}

// The processor's; the device's is the same, but for rounding and what that decides.
static float *give_back(struct view *view, const struct asked *asked, double *looked)
{
    double looked_by_device, squares = 0, sum = 0;
    float *device = given_by(view, asked, true, &looked_by_device);
    float *native = given_by(view, asked, false, looked);
    const size_t pixels = (size_t)view->viewpoint.width_px * view->viewpoint.height_px;
    for (size_t i = 0; i < pixels; i++) {
        const double off = device[4 * i] - native[4 * i];
        assert_true(fabs(off) <= 1e-3 * (native[4 * i] + .01));
        squares += off * off;
        sum += native[4 * i];
    }
    print_message("    levels %u, %.1f parts a pixel, by the device %.1f, %.1e of the mean off\n",
                  asked->levels, *looked, looked_by_device,
                  sqrt(squares * (double)pixels) / fmax(sum, 1e-30));
    assert_true(sqrt(squares * (double)pixels) <= 1e-4 * sum);
    assert_true(fabs(looked_by_device - *looked) <= 1e-3 * *looked);
    free(device);
    return native;
}

// Where the ray through a pixel's middle meets the plane on which a coordinate is `at`; false if
// that is behind the viewer.
static bool meet(const struct bd_viewpoint *v, uint32_t x, uint32_t y, int axis, double at,
                 double place[3])
{
    const double across = v->half_width * (2 * (x + .5) / v->width_px - 1);
    const double up = v->half_height * (1 - 2 * (y + .5) / v->height_px);
    const double sides = v->orthographic ? 0 : 1, shift = v->orthographic ? 1 : 0;
    const double side[3] = {v->axis_x.x * across + v->axis_y.x * up,
                            v->axis_x.y * across + v->axis_y.y * up,
                            v->axis_x.z * across + v->axis_y.z * up};
    const double d[3] = {side[0] * sides - v->axis_z.x, side[1] * sides - v->axis_z.y,
                         side[2] * sides - v->axis_z.z};
    const double from[3] = {v->position_m.x + shift * side[0], v->position_m.y + shift * side[1],
                            v->position_m.z + shift * side[2]};
    const double t = (at - from[axis]) / d[axis];
    for (int c = 0; c < 3; c++) place[c] = from[c] + t * d[c];
    return t > 0;
}

// Of pixels that see the floor, y = 0, near enough to a place to be judged.
struct found {
    double mean, expected, worst;
    uint32_t count;
};

typedef bool judge_fn(const double at[3], double wanted, double *expected);

static struct found judge(const struct view *view, const float *got, judge_fn *judges,
                          double wanted)
{
    const struct bd_viewpoint *v = &view->viewpoint;
    struct found found = {0};
    for (uint32_t y = 0; y < v->height_px; y++)
        for (uint32_t x = 0; x < v->width_px && found.count < 12; x++) {
            double at[3], expected;
            if (!meet(v, x, y, 1, 0, at) || !judges(at, wanted, &expected)) continue;
            const double value = got[4 * ((size_t)y * v->width_px + x)] / M_PI;
            found.mean += value;
            found.expected += expected;
            found.worst = fmax(found.worst, fabs(value / expected - 1));
            found.count++;
        }
    return found;
}

static void check(const struct view *view, const float *got, judge_fn *judges, double wanted,
                  double most)
{
    const struct found found = judge(view, got, judges, wanted);
    print_message("    u %.2f: %.4f of %.4f (%+.2f %%, worst pixel %.2f %%)\n", wanted,
                  found.mean / found.count, found.expected / found.count,
                  100 * (found.mean / found.expected - 1), 100 * found.worst);
    assert_true(found.count > 0 && fabs(found.mean / found.expected - 1) < most);
}

// --- the perpendicular wall ---------------------------------------------------------------------

// Residual of an infinite wall that sends 1, as a part of pi, at the distance u = d sqrt(b).
static double wall_residual(double u)
{
    const int steps = 600;
    double sum = 0;
    for (int i = 0; i < steps; i++) // height over the floor, b = 1
        for (int j = 0; j < steps; j++) {
            const double h = (i + .5) / steps, z = (j + .5) / steps;
            const double r2 = u * u + h * h + z * z;
            sum += fmax(h * u / (r2 * r2) - 1, 0) * 2 / ((double)steps * steps);
        }
    return sum / M_PI;
}

static bool judges_wall(const double at[3], double wanted, double *expected)
{
    const double u = at[0] * sqrt(CLAMP_PER_M2);
    if (at[0] <= 0 || fabs(at[2]) > .1 || fabs(u - wanted) > .006) return false;
    *expected = wall_residual(u);
    return true;
}

// A floor that sends nothing at y = 0 and a wall that does at x = 0, seen from between them.
static void make_wall(struct world *w, double turn, bool orthographic)
{
    const double floor[4][3] = {{0, 0, 3}, {4, 0, 3}, {4, 0, -3}, {0, 0, -3}};
    const double wall[4][3] = {{0, 0, 3}, {0, 0, -3}, {0, 4, -3}, {0, 4, 3}};
    const double eye[3] = {1.6 * cos(turn), 1.6 * sin(turn), .3}, target[3] = {.2, .2, 0};
    world_clear(w);
    world_add_quad(w, world_add_material(w, 0), floor, 1);
    world_add_quad(w, world_add_material(w, 1), wall, 1);
    world_add_camera(w, eye, target, 1.2);
    if (orthographic) {
        struct bd_camera *camera = &w->scene->cameras[w->scene->camera_count - 1];
        camera->orthographic = true;
        camera->xmag = camera->ymag = 1;
        camera->near_m = .01f;
        camera->far_m = 10;
    }
}

static struct view look(struct world *w)
{
    struct view view = view_open(w);
    view_look(&view, 0, SIDE, SIDE, true);
    return view;
}

static struct view open_wall(struct world *w, double turn, bool orthographic)
{
    make_wall(w, turn, orthographic);
    return look(w);
}

static const double distances[] = {.02, .06, .1, .2, .3, .4};

static void check_wall(struct view *view, const struct asked *asked, double most)
{
    double looked;
    float *got = give_back(view, asked, &looked);
    for (size_t k = 0; k < sizeof distances / sizeof *distances; k++)
        check(view, got, judges_wall, distances[k], most);
    free(got);
}

static void a_wall_gives_back_what_is_near(void **state)
{
    for (int turn = 3; turn <= 5; turn += 2) { // 4 has its levels judged below
        struct view view = open_wall(*state, M_PI / 16 * turn, false);
        check_wall(&view, &usual, .02);
        view_close(&view);
    }
    struct view view = open_wall(*state, M_PI / 4, true);
    check_wall(&view, &usual, .02);
    view_close(&view);
}

// Parts of many pixels are for speed: pixel by pixel it is the same.
static void levels_leave_out_pixels_and_no_light(void **state)
{
    struct view view = open_wall(*state, M_PI / 4, false);
    struct asked one_level = usual;
    double all, few;
    one_level.levels = 1;
    float *of_pixels = given_by(&view, &one_level, false, &all);
    float *of_parts = given_by(&view, &usual, false, &few);
    print_message("    %.0f pixels, %.0f parts\n", all, few);
    assert_true(all > 20 * few);
    for (size_t k = 0; k < sizeof distances / sizeof *distances; k++) {
        check(&view, of_pixels, judges_wall, distances[k], .01);
        check(&view, of_parts, judges_wall, distances[k], .02);
    }
    free(of_pixels);
    free(of_parts);
    view_close(&view);
}

// --- the parallel plane -------------------------------------------------------------------------

#define CEILING_M 0.2

static bool judges_floor(const double at[3], double wanted, double *expected)
{
    const double u = CEILING_M * sqrt(CLAMP_PER_M2);
    *expected = (1 - u) * (1 - u);
    return fabs(at[0] - wanted) < .02 && fabs(at[2]) < .1;
}

// A floor that sends nothing under a ceiling that does, seen from between them.
static void a_ceiling_gives_back_what_is_near(void **state)
{
    struct world *w = *state;
    const double floor[4][3] = {{-2, 0, 3}, {4, 0, 3}, {4, 0, -3}, {-2, 0, -3}};
    const double ceiling[4][3] = {
        {-2, CEILING_M, -3}, {4, CEILING_M, -3}, {4, CEILING_M, 3}, {-2, CEILING_M, 3}};
    world_clear(w);
    world_add_quad(w, world_add_material(w, 0), floor, 1);
    world_add_quad(w, world_add_material(w, 1), ceiling, 1);
    world_add_camera(w, (const double[]){-.1, CEILING_M / 2, 0},
                     (const double[]){1, CEILING_M / 2, 0}, 2.7);
    struct view view = view_open(w);
    double looked;
    view_look(&view, 0, 3 * SIDE / 2, 3 * SIDE / 2, true);
    float *got = give_back(&view, &usual, &looked);
    check(&view, got, judges_floor, .3, .03);
    free(got);
    view_close(&view);
}

// --- iterations
// -----------------------------------------------------------------------------------

#define HIGH_M 0.3
#define WHITE  0.8

static double given_after(struct view *view, uint32_t iterations)
{
    struct asked asked = usual;
    double looked;
    asked.iterations = iterations;
    float *got = given_by(view, &asked, false, &looked);
    const struct found found = judge(view, got, judges_floor, .3);
    free(got);
    return found.mean / found.count;
}

// Between two planes that both send, each iteration gives q = rho (1 - u)^2 of the one before.
static void iterations_go_as_powers(void **state)
{
    struct world *w = *state;
    const double floor[4][3] = {{-2, 0, 3}, {4, 0, 3}, {4, 0, -3}, {-2, 0, -3}};
    const double ceiling[4][3] = {
        {-2, HIGH_M, -3}, {4, HIGH_M, -3}, {4, HIGH_M, 3}, {-2, HIGH_M, 3}};
    world_clear(w);
    const int32_t white = world_add_material(w, WHITE);
    world_add_quad(w, white, floor, 1);
    world_add_quad(w, white, ceiling, 1);
    world_add_camera(w, (const double[]){-.1, HIGH_M / 2, 0}, (const double[]){1, HIGH_M / 2, 0},
                     2.7);
    struct view view = view_open(w);
    view_look(&view, 0, 2 * SIDE, 2 * SIDE, true);
    const double u = HIGH_M * sqrt(CLAMP_PER_M2), q = WHITE * (1 - u) * (1 - u);
    double before = 0, expected = 1;
    for (uint32_t n = 1; n <= 3; n++) {
        const double sum = given_after(&view, n), own = sum - before;
        expected *= q;
        print_message("    iteration %u: %.5f of %.5f\n", n, own, expected);
        ASSERT_REL(own, expected, .02 * n);
        before = sum;
    }
    view_close(&view);
}

// --- levels ---------------------------------------------------------------------------------------

// Area, power and first moment of what a level sends.
struct sums {
    double area, power, moment;
};

static struct sums sums_of(const struct bd_screen *screen, uint32_t level)
{
    const struct bd_uvec4 *l = &screen->levels[level];
    struct sums sums = {0};
    for (size_t i = l->z; i < l->z + (size_t)l->x * l->y; i++) {
        const struct bd_screen_part *part = &screen->parts[i];
        const double area = part->middle_area.w;
        sums.area += area;
        sums.power += area * part->radiance_thickness.x;
        sums.moment += area * part->middle_area.x;
    }
    return sums;
}

static enum bd_err shine_by_place(const struct bd_pass_context *context, struct bd_screen *screen)
{
    const size_t pixels = (size_t)screen->width_px * screen->height_px;
    float *irradiance = malloc(pixels * 3 * sizeof *irradiance);
    assert_non_null(irradiance);
    for (size_t i = 0; i < 3 * pixels; i++) irradiance[i] = 1 + (float)(i / 3 % 97);
    const enum bd_err err = bd_screen_shine(context, screen, irradiance);
    free(irradiance);
    return err;
}

// By the processor. With its pool, which is the caller's.
static struct bd_screen *screen_of(struct view *view, struct bd_pool *pool)
{
    const struct bd_gather_inputs gather = {
        .scene = view->scene, .viewpoint = &view->viewpoint, .gbuffer = view->gbuffer};
    const struct bd_processor processor = {pool, bd_native_loops()};
    struct bd_pass_context context = view->context;
    struct bd_err_detail detail = {0};
    struct bd_screen *screen;
    context.processor = &processor;
    const struct bd_screen_inputs inputs = {
        .gather = &gather, .pool = pool, .lambert = true, .levels = BD_SCREEN_LEVELS_MAX};
    if (bd_screen_create(&context, &inputs, &screen, &detail)) fail_msg("%s", detail.message);
    assert_int_equal(shine_by_place(&context, screen), BD_ERR_OK);
    return screen;
}

// Of a picture of odd sides, part of which shows nothing: what each level sends is what its pixels
// send, however areas differ.
static void levels_keep_area_and_power(void **state)
{
    struct view view = open_wall(*state, M_PI / 5, false);
    struct bd_pool *pool = bd_pool_create(0);
    bd_gbuffer_destroy(view.world->gpu, &view.gbuffer);
    view_look(&view, 0, 123, 77, true);
    struct bd_screen *screen = screen_of(&view, pool);
    const struct sums finest = sums_of(screen, 0);
    assert_int_equal(screen->level_count, 8); // to a single part
    for (uint32_t level = 1; level < screen->level_count; level++) {
        const struct sums sums = sums_of(screen, level);
        ASSERT_REL(sums.area, finest.area, 1e-5);
        ASSERT_REL(sums.power, finest.power, 1e-5);
        ASSERT_REL(sums.moment, finest.moment, 1e-4);
    }
    bd_screen_destroy(&screen);
    bd_pool_destroy(&pool);
    view_close(&view);
}

// --- what is about a place ----------------------------------------------------------------------

#define CARD_M   .35 // above the floor
#define RADIUS_M .2
#define STEP_M   .04
#define CREASE_M .01 // so near to it a pixel may be either's

// Over the floor beside a wall, a card that hides part of both from the camera.
static struct view wall_and_card(struct world *w)
{
    const double card[4][3] = {
        {.5, CARD_M, .25}, {.9, CARD_M, .25}, {.9, CARD_M, -.25}, {.5, CARD_M, -.25}};
    make_wall(w, M_PI / 4, false);
    const int32_t two_sided = world_add_material(w, 1);
    w->scene->materials[two_sided].double_sided = true;
    world_add_quad(w, two_sided, card, 1);
    return look(w);
}

// Whether a pixel where the place may be seen is of its surface, and as near to it as pixels are.
static bool shows(const struct bd_screen *screen, f3 place, f3 normal)
{
    uint32_t bounds[4];
    bd_screen_bounds(screen, place, 1e-6f, bounds);
    for (uint32_t y = bounds[2]; y < bounds[3]; y++)
        for (uint32_t x = bounds[0]; x < bounds[1]; x++) {
            const size_t pixel = (size_t)y * screen->width_px + x;
            const f3 off = f3_sub(place, f3_from(&screen->parts[pixel].middle_area));
            const struct bd_vec4 *own = &screen->parts[pixel].normal_radius;
            if (screen->receivers[pixel].place_lit.w > 0 && f3_dot(f3_from(own), normal) > .9f &&
                f3_length(off) < 4 * own->w)
                return true;
        }
    return false;
}

static bool is_near(const double a[3], const double b[3])
{
    return hypot(hypot(a[0] - b[0], a[1] - b[1]), a[2] - b[2]) < RADIUS_M;
}

// Whether the screen has every place of the floor, the wall and the card's lower side that is so
// near, a few of them looked at.
static bool has_all_about(const struct view *view, const struct bd_screen *screen,
                          const double at[3])
{
    const float per_m = (float)view->scene->space.render_per_m;
    const bd_dvec3 origin = view->scene->space.origin_m;
    const f3 normals[3] = {{0, 1, 0}, {1, 0, 0}, {0, -1, 0}};
    for (double u = -RADIUS_M; u <= RADIUS_M; u += STEP_M)
        for (double v = -RADIUS_M; v <= RADIUS_M; v += STEP_M) {
            const double places[3][3] = {{at[0] + u, 0, at[2] + v},
                                         {0, at[1] + u, at[2] + v},
                                         {at[0] + u, CARD_M, at[2] + v}};
            for (int i = 0; i < 3; i++) {
                const double *p = places[i];
                const bool is_card = p[0] > .5 && p[0] < .9 && fabs(p[2]) < .25;
                if (!is_near(p, at) || p[i == 1] < CREASE_M || (i == 2 && !is_card)) continue;
                const f3 place = {(float)(p[0] - origin.x) * per_m,
                                  (float)(p[1] - origin.y) * per_m,
                                  (float)(p[2] - origin.z) * per_m};
                if (!shows(screen, place, normals[i])) return false;
            }
        }
    return true;
}

// Who is told that the screen has all that is near can rely on it; and many are.
static void the_screen_knows_what_it_holds(void **state)
{
    struct view view = wall_and_card(*state);
    struct bd_pool *pool = bd_pool_create(0);
    struct bd_screen *screen = screen_of(&view, pool);
    const float radius = (float)(RADIUS_M * view.scene->space.render_per_m);
    uint32_t told = 0, right = 0, had = 0;
    for (uint32_t i = 0; i < SIDE * SIDE; i += 13) {
        const f3 place = f3_from(&screen->receivers[i].place_lit);
        const bd_dvec3 origin = view.scene->space.origin_m;
        const double per_m = view.scene->space.render_per_m;
        const double at[3] = {place.x / per_m + origin.x, place.y / per_m + origin.y,
                              place.z / per_m + origin.z};
        if (screen->receivers[i].place_lit.w == 0) continue;
        const bool has_all = has_all_about(&view, screen, at);
        const bool is_told = bd_screen_holds_about(screen, place, radius);
        told += is_told;
        had += has_all;
        right += is_told && has_all;
    }
    print_message("    %u of %u are told, %u of them rightly\n", told, had, right);
    assert_true(right == told && told > had / 3);
    bd_screen_destroy(&screen);
    bd_pool_destroy(&pool);
    view_close(&view);
}

// --- as printed ---------------------------------------------------------------------------------

// What was mended shows beside a wall: parts that span the edge are judged by their middles, which
// lie below a horizon, and all that they hold is lost.
static void the_printed_form_is_further_off(void **state)
{
    struct view view = open_wall(*state, M_PI / 4, false);
    struct asked printed = usual;
    double looked, off = 0, own_off = 0;
    printed.printed = true;
    printed.smooth_sr = .08f;
    printed.edge_sr = .04f;
    float *as_printed = give_back(&view, &printed, &looked),
          *own = give_back(&view, &usual, &looked);
    for (size_t k = 0; k < sizeof distances / sizeof *distances; k++) {
        const struct found of_print = judge(&view, as_printed, judges_wall, distances[k]);
        const struct found of_own = judge(&view, own, judges_wall, distances[k]);
        print_message("    u %.2f: %+.2f %%, here %+.2f %%\n", distances[k],
                      100 * (of_print.mean / of_print.expected - 1),
                      100 * (of_own.mean / of_own.expected - 1));
        off = fmax(off, fabs(of_print.mean / of_print.expected - 1));
        own_off = fmax(own_off, fabs(of_own.mean / of_own.expected - 1));
    }
    assert_true(off > .2 && own_off < .02);
    free(as_printed);
    free(own);
    view_close(&view);
}

// --- energy -------------------------------------------------------------------------------------

// Fins behind one another hide each other from the wall: what all of them send there together is
// not more than a hemisphere sends.
static void no_energy_is_made(void **state)
{
    struct world *w = *state;
    world_clear(w);
    const int32_t own = world_add_material(w, 1);
    w->scene->materials[own].double_sided = true;
    for (int i = 0; i < 40; i++) { // fins that face a wall behind them and the viewer
        const double x = -.8 + .04 * i;
        const double fin[4][3] = {{x, 0, 0}, {x + .02, 0, .25}, {x + .02, 1, .25}, {x, 1, 0}};
        world_add_quad(w, own, fin, 1);
    }
    const double wall[4][3] = {{-1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {-1, 1, 0}};
    world_add_quad(w, own, wall, 1);
    world_add_camera(w, (const double[]){0, .5, 1.4}, (const double[]){0, .5, 0}, .8);
    struct view view = view_open(w);
    struct asked wide = usual;
    double looked, most = 0;
    wide.clamp_per_m2 = 1;
    view_look(&view, 0, SIDE, SIDE, true);
    float *got = give_back(&view, &wide, &looked);
    for (size_t i = 0; i < SIDE * SIDE; i++) most = fmax(most, got[4 * i]);
    print_message("    at most %.4f of a hemisphere\n", most / M_PI);
    assert_true(most > .05 * M_PI && most <= M_PI * 1.0001);
    free(got);
    view_close(&view);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_wall_gives_back_what_is_near),
        cmocka_unit_test(levels_leave_out_pixels_and_no_light),
        cmocka_unit_test(a_ceiling_gives_back_what_is_near),
        cmocka_unit_test(iterations_go_as_powers),
        cmocka_unit_test(levels_keep_area_and_power),
        cmocka_unit_test(the_screen_knows_what_it_holds),
        cmocka_unit_test(the_printed_form_is_further_off),
        cmocka_unit_test(no_energy_is_made),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
