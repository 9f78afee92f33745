// Random walks through edits of bundled scenes, from a fixed seed: whatever is accepted can be
// taken back, comes back from bytes, is what finishing from nothing makes of it, and what is left
// at the end comes back from an export.
//
// usage: edit_walk OWN_SCENES [SHARED_SCENES]; with SHARED_SCENES it also times one edit.

#include <math.h>

#include "base/clock.h"
#include "scene/edit/edit.h"
#include "tests/unit/scene/round_trip.h"

static const char *own_scenes, *shared_scenes;

static uint32_t random_state;

static uint32_t random_below(uint32_t end)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (uint32_t)((uint64_t)random_state * end >> 32);
}

static double random_real(void)
{
    return random_below(1u << 20) / (double)(1u << 20);
}

// Any slot, sometimes one past the end, sometimes none: refusals are part of the walk.
static int32_t random_id(uint32_t count)
{
    return (int32_t)random_below(count + 2) - 1;
}

static struct bd_transform_edit random_transform(void)
{
    struct bd_transform_edit transform = {.is_given = random_below(2), .given = random_below(8)};
    for (int i = 0; i < 3; i++) {
        transform.translation[i] = 4 * random_real() - 2;
        transform.scale[i] = 2 * random_real() - 0.5;
        transform.rotation[i] = random_real() - 0.5;
    }
    transform.rotation[3] = 1;
    return transform;
}

// What the operations of one batch say, by the table's rows; each has a place of its own.
#define OPS_MAX  3
#define ROWS_MAX 24
static struct said {
    struct bd_field_value values[ROWS_MAX];
    double numbers[ROWS_MAX][4];
} said[OPS_MAX];

static struct bd_field_value random_value(const struct bd_scene *s,
                                          const struct bd_object_field *row, double numbers[4])
{
    struct bd_scene_counts slots = bd_scene_slots(s);
    const double reach = fmin(row->most - row->least, row->type == BD_FIELD_NUMBERS ? 3 : 0);
    uint32_t words = 0;
    while (row->words && row->words[words]) words++;
    for (uint32_t i = 0; i < row->count; i++)
        numbers[i] = row->or_none && random_below(2) ? 0 : row->least + reach * random_real();
    struct bd_field_value value = {row->name, "walk", numbers, row->count, 0};
    if (row->type == BD_FIELD_WORD) value.text = row->words[random_below(words)];
    if (row->type == BD_FIELD_SWITCH) value.whole = random_below(4) != 0;
    if (row->type == BD_FIELD_OBJECT || row->type == BD_FIELD_MAP)
        value.whole = random_id(*bd_slots_of(&slots, row->refers_to));
    return value;
}

static void say(struct bd_edit_op *op, const struct bd_scene *s, enum bd_object_kind kind,
                struct said *out)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    assert_true(list.count <= ROWS_MAX);
    op->fields = out->values;
    for (uint32_t i = 0; i < list.count; i++)
        if (list.rows[i].type != BD_FIELD_HEAVY && random_below(4) == 0)
            out->values[op->field_count++] = random_value(s, &list.rows[i], out->numbers[i]);
}

