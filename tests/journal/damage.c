// Files that were cut short and bits that flipped: what is served is what was written, whatever is
// missing of it; what cannot be served is refused with a line, and the file is kept.
//
// usage: damage [BITS]

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"
#include "tests/journal/failing_vfs.h"
#include "tests/journal/files.h"
#include "tests/journal/story.h"
#include "tests/unit/cmocka_all.h"

static size_t bit_count = 150;
static char directory[64];
static struct story story;
static struct file_bytes whole, whole_log; // the file; and one with all of it still in the log
static struct file_bytes logged;

static int set_up(void **state)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    (void)state;
    bd_log_setup(BD_LOG_ERROR, false);
    kit_make_directory(directory);
    story_make(&story);
    if (bd_journal_open(directory, &journal, &detail)) fail_msg("%s", detail.message);
    assert_int_equal(story_write(&story, journal, &detail), BD_ERR_OK);
    logged = file_read(directory, BD_JOURNAL_FILE);
    whole_log = file_read(directory, BD_JOURNAL_FILE "-wal");
    assert_true(whole_log.size > 100000);
    bd_journal_close(&journal);
    assert_false(file_exists(directory, BD_JOURNAL_FILE "-wal"));
    whole = file_read(directory, BD_JOURNAL_FILE);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    kit_remove_directory(directory);
    story_free(&story);
    free(whole.data);
    free(logged.data);
    free(whole_log.data);
    return 0;
}

enum outcome { SERVED_WHOLE, SERVED_LESS, REFUSED };

static bool commits(struct bd_journal *journal)
{
    struct bd_err_detail detail = {0};
    struct kit_loaded loaded;
    if (kit_load(journal, "a", 0, &loaded, &detail)) return false;
    if (bd_journal_cut(journal, "a", loaded.revision, &detail)) return false;
    struct kit_edit next;
    kit_make_edit(&next, loaded.revision + 1, loaded.state, 99);
    return kit_commit(journal, "a", &next, &detail) == BD_ERR_OK;
}

// Damage where a start does not look is met by a commit: that one fails, and a start mends it.
static void expect_mended(struct bd_journal **journal, const char *what, size_t at)
{
    struct bd_err_detail detail = {0};
    char why[256];
    bd_journal_close(journal);
    if (bd_journal_open(directory, journal, &detail))
        fail_msg("%s %zu: %s", what, at, detail.message);
    if (!story_is_true(&story, *journal, why, sizeof why)) fail_msg("%s %zu: %s", what, at, why);
    if (!commits(*journal)) fail_msg("%s %zu: no commit", what, at);
}

// Opens what was damaged: nothing that it serves may be wrong, and it must be possible to go on.
static enum outcome try_it(const char *what, size_t at)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    char why[256];
    struct file_bytes before = file_read(directory, BD_JOURNAL_FILE);
    enum bd_err err = bd_journal_open(directory, &journal, &detail);
    if (err && (strcmp(detail.field, "data") != 0 || !strstr(detail.message, BD_JOURNAL_FILE)))
        fail_msg("%s %zu: %s", what, at, detail.message);
    if (err) {
        struct file_bytes after = file_read(directory, BD_JOURNAL_FILE);
        assert_int_equal(after.size, before.size);
        assert_memory_equal(after.data, before.data, after.size);
        free(after.data);
    }
    free(before.data);
    if (err) return REFUSED;
    if (!story_is_true(&story, journal, why, sizeof why)) fail_msg("%s %zu: %s", what, at, why);
    bool is_whole = story_is_whole(&story, journal, why, sizeof why);
    struct bd_journal_stats stats;
    assert_int_equal(bd_journal_get_stats(journal, &stats, &detail), BD_ERR_OK);
    if (stats.scene_count == 2 && !commits(journal)) expect_mended(&journal, what, at);
    bd_journal_close(&journal);
    return is_whole ? SERVED_WHOLE : SERVED_LESS;
}

static void put_files(const struct file_bytes *file, size_t size, const struct file_bytes *log,
                      size_t log_size)
{
    files_remove(directory);
    file_write(directory, BD_JOURNAL_FILE, file->data, size);
    if (log) file_write(directory, BD_JOURNAL_FILE "-wal", log->data, log_size);
}

