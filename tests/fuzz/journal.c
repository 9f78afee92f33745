// Journals that a disk, a crash or somebody has damaged, and sessions with a journal that is opened
// again and again: no start shows what never was, and the next one shows the same.
//
// The first byte says which:
//   0: five bytes a change of the golden file: where (three), how, by what    1: of its log
//   2: forged rows (forge.h)
//   3: two bytes a step of a session (tests/journal/session.h); 255: it is closed and opened

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/store/store_journal.h"
#include "tests/fuzz/batch.h"
#include "tests/fuzz/derived.h"
#include "tests/fuzz/forge.h"
#include "tests/fuzz/golden.h"
#include "tests/fuzz/machine.h"
#include "tests/journal/session.h"

#include "target.h"

#define DAMAGE_BYTES    5
#define DAMAGES_MAX     32
#define STEPS_MAX       48
#define COLLECT_ROUNDS  64
#define SCENES_MAX      8 // of forged ones there can be none more than were written
#define PAGE            BD_JOURNAL_PAGE_BYTES
#define LOG_FRAME_BYTES (PAGE + 24)

static char directory[64];

// --- damage -----------------------------------------------------------------------------------

static void damage_one(struct file_bytes *file, const uint8_t change[DAMAGE_BYTES], size_t unit)
{
    if (file->size == 0) return;
    const size_t at = (change[0] | change[1] << 8 | (size_t)change[2] << 16) % file->size;
    const uint8_t by = change[4];
    const size_t start = at / unit * unit, other = by * unit % file->size;
    const size_t most = file->size - (start > other ? start : other);
    const size_t length = unit < most ? unit : most;
    switch (change[3] % 6) {
    case 0:
        file->data[at] ^= by;
        break;
    case 1:
        file->data[at] = by;
        break;
    case 2: // a sector, or what is left of it
        memset(file->data + at, by, file->size - at < 512 ? file->size - at : 512);
        break;
    case 3: // a page that went somewhere else
        memmove(file->data + other, file->data + start, length);
        break;
    case 4: // one that never came
        memset(file->data + start, 0, length);
        break;
    default:
        file->size = at;
        break;
    }
}

static struct file_bytes copy_of(const struct file_bytes *file)
{
    struct file_bytes copy = {malloc(file->size + 1), file->size};
    BD_ASSERT(copy.data);
    memcpy(copy.data, file->data, file->size);
    return copy;
}

static void damage(struct file_bytes *file, const uint8_t *changes, size_t size, size_t unit)
{
    for (size_t i = 0; i < DAMAGES_MAX && (i + 1) * DAMAGE_BYTES <= size; i++)
        damage_one(file, changes + i * DAMAGE_BYTES, unit);
}

// --- what is shown ----------------------------------------------------------------------------

struct shown {
    uint32_t count;
    struct bd_store_entry entries[SCENES_MAX];
    uint8_t sha256[SCENES_MAX][BD_SHA256_BYTES];
};

// One start, to what is asked of it.
struct start {
    struct bd_journal *journal;
    struct bd_store *store;
    bool is_forged;
    bool has_failed; // some call met damage: what the next start finds may be less
};

static const struct golden_scene *find_golden(const char *id)
{
    const struct golden *golden = golden_get();
    for (int i = 0; i < GOLDEN_SCENES; i++)
        if (strcmp(golden->scenes[i].id, id) == 0) return &golden->scenes[i];
    return NULL;
}

static bool is_state(const struct golden_scene *golden, uint64_t revision,
                     const struct bd_scene *scene)
{
    return revision >= 1 && revision <= golden->revision &&
           memcmp(golden->sha256[revision], scene->content_sha256, BD_SHA256_BYTES) == 0;
}

static void note(struct start *start, enum bd_err err, const struct bd_err_detail *detail)
{
    if (!err) return;
    BD_ASSERT(detail->message[0]);
    start->has_failed = true;
}

// What can be taken back gives the state before.
static void check_inverse(struct start *start, const struct golden_scene *golden, uint64_t revision,
                          const struct bd_scene *then)
{
    struct bd_scene *before = NULL;
    struct bd_store_step step = {0};
    struct bd_err_detail detail = {0};
    enum bd_err err =
        bd_store_read_step(start->journal, golden->id, revision, then, &step, &detail);
    note(start, err, &detail);
    if (err) return;
    err = bd_delta_apply(then, &step.inverse, &before, &detail);
    if (!start->is_forged) {
        BD_ASSERT_CMP(err, ==, BD_ERR_OK);
        BD_ASSERT(is_state(golden, revision - 1, before));
    }
    bd_store_step_finish(&step);
    bd_scene_release(&before);
}

