// Batches of edits as clients send them, applied to a small scene by the store: wholly or not at
// all, undone to the same hash, the same from bytes and from nothing.
//
// A script (script.h). Commands:
//   e, end: an EditBatch in JSON, kept      t: one that lies transient
//   x: one that the disk refuses            b: an EditBatch in protobuf, kept
//   d: the payload of the next batch        c: commit what lies transient
//   u: undo    r: redo    v: revert to the revision that the first byte says

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/store/store.h"
#include "tests/fuzz/batch.h"
#include "tests/fuzz/promises.h"
#include "tests/fuzz/script.h"

#include "target.h"

// Each step costs a dozen finished scenes: enough for any order of commands, quick enough to try
// many.
#define STEPS_MAX     32
#define REVISIONS_MAX (2 * STEPS_MAX + 2) // a step makes two at most

struct world {
    struct bd_store *store;
    char id[BD_SCENE_ID_BYTES];
    struct bd_batch *past[REVISIONS_MAX]; // by revision: what made it
    uint64_t revision;
    uint8_t *payload; // of the next batch; never NULL
    size_t payload_bytes;
};

// --- the store ------------------------------------------------------------------------------

static const struct bd_store_entry *entry_of(const struct world *world)
{
    const struct bd_store_entry *entry;
    enum bd_err err = bd_store_get(world->store, world->id, &entry, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    return entry;
}

static struct bd_scene *head_of(const struct world *world)
{
    const struct bd_scene *head;
    uint64_t revision;
    enum bd_err err = bd_store_head(world->store, world->id, &head, &revision, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    BD_ASSERT_CMP(revision, ==, world->revision);
    return bd_scene_retain((struct bd_scene *)head);
}

// What is staged is on the disk: the one batch, which is kept.
static void publish(struct world *world)
{
    struct bd_batch *batch = bd_store_take_staged(world->store);
    BD_ASSERT(batch && !batch->next);
    bd_store_publish(world->store, batch);
    world->revision = batch->revision;
    BD_ASSERT_CMP(world->revision, <, REVISIONS_MAX);
    world->past[world->revision] = batch;
}

static void fail(struct world *world)
{
    struct bd_batch *batch = bd_store_take_staged(world->store);
    BD_ASSERT(batch && !batch->next);
    bd_store_fail(world->store, batch);
    bd_batch_free(&batch);
}

// Nothing lies transient, nothing is on its way: what is shown is what the last batch made.
static void check_rest(const struct world *world)
{
    const struct bd_store_entry *entry = entry_of(world);
    BD_ASSERT_CMP(entry->revision, ==, world->revision);
    if (entry->transient == 0)
        BD_ASSERT(promises_is_same(entry->scene, world->past[world->revision]->after));
    struct bd_scene *head = head_of(world);
    BD_ASSERT(promises_is_same(head, world->past[world->revision]->after));
    bd_scene_release(&head);
}

static void begin(struct world *world)
{
    static struct bd_scene *scene; // made once: it never changes
    if (!scene) scene = batch_small_scene();
    *world = (struct world){.store = bd_store_create(4), .payload = malloc(1)};
    BD_ASSERT(world->payload);
    struct bd_batch *batch;
    enum bd_err err = bd_store_stage_add(world->store, scene, "small", "", &batch, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    memcpy(world->id, batch->scene_id, sizeof world->id);
    publish(world);
}

static void finish(struct world *world)
{
    for (uint64_t i = 1; i <= world->revision; i++) bd_batch_free(&world->past[i]);
    bd_store_destroy(&world->store);
    free(world->payload);
}

// --- batches --------------------------------------------------------------------------------

// Takes the delta.
static bool stage(struct world *world, enum bd_batch_kind kind, uint64_t of, struct bd_delta *delta)
{
    struct bd_err_detail detail = {0};
    struct bd_batch *batch;
    const struct bd_store_change change = {
        .scene_id = world->id, .kind = kind, .of = of, .delta = delta};
    enum bd_err err = bd_store_stage(world->store, &change, &batch, &detail);
    bd_delta_finish(delta);
    if (err) BD_ASSERT(detail.message[0]);
    return !err;
}

// Against what is shown, if it is to lie over that.
static bool check_batch(struct world *world, const Bounced__EditBatch *batch,
                        const struct bd_scene *base, struct bd_delta *delta)
{
    struct bd_err_detail detail = {0};
    const struct batch_inputs inputs = {.payload = world->payload,
                                        .payload_bytes = world->payload_bytes};
    struct bd_scene *after = NULL;
    enum bd_err err = batch_check(batch, &inputs, base, delta, NULL, &detail);
    if (err) {
        BD_ASSERT(detail.message[0] && strncmp(detail.field, "ops", 3) == 0);
        BD_ASSERT_CMP(delta->count, ==, 0);
        return false;
    }
    // What was checked can be applied.
    err = bd_delta_apply(base, delta, &after, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    promises_check(base, delta, after);
    bd_scene_release(&after);
    return true;
}

static void edit(struct world *world, const Bounced__EditBatch *batch, bool is_refused)
{
    struct bd_scene *base = head_of(world);
    struct bd_delta delta;
    if (check_batch(world, batch, base, &delta)) {
        bool staged = stage(world, BD_BATCH_EDIT, 0, &delta);
        BD_ASSERT(staged);
        if (is_refused)
            fail(world);
        else
            publish(world);
    }
    bd_scene_release(&base);
}

static void lay(struct world *world, const Bounced__EditBatch *batch)
{
    struct bd_scene *base = bd_scene_retain(entry_of(world)->scene);
    struct bd_err_detail detail = {0};
    struct bd_delta delta;
    if (check_batch(world, batch, base, &delta)) {
        const struct bd_store_entry *entry;
        struct bd_scene *after = NULL;
        enum bd_err err = bd_delta_apply(base, &delta, &after, &detail);
        if (!err) err = bd_store_lay(world->store, world->id, NULL, &delta, &entry, &detail);
        BD_ASSERT_CMP(err, ==, BD_ERR_OK);
        BD_ASSERT(promises_is_same(entry->scene, after));
        bd_scene_release(&after);
        bd_delta_finish(&delta);
    }
    bd_scene_release(&base);
}

static void commit(struct world *world)
{
    struct bd_scene *shown = bd_scene_retain(entry_of(world)->scene);
    struct bd_batch *batch;
    struct bd_err_detail detail = {0};
    // What had lost its meaning was dropped when it did.
    enum bd_err err = bd_store_stage_commit(world->store, world->id, NULL, NULL, &batch, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    if (batch) {
        publish(world);
        BD_ASSERT(promises_is_same(entry_of(world)->scene, shown));
    }
    bd_scene_release(&shown);
}

static void take_batch(struct world *world, Bounced__EditBatch *batch, int command)
{
    if (!batch) return;
    if (command == 't')
        lay(world, batch);
    else
        edit(world, batch, command == 'x');
    batch_free(batch);
}

// --- the past -------------------------------------------------------------------------------

static void take_back(struct world *world, bool redo)
{
    struct bd_err_detail detail = {0};
    const struct bd_delta none = {0};
    struct bd_delta delta;
    uint64_t of;
    if (bd_store_undo_target(world->store, world->id, NULL, redo, &of, &detail)) {
        BD_ASSERT(detail.message[0]);
        return;
    }
    BD_ASSERT(of > 1 && of <= world->revision);
    bool copied = bd_delta_merge(&none, &world->past[of]->inverse, &delta);
    BD_ASSERT(copied);
    bool staged = stage(world, redo ? BD_BATCH_REDO : BD_BATCH_UNDO, of, &delta);
    BD_ASSERT(staged);
    publish(world);
    BD_ASSERT(promises_is_same(world->past[world->revision]->after, world->past[of - 1]->after));
}

static void revert(struct world *world, uint64_t revision)
{
    struct bd_scene *head = head_of(world);
    struct bd_delta delta;
    bool made = bd_delta_between(head, world->past[revision]->after, &delta);
    BD_ASSERT(made);
    bool staged = stage(world, BD_BATCH_REVERT, revision, &delta);
    BD_ASSERT(staged);
    publish(world);
    BD_ASSERT(promises_is_same(world->past[world->revision]->after, world->past[revision]->after));
    bd_scene_release(&head);
}

static void take_payload(struct world *world, const struct script *script)
{
    free(world->payload);
    world->payload = malloc(script->size ? script->size : 1); // one byte beyond is the sanitizer's
    BD_ASSERT(world->payload);
    memcpy(world->payload, script->bytes, script->size);
    world->payload_bytes = script->size;
}

// --- the target -----------------------------------------------------------------------------

static void step(struct world *world, const struct script *script, int command)
{
    switch (command) {
    case 'b':
        take_batch(world, batch_from_bytes(script->bytes, script->size), command);
        break;
    case 'd':
        take_payload(world, script);
        break;
    case 'c':
        commit(world);
        break;
    case 'u':
    case 'r':
        commit(world); // what lies transient was done last
        take_back(world, command == 'r');
        break;
    case 'v':
        commit(world);
        revert(world, 1 + script_number(script, (uint32_t)world->revision));
        break;
    default:
        take_batch(world, batch_from_json(script->bytes, script->size), command);
        break;
    }
    check_rest(world);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    struct script script;
    struct world world;
    // A transient state that loses its meaning is worth a line in the daemon's log, and none here.
    bd_log_setup(BD_LOG_ERROR, false);
    script_begin(&script, bytes, size);
    begin(&world);
    for (int i = 0, command; i < STEPS_MAX && (command = script_next(&script)) >= 0; i++)
        step(&world, &script, command);
    finish(&world);
    script_finish(&script);
    return 0;
}