static void files_that_are_cut_short(void **state)
{
    (void)state;
    size_t counts[3] = {0};
    for (size_t size = 1; size < whole.size; size += size < 8192 ? 1021 : 4093) {
        put_files(&whole, size, NULL, 0);
        enum outcome outcome = try_it("cut at", size);
        // Whatever was lost: the file as it was is there for a person.
        if (outcome == SERVED_LESS) assert_true(file_exists(directory, BD_JOURNAL_FILE ".damaged"));
        counts[outcome]++;
    }
    print_message("cut short: %zu whole, %zu less, %zu refused\n", counts[0], counts[1], counts[2]);
    assert_true(counts[SERVED_LESS] > 5);
    assert_true(counts[REFUSED] > 0);
}

// A log that ends too soon is what a crash leaves: always served, and a prefix of the commits.
static void logs_that_are_cut_short(void **state)
{
    (void)state;
    size_t counts[3] = {0};
    for (size_t size = 0; size < whole_log.size; size += 5003) {
        put_files(&logged, logged.size, &whole_log, size);
        counts[try_it("log cut at", size)]++;
    }
    print_message("log cut short: %zu whole, %zu less, %zu refused\n", counts[0], counts[1],
                  counts[2]);
    assert_int_equal(counts[REFUSED], 0);
    assert_true(counts[SERVED_LESS] > 20);
    put_files(&logged, logged.size, &whole_log, whole_log.size);
    assert_int_equal(try_it("log of bytes", whole_log.size), SERVED_WHOLE);
}

static void bits_that_flip_in_the_log(void **state)
{
    (void)state;
    size_t counts[3] = {0};
    uint64_t random = 5;
    for (int i = 0; i < 40; i++) {
        size_t byte = kit_random(&random) % whole_log.size;
        uint8_t bit = (uint8_t)(1 << kit_random(&random) % 8);
        whole_log.data[byte] ^= bit;
        put_files(&logged, logged.size, &whole_log, whole_log.size);
        whole_log.data[byte] ^= bit;
        counts[try_it("bit of the log", byte)]++;
    }
    print_message("bits of the log: %zu whole, %zu less, %zu refused\n", counts[0], counts[1],
                  counts[2]);
    assert_int_equal(counts[REFUSED], 0);
}

static void bits_that_flip(void **state)
{
    (void)state;
    size_t counts[3] = {0};
    uint64_t random = 3;
    for (size_t i = 0; i < bit_count; i++) {
        size_t byte = kit_random(&random) % whole.size;
        uint8_t bit = (uint8_t)(1 << kit_random(&random) % 8);
        whole.data[byte] ^= bit;
        put_files(&whole, whole.size, NULL, 0);
        whole.data[byte] ^= bit;
        counts[try_it("bit", byte)]++;
    }
    print_message("bits: %zu whole, %zu less, %zu refused\n", counts[0], counts[1], counts[2]);
    assert_true(counts[SERVED_WHOLE] > bit_count / 4);
    assert_true(counts[SERVED_LESS] > bit_count / 10);
    assert_true(counts[REFUSED] < bit_count / 20);
}

// Turns over a byte of what the file holds of it.
static void spoil(const void *data, size_t size)
{
    struct file_bytes file = file_read(directory, BD_JOURNAL_FILE);
    uint8_t *found = memmem(file.data, file.size, data, size);
    assert_non_null(found);
    found[size / 2] ^= 0x40;
    file_write(directory, BD_JOURNAL_FILE, file.data, file.size);
    free(file.data);
}

static struct bd_journal *open_journal(void)
{
    struct bd_journal *journal;
    struct bd_err_detail detail = {0};
    if (bd_journal_open(directory, &journal, &detail)) fail_msg("%s", detail.message);
    return journal;
}

static void expect_revision(struct bd_journal *journal, uint64_t expected)
{
    struct bd_err_detail detail = {0};
    struct kit_loaded loaded;
    assert_int_equal(kit_load(journal, "a", 0, &loaded, &detail), BD_ERR_OK);
    assert_int_equal(loaded.revision, expected);
    assert_true(loaded.state == story.a[expected].state);
}

