// The store: what is staged is seen by nobody, what is published by everybody, what fails by none;
// what is transient lies over it.

#include "scene/store/store.h"

#include "scene/edit/edit.h"
#include "tests/unit/scene/fields.h"
#include "tests/unit/scene/snapshots.h"

static const char *own_scenes;

// --- a store with one scene -----------------------------------------------------------------

struct world {
    struct bd_store *store;
    char id[BD_SCENE_ID_BYTES];
};

static void publish_all(struct bd_store *store)
{
    struct bd_batch *batch = bd_store_take_staged(store);
    while (batch) {
        struct bd_batch *next = batch->next;
        bd_store_publish(store, batch);
        bd_batch_free(&batch);
        batch = next;
    }
}

static void fail_all(struct bd_store *store)
{
    struct bd_batch *batch = bd_store_take_staged(store);
    while (batch) {
        struct bd_batch *next = batch->next;
        bd_store_fail(store, batch);
        bd_batch_free(&batch);
        batch = next;
    }
}

static struct world open_world(void)
{
    struct world world = {.store = bd_store_create(4)};
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    struct bd_batch *batch;
    assert_non_null(scene);
    assert_int_equal(bd_store_stage_add(world.store, scene, "two", "me", &batch, NULL), BD_ERR_OK);
    memcpy(world.id, batch->scene_id, sizeof world.id);
    bd_scene_release(&scene);
    publish_all(world.store);
    return world;
}

static const struct bd_store_entry *entry_of(const struct world *world)
{
    const struct bd_store_entry *entry;
    assert_int_equal(bd_store_get(world->store, world->id, &entry, NULL), BD_ERR_OK);
    return entry;
}

static float shown_intensity(const struct world *world, uint32_t light)
{
    return entry_of(world)->scene->lights[light].intensity;
}

// The head's light with another intensity.
static struct bd_delta dimmed(const struct world *world, uint32_t light, float intensity)
{
    struct bd_delta delta = {0};
    const struct bd_scene *head;
    uint64_t revision;
    assert_int_equal(bd_store_head(world->store, world->id, &head, &revision, NULL), BD_ERR_OK);
    assert_true(bd_delta_take(&delta, head, BD_OBJECT_LIGHT, light));
    delta.changes[0].light.intensity = intensity;
    return delta;
}

static enum bd_err stage_as(const struct world *world, enum bd_batch_kind kind, uint64_t base,
                            const char *edit_id, struct bd_delta delta,
                            struct bd_err_detail *detail)
{
    const struct bd_store_change change = {.scene_id = world->id,
                                           .kind = kind,
                                           .base_revision = base,
                                           .client_edit_id = edit_id,
                                           .delta = &delta};
    struct bd_batch *batch;
    enum bd_err err = bd_store_stage(world->store, &change, &batch, detail);
    bd_delta_finish(&delta);
    return err;
}

static void dim(const struct world *world, float intensity)
{
    struct bd_delta delta = dimmed(world, 0, intensity);
    assert_int_equal(stage_as(world, BD_BATCH_EDIT, 0, NULL, delta, NULL), BD_ERR_OK);
}

static void lay(const struct world *world, uint32_t light, float intensity)
{
    const struct bd_store_entry *entry;
    struct bd_delta delta = dimmed(world, light, intensity);
    assert_int_equal(bd_store_lay(world->store, world->id, "me", &delta, &entry, NULL), BD_ERR_OK);
    bd_delta_finish(&delta);
}

static struct bd_batch *commit(const struct world *world)
{
    struct bd_batch *batch;
    assert_int_equal(bd_store_stage_commit(world->store, world->id, NULL, "drag", &batch, NULL),
                     BD_ERR_OK);
    return batch;
}

// --- tests ----------------------------------------------------------------------------------

