// What rays meet in environment maps beside what they meet in triangles (pass/env_rays.h), and from
// where those maps see the most of a scene (pass/env_choice.h): rooms made by hand, where what is
// right is known, and scenes of the scene lists.
//
// usage: pass_env_maps [SCENE.glb]...

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lights/directions.h"
#include "lights/sequence.h"
#include "lights/surface_points.h"
#include "pass/env_choice.h"
#include "pass/env_rays.h"
#include "picture.h"
#include "tests/reference/stage.h"
#include "tests/tools/load_scene.h"

#define RAYS    16384u
#define SIDE_PX 256u

static int file_count;
static char **files;

// A scene on the device, rays in it, and photons' beginnings on its surfaces.
struct place {
    const char *name;
    struct bd_scene *scene;
    struct bd_uploader uploader;
    struct bd_gpu_scene *uploaded;
    struct bd_rays *rays;
    struct bd_pool *pool;
    struct bd_tracer tracer;
    struct bd_processor processor;
    struct bd_pass_context context;
    struct bd_ray asked[RAYS];
    f3 normals[RAYS]; // where they set out
    struct bd_ray_hit met[RAYS], shown[RAYS];
    uint32_t count;
};

static enum bd_err go_on(void *user)
{
    (void)user;
    return BD_ERR_OK;
}

static void check(enum bd_err err, const struct bd_err_detail *detail)
{
    if (err) fail_msg("%s", detail->message);
}

// As a diffuse surface sends light.
static void set_out(struct place *place)
{
    struct bd_surface_points points;
    struct bd_err_detail detail = {0};
    const struct bd_sequence sequence = bd_sequence_of(3, 5);
    const struct bd_surface_points_how how = {.count = RAYS, .sends = BD_SENDS_LAMBERT};
    check(bd_surface_points_init(&points, place->scene, &how, go_on, NULL, &detail), &detail);
    place->count = points.count;
    for (uint32_t i = 0; i < points.count; i++) {
        const struct bd_surface_point *at = &points.points[i];
        const struct bd_basis basis = bd_basis_of(at->normal);
        float number[2];
        bd_sequence_pair(&sequence, i, number);
        place->normals[i] = at->normal;
        const f3 d = bd_from_basis(&basis, at->normal, bd_cosine_direction(number));
        place->asked[i] =
            (struct bd_ray){.origin = {at->position.x, at->position.y, at->position.z},
                            .from_triangle = at->triangle,
                            .direction = {d.x, d.y, d.z},
                            .far = INFINITY};
    }
    bd_surface_points_finish(&points);
    bd_rays_nearest(place->rays, place->pool, BD_RAYS_ALPHA_MASK, place->asked, place->count,
                    place->met);
}

static struct place *enter(const char *name, struct bd_scene *scene)
{
    struct place *place = calloc(1, sizeof *place);
    struct bd_err_detail detail = {0};
    const struct bd_rays_build build = {.repeated_max = BD_RAYS_REPEATED_MAX};
    assert_non_null(place);
    place->name = name;
    place->scene = scene;
    place->uploader.gpu = context.gpu;
    check(bd_gpu_scene_create(&place->uploader, scene, &place->uploaded, &detail), &detail);
    check(bd_rays_create(scene, &build, &place->rays, &detail), &detail);
    place->pool = bd_pool_create(0);
    place->tracer = (struct bd_tracer){place->rays, place->pool};
    place->processor.pool = place->pool;
    place->context = context;
    place->context.processor = &place->processor;
    set_out(place);
    return place;
}

static void leave(struct place **place)
{
    bd_pool_destroy(&(*place)->pool);
    bd_rays_destroy(&(*place)->rays);
    bd_gpu_scene_destroy(&(*place)->uploader, &(*place)->uploaded);
    free(*place);
    *place = NULL;
}

