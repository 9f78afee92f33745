// What one turn of the loop staged goes to the journal together, and what becomes of it: with the
// real store and loop, and a journal that fails where a test says so.

#include "net/commit/commit.h"

#include "net/commit/commits.h"
#include "scene/store/store_journal.h"
#include "tests/unit/scene/snapshots.h"

static const char *scene_folder;

// --- a journal that takes only what follows on what it has ------------------------------------

static struct {
    uint32_t fail_count; // of the next writes
    uint64_t revision;
} journal;

enum bd_err __wrap_bd_store_write(struct bd_journal *unused, const struct bd_batch *first,
                                  const struct bd_batch **faulty, struct bd_err_detail *detail);
enum bd_err __wrap_bd_store_write(struct bd_journal *unused, const struct bd_batch *first,
                                  const struct bd_batch **faulty, struct bd_err_detail *detail)
{
    (void)unused;
    *faulty = NULL;
    if (journal.fail_count > 0) {
        journal.fail_count--;
        return bd_err_set(detail, BD_ERR_IO, "journal", "no space left");
    }
    uint64_t revision = journal.revision;
    for (const struct bd_batch *batch = first; batch; batch = batch->next) {
        *faulty = batch;
        if (batch->kind == BD_BATCH_UNNAME)
            return bd_err_set(detail, BD_ERR_NOT_FOUND, "name", "there is no such name");
        if (batch->kind == BD_BATCH_ADD) revision = 0;
        if (batch->revision != revision + 1)
            return bd_err_set(detail, BD_ERR_CONFLICT, "revision", "not the next one");
        revision++;
    }
    journal.revision = revision;
    return BD_ERR_OK;
}

// --- a loop with one scene ------------------------------------------------------------------

struct waiter {
    struct bd_commit_waiter waiter; // first
    struct bd_commits *commits;
    const char *scene_id;
    struct waiter *next;               // who edits as soon as this one has heard
    int32_t light;                     // -1: a name
    uint64_t revision, shown_revision; // as told, and what everybody could see by then
    uint32_t heard;
    enum bd_err err;
};

struct world {
    struct bd_serving serving;
    struct bd_loop loop;
    struct bd_live live;
    struct bd_commits commits;
    char id[BD_SCENE_ID_BYTES];
};

static const struct bd_store_entry *entry_of(const struct bd_commits *commits, const char *id)
{
    const struct bd_store_entry *entry;
    assert_int_equal(bd_store_get(commits->loop->serving->store, id, &entry, NULL), BD_ERR_OK);
    return entry;
}

static void ask(struct waiter *waiter);

static void on_done(struct bd_commit_waiter *commit_waiter, const struct bd_batch *batch,
                    enum bd_err err, const struct bd_err_detail *detail)
{
    struct waiter *waiter = (struct waiter *)commit_waiter;
    assert_true(!err || (detail->err == err && detail->message[0]));
    waiter->heard++;
    waiter->err = err;
    waiter->revision = batch->revision;
    waiter->shown_revision = entry_of(waiter->commits, waiter->scene_id)->revision;
    if (waiter->next) ask(waiter->next);
}

static struct bd_batch *stage_name(const struct waiter *waiter)
{
    struct bd_batch *batch;
    assert_int_equal(bd_store_stage_name(waiter->commits->loop->serving->store, waiter->scene_id,
                                         "none", 0, true, &batch, NULL),
                     BD_ERR_OK);
    return batch;
}

// The light becomes as bright as its number says.
static struct bd_batch *stage_edit(const struct waiter *waiter)
{
    struct bd_store *store = waiter->commits->loop->serving->store;
    struct bd_delta delta = {0};
    const struct bd_scene *head;
    struct bd_batch *batch;
    uint64_t revision;
    assert_int_equal(bd_store_head(store, waiter->scene_id, &head, &revision, NULL), BD_ERR_OK);
    assert_true(bd_delta_take(&delta, head, BD_OBJECT_LIGHT, waiter->light));
    delta.changes[0].light.intensity = 100 + (float)waiter->light;
    const struct bd_store_change change = {
        .scene_id = waiter->scene_id, .kind = BD_BATCH_EDIT, .delta = &delta};
    assert_int_equal(bd_store_stage(store, &change, &batch, NULL), BD_ERR_OK);
    return batch;
}

static void ask(struct waiter *waiter)
{
    struct bd_batch *batch = waiter->light < 0 ? stage_name(waiter) : stage_edit(waiter);
    batch->user = &waiter->waiter;
    bd_commit_soon(waiter->commits);
}

static struct waiter waiter_of(struct world *world, int32_t light, struct waiter *next)
{
    return (struct waiter){.waiter = {on_done},
                           .commits = &world->commits,
                           .scene_id = world->id,
                           .next = next,
                           .light = light};
}

static void run(struct world *world)
{
    assert_int_equal(uv_run(&world->loop.uv, UV_RUN_DEFAULT), 0);
    assert_false(bd_commit_is_pending(&world->commits));
}