static void holds_so_many_scenes(void **state)
{
    (void)state;
    struct bd_store *store = bd_store_create(2);
    struct bd_scene *scene = bd_scene_create();
    struct bd_batch *one, *two, *three;
    struct bd_err_detail detail;
    assert_int_equal(bd_store_stage_add(store, scene, "one", "", &one, NULL), BD_ERR_OK);
    assert_int_equal(bd_store_stage_add(store, scene, "two", "", &two, NULL), BD_ERR_OK);
    assert_string_not_equal(one->scene_id, two->scene_id);
    // Those on their way count.
    assert_int_equal(bd_store_stage_add(store, scene, "three", "", &three, &detail), BD_ERR_LIMIT);
    assert_string_equal(detail.field, "scenes");
    bd_store_destroy(&store);
    assert_int_equal(scene->reference_count, 1);
    bd_scene_release(&scene);
}

static void nobody_sees_what_is_staged(void **state)
{
    (void)state;
    struct bd_store *store = bd_store_create(2);
    struct bd_scene *scene = bd_scene_create();
    const struct bd_store_entry *entry;
    struct bd_batch *batch;
    char id[BD_SCENE_ID_BYTES];
    assert_int_equal(bd_store_stage_add(store, scene, "one", "", &batch, NULL), BD_ERR_OK);
    memcpy(id, batch->scene_id, sizeof id);
    assert_int_equal(bd_store_get(store, id, &entry, NULL), BD_ERR_NOT_FOUND);
    assert_int_equal(bd_store_count(store), 0);
    publish_all(store);
    assert_int_equal(bd_store_get(store, id, &entry, NULL), BD_ERR_OK);
    assert_int_equal(entry->revision, 1);
    assert_string_equal(bd_store_at(store, 0)->name, "one");
    assert_null(bd_store_at(store, 1));

    // One that is about to go is there until it is gone, but nothing can be changed in it.
    assert_int_equal(bd_store_stage_remove(store, id, &batch, NULL), BD_ERR_OK);
    assert_int_equal(bd_store_get(store, id, &entry, NULL), BD_ERR_OK);
    assert_int_equal(bd_store_stage_remove(store, id, &batch, NULL), BD_ERR_NOT_FOUND);
    fail_all(store);
    assert_int_equal(bd_store_stage_remove(store, id, &batch, NULL), BD_ERR_OK);
    publish_all(store);
    assert_int_equal(bd_store_get(store, id, &entry, NULL), BD_ERR_NOT_FOUND);
    bd_store_destroy(&store);
    bd_scene_release(&scene);
}

static void edits_are_shown_once_they_are_durable(void **state)
{
    (void)state;
    struct world world = open_world();
    const float before = shown_intensity(&world, 0);
    dim(&world, 3);
    dim(&world, 4); // on top of the first
    assert_true(shown_intensity(&world, 0) == before);
    assert_int_equal(entry_of(&world)->revision, 1);
    publish_all(world.store);
    assert_true(shown_intensity(&world, 0) == 4);
    assert_int_equal(entry_of(&world)->revision, 3);
    bd_store_destroy(&world.store);
}

static void what_fails_was_never_there(void **state)
{
    (void)state;
    struct world world = open_world();
    const float before = shown_intensity(&world, 0);
    dim(&world, 3);
    dim(&world, 4);
    fail_all(world.store);
    assert_true(shown_intensity(&world, 0) == before);
    dim(&world, 5);
    publish_all(world.store);
    assert_true(shown_intensity(&world, 0) == 5);
    assert_int_equal(entry_of(&world)->revision, 2); // the numbers were not used up
    bd_store_destroy(&world.store);
}

