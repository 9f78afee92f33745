// Every call of the journal: what it keeps, what it refuses, and that it is still there after a
// restart.

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scene/journal/journal_internal.h"
#include "tests/journal/kit.h"
#include "tests/unit/cmocka_all.h"

struct place {
    char directory[64];
    struct bd_journal *journal;
    struct bd_err_detail detail;
};

static void open_again(struct place *place)
{
    bd_journal_close(&place->journal);
    enum bd_err err = bd_journal_open(place->directory, &place->journal, &place->detail);
    if (err) fail_msg("%s", place->detail.message);
}

static int set_up(void **state)
{
    struct place *place = calloc(1, sizeof *place);
    assert_non_null(place);
    kit_make_directory(place->directory);
    *state = place;
    open_again(place);
    return 0;
}

static int tear_down(void **state)
{
    struct place *place = *state;
    bd_journal_close(&place->journal);
    kit_remove_directory(place->directory);
    free(place);
    return 0;
}

// A scene of `count` revisions; `edits` has room for one more, edits[revision].
static void grow_scene(struct place *place, const char *scene, struct kit_edit *edits,
                       uint64_t count)
{
    struct kit_snapshot snapshot;
    kit_make_edit(&edits[1], 1, 0, 7);
    kit_make_snapshot(&snapshot, 1, edits[1].state);
    assert_int_equal(kit_add(place->journal, scene, &edits[1], &snapshot, &place->detail),
                     BD_ERR_OK);
    for (uint64_t i = 2; i <= count; i++) {
        kit_make_edit(&edits[i], i, edits[i - 1].state, 7);
        assert_int_equal(kit_commit(place->journal, scene, &edits[i], &place->detail), BD_ERR_OK);
    }
}

static void write_snapshot(struct place *place, const char *scene, const struct kit_edit *edit)
{
    struct kit_snapshot snapshot;
    kit_make_snapshot(&snapshot, edit->edit.revision, edit->state);
    enum bd_err err =
        bd_journal_write_snapshot(place->journal, scene, &snapshot.snapshot, &place->detail);
    if (err) fail_msg("%s", place->detail.message);
}

static void name_it(struct place *place, const char *scene, const char *name, uint64_t revision,
                    enum bd_err expected)
{
    struct bd_journal_record record = {
        .kind = BD_JOURNAL_NAME, .scene = scene, .name = name, .revision = revision};
    assert_int_equal(bd_journal_commit(place->journal, &record, 1, NULL, &place->detail), expected);
}

static void expect_state(struct place *place, const char *scene, uint64_t revision,
                         const struct kit_edit *edits, uint64_t reached, uint64_t snapshot)
{
    struct kit_loaded loaded;
    enum bd_err err = kit_load(place->journal, scene, revision, &loaded, &place->detail);
    if (err) fail_msg("%s", place->detail.message);
    assert_int_equal(loaded.revision, reached);
    assert_true(loaded.state == edits[reached].state);
    assert_int_equal(loaded.snapshot_revision, snapshot);
    assert_int_equal(loaded.edit_count, reached - snapshot);
}

static void expect_unreachable(struct place *place, const char *scene, uint64_t revision)
{
    struct kit_loaded loaded;
    assert_int_equal(kit_load(place->journal, scene, revision, &loaded, &place->detail),
                     BD_ERR_NOT_FOUND);
    assert_string_equal(place->detail.field, "revision");
}

struct seen_scenes {
    int count;
    char text[512];
};

static void see_scene(void *user, const struct bd_journal_scene *scene)
{
    struct seen_scenes *seen = user;
    size_t length = strlen(seen->text);
    seen->count++;
    snprintf(seen->text + length, sizeof seen->text - length, "%s %s %llu;", scene->scene,
             scene->name, (unsigned long long)scene->revision);
}

struct sought_owner {
    const char *scene;
    char owner[64];
};