static int open_world(void **state)
{
    struct world *world = calloc(1, sizeof *world);
    struct bd_scene *scene = load(scene_folder, "two_lights.glb");
    struct bd_batch *batch;
    assert_true(world && scene);
    memset(&journal, 0, sizeof journal);
    world->serving.store = bd_store_create(4);
    assert_int_equal(uv_loop_init(&world->loop.uv), 0);
    world->loop.serving = &world->serving;
    world->live.loop = world->commits.loop = &world->loop;
    world->commits.live = &world->live;
    bd_commit_begin(&world->commits);
    assert_int_equal(bd_store_stage_add(world->serving.store, scene, "two", "me", &batch, NULL),
                     BD_ERR_OK);
    memcpy(world->id, batch->scene_id, sizeof world->id);
    bd_scene_release(&scene);
    bd_commit_soon(&world->commits);
    run(world);
    *state = world;
    return 0;
}

static int close_world(void **state)
{
    struct world *world = *state;
    bd_commit_close(&world->commits);
    uv_run(&world->loop.uv, UV_RUN_DEFAULT);
    assert_int_equal(uv_loop_close(&world->loop.uv), 0);
    bd_commit_finish(&world->commits);
    bd_store_destroy(&world->serving.store);
    free(world);
    return 0;
}

// --- what becomes of it ---------------------------------------------------------------------

static void who_hears_of_it_can_see_it(void **state)
{
    struct world *world = *state;
    struct waiter first = waiter_of(world, 0, NULL), second = waiter_of(world, 1, NULL);
    ask(&first);
    ask(&second);
    assert_int_equal(entry_of(&world->commits, world->id)->revision, 1);
    run(world);
    assert_true(first.heard == 1 && second.heard == 1 && !first.err && !second.err);
    assert_int_equal(first.revision, 2);
    assert_int_equal(second.revision, 3);
    assert_true(first.shown_revision >= 2);
    assert_int_equal(second.shown_revision, 3);
}

// Both failed with the disk; each edits again the moment that it hears so. What the first one then
// staged has to stand when the second one hears.
static void who_hears_of_a_failure_may_edit_at_once(void **state)
{
    struct world *world = *state;
    struct waiter again[2] = {waiter_of(world, 0, NULL), waiter_of(world, 1, NULL)};
    struct waiter first = waiter_of(world, 0, &again[0]), second = waiter_of(world, 1, &again[1]);
    journal.fail_count = 1;
    ask(&first);
    ask(&second);
    run(world);
    assert_true(first.heard == 1 && second.heard == 1);
    assert_int_equal(first.err, BD_ERR_IO);
    assert_int_equal(second.err, BD_ERR_IO);
    assert_int_equal(first.shown_revision, 1);
    for (uint32_t i = 0; i < 2; i++) {
        assert_int_equal(again[i].heard, 1);
        assert_int_equal(again[i].err, BD_ERR_OK);
        assert_int_equal(again[i].revision, 2 + i);
    }
    const struct bd_store_entry *entry = entry_of(&world->commits, world->id);
    assert_int_equal(entry->revision, 3);
    assert_true(entry->scene->lights[0].intensity == 100);
    assert_true(entry->scene->lights[1].intensity == 101);
}

// What was staged on top of it while it was on its way, and had not been taken, fails with it.
static void what_stands_on_a_failure_fails_with_it(void **state)
{
    struct world *world = *state;
    struct waiter first = waiter_of(world, 0, NULL), second = waiter_of(world, 1, NULL);
    journal.fail_count = 1;
    ask(&first);
    uv_run(&world->loop.uv, UV_RUN_NOWAIT); // takes the first one
    ask(&second);
    run(world);
    assert_true(first.heard == 1 && second.heard == 1);
    assert_int_equal(first.err, BD_ERR_IO);
    assert_int_equal(second.err, BD_ERR_IO);
    assert_int_equal(entry_of(&world->commits, world->id)->revision, 1);
}

static void a_name_that_is_not_there_fails_alone(void **state)
{
    struct world *world = *state;
    struct waiter before = waiter_of(world, 0, NULL), name = waiter_of(world, -1, NULL);
    struct waiter behind = waiter_of(world, 1, NULL);
    ask(&before);
    ask(&name);
    ask(&behind);
    run(world);
    assert_true(before.heard == 1 && name.heard == 1 && behind.heard == 1);
    assert_int_equal(name.err, BD_ERR_NOT_FOUND);
    assert_true(!before.err && !behind.err);
    assert_int_equal(entry_of(&world->commits, world->id)->revision, 3);
}

int main(int argc, char **argv)
{
    assert_true(argc > 1);
    scene_folder = argv[1];
#define WITH_WORLD(test) cmocka_unit_test_setup_teardown(test, open_world, close_world)
    const struct CMUnitTest tests[] = {
        WITH_WORLD(who_hears_of_it_can_see_it),
        WITH_WORLD(who_hears_of_a_failure_may_edit_at_once),
        WITH_WORLD(what_stands_on_a_failure_fails_with_it),
        WITH_WORLD(a_name_that_is_not_there_fails_alone),
    };
    return cmocka_run_group_tests_name("commit", tests, NULL, NULL);
}