// Both were one transaction: the name could not be given, the edit is on the disk.
static void a_name_that_fails_takes_no_edit_back(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_batch *name;
    const struct bd_scene *head;
    uint64_t revision;
    dim(&world, 5);
    assert_int_equal(bd_store_stage_name(world.store, world.id, "none", 0, true, &name, NULL),
                     BD_ERR_OK);
    dim(&world, 6);
    struct bd_batch *first = bd_store_take_staged(world.store), *last = name->next;
    assert_ptr_equal(first->next, name);
    bd_store_fail(world.store, name);
    bd_batch_free(&name);
    assert_int_equal(bd_store_head(world.store, world.id, &head, &revision, NULL), BD_ERR_OK);
    assert_int_equal(revision, 3);
    assert_true(head->lights[0].intensity == 6);
    bd_store_publish(world.store, first);
    bd_store_publish(world.store, last);
    bd_batch_free(&first);
    bd_batch_free(&last);
    assert_int_equal(entry_of(&world)->revision, 3);
    bd_store_destroy(&world.store);
}

static void holdings_count_what_is_on_its_way(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_scene *scene = load(own_scenes, "two_lights.glb");
    struct bd_batch *batch;
    assert_non_null(scene);
    const uint64_t bytes = bd_scene_bytes(scene);
    assert_int_equal(bd_store_stage_add(world.store, scene, "three", "me", &batch, NULL),
                     BD_ERR_OK);
    struct bd_store_holdings all = bd_store_holdings(world.store, "me", "");
    struct bd_store_holdings but = bd_store_holdings(world.store, "me", world.id);
    struct bd_store_holdings none = bd_store_holdings(world.store, "you", "");
    assert_true(all.scenes == 2 && all.bytes == 2 * bytes);
    assert_true(but.scenes == 2 && but.bytes == bytes);
    assert_true(none.scenes == 0 && none.bytes == 0);
    bd_scene_release(&scene);
    fail_all(world.store);
    assert_int_equal(bd_store_holdings(world.store, "me", "").scenes, 1);
    bd_store_destroy(&world.store);
}

static void a_stale_base_is_refused(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_err_detail detail;
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 1, NULL, dimmed(&world, 0, 3), NULL),
                     BD_ERR_OK);
    // Already while the first is on its way.
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 1, NULL, dimmed(&world, 0, 4), &detail),
                     BD_ERR_CONFLICT);
    assert_string_equal(detail.field, "base_revision");
    assert_string_equal(detail.message, "the scene is at revision 2, not 1");
    publish_all(world.store);
    assert_true(shown_intensity(&world, 0) == 3);
    bd_store_destroy(&world.store);
}

static void transient_changes_lie_over_it(void **state)
{
    (void)state;
    struct world world = open_world();
    lay(&world, 0, 7);
    lay(&world, 0, 8);
    assert_true(shown_intensity(&world, 0) == 8);
    assert_int_equal(entry_of(&world)->revision, 1);
    assert_int_equal(entry_of(&world)->transient, 2);

    // An edit of another object leaves them; one of the same object wins.
    struct bd_delta other = dimmed(&world, 1, 3);
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, NULL, other, NULL), BD_ERR_OK);
    publish_all(world.store);
    assert_true(shown_intensity(&world, 0) == 8 && shown_intensity(&world, 1) == 3);
    dim(&world, 5);
    publish_all(world.store);
    assert_true(shown_intensity(&world, 0) == 5);
    assert_int_equal(entry_of(&world)->transient, 0);
    bd_store_destroy(&world.store);
}

// A drag in one place takes no edit back that is made in another, on the disk or on its way to it.
static void a_commit_holds_what_was_laid_and_no_more(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_err_detail detail;
    struct bd_batch *batch;
    lay(&world, 0, 7);
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, NULL, dimmed(&world, 1, 3), NULL),
                     BD_ERR_OK);
    publish_all(world.store);
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, NULL, dimmed(&world, 1, 4), NULL),
                     BD_ERR_OK);
    assert_int_equal(bd_store_stage_commit(world.store, world.id, NULL, NULL, &batch, &detail),
                     BD_ERR_BUSY);
    assert_string_equal(detail.field, "commit");
    publish_all(world.store);
    batch = commit(&world);
    assert_int_equal(batch->forward.count, 1);
    publish_all(world.store);
    assert_true(shown_intensity(&world, 0) == 7 && shown_intensity(&world, 1) == 4);
    bd_store_destroy(&world.store);
}