// What can still be read of the past is what it was.
static void check_revision(struct start *start, const struct golden_scene *golden,
                           uint64_t revision)
{
    struct bd_scene *then = NULL;
    struct bd_err_detail detail = {0};
    enum bd_err err = bd_store_read_revision(start->journal, golden->id, revision, &then, &detail);
    note(start, err, &detail);
    if (err) return;
    if (!start->is_forged) BD_ASSERT(is_state(golden, revision, then));
    if (revision > 1) check_inverse(start, golden, revision, then);
    bd_scene_release(&then);
}

static void check_scene(struct start *start, const struct bd_store_entry *entry)
{
    const struct golden_scene *golden = find_golden(entry->id);
    BD_ASSERT_CMP(entry->transient, ==, 0);
    derived_check_from_scratch(entry->scene);
    if (!start->is_forged) {
        BD_ASSERT(golden);
        BD_ASSERT(is_state(golden, entry->revision, entry->scene));
    }
    for (uint64_t i = 1; golden && i <= golden->revision && i <= entry->revision; i++)
        check_revision(start, golden, i);
}

static void note_shown(const struct start *start, struct shown *out)
{
    out->count = bd_store_count(start->store);
    BD_ASSERT_CMP(out->count, <=, SCENES_MAX);
    for (uint32_t i = 0; i < out->count; i++) {
        out->entries[i] = *bd_store_at(start->store, i);
        memcpy(out->sha256[i], out->entries[i].scene->content_sha256, BD_SHA256_BYTES);
    }
}

// --- going on ---------------------------------------------------------------------------------

static void see_edit(void *user, const struct bd_journal_edit *edit)
{
    BD_ASSERT(edit->kind && edit->message);
    ++*(uint32_t *)user;
}

static void see_name(void *user, const char *name, uint64_t revision)
{
    (void)revision;
    BD_ASSERT(name);
    ++*(uint32_t *)user;
}

static void read_lists(struct start *start, const char *id)
{
    struct bd_err_detail detail = {0};
    uint32_t count = 0;
    uint64_t oldest;
    note(start, bd_journal_each_edit(start->journal, id, 0, UINT32_MAX, see_edit, &count, &detail),
         &detail);
    note(start, bd_journal_each_name(start->journal, id, see_name, &count, &detail), &detail);
    note(start, bd_journal_oldest(start->journal, id, &oldest, &detail), &detail);
}