static void see_owner(void *user, const struct bd_journal_scene *scene)
{
    struct sought_owner *sought = user;
    if (strcmp(scene->scene, sought->scene) == 0)
        snprintf(sought->owner, sizeof sought->owner, "%s", scene->owner);
}

static void expect_owner(struct place *place, const char *scene, const char *expected)
{
    struct sought_owner sought = {.scene = scene};
    assert_int_equal(bd_journal_each_scene(place->journal, see_owner, &sought, NULL), BD_ERR_OK);
    assert_string_equal(sought.owner, expected);
}

static void expect_scenes(struct place *place, const char *expected)
{
    struct seen_scenes seen = {0};
    assert_int_equal(bd_journal_each_scene(place->journal, see_scene, &seen, &place->detail),
                     BD_ERR_OK);
    assert_string_equal(seen.text, expected);
}

static void scenes_come_back(void **state)
{
    struct place *place = *state;
    struct kit_edit a[5], b[3];
    expect_scenes(place, "");
    grow_scene(place, "a", a, 4);
    grow_scene(place, "b", b, 2);
    for (int i = 0; i < 2; i++) {
        expect_scenes(place, "a box 4;b box 2;");
        expect_state(place, "a", 0, a, 4, 1);
        expect_state(place, "a", 2, a, 2, 1);
        expect_state(place, "b", 0, b, 2, 1);
        expect_unreachable(place, "a", 5);
        open_again(place);
    }
    struct kit_loaded loaded;
    assert_int_equal(kit_load(place->journal, "c", 0, &loaded, &place->detail), BD_ERR_NOT_FOUND);
    assert_string_equal(place->detail.field, "scene");
}

static void a_start_begins_at_the_newest_snapshot(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[9];
    grow_scene(place, "a", edits, 8);
    write_snapshot(place, "a", &edits[5]);
    write_snapshot(place, "a", &edits[8]);
    write_snapshot(place, "a", &edits[8]); // again: replaced
    open_again(place);
    expect_state(place, "a", 0, edits, 8, 8);
    expect_state(place, "a", 7, edits, 7, 5);
    expect_state(place, "a", 4, edits, 4, 1);
}

static void a_snapshot_must_be_of_its_revision(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[4];
    struct kit_snapshot snapshot;
    grow_scene(place, "a", edits, 3);
    kit_make_snapshot(&snapshot, 3, edits[2].state);
    assert_int_equal(
        bd_journal_write_snapshot(place->journal, "a", &snapshot.snapshot, &place->detail),
        BD_ERR_CONFLICT);
    assert_string_equal(place->detail.field, "snapshot");
    kit_make_snapshot(&snapshot, 4, edits[3].state);
    assert_int_equal(
        bd_journal_write_snapshot(place->journal, "a", &snapshot.snapshot, &place->detail),
        BD_ERR_NOT_FOUND);
}

static void edits_are_found(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[6];
    struct bd_journal_edit got;
    grow_scene(place, "a", edits, 5);
    open_again(place);
    for (uint64_t i = 1; i <= 5; i++) {
        assert_int_equal(bd_journal_get_edit(place->journal, "a", i, &got, &place->detail),
                         BD_ERR_OK);
        assert_true(kit_is_edit(&got, &edits[i], false));
        assert_int_equal(bd_journal_find_edit(place->journal, "a", edits[i].client_edit_id, &got,
                                              &place->detail),
                         BD_ERR_OK);
        assert_true(kit_is_edit(&got, &edits[i], false));
    }
    assert_int_equal(bd_journal_get_edit(place->journal, "a", 6, &got, &place->detail),
                     BD_ERR_NOT_FOUND);
    assert_string_equal(place->detail.field, "revision");
    assert_int_equal(bd_journal_find_edit(place->journal, "a", "", &got, &place->detail),
                     BD_ERR_NOT_FOUND);
    assert_int_equal(bd_journal_find_edit(place->journal, "a", "e9", &got, &place->detail),
                     BD_ERR_NOT_FOUND);
    assert_string_equal(place->detail.field, "client_edit_id");
}

