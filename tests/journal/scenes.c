// Scenes through the journal and back, with content that is damaged, a disk that does not answer,
// and a past that is larger than memory should be.
//
// usage: scenes FOLDER of scenes | scenes --load DIRECTORY

#include <sys/resource.h>

#include "base/log.h"
#include "base/sanitizer.h"
#include "scene/journal/journal_internal.h"
#include "scene/store/store_journal.h"
#include "tests/journal/failing_vfs.h"
#include "tests/journal/kit.h"
#include "tests/unit/scene/snapshots.h"

#define SKY_WIDTH_PX       32
#define LARGE_SKY_WIDTH_PX 512
// 144 MiB of skies, of which the scene shows one.
#define PAST_SKIES   96
#define PEAK_KIB_MAX (100 << 10)

static const char *program, *scene_folder;

// --- a store over a journal -----------------------------------------------------------------

struct world {
    char directory[64];
    char id[BD_SCENE_ID_BYTES];
    uint32_t sky_width_px;
    struct bd_journal *journal;
    struct bd_store *store;
};

static void must(enum bd_err err, const struct bd_err_detail *detail)
{
    if (err) fail_msg("%s: %s", detail->field, detail->message);
}

static void open_journal(struct world *world)
{
    struct bd_err_detail detail = {0};
    world->store = bd_store_create(4);
    must(bd_journal_open(world->directory, &world->journal, &detail), &detail);
}

static void close_journal(struct world *world)
{
    bd_store_destroy(&world->store);
    bd_journal_close(&world->journal);
}

// As after an end of the daemon, up to its first look at the scenes.
static void start_again(struct world *world)
{
    close_journal(world);
    open_journal(world);
}

static void load_all(struct world *world)
{
    struct bd_err_detail detail = {0};
    must(bd_store_load(world->store, world->journal, &detail), &detail);
}

static void keep(struct world *world)
{
    struct bd_err_detail detail = {0};
    const struct bd_batch *faulty;
    struct bd_batch *batch = bd_store_take_staged(world->store);
    assert_non_null(batch);
    must(bd_store_write(world->journal, batch, &faulty, &detail), &detail);
    bd_store_publish(world->store, batch);
    bd_batch_free(&batch);
}

static int set_up(void **state)
{
    struct world *world = calloc(1, sizeof *world);
    struct bd_scene *scene = load(scene_folder, "two_lights.glb");
    struct bd_batch *batch;
    assert_true(world && scene);
    kit_make_directory(world->directory);
    world->sky_width_px = SKY_WIDTH_PX;
    open_journal(world);
    assert_int_equal(bd_store_stage_add(world->store, scene, "two", "me", &batch, NULL), BD_ERR_OK);
    memcpy(world->id, batch->scene_id, sizeof world->id);
    bd_scene_release(&scene);
    keep(world);
    *state = world;
    return 0;
}

static int tear_down(void **state)
{
    struct world *world = *state;
    close_journal(world);
    kit_remove_directory(world->directory);
    free(world);
    return 0;
}

// --- skies: content that is easily made -----------------------------------------------------

static struct bd_sky_map *make_sky(const struct world *world, float radiance)
{
    struct bd_sky_map *sky = calloc(1, sizeof *sky);
    const uint32_t width_px = world->sky_width_px, height_px = width_px / 2;
    const size_t floats = (size_t)3 * width_px * height_px;
    assert_non_null(sky);
    *sky = (struct bd_sky_map){.reference_count = 1,
                               .width_px = width_px,
                               .height_px = height_px,
                               .rgb = malloc(floats * sizeof(float))};
    assert_non_null(sky->rgb);
    for (size_t i = 0; i < floats; i++) sky->rgb[i] = radiance;
    bd_sky_map_seal(sky);
    return sky;
}