static void a_commit_makes_one_batch_of_them(void **state)
{
    (void)state;
    struct world world = open_world();
    const float before = shown_intensity(&world, 0);
    lay(&world, 0, 7);
    lay(&world, 1, 8);
    struct bd_batch *batch = commit(&world);
    assert_int_equal(batch->forward.count, 2);
    assert_int_equal(batch->revision, 2);
    // The inverse leads to what was durable, not to a step of the drag.
    assert_true(batch->inverse.changes[0].light.intensity == before);
    // Until it is durable it is shown, as transient.
    assert_true(shown_intensity(&world, 0) == 7);
    assert_int_equal(entry_of(&world)->transient, 2);
    lay(&world, 0, 9); // the drag goes on meanwhile
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->revision, 2);
    assert_int_equal(entry_of(&world)->transient, 1);
    assert_true(shown_intensity(&world, 0) == 9 && shown_intensity(&world, 1) == 8);
    assert_non_null(commit(&world));
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->transient, 0);
    assert_null(commit(&world)); // nothing lies there
    bd_store_destroy(&world.store);
}

static void a_commit_that_fails_loses_nothing(void **state)
{
    (void)state;
    struct world world = open_world();
    lay(&world, 0, 7);
    lay(&world, 1, 8);
    assert_non_null(commit(&world));
    lay(&world, 0, 9);
    fail_all(world.store);
    assert_true(shown_intensity(&world, 0) == 9 && shown_intensity(&world, 1) == 8);
    assert_int_equal(entry_of(&world)->transient, 3);
    lay(&world, 1, 6);
    assert_int_equal(entry_of(&world)->transient, 4);
    struct bd_batch *batch = commit(&world);
    assert_int_equal(batch->forward.count, 2);
    assert_true(batch->forward.changes[0].light.intensity == 9);
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->revision, 2);
    bd_store_destroy(&world.store);
}

// --- ids ------------------------------------------------------------------------------------

// A new node, as an operation makes it of `base`.
static struct bd_delta added_node(const struct bd_scene *base, int32_t light, int32_t *id)
{
    const struct bd_edit_op op = {.kind = BD_EDIT_ADD_NODE, FIELDS(WHOLE(light, light))};
    struct bd_delta delta;
    assert_int_equal(bd_edit_check(base, &op, 1, &bd_edit_default_limits, &delta, id, NULL),
                     BD_ERR_OK);
    return delta;
}

static int32_t stage_node(const struct world *world)
{
    const struct bd_scene *head;
    uint64_t revision;
    int32_t id;
    assert_int_equal(bd_store_head(world->store, world->id, &head, &revision, NULL), BD_ERR_OK);
    struct bd_delta delta = added_node(head, BD_NONE, &id);
    assert_int_equal(stage_as(world, BD_BATCH_EDIT, 0, NULL, delta, NULL), BD_ERR_OK);
    return id;
}

static enum bd_err lay_node(const struct world *world, int32_t light, int32_t *id,
                            struct bd_err_detail *detail)
{
    const struct bd_store_entry *entry;
    struct bd_delta delta = added_node(entry_of(world)->scene, light, id);
    enum bd_err err = bd_store_lay(world->store, world->id, "me", &delta, &entry, detail);
    bd_delta_finish(&delta);
    return err;
}

static bool shows_node(const struct world *world, int32_t id)
{
    const struct bd_scene *scene = entry_of(world)->scene;
    return (uint32_t)id < scene->node_count && !scene->nodes[id].is_removed;
}