// Revision 7 needs content 1: it is found when it is read, and the scene ends before it.
static void damaged_content_ends_a_scene_before_it(void **state)
{
    (void)state;
    struct bd_err_detail detail = {0};
    struct bd_journal_stats stats;
    put_files(&whole, whole.size, NULL, 0);
    spoil(story.content[1].bytes, 500);
    struct bd_journal *journal = open_journal();
    expect_revision(journal, STORY_REVISIONS); // nobody has read it yet
    assert_int_equal(kit_read(journal, &story.content[1], &detail), BD_ERR_NOT_FOUND);
    assert_non_null(strstr(detail.message, "is damaged"));
    assert_false(kit_has(journal, &story.content[1]));
    expect_revision(journal, 6);
    // Put again, it is whole again.
    assert_int_equal(kit_put(journal, &story.content[1].content, 1, &detail), BD_ERR_OK);
    assert_int_equal(kit_read(journal, &story.content[1], &detail), BD_ERR_OK);
    expect_revision(journal, STORY_REVISIONS);
    bd_journal_close(&journal);

    spoil(story.content[1].bytes, 500);
    journal = open_journal();
    assert_int_equal(kit_read(journal, &story.content[1], &detail), BD_ERR_NOT_FOUND);
    assert_int_equal(bd_journal_cut(journal, "a", 6, &detail), BD_ERR_OK);
    assert_int_equal(kit_commit(journal, "a", &story.a[8], &detail), BD_ERR_CONFLICT);
    assert_true(commits(journal));
    assert_int_equal(bd_journal_get_stats(journal, &stats, &detail), BD_ERR_OK);
    assert_int_equal(stats.edit_count, 7 + STORY_REVISIONS / 2);
    bd_journal_close(&journal);
}

static void a_damaged_edit_ends_a_scene_before_it(void **state)
{
    (void)state;
    put_files(&whole, whole.size, NULL, 0);
    spoil(story.a[10].forward, 24);
    struct bd_journal *journal = open_journal();
    expect_revision(journal, 9);
    bd_journal_close(&journal);
    assert_true(file_exists(directory, BD_JOURNAL_FILE ".damaged"));
    // Once mended, it is mended; and a second damage does not overwrite the first file.
    spoil(story.a[9].forward, 24);
    journal = open_journal();
    expect_revision(journal, 8);
    bd_journal_close(&journal);
    assert_true(file_exists(directory, BD_JOURNAL_FILE ".damaged.1"));
}

// Of the past alone: the scene is served at its newest, and what needs the edit is refused.
static void a_damaged_past_costs_only_the_past(void **state)
{
    (void)state;
    struct bd_err_detail detail = {0};
    struct bd_journal_edit edit;
    struct kit_loaded loaded;
    put_files(&whole, whole.size, NULL, 0);
    spoil(story.a[3].forward, 24);
    struct bd_journal *journal = open_journal();
    expect_revision(journal, STORY_REVISIONS);
    assert_int_equal(bd_journal_get_edit(journal, "a", 3, &edit, &detail), BD_ERR_IO);
    assert_int_equal(kit_load(journal, "a", 4, &loaded, &detail), BD_ERR_NOT_FOUND);
    assert_int_equal(kit_load(journal, "a", 2, &loaded, &detail), BD_ERR_OK);
    bd_journal_close(&journal);
    assert_false(file_exists(directory, BD_JOURNAL_FILE ".damaged"));
}

// Without the newest snapshot the older one and all edits after it do.
static void a_damaged_snapshot_costs_nothing(void **state)
{
    (void)state;
    struct kit_snapshot snapshot;
    put_files(&whole, whole.size, NULL, 0);
    kit_make_snapshot(&snapshot, 6, story.a[6].state);
    spoil(snapshot.index, 64);
    struct bd_journal *journal = open_journal();
    expect_revision(journal, STORY_REVISIONS);
    bd_journal_close(&journal);
}

static void add_scene(struct bd_journal *journal, const char *id, struct kit_edit edits[3])
{
    struct bd_err_detail detail = {0};
    struct kit_snapshot snapshot;
    kit_make_edit(&edits[1], 1, 0, 3);
    kit_make_edit(&edits[2], 2, edits[1].state, 3);
    kit_make_snapshot(&snapshot, 1, edits[1].state);
    if (kit_add(journal, id, &edits[1], &snapshot, &detail) ||
        kit_commit(journal, id, &edits[2], &detail))
        fail_msg("%s", detail.message);
}