// One revision more.
static void show_sky(struct world *world, float radiance)
{
    struct bd_delta delta = {0};
    const struct bd_scene *head;
    struct bd_batch *batch;
    uint64_t revision;
    assert_int_equal(bd_store_head(world->store, world->id, &head, &revision, NULL), BD_ERR_OK);
    assert_true(bd_delta_take(&delta, head, BD_OBJECT_ENVIRONMENT, 0));
    bd_sky_map_release(&delta.changes[0].environment.map);
    delta.changes[0].environment.map = make_sky(world, radiance);
    const struct bd_store_change change = {
        .scene_id = world->id, .kind = BD_BATCH_EDIT, .delta = &delta};
    assert_int_equal(bd_store_stage(world->store, &change, &batch, NULL), BD_ERR_OK);
    bd_delta_finish(&delta);
    keep(world);
}

static const struct bd_store_entry *entry_of(const struct world *world)
{
    const struct bd_store_entry *entry;
    assert_int_equal(bd_store_get(world->store, world->id, &entry, NULL), BD_ERR_OK);
    return entry;
}

// 0: there is none.
static void expect_sky(const struct world *world, uint64_t revision, float radiance)
{
    const struct bd_store_entry *entry = entry_of(world);
    const struct bd_sky_map *shown = entry->scene->environment.map;
    assert_int_equal(entry->revision, revision);
    assert_true(shown ? shown->rgb[0] == radiance : radiance == 0);
}

static bool has_sky(const struct world *world, float radiance)
{
    struct bd_sky_map *sky = make_sky(world, radiance);
    struct bd_err_detail detail = {0};
    bool is_there = false;
    must(bd_journal_has_content(world->journal, sky->sha256, &is_there, &detail), &detail);
    bd_sky_map_release(&sky);
    return is_there;
}

// What the disk holds of it is not what it was; nobody knows until it is read.
static void damage_sky(struct world *world, float radiance)
{
    struct bd_sky_map *sky = make_sky(world, radiance);
    sqlite3_stmt *spoil;
    assert_int_equal(sqlite3_prepare_v2(world->journal->db,
                                        "UPDATE parts SET bytes=zeroblob(length(bytes)) WHERE"
                                        " content=(SELECT id FROM contents WHERE sha256=?1)",
                                        -1, &spoil, NULL),
                     SQLITE_OK);
    sqlite3_bind_blob(spoil, 1, sky->sha256, sizeof sky->sha256, SQLITE_STATIC);
    assert_int_equal(sqlite3_step(spoil), SQLITE_DONE);
    sqlite3_finalize(spoil);
    assert_true(sqlite3_changes(world->journal->db) > 0);
    bd_sky_map_release(&sky);
}

static void write_snapshot(struct world *world)
{
    struct bd_err_detail detail = {0};
    const struct bd_store_entry *entry = entry_of(world);
    must(bd_store_snapshot(world->journal, world->id, entry->revision, entry->scene, &detail),
         &detail);
}

// --- tests ----------------------------------------------------------------------------------

static void a_scene_comes_back(void **state)
{
    struct world *world = *state;
    show_sky(world, 1);
    show_sky(world, 2);
    start_again(world);
    load_all(world);
    expect_sky(world, 3, 2);
}

// The newest snapshot needs one, an edit behind the older one the other.
static void a_start_looks_past_all_damaged_content(void **state)
{
    struct world *world = *state;
    show_sky(world, 1);
    show_sky(world, 2);
    write_snapshot(world);
    damage_sky(world, 1);
    damage_sky(world, 2);
    start_again(world);
    load_all(world);
    expect_sky(world, 1, 0);
    show_sky(world, 3);
    start_again(world);
    load_all(world);
    expect_sky(world, 2, 3);
}

static void a_snapshot_puts_anew_what_is_damaged(void **state)
{
    struct world *world = *state;
    struct bd_scene *then;
    show_sky(world, 1);
    damage_sky(world, 1);
    // Somebody asks for the past, and so it is found.
    assert_int_equal(bd_store_read_revision(world->journal, world->id, 2, &then, NULL),
                     BD_ERR_NOT_FOUND);
    assert_false(has_sky(world, 1));
    write_snapshot(world);
    assert_true(has_sky(world, 1));
    start_again(world);
    load_all(world);
    expect_sky(world, 2, 1);
}