static struct bd_edit_op random_op(const struct bd_scene *s, const struct bd_scene *other,
                                   struct said *out)
{
    struct bd_edit_op op = {.kind = (enum bd_edit_kind)random_below(BD_EDIT_KIND_COUNT)};
    op.id = random_id(s->node_count);
    switch (op.kind) {
    case BD_EDIT_ADD_NODE:
    case BD_EDIT_SET_NODE:
        say(&op, s, BD_OBJECT_NODE, out);
        op.transform = random_transform();
        break;
    case BD_EDIT_SET_TRANSFORM:
        op.transform = random_transform();
        break;
    case BD_EDIT_ADD_MESH:
    case BD_EDIT_SET_MESH:
        op.id = random_id(s->mesh_count);
        op.mesh = (struct bd_mesh_edit){"walk", s->meshes[random_below(s->mesh_count)]};
        break;
    case BD_EDIT_SET_MESH_VERTICES:
        op.id = random_id(s->mesh_count);
        op.mesh.mesh = s->meshes[random_below(s->mesh_count)];
        break;
    case BD_EDIT_REMOVE_MESH:
        op.id = random_id(s->mesh_count);
        break;
    case BD_EDIT_ADD_MATERIAL:
    case BD_EDIT_SET_MATERIAL:
    case BD_EDIT_REMOVE_MATERIAL:
        op.id = random_id(s->material_count);
        say(&op, s, BD_OBJECT_MATERIAL, out);
        break;
    case BD_EDIT_ADD_TEXTURE:
    case BD_EDIT_SET_TEXTURE:
    case BD_EDIT_REMOVE_TEXTURE:
        op.id = random_id(s->texture_count);
        say(&op, s, BD_OBJECT_TEXTURE, out);
        if (s->picture_count && random_below(2))
            op.picture = s->pictures[random_below(s->picture_count)];
        if (op.picture && op.picture->is_removed) op.picture = NULL;
        break;
    case BD_EDIT_ADD_LIGHT:
    case BD_EDIT_SET_LIGHT:
    case BD_EDIT_REMOVE_LIGHT:
        op.id = random_id(s->authored_light_count);
        say(&op, s, BD_OBJECT_LIGHT, out);
        break;
    case BD_EDIT_ADD_CAMERA:
    case BD_EDIT_SET_CAMERA:
    case BD_EDIT_REMOVE_CAMERA:
        op.id = random_id(s->authored_camera_count);
        say(&op, s, BD_OBJECT_CAMERA, out);
        break;
    case BD_EDIT_SET_ENVIRONMENT:
        op.environment.radiance[random_below(3)] = random_below(2) ? random_real() : 0;
        break;
    case BD_EDIT_IMPORT: // seldom: it makes the scene grow
        op.import = (struct bd_import_edit){random_id(s->node_count), "in", other};
        if (random_below(20)) op = (struct bd_edit_op){.kind = BD_EDIT_ADD_NODE};
        break;
    case BD_EDIT_REMOVE_NODE:
    case BD_EDIT_KIND_COUNT:
        break;
    }
    return op;
}

struct walk {
    struct bd_scene *scene;  // by deltas
    struct bd_scene *replay; // by deltas that were written and read, from the first index
    struct shelf shelf;
    unsigned accepted;
};

static struct bd_delta by_bytes(struct walk *walk, const struct bd_delta *delta)
{
    struct bytes bytes = {0};
    struct bd_delta again;
    struct bd_err_detail detail = {0};
    bd_content_of_delta(delta, keep_content, &walk->shelf);
    assert_true(bd_delta_write(delta, collect, &bytes));
    if (bd_delta_read(bytes.data, bytes.size, find_on_shelf, &walk->shelf, &again, &detail) !=
        BD_ERR_OK)
        fail_msg("%s: %s", detail.field, detail.message);
    free(bytes.data);
    return again;
}

static void replace(struct bd_scene **scene, struct bd_scene *with)
{
    bd_scene_release(scene);
    *scene = with;
}

static struct bd_scene *applied(const struct bd_scene *base, const struct bd_delta *delta)
{
    struct bd_scene *out;
    struct bd_err_detail detail = {0};
    if (bd_delta_apply(base, delta, &out, &detail) != BD_ERR_OK)
        fail_msg("%s: %s", detail.field, detail.message);
    return out;
}

static void step(struct walk *walk, const struct bd_scene *other)
{
    struct bd_edit_op ops[OPS_MAX];
    struct bd_delta delta, inverse;
    struct bd_err_detail detail = {0};
    const uint32_t count = 1 + random_below(OPS_MAX);
    for (uint32_t i = 0; i < count; i++) ops[i] = random_op(walk->scene, other, &said[i]);
    if (bd_edit_check(walk->scene, ops, count, &bd_edit_default_limits, &delta, NULL, &detail) !=
        BD_ERR_OK) {
        assert_true(strncmp(detail.field, "ops[", 4) == 0 && detail.message[0]);
        return;
    }
    struct bd_scene *after = applied(walk->scene, &delta);
    assert_true(bd_delta_invert(walk->scene, &delta, &inverse));
    struct bd_scene *back = applied(after, &inverse);
    assert_memory_equal(back->content_sha256, walk->scene->content_sha256, 32);
    assert_as_from_scratch(after);
    struct bd_delta read = by_bytes(walk, &delta);
    replace(&walk->replay, applied(walk->replay, &read));
    assert_memory_equal(walk->replay->content_sha256, after->content_sha256, 32);
    assert_same_derived(walk->replay, after);
    replace(&walk->scene, after);
    bd_scene_release(&back);
    bd_delta_finish(&delta), bd_delta_finish(&inverse), bd_delta_finish(&read);
    walk->accepted++;
}

