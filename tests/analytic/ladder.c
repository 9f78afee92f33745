// Every technique's ladder, climbed from its foot: no rung costs more than six times the one
// before.
//
// What a rung costs is worked out, not timed: evaluations of a VPL, from the numbers that frames
// report. Blocks are counted with few VPLs and photons, since they hardly depend on how many there
// are; VPLs of a light's blocks in a picture of a pixel. Of a tree's cuts nothing is reported:
// there the processor's time is taken.

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <cmocka.h>

#include "frame/ladder.h"
#include "technique/technique.h"
#include "world.h"

#define COST_RATIO_MAX 6.0
// What every frame costs whatever it is made with, in evaluations of a VPL for each pixel:
// G-buffer, direct light and composite.
#define COST_OF_A_PIXEL 200.0

static const double origin[3] = {0, 0, 0}, down[3] = {0, -1, 0};

// Flat walls, so that most of a picture is few blocks: there a rung that splits them costs the
// most.
static void make_room(struct world *w)
{
    world_clear(w);
    int32_t grey = world_add_material(w, 0.5f);
    world_add_box_room(w, grey, origin, 1);
    for (int i = 0; i < 3; i++) {
        const double x = -.6 + .45 * i, z = -.4 + .2 * i;
        const double wall[4][3] = {
            {x, -1, z}, {x + .3, -1, z - .1}, {x + .3, .2, z - .1}, {x, .2, z}};
        world_add_quad(w, grey, wall, 4);
    }
    const double lamp[3] = {.3, .5, .2}, eye[3] = {.5, .2, .7};
    world_add_light(w, BD_LIGHT_POINT, lamp, down, 1);
    world_add_camera(w, eye, origin, 1.0);
    world_finish(w);
}

static void set(struct bd_param_list *list, const char *key, const char *value)
{
    for (uint32_t i = 0; i < list->count; i++)
        if (strcmp(list->pairs[i].key, key) == 0) strcpy(list->pairs[i].value, value);
}

static double number(const struct bd_param_list *list, const char *key, double otherwise)
{
    for (uint32_t i = 0; i < list->count; i++)
        if (strcmp(list->pairs[i].key, key) == 0) return strtod(list->pairs[i].value, NULL);
    return otherwise;
}

static double processor_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec * 1e3 + (double)now.tv_nsec * 1e-6;
}

static struct bd_report render(struct world *w, const struct bd_technique *technique,
                               const struct bd_param_list *params, uint32_t side_px, double *ms)
{
    struct bd_frame_request request = bd_frame_request_default;
    struct bd_image *layers[BD_LAYER_COUNT] = {0};
    struct bd_report report;
    struct bd_err_detail detail = {0};
    snprintf(request.technique, sizeof request.technique, "%s", technique->name);
    request.width_px = request.height_px = side_px;
    request.params = *params;
    request.fresh = BD_FRESH_CAMERA;
    double begun_ms = processor_ms();
    enum bd_err err =
        bd_frame_render(&w->renderer, w->scene, &request, NULL, NULL, layers, &report, &detail);
    if (err) fail_msg("%s: %s", technique->name, detail.message);
    *ms = processor_ms() - begun_ms;
    world_free_layers(layers);
    return report;
}

// Places at which light is gathered, as a part of all pixels.
static double part_of_pixels(struct world *w, const struct bd_technique *technique,
                             const struct bd_param_list *rung)
{
    const uint32_t side_px = 256;
    struct bd_param_list few = *rung;
    double ms;
    set(&few, "vpls", "64");
    set(&few, "cluster_levels", "0");
    set(&few, "photons", "1024");
    set(&few, "points", "1024");
    set(&few, "exploit", "1");
    set(&few, "clusters", "1");
    set(&few, "map_rays", "0");
    struct bd_report report = render(w, technique, &few, side_px, &ms);
    return (double)report.counts.fragments / (side_px * side_px);
}

static double vpls_of(struct world *w, const struct bd_technique *technique,
                      const struct bd_param_list *rung)
{
    struct bd_param_list few = *rung;
    double ms;
    set(&few, "photons", "1024");
    return (double)render(w, technique, &few, 1, &ms).counts.vpls;
}

// Points that a place looks at, twice where they say what others may give.
static double points_of(const struct bd_param_list *rung)
{
    return number(rung, "exploit", 2048) +
           2 * number(rung, "explore", 2) * number(rung, "clusters", 512);
}

// Where each walks a tree.
static double ms_of_a_place(struct world *w, const struct bd_technique *technique,
                            const struct bd_param_list *rung)
{
    double first_ms, ms;
    (void)render(w, technique, rung, 32, &first_ms); // programs are compiled
    struct bd_report report = render(w, technique, rung, 32, &ms);
    return ms / (double)report.counts.fragments;
}

// Of a pixel, in evaluations of a VPL.
static double cost_of(struct world *w, const struct bd_technique *technique,
                      const struct bd_param_list *rung)
{
    if (technique->is_reference) return number(rung, "spp", 0);
    if (!technique->indirect) {
        double side = number(rung, "shadow_size", 0);
        return side * side;
    }
    double places = 1;
    if (technique->inputs & BD_INPUT_FRAGMENTS) places = part_of_pixels(w, technique, rung);
    if (technique->inputs & BD_INPUT_VPL_TREE) return places * ms_of_a_place(w, technique, rung);
    if (technique->inputs & BD_INPUT_POINTS) return COST_OF_A_PIXEL + places * points_of(rung);
    double share = number(rung, "splat_share", 1);
    return COST_OF_A_PIXEL + places * share * vpls_of(w, technique, rung);
}

static void no_rung_costs_more_than_six_times_the_one_before(void **state)
{
    struct world *w = *state;
    const struct bd_technique *technique;
    make_room(w);
    for (uint32_t i = 0; (technique = bd_technique_at(i)) != NULL; i++) {
        const struct bd_param_list none = {0};
        struct bd_param_list rung;
        uint32_t next = bd_ladder_begin(technique, &none, &rung);
        double before = 0;
        do {
            double cost = cost_of(w, technique, &rung);
            printf("    %s rung %u: %.4g, %.3g times\n", technique->name, next - 1, cost,
                   before > 0 ? cost / before : 1);
            if (before > 0 && cost > COST_RATIO_MAX * before)
                fail_msg("%s: rung %u costs %.3g times the one before", technique->name, next - 1,
                         cost / before);
            before = cost;
        } while (bd_ladder_climb(technique, &none, &next, &rung));
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_rung_costs_more_than_six_times_the_one_before),
    };
    return cmocka_run_group_tests(tests, world_open, world_close);
}