static void fail_at(struct world *world, uint64_t at)
{
    // Nothing in the cache: each page is a call.
    sqlite3_db_release_memory(world->journal->db);
    failing_at(at ? DISK_FAULT_IO : DISK_FAULT_NONE, at, 1);
}

// It is not damage: a start that meets it may leave the scene out, and cuts nothing off.
static void a_start_on_a_disk_that_does_not_answer_loses_nothing(void **state)
{
    struct world *world = *state;
    bool has_failed = true;
    uint64_t at = 0;
    show_sky(world, 1);
    show_sky(world, 2);
    while (has_failed) {
        struct bd_err_detail detail = {0};
        start_again(world);
        fail_at(world, ++at);
        enum bd_err err = bd_store_load(world->store, world->journal, &detail);
        has_failed = failing_failed_count() > 0;
        fail_at(world, 0);
        assert_true(!err || err == BD_ERR_IO);
        start_again(world);
        load_all(world);
        expect_sky(world, 3, 2);
    }
    assert_true(at > 10);
}

static void the_past_on_a_disk_that_does_not_answer_is_not_missing(void **state)
{
    struct world *world = *state;
    show_sky(world, 1);
    for (uint64_t at = 1;; at++) {
        struct bd_err_detail detail = {0};
        struct bd_scene *then = NULL;
        fail_at(world, at);
        enum bd_err err = bd_store_read_revision(world->journal, world->id, 2, &then, &detail);
        bool has_failed = failing_failed_count() > 0;
        fail_at(world, 0);
        bd_scene_release(&then);
        if (err != (has_failed ? BD_ERR_IO : BD_ERR_OK))
            fail_msg("call %zu: %s: %s", (size_t)at, detail.field, detail.message);
        if (!has_failed) return;
    }
}

// --- memory ---------------------------------------------------------------------------------

static int load_and_tell_peak(const char *directory)
{
    struct rusage usage;
    struct world world = {0};
    snprintf(world.directory, sizeof world.directory, "%s", directory);
    open_journal(&world);
    load_all(&world);
    getrusage(RUSAGE_SELF, &usage);
    printf("%ld\n", usage.ru_maxrss);
    close_journal(&world);
    return 0;
}

// Of a start in a process of its own.
static long peak_kib_of(const struct world *world)
{
    char command[512];
    long peak_kib = 0;
    // What a sanitizer keeps of freed memory is none of ours.
    snprintf(command, sizeof command,
             "ASAN_OPTIONS=$ASAN_OPTIONS:quarantine_size_mb=1 '%s' --load '%s'", program,
             world->directory);
    FILE *child = popen(command, "r");
    assert_non_null(child);
    assert_int_equal(fscanf(child, "%ld", &peak_kib), 1);
    assert_int_equal(pclose(child), 0);
    return peak_kib;
}

static void a_start_does_not_hold_the_past(void **state)
{
    struct world *world = *state;
    world->sky_width_px = LARGE_SKY_WIDTH_PX;
    for (int i = 1; i <= PAST_SKIES; i++) show_sky(world, (float)i);
    close_journal(world);
    long peak_kib = peak_kib_of(world);
    print_message("peak of a start: %ld KiB\n", peak_kib);
    if (!BD_UNDER_THREAD_SANITIZER) assert_in_range(peak_kib, 1, PEAK_KIB_MAX);
    open_journal(world);
    load_all(world);
    expect_sky(world, 1 + PAST_SKIES, PAST_SKIES);
}

int main(int argc, char **argv)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(a_scene_comes_back),
        TEST(a_start_looks_past_all_damaged_content),
        TEST(a_snapshot_puts_anew_what_is_damaged),
        TEST(a_start_on_a_disk_that_does_not_answer_loses_nothing),
        TEST(the_past_on_a_disk_that_does_not_answer_is_not_missing),
        TEST(a_start_does_not_hold_the_past),
    };
    bd_log_setup(BD_LOG_ERROR, false);
    failing_register();
    if (argc == 3 && strcmp(argv[1], "--load") == 0) return load_and_tell_peak(argv[2]);
    if (argc < 2) return 2;
    program = argv[0];
    scene_folder = argv[1];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