struct seen_edits {
    const struct kit_edit *made;
    uint64_t first, last;
    uint32_t count;
};

static void see_edit(void *user, const struct bd_journal_edit *edit)
{
    struct seen_edits *seen = user;
    assert_true(kit_is_edit(edit, &seen->made[edit->revision], true));
    if (!seen->count) seen->first = edit->revision;
    seen->last = edit->revision;
    assert_int_equal(seen->last, seen->first + seen->count);
    seen->count++;
}

static void expect_log(struct place *place, const struct kit_edit *made, uint64_t after,
                       uint32_t limit, uint64_t first, uint32_t count)
{
    struct seen_edits seen = {.made = made};
    assert_int_equal(
        bd_journal_each_edit(place->journal, "a", after, limit, see_edit, &seen, &place->detail),
        BD_ERR_OK);
    assert_int_equal(seen.count, count);
    if (count) assert_int_equal(seen.first, first);
}

static void the_log_is_the_newest_oldest_first(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[8];
    grow_scene(place, "a", edits, 7);
    expect_log(place, edits, 0, 100, 1, 7);
    expect_log(place, edits, 0, 3, 5, 3);
    expect_log(place, edits, 4, 100, 5, 3);
    expect_log(place, edits, 4, 1, 7, 1);
    expect_log(place, edits, 7, 100, 0, 0);
    expect_log(place, edits, 0, 0, 0, 0);
}

static enum bd_err commit_all(struct place *place, const struct bd_journal_record *records,
                              uint32_t count, uint32_t *faulty)
{
    return bd_journal_commit(place->journal, records, count, faulty, &place->detail);
}

static void a_commit_is_all_or_nothing(void **state)
{
    struct place *place = *state;
    struct kit_edit a[4], b[2], next, wrong;
    struct kit_snapshot snapshot;
    uint32_t faulty;
    grow_scene(place, "a", a, 3);
    kit_make_edit(&next, 4, a[3].state, 7);
    kit_make_edit(&wrong, 6, a[3].state, 7);
    kit_make_edit(&b[1], 1, 0, 7);
    kit_make_snapshot(&snapshot, 1, b[1].state);
    struct bd_journal_record records[] = {
        {BD_JOURNAL_EDIT, "a", NULL, 0, &next.edit, NULL, NULL},
        {BD_JOURNAL_ADD_SCENE, "b", "two", 0, &b[1].edit, &snapshot.snapshot, "me"},
        {BD_JOURNAL_NAME, "a", "good", 2, NULL, NULL, NULL},
        {BD_JOURNAL_EDIT, "a", NULL, 0, &wrong.edit, NULL, NULL},
    };
    assert_int_equal(commit_all(place, records, 4, &faulty), BD_ERR_CONFLICT);
    assert_int_equal(faulty, 3);
    assert_string_equal(place->detail.field, "revision");
    expect_scenes(place, "a box 3;");
    assert_int_equal(commit_all(place, records, 3, &faulty), BD_ERR_OK);
    expect_owner(place, "b", "me");
    open_again(place);
    expect_scenes(place, "a box 4;b two 1;");
}