static struct bd_env_maps *maps_of(struct place *place, uint32_t count, bool traced, uint32_t seed)
{
    struct bd_env_maps *maps;
    struct bd_err_detail detail = {0};
    const struct bd_tracer *tracer = traced ? &place->tracer : NULL;
    const struct bd_env_maps_inputs inputs = {.scene = place->uploaded,
                                              .snapshot = place->scene,
                                              .tracer = tracer,
                                              .choice_tracer = tracer,
                                              .count = count,
                                              .side_px = SIDE_PX,
                                              .seed = seed};
    check(bd_env_maps_run(&place->context, &inputs, &maps, &detail), &detail);
    return maps;
}

// --- rays ---------------------------------------------------------------------------------------

struct counts {
    uint32_t hits, right, wrong, lost, made_up; // of rays that meet something; those that do not
};

static f3 end_of(const struct bd_ray *ray, float distance)
{
    const f3 from = f3_of(ray->origin[0], ray->origin[1], ray->origin[2]);
    return f3_add(
        from, f3_scale(f3_of(ray->direction[0], ray->direction[1], ray->direction[2]), distance));
}

// Right: within so much of the scene's radius.
static struct counts ask(struct place *place, const struct bd_env_maps *maps, bool as_printed,
                         float right)
{
    const struct bd_env_view view = {maps, as_printed};
    struct bd_ray_counts traced = {0};
    struct counts counts = {0};
    assert_int_equal(bd_env_rays_nearest(&place->context, &view, place->pool, place->asked,
                                         place->count, place->shown, &traced),
                     BD_ERR_OK);
    for (uint32_t i = 0; i < place->count; i++) {
        const struct bd_ray_hit *met = &place->met[i], *shown = &place->shown[i];
        const bool is_shown = shown->triangle != BD_NO_TRIANGLE;
        if (met->triangle == BD_NO_TRIANGLE) {
            counts.made_up += is_shown;
            continue;
        }
        counts.hits++;
        counts.lost += !is_shown;
        if (!is_shown) continue;
        const f3 off = f3_sub(end_of(&place->asked[i], met->distance),
                              end_of(&place->asked[i], shown->distance));
        const bool is_right = f3_length(off) < right * (float)maps->hits.space.radius;
        counts.right += is_right;
        counts.wrong += !is_right;
    }
    printf("    %s, %u maps%s: right %.4f, wrong %.4f, lost %.4f of %u; made up %u of %u\n",
           place->name, maps->count, as_printed ? ", as printed" : "",
           counts.right / (double)counts.hits, counts.wrong / (double)counts.hits,
           counts.lost / (double)counts.hits, counts.hits, counts.made_up,
           place->count - counts.hits);
    return counts;
}

static double part(uint32_t count, const struct counts *of)
{
    return count / (double)of->hits;
}

static struct bd_scene *finished(struct stage *stage)
{
    struct bd_err_detail detail = {0};
    if (!bd_scene_is_finished(stage->scene)) check(bd_scene_finish(stage->scene, &detail), &detail);
    return stage->scene;
}

// B5.5: of rays in convex rooms .99 and more, with three looks; of the printed scheme .73 to .92.
static void in_convex_rooms_nearly_all_are_right(void **unused)
{
    (void)unused;
    static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, centre[3] = {0};
    for (int sphere = 0; sphere < 2; sphere++) {
        struct stage *stage = stage_create();
        const int32_t wall = stage_material(stage, 0.5f);
        if (sphere)
            stage_sphere(stage, wall, centre, 1, 4, true);
        else
            stage_box(stage, wall, low, high);
        stage_material_at(stage, wall)->double_sided = false;
        struct place *place = enter(sphere ? "sphere" : "cube", finished(stage));
        for (int traced = 0; traced < 2; traced++) {
            struct bd_env_maps *maps = maps_of(place, 1, traced, 0);
            const struct counts bracketed = ask(place, maps, false, 0.02f);
            const struct counts printed = ask(place, maps, true, 0.02f);
            assert_true(part(bracketed.right, &bracketed) >= 0.99);
            assert_true(part(bracketed.wrong, &bracketed) <= 0.001);
            assert_true(part(printed.right, &printed) < part(bracketed.right, &bracketed));
            assert_true(part(printed.right, &printed) > 0.5);
            bd_env_maps_destroy(context.gpu, &maps);
        }
        leave(&place);
        stage_destroy(&stage);
    }
}