// One more edit, which is kept whole or not at all.
static void commit_edit(struct start *start, const char *id)
{
    static const char json[] = "{\"ops\":[{\"add_light\":{\"name\":\"more\"}}]}";
    const struct batch_inputs inputs = {0};
    const struct bd_scene *head;
    const struct bd_batch *faulty;
    struct bd_err_detail detail = {0};
    struct bd_delta delta;
    struct bd_batch *staged;
    uint64_t revision;
    Bounced__EditBatch *batch = batch_from_json((const uint8_t *)json, strlen(json));
    enum bd_err err = bd_store_head(start->store, id, &head, &revision, &detail);
    BD_ASSERT(batch && !err);
    err = batch_check(batch, &inputs, head, &delta, NULL, &detail);
    batch_free(batch);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    const struct bd_store_change change = {.scene_id = id, .kind = BD_BATCH_EDIT, .delta = &delta};
    err = bd_store_stage(start->store, &change, &staged, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    staged = bd_store_take_staged(start->store);
    err = bd_store_write(start->journal, staged, &faulty, &detail);
    note(start, err, &detail);
    if (err)
        bd_store_fail(start->store, staged);
    else
        bd_store_publish(start->store, staged);
    bd_batch_free(&staged);
}

static void collect(struct start *start)
{
    struct bd_err_detail detail = {0};
    enum bd_err err = BD_ERR_OK;
    bool is_done = false;
    for (int i = 0; !err && !is_done && i < COLLECT_ROUNDS; i++)
        err = bd_journal_collect(start->journal, &is_done, &detail);
    note(start, err, &detail);
}

static void go_on(struct start *start)
{
    for (uint32_t i = 0; i < bd_store_count(start->store); i++) {
        char id[BD_SCENE_ID_BYTES];
        memcpy(id, bd_store_at(start->store, i)->id, sizeof id);
        read_lists(start, id);
        commit_edit(start, id);
    }
    collect(start);
}

// --- starts -----------------------------------------------------------------------------------

// False if the file is refused.
static bool open_start(struct start *start)
{
    struct bd_err_detail detail = {0};
    start->store = bd_store_create(SCENES_MAX);
    enum bd_err err = bd_journal_open(directory, &start->journal, &detail);
    if (!err) err = bd_store_load(start->store, start->journal, &detail);
    if (err) BD_ASSERT(detail.message[0]);
    return !err;
}

static void close_start(struct start *start)
{
    bd_store_destroy(&start->store);
    bd_journal_close(&start->journal);
}

// Whatever a start shows, the next one shows, if nothing failed in between.
static void expect_again(const struct shown *shown, bool is_forged)
{
    struct start start = {.is_forged = is_forged};
    bool is_open = open_start(&start);
    BD_ASSERT(is_open);
    BD_ASSERT_CMP(bd_store_count(start.store), ==, shown->count);
    for (uint32_t i = 0; i < shown->count; i++) {
        const struct bd_store_entry *entry = bd_store_at(start.store, i);
        BD_ASSERT(strcmp(entry->id, shown->entries[i].id) == 0);
        BD_ASSERT_CMP(entry->revision, ==, shown->entries[i].revision);
        BD_ASSERT(memcmp(entry->scene->content_sha256, shown->sha256[i], BD_SHA256_BYTES) == 0);
    }
    close_start(&start);
}

static void try_start(bool is_forged)
{
    struct start start = {.is_forged = is_forged};
    struct shown shown = {0};
    const bool is_open = open_start(&start);
    if (is_open) {
        for (uint32_t i = 0; i < bd_store_count(start.store); i++)
            check_scene(&start, bd_store_at(start.store, i));
        go_on(&start);
        note_shown(&start, &shown);
    }
    close_start(&start);
    if (is_open && !start.has_failed) expect_again(&shown, is_forged);
}

static void try_damaged(const uint8_t *changes, size_t size, bool in_log)
{
    const struct golden *golden = golden_get();
    struct file_bytes file = copy_of(in_log ? &golden->logged : &golden->whole);
    struct file_bytes log = copy_of(&golden->log);
    damage(in_log ? &log : &file, changes, size, in_log ? LOG_FRAME_BYTES : PAGE);
    file_write(directory, BD_JOURNAL_FILE, file.data, file.size);
    if (in_log) file_write(directory, BD_JOURNAL_FILE "-wal", log.data, log.size);
    free(file.data);
    free(log.data);
    try_start(false);
}

static void try_forged(const uint8_t *changes, size_t size)
{
    const struct golden *golden = golden_get();
    file_write(directory, BD_JOURNAL_FILE, golden->whole.data, golden->whole.size);
    forge(directory, changes, size);
    try_start(true);
}

// --- sessions ---------------------------------------------------------------------------------

static void reopen(struct session *session)
{
    char why[256];
    struct bd_err_detail detail = {0};
    bd_journal_close(&session->journal);
    enum bd_err err = bd_journal_open(directory, &session->journal, &detail);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    bool holds = session_holds(session->journal, &session->kept, why, sizeof why);
    if (!holds) fprintf(stderr, "%s\n", why);
    BD_ASSERT(holds);
}

static void try_session(const uint8_t *steps, size_t size)
{
    static struct session session; // large
    session_begin(&session, 1);
    reopen(&session);
    for (size_t i = 0; i < STEPS_MAX && 2 * i + 1 < size; i++) {
        struct bd_err_detail detail = {0};
        if (steps[2 * i] == 255) {
            reopen(&session);
            continue;
        }
        session.random = (steps[2 * i] | (uint64_t)steps[2 * i + 1] << 8) * 0x9e3779b97f4a7c15u + 7;
        enum bd_err err = session_step(&session, &detail);
        BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    }
    reopen(&session);
    bd_journal_close(&session.journal);
}

// --- the target -------------------------------------------------------------------------------

static void remove_directory(void)
{
    kit_remove_directory(directory);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    if (!directory[0]) {
        kit_make_directory(directory);
        atexit(remove_directory);
        golden_get();
    }
    if (size == 0) return 0;
    // Damage is worth a warning to whoever runs the daemon; here all is damage.
    bd_log_setup(BD_LOG_ERROR, false);
    files_remove(directory);
    machine_begin(2);
    if (bytes[0] % 4 == 2)
        try_forged(bytes + 1, size - 1);
    else if (bytes[0] % 4 == 3)
        try_session(bytes + 1, size - 1);
    else
        try_damaged(bytes + 1, size - 1, bytes[0] % 4 == 1);
    machine_end();
    return 0;
}