// Its records are still there, and the file that is built anew may give its number to another.
static void what_a_removed_scene_left_is_nobodys(void **state)
{
    (void)state;
    const struct bd_journal_record removal = {.kind = BD_JOURNAL_REMOVE_SCENE, .scene = "c"};
    struct bd_err_detail detail = {0};
    struct bd_journal_stats stats;
    struct kit_edit edits[3];
    put_files(&whole, whole.size, NULL, 0);
    struct bd_journal *journal = open_journal();
    add_scene(journal, "c", edits);
    assert_int_equal(bd_journal_commit(journal, &removal, 1, NULL, &detail), BD_ERR_OK);
    bd_journal_close(&journal);
    spoil(story.a[10].forward, 24);
    journal = open_journal();
    expect_revision(journal, 9);
    assert_int_equal(bd_journal_get_stats(journal, &stats, &detail), BD_ERR_OK);
    assert_int_equal(stats.edit_count, 9 + STORY_REVISIONS / 2);
    add_scene(journal, "d", edits);
    bd_journal_close(&journal);
}

// A part whose row cannot be read is not there: the content is known to be missing before anybody
// reads it, and is whole once it is put again.
static void content_without_all_of_its_parts_is_missing(void **state)
{
    (void)state;
    struct bd_err_detail detail = {0};
    put_files(&whole, whole.size, NULL, 0);
    struct bd_journal *journal = open_journal();
    assert_int_equal(sqlite3_exec(journal->db,
                                  "DELETE FROM parts WHERE content="
                                  "(SELECT id FROM contents WHERE size=3000)",
                                  NULL, NULL, NULL),
                     SQLITE_OK);
    bd_journal_close(&journal);
    spoil(story.a[10].forward, 24);
    journal = open_journal();
    assert_false(kit_has(journal, &story.content[1]));
    assert_true(kit_has(journal, &story.content[0]) && kit_has(journal, &story.content[2]));
    expect_revision(journal, 6);
    assert_int_equal(kit_put(journal, &story.content[1].content, 1, &detail), BD_ERR_OK);
    expect_revision(journal, 9);
    bd_journal_close(&journal);
}

// True if a call failed. The file that is damaged is mended by this start or by the next one.
static bool mend_with_trouble(enum disk_detail detail, uint64_t at, uint64_t count)
{
    struct bd_journal *journal;
    struct bd_err_detail why = {0};
    char what[256];
    failing_at(detail, at, count);
    enum bd_err err = bd_journal_open(directory, &journal, &why);
    bd_journal_close(&journal);
    bool has_failed = failing_failed_count() > 0;
    failing_at(DISK_FAULT_NONE, 0, 0);
    if (err && (!has_failed || strcmp(why.field, "data") != 0))
        fail_msg("call %zu: %s: %s", (size_t)at, why.field, why.message);
    journal = open_journal();
    expect_revision(journal, 9);
    for (int i = 0; i < STORY_CONTENTS; i++)
        assert_int_equal(kit_read(journal, &story.content[i], &why), BD_ERR_OK);
    if (!story_is_true(&story, journal, what, sizeof what))
        fail_msg("call %zu: %s", (size_t)at, what);
    bd_journal_close(&journal);
    return has_failed;
}

// Nothing takes the damaged file's place that is not whole itself, wherever the disk fails.
static void a_file_is_built_anew_whole_or_not_at_all(void **state)
{
    (void)state;
    static const struct {
        enum disk_detail detail;
        uint64_t count;
    } troubles[] = {{DISK_FAULT_IO, 1}, {DISK_FAULT_IO, 0}, {DISK_FAULT_FULL, 0}};
    put_files(&whole, whole.size, NULL, 0);
    spoil(story.a[10].forward, 24);
    struct file_bytes spoiled = file_read(directory, BD_JOURNAL_FILE);
    for (size_t i = 0; i < sizeof troubles / sizeof *troubles; i++) {
        uint64_t at = 0;
        do put_files(&spoiled, spoiled.size, NULL, 0);
        while (mend_with_trouble(troubles[i].detail, ++at, troubles[i].count));
        print_message("mended with trouble at each of %zu calls\n", (size_t)at);
        assert_true(at > 50);
    }
    free(spoiled.data);
}

int main(int argc, char **argv)
{
    if (argc > 1) bit_count = strtoul(argv[1], NULL, 10);
    failing_register();
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(files_that_are_cut_short),
        TEST(logs_that_are_cut_short),
        TEST(bits_that_flip_in_the_log),
        TEST(bits_that_flip),
        TEST(damaged_content_ends_a_scene_before_it),
        TEST(a_damaged_edit_ends_a_scene_before_it),
        TEST(a_damaged_past_costs_only_the_past),
        TEST(a_damaged_snapshot_costs_nothing),
        TEST(what_a_removed_scene_left_is_nobodys),
        TEST(content_without_all_of_its_parts_is_missing),
        TEST(a_file_is_built_anew_whole_or_not_at_all),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
