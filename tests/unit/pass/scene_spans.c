// Spans of what is seen: each triangle in sight once, in order, and few beside them.

#include <stdlib.h>

#include "pass/scene_spans.h"
#include "shared/instance.h"
#include "tests/unit/cmocka_all.h"

// Instances of a strip of triangles along x, a metre a chunk; the rows of instance i shift it by a
// number of metres that the case says. The viewpoint looks along -z at x from -2 to 2.
#define CHUNKS    8u
#define TRIANGLES ((CHUNKS - 1) * BD_CHUNK_TRIANGLES + 100)
#define INSTANCES 5u

struct stage {
    struct bd_box chunks[CHUNKS];
    struct bd_gpu_mesh mesh;
    struct bd_gpu_primitive primitive;
    struct bd_triangle_run run;
    struct bd_scene_draw draw;
    struct bd_gpu_scene scene;
    struct bd_seen_instance instances[INSTANCES];
    struct bd_seen_run seen_run;
    float rows[INSTANCES * 4 * BD_INSTANCE_VEC4S];
    struct bd_seen seen;
    struct bd_viewpoint viewpoint;
};

static void set_up(struct stage *s, const float shift_m[INSTANCES],
                   const bool is_all_seen[INSTANCES], uint32_t triangles)
{
    *s = (struct stage){
        .mesh.box = {{0, -.1f, -.1f}, {CHUNKS, .1f, .1f}},
        .primitive.chunks = s->chunks,
        .run = {.instance_count = INSTANCES, .triangles_per_instance = triangles},
        .draw = {.run = &s->run, .mesh = &s->mesh, .primitive = &s->primitive},
        .scene = {.space.render_per_m = 1,
                  .draws = &s->draw,
                  .order = {.run_count = 1, .runs = &s->run, .instance_count = INSTANCES}},
        .seen_run = {0, INSTANCES},
        .seen = {.count = INSTANCES,
                 .instances = s->instances,
                 .runs = &s->seen_run,
                 .rows = s->rows},
        .viewpoint = {.orthographic = true,
                      .half_width = 2,
                      .half_height = 1,
                      .far_m = 20,
                      .width_px = 1000,
                      .height_px = 1000},
    };
    for (uint32_t c = 0; c < CHUNKS; c++)
        s->chunks[c] = (struct bd_box){{(float)c, -.1f, -.1f}, {(float)c + 1, .1f, .1f}};
    for (uint32_t i = 0; i < INSTANCES; i++) {
        float *rows = s->rows + (size_t)i * 4 * BD_INSTANCE_VEC4S;
        rows[0] = rows[5] = rows[10] = 1;
        rows[3] = shift_m[i];
        rows[11] = -10;
        s->instances[i] = (struct bd_seen_instance){i, is_all_seen[i]};
    }
}

static struct bd_scene_spans spans_of(const struct stage *s)
{
    struct bd_scene_spans spans;
    assert_int_equal(bd_scene_spans_init(&spans, &s->scene, &s->viewpoint, &s->seen, NULL, NULL),
                     BD_ERR_OK);
    return spans;
}

static void assert_span(const struct bd_scene_span *span, uint32_t first_instance,
                        uint32_t instance_count, uint32_t first_triangle, uint32_t triangle_count)
{
    assert_int_equal(span->run, 0);
    assert_int_equal(span->first_instance, first_instance);
    assert_int_equal(span->instance_count, instance_count);
    assert_int_equal(span->first_triangle, first_triangle);
    assert_int_equal(span->triangle_count, triangle_count);
}

// Two whole ones, one of which a part is seen, one of which nothing is, one whose end is seen.
static void parts_of_large_instances(void **state)
{
    (void)state;
    struct stage s;
    set_up(&s, (float[]){0, 0, -3.5f, 100, -7.5f}, (bool[]){true, true, false, false, false},
           TRIANGLES);
    struct bd_scene_spans spans = spans_of(&s);
    assert_int_equal(spans.count, 3);
    assert_span(&spans.spans[0], 0, 2, 0, TRIANGLES);
    // From x = 1.5 to 5.5 of its own: chunks 1 to 5.
    assert_span(&spans.spans[1], 2, 1, BD_CHUNK_TRIANGLES, 5 * BD_CHUNK_TRIANGLES);
    // From 5.5 on: 5 to 7, the last of which is short.
    assert_span(&spans.spans[2], 4, 1, 5 * BD_CHUNK_TRIANGLES, TRIANGLES - 5 * BD_CHUNK_TRIANGLES);
    bd_scene_spans_finish(&spans);
}

// A part and a whole one that follow each other stay apart; a whole one in chunks joins whole ones.
static void whole_ones_alone_are_joined(void **state)
{
    (void)state;
    struct stage s;
    set_up(&s, (float[]){-6, 0, 0, 0, -6}, (bool[]){false, true, false, true, false}, TRIANGLES);
    s.viewpoint.half_width = 20; // all chunks of all of them
    struct bd_scene_spans spans = spans_of(&s);
    assert_int_equal(spans.count, 1);
    assert_span(&spans.spans[0], 0, INSTANCES, 0, TRIANGLES);
    bd_scene_spans_finish(&spans);
    s.viewpoint.half_width = 2;
    spans = spans_of(&s);
    // From 4 to 8; whole; 0 to 2; whole; 4 to 8. A chunk that touches the bound counts.
    assert_int_equal(spans.count, 5);
    assert_span(&spans.spans[0], 0, 1, 3 * BD_CHUNK_TRIANGLES, TRIANGLES - 3 * BD_CHUNK_TRIANGLES);
    assert_span(&spans.spans[1], 1, 1, 0, TRIANGLES);
    assert_span(&spans.spans[2], 2, 1, 0, 3 * BD_CHUNK_TRIANGLES);
    assert_span(&spans.spans[3], 3, 1, 0, TRIANGLES);
    bd_scene_spans_finish(&spans);
}

// The mesh's box reaches into the picture, and none of its chunks.
static void one_of_which_no_chunk_is_seen(void **state)
{
    (void)state;
    struct stage s;
    set_up(&s, (float[]){0, 100, 0, 0, 0}, (bool[]){true, false, true, true, true}, TRIANGLES);
    struct bd_scene_spans spans = spans_of(&s);
    assert_int_equal(spans.count, 2);
    assert_span(&spans.spans[0], 0, 1, 0, TRIANGLES);
    assert_span(&spans.spans[1], 2, 3, 0, TRIANGLES);
    bd_scene_spans_finish(&spans);
}

static void small_instances_are_one_span(void **state)
{
    (void)state;
    struct stage s;
    set_up(&s, (float[]){0, 0, 0, 0, 0}, (bool[]){true, false, false, true, false},
           BD_CHUNK_TRIANGLES);
    s.seen_run = (struct bd_seen_run){1, 3};
    struct bd_scene_spans spans = spans_of(&s);
    assert_int_equal(spans.count, 1);
    assert_span(&spans.spans[0], 1, 3, 0, BD_CHUNK_TRIANGLES);
    bd_scene_spans_finish(&spans);
    s.seen_run.count = 0;
    spans = spans_of(&s);
    assert_int_equal(spans.count, 0);
    bd_scene_spans_finish(&spans);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(parts_of_large_instances),
        cmocka_unit_test(whole_ones_alone_are_joined),
        cmocka_unit_test(one_of_which_no_chunk_is_seen),
        cmocka_unit_test(small_instances_are_one_span),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