// What one client drags and what another one keeps are two things, in any order.
static void an_id_is_given_once(void **state)
{
    (void)state;
    struct world world = open_world();
    int32_t dragged, kept, later;
    assert_int_equal(lay_node(&world, 0, &dragged, NULL), BD_ERR_OK);
    kept = stage_node(&world);
    assert_int_not_equal(kept, dragged);
    publish_all(world.store);
    assert_true(shows_node(&world, dragged) && shows_node(&world, kept));
    assert_int_equal(entry_of(&world)->transient, 1);
    assert_int_equal(entry_of(&world)->scene->nodes[dragged].light, 0);
    assert_int_equal(commit(&world)->forward.count, 1);
    publish_all(world.store);
    assert_true(shows_node(&world, dragged) && shows_node(&world, kept));

    // Nor by a batch that comes after one that was on its way when it was laid, or failed.
    dim(&world, 3);
    assert_int_equal(lay_node(&world, 0, &dragged, NULL), BD_ERR_OK);
    publish_all(world.store);
    dim(&world, 4);
    fail_all(world.store);
    later = stage_node(&world);
    assert_int_not_equal(later, dragged);
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->transient, 1);
    assert_true(shows_node(&world, dragged) && shows_node(&world, later));
    bd_store_destroy(&world.store);
}

static void an_id_that_was_dropped_is_not_given_again(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_err_detail detail;
    int32_t dragged, later;
    const struct bd_edit_op removal[] = {{.kind = BD_EDIT_REMOVE_NODE, .id = 0}};
    const struct bd_edit_op below = {.kind = BD_EDIT_ADD_NODE, FIELDS(WHOLE(parent, 0))};
    const struct bd_store_entry *entry = entry_of(&world);
    struct bd_delta delta;
    uint8_t hash[32];
    assert_int_equal(
        bd_edit_check(entry->scene, &below, 1, &bd_edit_default_limits, &delta, &dragged, &detail),
        BD_ERR_OK);
    assert_int_equal(bd_store_lay(world.store, world.id, "me", &delta, &entry, &detail), BD_ERR_OK);
    bd_delta_finish(&delta);
    const struct bd_scene *head;
    uint64_t revision;
    assert_int_equal(bd_store_head(world.store, world.id, &head, &revision, NULL), BD_ERR_OK);
    assert_int_equal(
        bd_edit_check(head, removal, 1, &bd_edit_default_limits, &delta, NULL, &detail), BD_ERR_OK);
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, NULL, delta, NULL), BD_ERR_OK);
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->transient, 0); // its parent is gone
    assert_false(shows_node(&world, dragged));
    memcpy(hash, entry_of(&world)->scene->content_sha256, sizeof hash);
    assert_int_equal(lay_node(&world, BD_NONE, &later, NULL), BD_ERR_OK);
    assert_int_not_equal(later, dragged);
    assert_int_not_equal(stage_node(&world), dragged);
    fail_all(world.store);
    // Slots that nothing lies in are in no hash.
    assert_int_equal(bd_store_head(world.store, world.id, &head, &revision, NULL), BD_ERR_OK);
    assert_memory_equal(head->content_sha256, hash, sizeof hash);
    bd_store_destroy(&world.store);
}

static void an_id_on_its_way_is_waited_for(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_err_detail detail;
    int32_t kept = stage_node(&world), dragged;
    assert_int_equal(lay_node(&world, BD_NONE, &dragged, &detail), BD_ERR_BUSY);
    assert_string_equal(detail.field, "ops");
    assert_int_equal(entry_of(&world)->transient, 0);
    lay(&world, 0, 7); // what adds nothing does not wait
    publish_all(world.store);
    assert_int_equal(lay_node(&world, BD_NONE, &dragged, &detail), BD_ERR_OK);
    assert_int_not_equal(dragged, kept);
    assert_true(shown_intensity(&world, 0) == 7);
    bd_store_destroy(&world.store);
}

