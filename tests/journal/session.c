#include "tests/journal/session.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

#define BATCH_MAX 4

static const char *const names[SESSION_NAMES] = {"good", "better", "best"};

void session_begin(struct session *session, uint64_t seed)
{
    *session = (struct session){.random = seed * 0x9e3779b97f4a7c15u + 7};
}

static uint32_t below(struct session *session, uint32_t count)
{
    return kit_random(&session->random) % count;
}

static size_t content_size(uint64_t seed)
{
    return 1 + seed % 23 * 1777 * (seed % 11 ? 1 : 8);
}

static enum bd_err put_content(struct session *session, uint64_t seed,
                               uint8_t sha256[BD_SHA256_BYTES], struct bd_err_detail *detail)
{
    struct kit_content content;
    kit_make_content(&content, content_size(seed), seed);
    memcpy(sha256, content.content.sha256, BD_SHA256_BYTES);
    enum bd_err err = kit_put(session->journal, &content.content, 1, detail);
    free(content.bytes);
    return err;
}

// --- what is done

static enum bd_err add_scene(struct session *session, struct model_scene *scene,
                             struct bd_err_detail *detail)
{
    struct kit_edit first;
    struct kit_snapshot snapshot;
    memset(scene, 0, sizeof *scene);
    snprintf(scene->id, sizeof scene->id, "s%u", ++session->salt);
    kit_make_edit(&first, 1, 0, session->salt);
    kit_make_snapshot(&snapshot, 1, first.state);
    scene->revision = 1;
    scene->states[1] = first.state;
    return kit_add(session->journal, scene->id, &first, &snapshot, detail);
}

// Scenes are in order of addition: the first goes, the second moves up, and a new one comes.
static enum bd_err replace_scene(struct session *session, struct bd_err_detail *detail)
{
    struct model *next = &session->in_flight;
    struct bd_journal_record remove = {.kind = BD_JOURNAL_REMOVE_SCENE,
                                       .scene = session->kept.scenes[0].id};
    next->scenes[0] = next->scenes[1];
    next->scenes[1].id[0] = 0;
    return bd_journal_commit(session->journal, &remove, 1, NULL, detail);
}

struct batch {
    struct kit_edit edits[BATCH_MAX];
    uint8_t sha256[BATCH_MAX][BD_SHA256_BYTES];
    struct bd_journal_record records[BATCH_MAX + 1];
    uint32_t count;
};

static enum bd_err add_to_batch(struct session *session, struct batch *batch,
                                struct model_scene *scene, struct bd_err_detail *detail)
{
    uint32_t at = batch->count++;
    struct kit_edit *edit = &batch->edits[at];
    kit_make_edit(edit, scene->revision + 1, scene->states[scene->revision], ++session->salt);
    batch->records[at] = (struct bd_journal_record){
        .kind = BD_JOURNAL_EDIT, .scene = scene->id, .edit = &edit->edit};
    scene->states[++scene->revision] = edit->state;
    if (below(session, 3)) return BD_ERR_OK;
    scene->content_seed = edit->state | 1;
    edit->edit.forward_content = (struct bd_journal_digests){batch->sha256[at], 1};
    return put_content(session, scene->content_seed, batch->sha256[at], detail);
}

static void add_name_to_batch(struct session *session, struct batch *batch,
                              struct model_scene *scene)
{
    uint32_t name = below(session, SESSION_NAMES);
    bool is_removed = scene->names[name] && below(session, 3) == 0;
    batch->records[batch->count++] =
        (struct bd_journal_record){.kind = is_removed ? BD_JOURNAL_UNNAME : BD_JOURNAL_NAME,
                                   .scene = scene->id,
                                   .name = names[name],
                                   .revision = scene->revision};
    scene->names[name] = is_removed ? 0 : scene->revision;
}

static enum bd_err commit_batch(struct session *session, struct bd_err_detail *detail)
{
    struct batch *batch = calloc(1, sizeof *batch);
    BD_ASSERT(batch);
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 1 + below(session, BATCH_MAX); i > 0 && !err; i--) {
        struct model_scene *scene = &session->in_flight.scenes[below(session, SESSION_SCENES)];
        err = add_to_batch(session, batch, scene, detail);
    }
    if (!err && below(session, 4) == 0)
        add_name_to_batch(session, batch, &session->in_flight.scenes[0]);
    if (!err) err = bd_journal_commit(session->journal, batch->records, batch->count, NULL, detail);
    free(batch);
    return err;
}

static enum bd_err write_snapshot(struct session *session, const struct model_scene *scene,
                                  struct bd_err_detail *detail)
{
    struct kit_snapshot snapshot;
    uint8_t sha256[BD_SHA256_BYTES];
    enum bd_err err = BD_ERR_OK;
    kit_make_snapshot(&snapshot, scene->revision, scene->states[scene->revision]);
    if (scene->content_seed) {
        err = put_content(session, scene->content_seed, sha256, detail);
        snapshot.snapshot.content = (struct bd_journal_digests){sha256, 1};
    }
    if (err) return err;
    return bd_journal_write_snapshot(session->journal, scene->id, &snapshot.snapshot, detail);
}

static enum bd_err collect(struct session *session, struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    bool is_done = false;
    for (uint32_t i = below(session, 20); i > 0 && !err && !is_done; i--)
        err = bd_journal_collect(session->journal, &is_done, detail);
    return err;
}