static void what_a_commit_refuses(void **state)
{
    struct place *place = *state;
    struct kit_edit a[4], edit;
    char text[BD_JOURNAL_TEXT_BYTES_MAX + 2];
    uint8_t unknown[BD_SHA256_BYTES] = {1};
    grow_scene(place, "a", a, 3);
    kit_make_edit(&edit, 4, a[3].state, 7);

    snprintf(edit.client_edit_id, sizeof edit.client_edit_id, "%s", a[2].client_edit_id);
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_CONFLICT);
    assert_string_equal(place->detail.field, "client_edit_id");
    edit.client_edit_id[0] = 0;

    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = 0;
    edit.edit.message = text;
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_LIMIT);
    assert_string_equal(place->detail.field, "message");
    text[BD_JOURNAL_TEXT_BYTES_MAX] = 0;

    char author[sizeof text];
    memset(author, 'y', sizeof author - 1);
    author[sizeof author - 1] = 0;
    edit.edit.author = author;
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_LIMIT);
    assert_string_equal(place->detail.field, "author");
    author[BD_JOURNAL_TEXT_BYTES_MAX] = 0;

    edit.edit.inverse_content = (struct bd_journal_digests){unknown, 1};
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_NOT_FOUND);
    assert_string_equal(place->detail.field, "content");
    edit.edit.inverse_content.count = 0;

    edit.edit.forward.size = (size_t)BD_JOURNAL_RECORD_BYTES_MAX + 1;
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_LIMIT);
    assert_string_equal(place->detail.field, "edit");
    edit.edit.forward.size = 8;

    assert_int_equal(kit_commit(place->journal, "nobody", &edit, &place->detail), BD_ERR_NOT_FOUND);
    struct kit_snapshot snapshot;
    kit_make_snapshot(&snapshot, 1, a[1].state);
    assert_int_equal(kit_add(place->journal, "a", &a[1], &snapshot, &place->detail),
                     BD_ERR_CONFLICT);
    assert_string_equal(place->detail.field, "scene");
    expect_scenes(place, "a box 3;");
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_OK);
    // Without an id, as often as you like.
    kit_make_edit(&edit, 5, a[3].state, 7);
    edit.client_edit_id[0] = 0;
    assert_int_equal(kit_commit(place->journal, "a", &edit, &place->detail), BD_ERR_OK);
}

static void see_name(void *user, const char *name, uint64_t revision)
{
    char *text = user;
    size_t length = strlen(text);
    snprintf(text + length, 256 - length, "%s %llu;", name, (unsigned long long)revision);
}

static void expect_names(struct place *place, const char *scene, const char *expected)
{
    char text[256] = "";
    assert_int_equal(bd_journal_each_name(place->journal, scene, see_name, text, &place->detail),
                     BD_ERR_OK);
    assert_string_equal(text, expected);
}

static void names_are_set_moved_and_removed(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[6];
    grow_scene(place, "a", edits, 5);
    name_it(place, "a", "last", 5, BD_ERR_OK);
    name_it(place, "a", "good", 3, BD_ERR_OK);
    name_it(place, "a", "first", 1, BD_ERR_OK);
    open_again(place);
    expect_names(place, "a", "first 1;good 3;last 5;");
    name_it(place, "a", "good", 5, BD_ERR_OK);
    expect_names(place, "a", "first 1;good 5;last 5;");
    name_it(place, "a", "far", 6, BD_ERR_NOT_FOUND);
    name_it(place, "a", "none", 0, BD_ERR_NOT_FOUND);
    name_it(place, "a", "", 2, BD_ERR_USAGE);
    struct bd_journal_record record = {.kind = BD_JOURNAL_UNNAME, .scene = "a", .name = "last"};
    assert_int_equal(commit_all(place, &record, 1, NULL), BD_ERR_OK);
    assert_int_equal(commit_all(place, &record, 1, NULL), BD_ERR_NOT_FOUND);
    assert_string_equal(place->detail.field, "name");
    open_again(place);
    expect_names(place, "a", "first 1;good 5;");
}

static struct bd_journal_stats stats_of(struct place *place)
{
    struct bd_journal_stats stats;
    assert_int_equal(bd_journal_get_stats(place->journal, &stats, &place->detail), BD_ERR_OK);
    return stats;
}