// A ball in a room: what one map does not show others do.
static void what_is_hidden_from_one_others_show(void **unused)
{
    (void)unused;
    static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, ball[3] = {0.2, -0.3, 0.1};
    struct stage *stage = stage_create();
    const int32_t wall = stage_material(stage, 0.5f);
    stage_box(stage, wall, low, high);
    stage_sphere(stage, wall, ball, 0.4, 3, false);
    stage_material_at(stage, wall)->double_sided = false;
    struct place *place = enter("cube with a ball", finished(stage));
    struct bd_env_maps *one = maps_of(place, 1, true, 0), *many = maps_of(place, 8, true, 0);
    const struct counts of_one = ask(place, one, false, 0.02f);
    const struct counts of_many = ask(place, many, false, 0.02f);
    const struct counts printed = ask(place, many, true, 0.02f);
    assert_true(many->count > 1 && many->covered > one->covered);
    assert_true(part(of_many.right, &of_many) > part(of_one.right, &of_one) + 0.02);
    assert_true(part(of_many.right, &of_many) >= 0.98);
    assert_true(part(printed.right, &printed) < part(of_many.right, &of_many));
    bd_env_maps_destroy(context.gpu, &one);
    bd_env_maps_destroy(context.gpu, &many);
    leave(&place);
    stage_destroy(&stage);
}

// Whether two places look at each other: those that do not are asked by nobody.
static bool face_each_other(const struct place *place, uint32_t a, uint32_t b)
{
    const float *from = place->asked[a].origin, *to = place->asked[b].origin;
    const f3 way = f3_of(to[0] - from[0], to[1] - from[1], to[2] - from[2]);
    return f3_dot(place->normals[a], way) > 0 && f3_dot(place->normals[b], way) < 0;
}

static void segments_are_blocked_alike(void **unused)
{
    (void)unused;
    static const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1}, ball[3] = {0.2, -0.3, 0.1};
    struct stage *stage = stage_create();
    const int32_t wall = stage_material(stage, 0.5f);
    stage_box(stage, wall, low, high);
    stage_sphere(stage, wall, ball, 0.4, 3, false);
    stage_material_at(stage, wall)->double_sided = false;
    struct place *place = enter("segments", finished(stage));
    struct bd_env_maps *maps = maps_of(place, 8, true, 0);
    struct bd_segment *segments = calloc(RAYS, sizeof *segments);
    uint32_t *blocked = calloc(RAYS / 32 + 1, 4), *shown = calloc(RAYS / 32 + 1, 4);
    struct bd_ray_counts traced = {0};
    assert_true(segments && blocked && shown);
    for (uint32_t i = 0; i < place->count; i++) {
        const struct bd_ray *from = &place->asked[i];
        const uint32_t other = (i * 7919u + 13) % place->count;
        const struct bd_ray *to = &place->asked[other];
        if (!face_each_other(place, i, other)) continue;
        memcpy(segments[i].from, from->origin, sizeof segments[i].from);
        memcpy(segments[i].to, to->origin, sizeof segments[i].to);
        segments[i].from_triangle = from->from_triangle;
        segments[i].to_triangle = to->from_triangle;
    }
    const struct bd_env_view view = {maps, false};
    bd_rays_occluded(place->rays, place->pool, BD_RAYS_ALPHA_MASK, segments, place->count, blocked);
    assert_int_equal(bd_env_rays_occluded(&place->context, &view, place->pool, segments,
                                          place->count, shown, &traced),
                     BD_ERR_OK);
    uint32_t differ = 0, hidden = 0, blocked_alone = 0;
    for (uint32_t i = 0; i < place->count; i++) {
        differ += (blocked[i / 32] ^ shown[i / 32]) >> i % 32 & 1;
        hidden += blocked[i / 32] >> i % 32 & 1;
        blocked_alone += (shown[i / 32] & ~blocked[i / 32]) >> i % 32 & 1;
    }
    printf("    %u of %u segments differ, %u of them blocked; %u are\n", differ, place->count,
           blocked_alone, hidden);
    assert_true(hidden > place->count / 20 && differ < place->count / 100);
    free(segments);
    free(blocked);
    free(shown);
    bd_env_maps_destroy(context.gpu, &maps);
    leave(&place);
    stage_destroy(&stage);
}

