#include "tests/journal/story.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const size_t content_sizes[STORY_CONTENTS] = {0, 3000, 9000};

void story_make(struct story *story)
{
    memset(story, 0, sizeof *story);
    for (int i = 0; i < STORY_CONTENTS; i++)
        kit_make_content(&story->content[i], content_sizes[i], 40 + (uint64_t)i);
    for (uint64_t i = 1; i <= STORY_REVISIONS + 1; i++) {
        kit_make_edit(&story->a[i], i, i > 1 ? story->a[i - 1].state : 0, 1);
        kit_make_edit(&story->b[i], i, i > 1 ? story->b[i - 1].state : 0, 2);
    }
    // Edit 7 of "a" takes content 1 for 2.
    story->a[7].edit.forward_content =
        (struct bd_journal_digests){story->content[1].content.sha256, 1};
    story->a[7].edit.inverse_content =
        (struct bd_journal_digests){story->content[2].content.sha256, 1};
}

void story_free(struct story *story)
{
    for (int i = 0; i < STORY_CONTENTS; i++) free(story->content[i].bytes);
}

static enum bd_err write_contents(struct story *story, struct bd_journal *journal,
                                  struct bd_err_detail *detail)
{
    struct bd_journal_content list[STORY_CONTENTS];
    for (int i = 0; i < STORY_CONTENTS; i++) list[i] = story->content[i].content;
    return kit_put(journal, list, STORY_CONTENTS, detail);
}

static enum bd_err write_scene(struct story *story, struct bd_journal *journal, const char *scene,
                               const struct kit_edit *edits, uint64_t count,
                               struct bd_err_detail *detail)
{
    struct kit_snapshot snapshot;
    kit_make_snapshot(&snapshot, 1, edits[1].state);
    snapshot.snapshot.content =
        (struct bd_journal_digests){story->content[2].content.sha256, scene[0] == 'a'};
    enum bd_err err = kit_add(journal, scene, &edits[1], &snapshot, detail);
    for (uint64_t i = 2; i <= count && !err; i++)
        err = kit_commit(journal, scene, &edits[i], detail);
    kit_make_snapshot(&snapshot, count / 2, edits[count / 2].state);
    return err ? err : bd_journal_write_snapshot(journal, scene, &snapshot.snapshot, detail);
}

enum bd_err story_write(struct story *story, struct bd_journal *journal,
                        struct bd_err_detail *detail)
{
    struct bd_journal_record names[] = {
        {.kind = BD_JOURNAL_NAME, .scene = "a", .name = "good", .revision = 3},
        {.kind = BD_JOURNAL_NAME,
         .scene = "a",
         .name = "k\xc3\xbc"
                 "che",
         .revision = STORY_REVISIONS},
    };
    enum bd_err err = write_contents(story, journal, detail);
    if (!err) err = write_scene(story, journal, "a", story->a, STORY_REVISIONS, detail);
    if (!err) err = write_scene(story, journal, "b", story->b, STORY_REVISIONS / 2, detail);
    return err ? err : bd_journal_commit(journal, names, 2, NULL, detail);
}

struct look {
    const struct story *story;
    struct bd_journal *journal;
    const struct kit_edit *edits;
    uint32_t scene_count, edit_count, name_count;
    uint64_t revisions[2];
    char *why;
    size_t why_bytes;
    bool is_true;
};

static void differ(struct look *look, const char *what, uint64_t revision)
{
    if (look->is_true)
        snprintf(look->why, look->why_bytes, "%.200s (revision %llu)", what,
                 (unsigned long long)revision);
    look->is_true = false;
}

static void see_edit(void *user, const struct bd_journal_edit *edit)
{
    struct look *look = user;
    look->edit_count++;
    if (edit->revision == 0 || edit->revision > STORY_REVISIONS + 1 ||
        !kit_is_edit(edit, &look->edits[edit->revision], true))
        differ(look, "an entry of the log", edit->revision);
}

static void see_name(void *user, const char *name, uint64_t revision)
{
    struct look *look = user;
    look->name_count++;
    if (revision != (strcmp(name, "good") == 0 ? 3 : STORY_REVISIONS))
        differ(look, "a name", revision);
}