static void content_comes_back(void **state)
{
    static const size_t sizes[] = {0,
                                   1,
                                   4096,
                                   BD_JOURNAL_PART_BYTES - 1,
                                   BD_JOURNAL_PART_BYTES,
                                   BD_JOURNAL_PART_BYTES + 1,
                                   3 * BD_JOURNAL_SLICE_BYTES + 5};
    enum { COUNT = sizeof sizes / sizeof *sizes };
    struct place *place = *state;
    struct kit_content content[COUNT];
    struct bd_journal_content list[COUNT];
    for (int i = 0; i < COUNT; i++) {
        kit_make_content(&content[i], sizes[i], (uint64_t)i);
        list[i] = content[i].content;
        assert_false(kit_has(place->journal, &content[i]));
        assert_int_equal(kit_read(place->journal, &content[i], &place->detail), BD_ERR_NOT_FOUND);
    }
    assert_int_equal(kit_put(place->journal, list, COUNT, &place->detail), BD_ERR_OK);
    uint64_t bytes = stats_of(place).file_bytes;
    assert_int_equal(kit_put(place->journal, list, COUNT, &place->detail), BD_ERR_OK);
    assert_true(stats_of(place).file_bytes < bytes + 65536); // twice is once
    open_again(place);
    for (int i = 0; i < COUNT; i++) {
        assert_true(kit_has(place->journal, &content[i]));
        assert_int_equal(kit_read(place->journal, &content[i], &place->detail), BD_ERR_OK);
        free(content[i].bytes);
    }
}

// Each call writes a bounded piece, and what is half there counts as not there.
static void content_goes_in_by_slices(void **state)
{
    struct place *place = *state;
    struct kit_content content;
    kit_make_content(&content, 2 * BD_JOURNAL_SLICE_BYTES + 1, 5);
    struct bd_journal_put put = {.content = &content.content, .count = 1};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(bd_journal_put_some(place->journal, &put, &place->detail), BD_ERR_OK);
        assert_int_equal(put.next, 0);
        assert_int_equal(put.next_bytes, (i + 1) * BD_JOURNAL_SLICE_BYTES);
    }
    bd_journal_put_end(place->journal, &put);
    open_again(place); // as after a crash in between
    assert_false(kit_has(place->journal, &content));
    assert_int_equal(kit_put(place->journal, &content.content, 1, &place->detail), BD_ERR_OK);
    assert_int_equal(kit_read(place->journal, &content, &place->detail), BD_ERR_OK);
    free(content.bytes);
}

static void compact(struct place *place, const char *scene, uint64_t keep)
{
    bool is_done = false;
    for (int i = 0; !is_done; i++) {
        assert_in_range(i, 0, 100);
        assert_int_equal(bd_journal_compact(place->journal, scene, keep, &is_done, &place->detail),
                         BD_ERR_OK);
    }
}

static int collect(struct place *place)
{
    bool is_done = false;
    int count = 0;
    for (; !is_done; count++) {
        assert_in_range(count, 0, 10000);
        assert_int_equal(bd_journal_collect(place->journal, &is_done, &place->detail), BD_ERR_OK);
    }
    return count;
}

static uint64_t oldest_of(struct place *place, const char *scene)
{
    uint64_t oldest;
    assert_int_equal(bd_journal_oldest(place->journal, scene, &oldest, &place->detail), BD_ERR_OK);
    return oldest;
}

static void compaction_forgets_what_is_old(void **state)
{
    struct place *place = *state;
    static struct kit_edit edits[1001];
    grow_scene(place, "a", edits, 1000);
    grow_scene(place, "b", edits, 10);
    for (int i = 100; i <= 1000; i += 100) write_snapshot(place, "a", &edits[i]);
    compact(place, "a", 2000);
    assert_int_equal(oldest_of(place, "a"), 1);
    // Snapshots at 100, 200 ...: 650 back from 1000 is 350, so 300 is the base.
    compact(place, "a", 650);
    assert_int_equal(oldest_of(place, "a"), 300);
    expect_state(place, "a", 300, edits, 300, 300);
    expect_state(place, "a", 350, edits, 350, 300);
    expect_unreachable(place, "a", 299);
    expect_log(place, edits, 0, 10000, 301, 700);
    compact(place, "a", 0);
    open_again(place);
    assert_int_equal(oldest_of(place, "a"), 1000);
    expect_log(place, edits, 0, 10000, 0, 0);
    expect_state(place, "a", 0, edits, 1000, 1000);
    expect_state(place, "b", 0, edits, 10, 1);
    assert_int_equal(stats_of(place).edit_count, 10);
    assert_int_equal(stats_of(place).snapshot_count, 2);
}