// A replay does not ask which ids are free.
static void states_of_two_objects_are_not_mixed(void **state)
{
    (void)state;
    struct world world = open_world();
    int32_t dragged, same;
    const struct bd_scene *head;
    uint64_t revision;
    assert_int_equal(bd_store_head(world.store, world.id, &head, &revision, NULL), BD_ERR_OK);
    struct bd_delta replayed = added_node(head, 1, &same);
    assert_int_equal(lay_node(&world, 0, &dragged, NULL), BD_ERR_OK);
    assert_int_equal(same, dragged);
    lay(&world, 0, 7);
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, NULL, replayed, NULL), BD_ERR_OK);
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->transient, 0);
    assert_int_equal(entry_of(&world)->scene->nodes[same].light, 1);
    assert_true(shown_intensity(&world, 0) != 7);
    bd_store_destroy(&world.store);
}

// --- history --------------------------------------------------------------------------------

static void undo_and_redo_find_their_revisions(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_err_detail detail;
    uint64_t target;
    assert_int_equal(bd_store_undo_target(world.store, world.id, NULL, false, &target, &detail),
                     BD_ERR_CONFLICT);
    assert_string_equal(detail.message, "there is nothing to undo");
    dim(&world, 3); // 2
    assert_int_equal(bd_store_undo_target(world.store, world.id, NULL, false, &target, &detail),
                     BD_ERR_BUSY);
    dim(&world, 4); // 3
    publish_all(world.store);
    static const struct {
        enum bd_batch_kind kind;
        uint64_t undo, redo; // after it; 0: nothing
    } steps[] = {
        {BD_BATCH_UNDO, 2, 4}, // 4 takes back 3
        {BD_BATCH_UNDO, 0, 5}, // 5 takes back 2
        {BD_BATCH_REDO, 6, 4}, // 6 takes back 5
        {BD_BATCH_EDIT, 7, 0}, // a new edit ends what could be redone
        {BD_BATCH_UNDO, 6, 8},
    };
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        struct bd_delta delta = dimmed(&world, 0, 10 + (float)i);
        assert_int_equal(stage_as(&world, steps[i].kind, 0, NULL, delta, NULL), BD_ERR_OK);
        publish_all(world.store);
        enum bd_err undo = bd_store_undo_target(world.store, world.id, NULL, false, &target, NULL);
        assert_int_equal(undo ? 0 : target, steps[i].undo);
        enum bd_err redo = bd_store_undo_target(world.store, world.id, NULL, true, &target, NULL);
        assert_int_equal(redo ? 0 : target, steps[i].redo);
    }
    bd_store_destroy(&world.store);
}

static void stage_by(const struct world *world, enum bd_batch_kind kind, uint64_t of,
                     const char *author, struct bd_delta delta)
{
    const struct bd_store_change change = {
        .scene_id = world->id, .kind = kind, .of = of, .author = author, .delta = &delta};
    struct bd_batch *batch;
    assert_int_equal(bd_store_stage(world->store, &change, &batch, NULL), BD_ERR_OK);
    publish_all(world->store);
}

static uint64_t target_of(const struct world *world, const char *author, bool redo)
{
    uint64_t target;
    enum bd_err err = bd_store_undo_target(world->store, world->id, author, redo, &target, NULL);
    return err ? 0 : target;
}