static enum bd_err step(struct session *session, struct bd_err_detail *detail)
{
    struct model *next = &session->in_flight;
    for (int i = 0; i < SESSION_SCENES; i++)
        if (!next->scenes[i].id[0]) return add_scene(session, &next->scenes[i], detail);
    struct model_scene *scene = &next->scenes[below(session, SESSION_SCENES)];
    bool is_done;
    if (scene->revision + BATCH_MAX >= SESSION_REVISIONS) return replace_scene(session, detail);
    switch (below(session, 16)) {
    case 0:
        return replace_scene(session, detail);
    case 1:
    case 2:
        return write_snapshot(session, scene, detail);
    case 3:
        return bd_journal_compact(session->journal, scene->id, below(session, 6), &is_done, detail);
    case 4:
        return collect(session, detail);
    default:
        return commit_batch(session, detail);
    }
}

enum bd_err session_step(struct session *session, struct bd_err_detail *detail)
{
    session->in_flight = session->kept;
    enum bd_err err = step(session, detail);
    if (!err) session->kept = session->in_flight;
    return err;
}

// --- what is held

struct look {
    struct bd_journal *journal;
    const struct model *model;
    const struct model_scene *scene;
    uint32_t count, name_count;
    uint64_t state;
    char *why;
    size_t why_bytes;
    bool is_same;
};

static void differ(struct look *look, const char *what, uint64_t got, uint64_t expected)
{
    if (look->is_same)
        snprintf(look->why, look->why_bytes, "scene %s: %s is %llx, not %llx",
                 look->scene ? look->scene->id : "-", what, (unsigned long long)got,
                 (unsigned long long)expected);
    look->is_same = false;
}

static void see_scene(void *user, const struct bd_journal_scene *scene)
{
    struct look *look = user;
    uint32_t at = look->count++;
    look->scene = at < SESSION_SCENES ? &look->model->scenes[at] : NULL;
    if (!look->scene || strcmp(look->scene->id, scene->scene) != 0)
        differ(look, "the list of scenes", at, 0);
    else if (look->scene->revision != scene->revision)
        differ(look, "the newest revision", scene->revision, look->scene->revision);
}

static void see_name(void *user, const char *name, uint64_t revision)
{
    struct look *look = user;
    look->name_count++;
    for (int i = 0; i < SESSION_NAMES; i++)
        if (strcmp(names[i], name) == 0 && look->scene->names[i] != revision)
            differ(look, "a name", revision, look->scene->names[i]);
}

static enum bd_err read_list(struct look *look, const struct bd_journal_digests *list,
                             struct bd_err_detail *detail)
{
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; i < list->count && !err; i++) {
        void *bytes = NULL;
        size_t size;
        err = bd_journal_read_content(look->journal, list->sha256 + i * BD_SHA256_BYTES, &bytes,
                                      &size, detail);
        if (!err) free(bytes);
    }
    return err;
}

static enum bd_err see_snapshot(void *user, const struct bd_journal_snapshot *snapshot,
                                struct bd_err_detail *detail)
{
    struct look *look = user;
    memcpy(&look->state, snapshot->index.data, sizeof look->state);
    return read_list(look, &snapshot->content, detail);
}

static enum bd_err see_edit(void *user, const struct bd_journal_edit *edit,
                            struct bd_err_detail *detail)
{
    struct look *look = user;
    look->state = bd_hash64(edit->forward.data, edit->forward.size, look->state);
    return read_list(look, &edit->forward_content, detail);
}

static void look_at_revision(struct look *look, uint64_t revision, uint64_t expected)
{
    struct bd_journal_visitor visitor = {see_snapshot, see_edit, look};
    struct bd_err_detail detail = {0};
    uint64_t reached;
    enum bd_err err =
        bd_journal_load(look->journal, look->scene->id, revision, &visitor, &reached, &detail);
    if (err) {
        differ(look, detail.message, revision, expected);
        return;
    }
    if (reached != expected) differ(look, "a revision", reached, expected);
    if (look->state != look->scene->states[expected])
        differ(look, "a state", look->state, look->scene->states[expected]);
}

static void look_at_scene(struct look *look, const struct model_scene *scene)
{
    struct bd_err_detail detail;
    uint64_t oldest = 0;
    look->scene = scene;
    look->name_count = 0;
    uint32_t name_count = 0;
    if (bd_journal_each_name(look->journal, scene->id, see_name, look, &detail) ||
        bd_journal_oldest(look->journal, scene->id, &oldest, &detail)) {
        differ(look, detail.message, 0, 0);
        return;
    }
    for (int i = 0; i < SESSION_NAMES; i++) name_count += scene->names[i] > 0;
    if (look->name_count != name_count)
        differ(look, "the number of names", look->name_count, name_count);
    look_at_revision(look, 0, scene->revision);
    // Of a long history some revisions: the walk to each begins at a snapshot.
    for (uint64_t i = oldest; i <= scene->revision; i += 1 + (scene->revision - oldest) / 8)
        look_at_revision(look, i, i);
    for (int i = 0; i < SESSION_NAMES; i++)
        if (scene->names[i]) look_at_revision(look, scene->names[i], scene->names[i]);
}

bool session_holds(struct bd_journal *journal, const struct model *model, char *why,
                   size_t why_bytes)
{
    struct look look = {
        .journal = journal, .model = model, .why = why, .why_bytes = why_bytes, .is_same = true};
    struct bd_err_detail detail;
    uint32_t count = 0;
    why[0] = 0;
    while (count < SESSION_SCENES && model->scenes[count].id[0]) count++;
    if (bd_journal_each_scene(journal, see_scene, &look, &detail))
        differ(&look, detail.message, 0, 0);
    if (look.count != count) differ(&look, "the number of scenes", look.count, count);
    for (uint32_t i = 0; i < count && look.is_same; i++) look_at_scene(&look, &model->scenes[i]);
    return look.is_same;
}