static void named_revisions_survive_compaction(void **state)
{
    struct place *place = *state;
    static struct kit_edit edits[101];
    grow_scene(place, "a", edits, 100);
    for (int i = 10; i <= 100; i += 10) write_snapshot(place, "a", &edits[i]);
    name_it(place, "a", "twelve", 12, BD_ERR_OK);
    name_it(place, "a", "fifteen", 15, BD_ERR_OK);
    name_it(place, "a", "forty", 40, BD_ERR_OK);
    name_it(place, "a", "late", 95, BD_ERR_OK);
    compact(place, "a", 10);
    open_again(place);
    expect_state(place, "a", 12, edits, 12, 10);
    expect_state(place, "a", 15, edits, 15, 10);
    expect_state(place, "a", 40, edits, 40, 40);
    expect_state(place, "a", 95, edits, 95, 90);
    expect_state(place, "a", 0, edits, 100, 100);
    uint64_t gone[] = {1, 9, 16, 39, 41, 89};
    for (size_t i = 0; i < sizeof gone / sizeof *gone; i++) expect_unreachable(place, "a", gone[i]);
    assert_int_equal(oldest_of(place, "a"), 90);
    assert_int_equal(stats_of(place).edit_count, 15);    // 11 to 15, 91 to 100
    assert_int_equal(stats_of(place).snapshot_count, 4); // 10, 40, 90, 100
    name_it(place, "a", "gone", 20, BD_ERR_NOT_FOUND);
}

// A scene whose edit 2 needs content 0 forward and 1 backward, edit 3 content 2.
static void grow_with_content(struct place *place, struct kit_edit edits[4],
                              struct kit_content content[3])
{
    struct bd_journal_content list[3];
    struct bd_journal_put put = {.content = list, .count = 3};
    for (int i = 0; i < 3; i++) {
        kit_make_content(&content[i], (size_t)(i + 1) * 3 * BD_JOURNAL_PART_BYTES, (uint64_t)i);
        list[i] = content[i].content;
    }
    while (put.next < put.count)
        assert_int_equal(bd_journal_put_some(place->journal, &put, &place->detail), BD_ERR_OK);
    collect(place); // takes nothing of what is on its way
    grow_scene(place, "a", edits, 1);
    kit_make_edit(&edits[2], 2, edits[1].state, 7);
    edits[2].edit.forward_content = (struct bd_journal_digests){content[0].content.sha256, 1};
    edits[2].edit.inverse_content = (struct bd_journal_digests){content[1].content.sha256, 1};
    kit_make_edit(&edits[3], 3, edits[2].state, 7);
    edits[3].edit.forward_content = (struct bd_journal_digests){content[2].content.sha256, 1};
    for (int i = 2; i < 4; i++)
        assert_int_equal(kit_commit(place->journal, "a", &edits[i], &place->detail), BD_ERR_OK);
    bd_journal_put_end(place->journal, &put);
}