static void look_at_edits(struct look *look, const char *scene, uint64_t newest)
{
    struct bd_err_detail detail = {0};
    struct bd_journal_edit edit;
    for (uint64_t i = 1; i <= newest; i++) {
        enum bd_err err = bd_journal_get_edit(look->journal, scene, i, &edit, &detail);
        if (!err && !kit_is_edit(&edit, &look->edits[i], false)) differ(look, "an edit", i);
        if (err && err != BD_ERR_IO && err != BD_ERR_NOT_FOUND) differ(look, detail.message, i);
    }
}

static void look_at_states(struct look *look, const char *scene, uint64_t newest)
{
    struct bd_err_detail detail = {0};
    struct kit_loaded loaded;
    for (uint64_t i = 0; i <= newest; i++) {
        enum bd_err err = kit_load(look->journal, scene, i, &loaded, &detail);
        if (err && err != BD_ERR_NOT_FOUND) differ(look, detail.message, i);
        if (!err && loaded.state != look->edits[loaded.revision].state) differ(look, "a state", i);
    }
}

static void see_scene(void *user, const struct bd_journal_scene *scene)
{
    struct look *look = user;
    look->scene_count++;
    if (strcmp(scene->name, "box") != 0 || strlen(scene->scene) != 1 ||
        (scene->scene[0] != 'a' && scene->scene[0] != 'b') || scene->revision > STORY_REVISIONS + 1)
        differ(look, "a scene", scene->revision);
    else
        look->revisions[scene->scene[0] - 'a'] = scene->revision;
}

static void look_at_scene(struct look *look, int index)
{
    static const char *const scenes[] = {"a", "b"};
    struct bd_err_detail detail = {0};
    const char *scene = scenes[index];
    look->edits = index == 0 ? look->story->a : look->story->b;
    if (!look->revisions[index]) return;
    if (bd_journal_each_edit(look->journal, scene, 0, 1000, see_edit, look, &detail) ||
        bd_journal_each_name(look->journal, scene, see_name, look, &detail))
        differ(look, detail.message, 0);
    look_at_edits(look, scene, look->revisions[index]);
    look_at_states(look, scene, look->revisions[index]);
}

// What the journal says of content must be so; how many there are is another matter.
static uint32_t look_at_contents(struct look *look)
{
    uint32_t count = 0;
    for (int i = 0; i < STORY_CONTENTS; i++) {
        struct bd_err_detail detail = {0};
        enum bd_err err = kit_read(look->journal, &look->story->content[i], &detail);
        if (err && err != BD_ERR_NOT_FOUND) differ(look, detail.message, 0);
        count += !err;
    }
    return count;
}

static uint32_t look_at_all(struct look *look)
{
    struct bd_err_detail detail = {0};
    look->why[0] = 0;
    if (bd_journal_each_scene(look->journal, see_scene, look, &detail))
        differ(look, detail.message, 0);
    for (int i = 0; i < 2 && look->is_true; i++) look_at_scene(look, i);
    return look_at_contents(look);
}

bool story_is_true(const struct story *story, struct bd_journal *journal, char *why,
                   size_t why_bytes)
{
    struct look look = {
        .story = story, .journal = journal, .why = why, .why_bytes = why_bytes, .is_true = true};
    look_at_all(&look);
    return look.is_true;
}

bool story_is_whole(const struct story *story, struct bd_journal *journal, char *why,
                    size_t why_bytes)
{
    struct look look = {
        .story = story, .journal = journal, .why = why, .why_bytes = why_bytes, .is_true = true};
    uint32_t contents = look_at_all(&look);
    if (look.is_true &&
        (contents != STORY_CONTENTS || look.scene_count != 2 || look.name_count != 2 ||
         look.revisions[0] != STORY_REVISIONS || look.revisions[1] != STORY_REVISIONS / 2 ||
         look.edit_count != STORY_REVISIONS + STORY_REVISIONS / 2)) {
        snprintf(why, why_bytes, "%u contents, %u scenes, %u names, %u edits", contents,
                 look.scene_count, look.name_count, look.edit_count);
        look.is_true = false;
    }
    return look.is_true;
}