static void everybody_has_a_past_of_their_own(void **state)
{
    (void)state;
    struct world world = open_world();
    static const struct {
        enum bd_batch_kind kind;
        uint64_t of;
        const char *author;
        uint64_t undo[3], redo[3]; // after it: of a, of b, of whoever
    } steps[] = {
        {BD_BATCH_EDIT, 0, "a", {2, 0, 2}, {0, 0, 0}},
        {BD_BATCH_EDIT, 0, "b", {2, 3, 3}, {0, 0, 0}},
        {BD_BATCH_EDIT, 0, "a", {4, 3, 4}, {0, 0, 0}},
        {BD_BATCH_EDIT, 0, "b", {4, 5, 5}, {0, 0, 0}},
        {BD_BATCH_UNDO, 4, "a", {2, 5, 5}, {6, 0, 6}},
        {BD_BATCH_EDIT, 0, "b", {2, 7, 7}, {6, 0, 0}}, // and a may still redo
        {BD_BATCH_REDO, 6, "a", {8, 7, 8}, {0, 0, 0}},
        {BD_BATCH_UNDO, 7, "a", {8, 5, 8}, {9, 0, 9}},   // what is b's
        {BD_BATCH_REDO, 9, "a", {8, 10, 10}, {0, 0, 0}}, // is b's again
        {BD_BATCH_UNDO, 8, "a", {2, 10, 10}, {11, 0, 11}},
        {BD_BATCH_EDIT, 0, "a", {12, 10, 12}, {0, 0, 0}}, // an edit of one's own ends it
    };
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
        const char *const who[] = {"a", "b", NULL};
        stage_by(&world, steps[i].kind, steps[i].of, steps[i].author,
                 dimmed(&world, 0, 10 + (float)i));
        for (int k = 0; k < 3; k++) {
            assert_int_equal(target_of(&world, who[k], false), steps[i].undo[k]);
            assert_int_equal(target_of(&world, who[k], true), steps[i].redo[k]);
        }
    }
    struct bd_err_detail detail;
    uint64_t target;
    assert_int_equal(bd_store_undo_target(world.store, world.id, "c", false, &target, &detail),
                     BD_ERR_CONFLICT);
    assert_string_equal(detail.message,
                        "there is nothing of yours to undo; the last that there is is revision 12, "
                        "by a: the scope \"all\" takes it");
    bd_store_destroy(&world.store);
}

// --- two who drag at once -------------------------------------------------------------------

static struct bd_light *light_of(struct bd_delta *delta)
{
    return &delta->changes[0].light;
}

// What is shown of light 0, changed by `by`: its intensity, or its red.
static void drag(const struct world *world, const char *by, float intensity, float red)
{
    const struct bd_store_entry *entry = entry_of(world);
    struct bd_delta delta = {0};
    assert_true(bd_delta_take(&delta, entry->scene, BD_OBJECT_LIGHT, 0));
    if (intensity >= 0) light_of(&delta)->intensity = intensity;
    if (red >= 0) light_of(&delta)->color[0] = red;
    assert_int_equal(bd_store_lay(world->store, world->id, by, &delta, &entry, NULL), BD_ERR_OK);
    bd_delta_finish(&delta);
}

static struct bd_batch *commit_of(const struct world *world, const char *author)
{
    struct bd_batch *batch;
    assert_int_equal(bd_store_stage_commit(world->store, world->id, author, NULL, &batch, NULL),
                     BD_ERR_OK);
    return batch;
}

static void expect_light(const struct bd_scene *scene, float intensity, float red)
{
    assert_float_equal(scene->lights[0].intensity, intensity, 0);
    assert_float_equal(scene->lights[0].color[0], red, 0);
}

static void each_commits_what_they_did(void **state)
{
    (void)state;
    struct world world = open_world();
    const struct bd_light was = entry_of(&world)->scene->lights[0];
    drag(&world, "a", 3, -1);
    drag(&world, "b", -1, 0.25f); // over what a laid
    drag(&world, "a", 4, -1);     // and a over that
    assert_int_equal(entry_of(&world)->transient, 3);
    expect_light(entry_of(&world)->scene, 4, 0.25f);
    struct bd_batch *batch = commit_of(&world, "a");
    assert_string_equal(batch->author, "a");
    expect_light(batch->after, 4, was.color[0]); // of a's alone
    expect_light(entry_of(&world)->scene, 4, 0.25f);
    batch = commit_of(&world, "b"); // behind it, in the same turn
    assert_string_equal(batch->author, "b");
    expect_light(batch->after, 4, 0.25f);
    assert_null(commit_of(&world, "b"));
    publish_all(world.store);
    assert_int_equal(entry_of(&world)->transient, 0);
    assert_int_equal(entry_of(&world)->revision, 3);
    expect_light(entry_of(&world)->scene, 4, 0.25f);
    bd_store_destroy(&world.store);
}