static void content_that_nothing_needs_is_collected(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[4];
    struct kit_content content[3];
    grow_with_content(place, edits, content);
    open_again(place);
    collect(place);
    for (int i = 0; i < 3; i++) assert_true(kit_has(place->journal, &content[i]));

    struct kit_snapshot snapshot;
    kit_make_snapshot(&snapshot, 3, edits[3].state);
    snapshot.snapshot.content = (struct bd_journal_digests){content[2].content.sha256, 1};
    assert_int_equal(
        bd_journal_write_snapshot(place->journal, "a", &snapshot.snapshot, &place->detail),
        BD_ERR_OK);
    compact(place, "a", 0);
    uint64_t before = stats_of(place).file_bytes;
    assert_true(collect(place) > 4); // 9 MiB go by slices of 4
    assert_false(kit_has(place->journal, &content[0]));
    assert_false(kit_has(place->journal, &content[1]));
    assert_true(kit_has(place->journal, &content[2]));
    open_again(place);
    assert_true(stats_of(place).file_bytes < before - 4 * BD_JOURNAL_PART_BYTES);
    assert_int_equal(kit_read(place->journal, &content[2], &place->detail), BD_ERR_OK);
    for (int i = 0; i < 3; i++) free(content[i].bytes);
}

static void removed_scenes_leave_nothing(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[4];
    static struct kit_edit many[601];
    struct kit_content content[3];
    grow_with_content(place, edits, content);
    grow_scene(place, "b", many, 600);
    name_it(place, "b", "good", 2, BD_ERR_OK);
    struct bd_journal_record records[] = {{.kind = BD_JOURNAL_REMOVE_SCENE, .scene = "a"},
                                          {.kind = BD_JOURNAL_REMOVE_SCENE, .scene = "b"}};
    assert_int_equal(commit_all(place, records, 2, NULL), BD_ERR_OK);
    assert_int_equal(commit_all(place, records, 1, NULL), BD_ERR_NOT_FOUND);
    expect_scenes(place, "");
    // The same id again is another scene, whose edits the removed one's do not meet.
    grow_scene(place, "b", many, 3);
    collect(place);
    struct bd_journal_stats stats = stats_of(place);
    assert_int_equal(stats.scene_count, 1);
    assert_int_equal(stats.edit_count, 3);
    assert_int_equal(stats.snapshot_count, 1);
    assert_int_equal(stats.content_count, 0);
    expect_names(place, "b", "");
    open_again(place);
    expect_state(place, "b", 0, many, 3, 1);
    for (int i = 0; i < 3; i++) free(content[i].bytes);
}

// Commits between the slices of a round: what they need stays, whatever the round has seen.
static void a_round_goes_on_beside_commits(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[64];
    struct kit_content content[64];
    for (int i = 0; i < 64; i++) kit_make_content(&content[i], 300000, 100 + (uint64_t)i);
    grow_scene(place, "a", edits, 1);
    for (int i = 2; i < 64; i++) {
        // Content that lay there unneeded and is put again; some of it is never committed.
        assert_int_equal(kit_put(place->journal, &content[i].content, 1, &place->detail),
                         BD_ERR_OK);
        struct bd_journal_put put = {.content = &content[i].content, .count = 1};
        bool is_done;
        assert_int_equal(bd_journal_collect(place->journal, &is_done, &place->detail), BD_ERR_OK);
        assert_int_equal(bd_journal_put_some(place->journal, &put, &place->detail), BD_ERR_OK);
        assert_int_equal(bd_journal_collect(place->journal, &is_done, &place->detail), BD_ERR_OK);
        kit_make_edit(&edits[i], (uint64_t)i, edits[i - 1].state, 7);
        edits[i].edit.forward_content = (struct bd_journal_digests){content[i].content.sha256, 1};
        assert_int_equal(kit_commit(place->journal, "a", &edits[i], &place->detail), BD_ERR_OK);
        bd_journal_put_end(place->journal, &put);
        assert_int_equal(bd_journal_collect(place->journal, &is_done, &place->detail), BD_ERR_OK);
    }
    collect(place);
    collect(place);
    for (int i = 2; i < 64; i++)
        assert_int_equal(kit_read(place->journal, &content[i], &place->detail), BD_ERR_OK);
    for (int i = 0; i < 64; i++) free(content[i].bytes);
    expect_state(place, "a", 0, edits, 63, 1);
}