// Hazard 40: of a ray that begins at a map's centre, or goes through it, no arc is left to step
// along.
static void aim_at_centre(struct place *place, const f3 centre)
{
    const struct bd_sequence sequence = bd_sequence_of(40, 5);
    for (uint32_t i = 0; i < place->count; i++) {
        struct bd_ray *ray = &place->asked[i];
        const f3 way = f3_sub(centre, f3_of(ray->origin[0], ray->origin[1], ray->origin[2]));
        const bool goes_through = i % 2 && f3_dot(way, place->normals[i]) > 0;
        float number[2];
        bd_sequence_pair(&sequence, i, number);
        const f3 d = goes_through ? f3_unit(way) : bd_direction_at(1 - 2 * number[0], number[1]);
        memcpy(ray->direction, (float[3]){d.x, d.y, d.z}, sizeof ray->direction);
        if (goes_through) continue;
        memcpy(ray->origin, (float[3]){centre.x, centre.y, centre.z}, sizeof ray->origin);
        ray->from_triangle = BD_NO_TRIANGLE;
    }
    bd_rays_nearest(place->rays, place->pool, BD_RAYS_ALPHA_MASK, place->asked, place->count,
                    place->met);
}

static void rays_through_a_centre_meet_what_lies_ahead(void **unused)
{
    (void)unused;
    static const double centre[3] = {0};
    struct stage *stage = stage_create();
    const int32_t wall = stage_material(stage, 0.5f);
    stage_sphere(stage, wall, centre, 1, 4, true);
    stage_material_at(stage, wall)->double_sided = false;
    struct place *place = enter("rays through the centre", finished(stage));
    struct bd_env_maps *maps = maps_of(place, 1, true, 0);
    aim_at_centre(place, maps->maps[0].centre);
    const struct counts counts = ask(place, maps, false, 5e-3f);
    assert_int_equal(counts.hits, place->count);
    assert_true(part(counts.right, &counts) >= 0.999);
    bd_env_maps_destroy(context.gpu, &maps);
    leave(&place);
    stage_destroy(&stage);
}

// --- the choice ---------------------------------------------------------------------------------

// Points of all surfaces that some centre sees, of all of them.
static double coverage(struct place *place, const f3 *centres, uint32_t count)
{
    struct bd_segment *segments = calloc(place->count, sizeof *segments);
    uint32_t *blocked = calloc(place->count / 32 + 1, sizeof *blocked), seen = 0;
    bool *is_seen = calloc(place->count, sizeof *is_seen);
    assert_true(segments && blocked && is_seen);
    for (uint32_t k = 0; k < count; k++) {
        for (uint32_t i = 0; i < place->count; i++) {
            const struct bd_ray *ray = &place->asked[i];
            segments[i] = (struct bd_segment){.from = {centres[k].x, centres[k].y, centres[k].z},
                                              .from_triangle = BD_NO_TRIANGLE,
                                              .to_triangle = ray->from_triangle};
            memcpy(segments[i].to, ray->origin, sizeof segments[i].to);
        }
        bd_rays_occluded(place->rays, place->pool, BD_RAYS_ALPHA_MASK, segments, place->count,
                         blocked);
        for (uint32_t i = 0; i < place->count; i++) is_seen[i] |= !(blocked[i / 32] >> i % 32 & 1);
    }
    for (uint32_t i = 0; i < place->count; i++) seen += is_seen[i];
    free(segments);
    free(blocked);
    free(is_seen);
    return seen / (double)place->count;
}