static struct bd_scene *from_index(struct walk *walk)
{
    struct bytes index = {0};
    struct bd_scene *scene;
    struct bd_err_detail detail = {0};
    bd_content_of_scene(walk->scene, keep_content, &walk->shelf);
    assert_true(bd_flat_write_index(walk->scene, collect, &index));
    assert_int_equal(
        bd_flat_read_index(index.data, index.size, find_on_shelf, &walk->shelf, &scene, &detail),
        BD_ERR_OK);
    assert_int_equal(bd_scene_finish(scene, &detail), BD_ERR_OK);
    assert_memory_equal(scene->content_sha256, walk->scene->content_sha256, 32);
    free(index.data);
    return scene;
}

static void walk_through(const char *name, uint32_t seed, unsigned steps)
{
    struct walk walk = {.scene = load(own_scenes, name)};
    struct bd_scene *other = load(own_scenes, "checker.glb");
    assert_non_null(walk.scene);
    walk.replay = from_index(&walk);
    random_state = seed;
    for (unsigned i = 0; i < steps; i++) step(&walk, other);
    print_message("%s, seed %u: %u of %u batches accepted\n", name, seed, walk.accepted, steps);
    assert_true(walk.accepted > steps / 10);
    struct bd_scene *last = from_index(&walk);
    assert_settles(last);
    bd_scene_release(&last), bd_scene_release(&other);
    bd_scene_release(&walk.scene), bd_scene_release(&walk.replay);
    clear_shelf(&walk.shelf);
}

static void walks(void **state)
{
    (void)state;
    walk_through("two_lights.glb", 1, 4000);
    walk_through("checker.glb", 2, 4000);
    walk_through("cornell.glb", 3, 2000);
}

// --- time -----------------------------------------------------------------------------------

static void one_edit_is_quick(void **state)
{
    (void)state;
    static const char *const names[] = {"cornell_box.glb", "sponza_dabrovic.glb"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        struct bd_scene *scene = shared_scenes ? load(shared_scenes, names[i]) : NULL;
        if (!scene) {
            print_message("skipped: no %s\n", names[i]);
            continue;
        }
        double best_ms = INFINITY;
        for (int round = 0; round < 20; round++) {
            struct bd_edit_op op = {
                .kind = BD_EDIT_SET_TRANSFORM,
                .id = scene->placed_lights[0].node,
                .transform = {.given = BD_GIVEN_TRANSLATION, .translation = {0, round, 0}}};
            if (op.id == BD_NONE) op.id = 0;
            struct bd_delta delta;
            struct bd_err_detail detail = {0};
            uint64_t start_ns = bd_clock_ns();
            assert_int_equal(
                bd_edit_check(scene, &op, 1, &bd_edit_default_limits, &delta, NULL, &detail),
                BD_ERR_OK);
            struct bd_scene *after = applied(scene, &delta);
            best_ms = fmin(best_ms, bd_ms_since(start_ns));
            bd_delta_finish(&delta);
            replace(&scene, after);
        }
        print_message("%s: a light's move, checked and applied: %.3f ms\n", names[i], best_ms);
        assert_true(best_ms < 100); // far above what it takes, far below hashing the scene's bytes
        bd_scene_release(&scene);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(walks),
        cmocka_unit_test(one_edit_is_quick),
    };
    if (argc < 2) return 2;
    own_scenes = argv[1];
    shared_scenes = argc > 2 ? argv[2] : NULL;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