static void cutting_takes_the_end_away(void **state)
{
    struct place *place = *state;
    struct kit_edit edits[9];
    grow_scene(place, "a", edits, 8);
    write_snapshot(place, "a", &edits[7]);
    name_it(place, "a", "late", 6, BD_ERR_OK);
    name_it(place, "a", "soon", 5, BD_ERR_OK);
    assert_int_equal(bd_journal_cut(place->journal, "a", 9, &place->detail), BD_ERR_NOT_FOUND);
    assert_int_equal(bd_journal_cut(place->journal, "a", 5, &place->detail), BD_ERR_OK);
    open_again(place);
    expect_state(place, "a", 0, edits, 5, 1);
    expect_names(place, "a", "soon 5;");
    kit_make_edit(&edits[6], 6, edits[5].state, 8);
    assert_int_equal(kit_commit(place->journal, "a", &edits[6], &place->detail), BD_ERR_OK);
    expect_state(place, "a", 0, edits, 6, 1);
}

static void one_daemon_at_a_time(void **state)
{
    struct place *place = *state;
    struct bd_journal *second;
    struct kit_edit edits[2];
    grow_scene(place, "a", edits, 1);
    assert_int_equal(bd_journal_open(place->directory, &second, &place->detail), BD_ERR_CONFLICT);
    assert_null(second);
    expect_scenes(place, "a box 1;");
}

static void settings_are_as_promised(void **state)
{
    static const struct {
        const char *pragma, *value;
    } settings[] = {
        {"journal_mode", "wal"}, {"synchronous", "2"},          {"locking_mode", "exclusive"},
        {"mmap_size", "0"},      {"wal_autocheckpoint", "512"}, {"trusted_schema", "0"},
        {"cache_size", "-2048"}, {"auto_vacuum", "2"},          {"cell_size_check", "1"},
        {"user_version", "3"},   {"page_size", "4096"},         {"application_id", "1650739820"}};
    struct place *place = *state;
    for (size_t i = 0; i < sizeof settings / sizeof *settings; i++) {
        char sql[64];
        sqlite3_stmt *get;
        snprintf(sql, sizeof sql, "PRAGMA %s", settings[i].pragma);
        assert_int_equal(sqlite3_prepare_v2(place->journal->db, sql, -1, &get, NULL), SQLITE_OK);
        bool answers = sqlite3_step(get) == SQLITE_ROW;
        // Where mapping is compiled out there is nothing to ask for.
        assert_true(answers || strcmp(settings[i].pragma, "mmap_size") == 0);
        if (answers) assert_string_equal(bd_column_text(get, 0), settings[i].value);
        sqlite3_finalize(get);
    }
}

int main(void)
{
#define TEST(function) cmocka_unit_test_setup_teardown(function, set_up, tear_down)
    const struct CMUnitTest tests[] = {
        TEST(scenes_come_back),
        TEST(a_start_begins_at_the_newest_snapshot),
        TEST(a_snapshot_must_be_of_its_revision),
        TEST(edits_are_found),
        TEST(the_log_is_the_newest_oldest_first),
        TEST(a_commit_is_all_or_nothing),
        TEST(what_a_commit_refuses),
        TEST(names_are_set_moved_and_removed),
        TEST(content_comes_back),
        TEST(content_goes_in_by_slices),
        TEST(compaction_forgets_what_is_old),
        TEST(named_revisions_survive_compaction),
        TEST(content_that_nothing_needs_is_collected),
        TEST(removed_scenes_leave_nothing),
        TEST(a_round_goes_on_beside_commits),
        TEST(cutting_takes_the_end_away),
        TEST(one_daemon_at_a_time),
        TEST(settings_are_as_promised),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
