// A disk that does not answer at one call of one request: the request says so, and nobody takes it
// for anything else. Nothing is in the cache, so that every page is a call.

#include <string.h>

#include "base/log.h"
#include "scene/journal/journal_internal.h"
#include "tests/journal/powercut_vfs.h"
#include "tests/journal/story.h"
#include "tests/unit/cmocka_all.h"

static struct story story;
static struct bd_journal *journal;

static int set_up(void **state)
{
    struct bd_err_detail detail = {0};
    (void)state;
    disk_format(1);
    story_make(&story);
    if (bd_journal_open(DISK_DIRECTORY, &journal, &detail)) fail_msg("%s", detail.message);
    assert_int_equal(story_write(&story, journal, &detail), BD_ERR_OK);
    return 0;
}

static int tear_down(void **state)
{
    (void)state;
    bd_journal_close(&journal);
    story_free(&story);
    disk_format(0);
    return 0;
}

static void fail_at(uint64_t at)
{
    sqlite3_db_release_memory(journal->db);
    disk_fail_at(at ? DISK_FAULT_IO : DISK_FAULT_NONE, at, 1);
}

static void expect_io(enum bd_err err, const struct bd_err_detail *detail, uint64_t at)
{
    if (err != BD_ERR_IO || strcmp(detail->field, "data") != 0)
        fail_msg("call %zu: %s, %s", (size_t)at, bd_err_name(err), detail->message);
}

// Less than the whole would be cut off as damaged by whoever asked for it.
static void expect_all_or_nothing(uint64_t revision, uint64_t expected)
{
    for (uint64_t at = 1;; at++) {
        struct bd_err_detail detail = {0};
        struct kit_loaded loaded;
        fail_at(at);
        enum bd_err err = kit_load(journal, "a", revision, &loaded, &detail);
        bool has_failed = disk_failed_count() > 0;
        fail_at(0);
        if (has_failed) {
            expect_io(err, &detail, at);
            continue;
        }
        assert_int_equal(err, BD_ERR_OK);
        assert_int_equal(loaded.revision, expected);
        assert_true(at > 5);
        return;
    }
}

// Its snapshot needs no content, and an edit does.
static void a_read_that_fails_does_not_end_a_scene(void **state)
{
    (void)state;
    expect_all_or_nothing(0, STORY_REVISIONS);
}

static void a_read_that_fails_does_not_end_the_past(void **state)
{
    (void)state;
    expect_all_or_nothing(3, 3);
}

static void content_is_there_or_nobody_knows(void **state)
{
    (void)state;
    bool is_there = true;
    struct bd_err_detail detail = {0};
    fail_at(1);
    enum bd_err err =
        bd_journal_has_content(journal, story.content[1].content.sha256, &is_there, &detail);
    expect_io(err, &detail, 1);
    fail_at(0);
    assert_true(kit_has(journal, &story.content[1]));
}

// One client's mistake is told from a disk that fails everybody.
static void a_failing_disk_is_no_records_fault(void **state)
{
    (void)state;
    const struct bd_journal_record records[] = {
        {.kind = BD_JOURNAL_NAME, .scene = "a", .name = "one", .revision = 3},
        {.kind = BD_JOURNAL_UNNAME, .scene = "a", .name = "one"},
    };
    for (uint64_t at = 1;; at++) {
        struct bd_err_detail detail = {0};
        uint32_t faulty = 0;
        fail_at(at);
        enum bd_err err = bd_journal_commit(journal, records, 2, &faulty, &detail);
        bool has_failed = disk_failed_count() > 0;
        fail_at(0);
        assert_int_equal(faulty, 2);
        if (err) expect_io(err, &detail, at);
        if (has_failed) continue;
        assert_int_equal(err, BD_ERR_OK);
        assert_true(at > 5);
        return;
    }
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(a_read_that_fails_does_not_end_a_scene),
        TEST(a_read_that_fails_does_not_end_the_past),
        TEST(content_is_there_or_nobody_knows),
        TEST(a_failing_disk_is_no_records_fault),
    };
    bd_log_setup(BD_LOG_ERROR, false);
    disk_register();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