#define SEEDS 20u
#define MAPS  8u

static f3 by_chance(const struct place *place, uint32_t seed, uint32_t number)
{
    const struct bd_features *f = &place->scene->features;
    const struct bd_render_space space = bd_render_space_of(place->scene);
    double at[3];
    for (uint32_t c = 0; c < 3; c++)
        at[c] = (bd_stirred(number * 3 + c + 1000 * seed) >> 8) * 0x1p-24;
    const bd_dvec3 world = {f->bounds_min.x + at[0] * (f->bounds_max.x - f->bounds_min.x),
                            f->bounds_min.y + at[1] * (f->bounds_max.y - f->bounds_min.y),
                            f->bounds_min.z + at[2] * (f->bounds_max.z - f->bounds_min.z)};
    const bd_dvec3 r = bd_render_from_world(&space, world);
    return f3_of((float)r.x, (float)r.y, (float)r.z);
}

// B5.4: those that are chosen see more than as many by chance, for nearly all seeds of either.
static void chosen_ones_see_more(struct place *place, uint32_t count)
{
    uint32_t won = 0;
    double chosen_sum = 0, random_sum = 0;
    for (uint32_t seed = 0; seed < SEEDS; seed++) {
        struct bd_env_maps *maps = maps_of(place, count, true, seed);
        f3 chosen[MAPS], random[MAPS];
        for (uint32_t k = 0; k < count; k++) random[k] = by_chance(place, seed, k);
        for (uint32_t k = 0; k < maps->count; k++) chosen[k] = maps->maps[k].centre;
        const double own = coverage(place, chosen, maps->count);
        const double other = coverage(place, random, count);
        won += own > other;
        chosen_sum += own;
        random_sum += other;
        bd_env_maps_destroy(context.gpu, &maps);
    }
    printf(
        "    %s, %u maps: chosen %.3f, by chance %.3f of all surfaces; better for %u of %u seeds\n",
        place->name, count, chosen_sum / SEEDS, random_sum / SEEDS, won, SEEDS);
    assert_true(won >= 19);
}

static void scenes_of_the_lists(void **unused)
{
    (void)unused;
    uint32_t found = 0;
    for (int i = 0; i < file_count; i++) {
        struct bd_scene *scene = NULL;
        struct bd_err_detail detail = {0};
        if (load_scene(files[i], &scene, &detail)) {
            printf("left out: %s\n", detail.message);
            continue;
        }
        struct place *place = enter(strrchr(files[i], '/') + 1, scene);
        struct bd_env_maps *maps = maps_of(place, MAPS, true, 0);
        ask(place, maps, false, 0.02f);
        ask(place, maps, true, 0.02f);
        // Eight of a box see all that can be seen, by chance too.
        const bool is_small = place->scene->features.triangle_count < 1000;
        chosen_ones_see_more(place, is_small ? MAPS / 2 : MAPS);
        bd_env_maps_destroy(context.gpu, &maps);
        leave(&place);
        bd_scene_release(&scene);
        found++;
    }
    if (!found) skip();
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(in_convex_rooms_nearly_all_are_right),
        cmocka_unit_test(what_is_hidden_from_one_others_show),
        cmocka_unit_test(segments_are_blocked_alike),
        cmocka_unit_test(rays_through_a_centre_meet_what_lies_ahead),
        cmocka_unit_test(scenes_of_the_lists),
    };
    file_count = argc - 1;
    files = argv + 1;
    return cmocka_run_group_tests(tests, open_device, close_device);
}