static void what_cannot_be_kept_is_theirs_again(void **state)
{
    (void)state;
    struct world world = open_world();
    const struct bd_light was = entry_of(&world)->scene->lights[0];
    drag(&world, "a", 3, -1);
    drag(&world, "b", -1, 0.25f);
    assert_non_null(commit_of(&world, NULL)); // who laid longest ago
    assert_non_null(commit_of(&world, NULL));
    assert_null(commit_of(&world, NULL));
    assert_int_equal(entry_of(&world)->transient_ns, 0);
    drag(&world, "b", -1, 0.5f);
    fail_all(world.store);
    expect_light(entry_of(&world)->scene, 3, 0.5f);
    assert_int_equal(entry_of(&world)->transient, 3);
    assert_true(entry_of(&world)->transient_ns > 0);
    struct bd_batch *batch = commit_of(&world, "b");
    expect_light(batch->after, was.intensity, 0.5f);
    publish_all(world.store);
    assert_string_equal(commit_of(&world, NULL)->author, "a");
    publish_all(world.store);
    expect_light(entry_of(&world)->scene, 3, 0.5f);
    bd_store_destroy(&world.store);
}

static void an_edit_id_is_used_once(void **state)
{
    (void)state;
    struct world world = open_world();
    struct bd_err_detail detail;
    uint64_t revision;
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, "e1", dimmed(&world, 0, 3), NULL),
                     BD_ERR_OK);
    assert_int_equal(bd_store_find_edit(world.store, world.id, "e1", &revision, &detail),
                     BD_ERR_BUSY);
    publish_all(world.store);
    assert_int_equal(bd_store_find_edit(world.store, world.id, "e1", &revision, NULL), BD_ERR_OK);
    assert_int_equal(revision, 2);
    assert_int_equal(bd_store_find_edit(world.store, world.id, "e2", &revision, NULL), BD_ERR_OK);
    assert_int_equal(revision, 0);
    // One that failed may be tried again.
    assert_int_equal(stage_as(&world, BD_BATCH_EDIT, 0, "e2", dimmed(&world, 0, 4), NULL),
                     BD_ERR_OK);
    fail_all(world.store);
    assert_int_equal(bd_store_find_edit(world.store, world.id, "e2", &revision, NULL), BD_ERR_OK);
    assert_int_equal(revision, 0);
    bd_store_destroy(&world.store);
}

int main(int argc, char **argv)
{
    assert_true(argc > 1);
    own_scenes = argv[1];
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holds_so_many_scenes),
        cmocka_unit_test(nobody_sees_what_is_staged),
        cmocka_unit_test(edits_are_shown_once_they_are_durable),
        cmocka_unit_test(what_fails_was_never_there),
        cmocka_unit_test(a_name_that_fails_takes_no_edit_back),
        cmocka_unit_test(holdings_count_what_is_on_its_way),
        cmocka_unit_test(a_stale_base_is_refused),
        cmocka_unit_test(transient_changes_lie_over_it),
        cmocka_unit_test(a_commit_holds_what_was_laid_and_no_more),
        cmocka_unit_test(a_commit_makes_one_batch_of_them),
        cmocka_unit_test(a_commit_that_fails_loses_nothing),
        cmocka_unit_test(an_id_is_given_once),
        cmocka_unit_test(an_id_that_was_dropped_is_not_given_again),
        cmocka_unit_test(an_id_on_its_way_is_waited_for),
        cmocka_unit_test(states_of_two_objects_are_not_mixed),
        cmocka_unit_test(undo_and_redo_find_their_revisions),
        cmocka_unit_test(everybody_has_a_past_of_their_own),
        cmocka_unit_test(each_commits_what_they_did),
        cmocka_unit_test(what_cannot_be_kept_is_theirs_again),
        cmocka_unit_test(an_edit_id_is_used_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
