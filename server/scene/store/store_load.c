// Records to scenes: one revision of one, or all at start-up.

#include "scene/store/store_journal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "image/bytes.h"
#include "scene/model/content_table.h"

// --- content --------------------------------------------------------------------------------

// Of the past of a scene so many bytes are kept in memory, since what went may come back.
#define PAST_BYTES_MAX (32u << 20)

// Content that is in memory, or in the journal.
struct finding {
    struct bd_journal *journal;
    struct bd_content_table held;   // by scenes that are loaded
    struct bd_content_table walked; // by the one that is being walked to, and by its past
    uint64_t walked_bytes;          // read since the past was forgotten
    struct bd_err_detail detail;    // of a disk that did not answer
};

static void finish_walked(struct finding *finding)
{
    bd_content_table_finish(&finding->walked);
    finding->walked_bytes = 0;
}

static void keep_content(void *user, const struct bd_content *content)
{
    bd_content_table_put(user, content);
}

// A history reads many times what its scene holds in the end.
static void forget_past(struct finding *finding, const struct bd_scene *scene)
{
    if (finding->walked_bytes <= PAST_BYTES_MAX) return;
    finish_walked(finding);
    bd_content_of_scene(scene, keep_content, &finding->walked);
}

static const struct bd_content *find_known(const struct finding *finding, const uint8_t sha256[32])
{
    const struct bd_content *held = bd_content_table_get(&finding->held, sha256);
    return held ? held : bd_content_table_get(&finding->walked, sha256);
}

static const struct bd_content *read_content(struct finding *finding, const uint8_t sha256[32])
{
    struct bd_content read = {0};
    struct bd_err_detail detail = {0};
    void *bytes = NULL;
    size_t size;
    enum bd_err err = bd_journal_read_content(finding->journal, sha256, &bytes, &size, &detail);
    if (err && err != BD_ERR_NOT_FOUND) finding->detail = detail;
    if (!err) err = bd_content_read(bytes, size, &read, NULL);
    free(bytes);
    if (err) return NULL;
    bd_content_table_put(&finding->walked, &read);
    bd_content_release(&read);
    finding->walked_bytes += size;
    return bd_content_table_get(&finding->walked, sha256);
}

static bool find_content(void *user, const uint8_t sha256[32], struct bd_content *out)
{
    struct finding *finding = user;
    const struct bd_content *known = find_known(finding, sha256);
    if (!known) known = read_content(finding, sha256);
    if (!known || known->kind != out->kind) return false;
    *out = bd_content_retain(known);
    return true;
}

// What a disk does not give just now is not missing.
static enum bd_err explain(const struct finding *finding, enum bd_err err,
                           struct bd_err_detail *detail)
{
    if (err != BD_ERR_NOT_FOUND || !finding->detail.err) return err;
    if (detail) *detail = finding->detail;
    return finding->detail.err;
}

// --- one scene ------------------------------------------------------------------------------

// A walk from a snapshot along the edits after it.
struct walk {
    struct finding *finding;
    struct bd_scene *scene;
};

static enum bd_err visit_snapshot(void *user, const struct bd_journal_snapshot *snapshot,
                                  struct bd_err_detail *detail)
{
    struct walk *walk = user;
    bd_scene_release(&walk->scene); // a second walk begins anew
    enum bd_err err = bd_flat_read_index(snapshot->index.data, snapshot->index.size, find_content,
                                         walk->finding, &walk->scene, detail);
    return err ? err : bd_scene_finish(walk->scene, detail);
}

static enum bd_err visit_edit(void *user, const struct bd_journal_edit *edit,
                              struct bd_err_detail *detail)
{
    struct walk *walk = user;
    struct bd_delta delta = {0};
    struct bd_scene *next = NULL;
    enum bd_err err = bd_delta_read(edit->forward.data, edit->forward.size, find_content,
                                    walk->finding, &delta, detail);
    if (!err) err = bd_delta_apply(walk->scene, &delta, &next, detail);
    bd_delta_finish(&delta);
    if (err) return err;
    bd_scene_release(&walk->scene);
    walk->scene = next;
    forget_past(walk->finding, next);
    if (memcmp(next->content_sha256, edit->snapshot_sha256, BD_SHA256_BYTES) == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_BAD_INPUT, "data",
                      "revision %llu is not what it was when it was written",
                      (unsigned long long)edit->revision);
}

static enum bd_err walk_to(struct finding *finding, const char *id, uint64_t revision,
                           struct bd_scene **out, uint64_t *reached, struct bd_err_detail *detail)
{
    struct walk walk = {.finding = finding};
    const struct bd_journal_visitor visitor = {visit_snapshot, visit_edit, &walk};
    enum bd_err err;
    uint64_t known_damage;
    // Content that was found damaged on the way counts as missing from here on, and the next walk
    // ends before it.
    do {
        finding->detail = (struct bd_err_detail){0};
        known_damage = bd_journal_damage_count(finding->journal);
        err = bd_journal_load(finding->journal, id, revision, &visitor, reached, detail);
    } while (err == BD_ERR_NOT_FOUND && revision == 0 &&
             bd_journal_damage_count(finding->journal) > known_damage);
    err = explain(finding, err, detail);
    if (err)
        bd_scene_release(&walk.scene);
    else
        *out = walk.scene;
    return err;
}

enum bd_err bd_store_read_revision(struct bd_journal *journal, const char *id, uint64_t revision,
                                   struct bd_scene **out, struct bd_err_detail *detail)
{
    struct finding finding = {.journal = journal};
    uint64_t reached;
    enum bd_err err = walk_to(&finding, id, revision, out, &reached, detail);
    finish_walked(&finding);
    return err;
}

// One revision's deltas; what the journal lends is gone with the next call to it, and finding
// content is one.
static enum bd_err read_deltas(struct finding *finding, const struct bd_journal_edit *edit,
                               struct bd_store_step *out, struct bd_err_detail *detail)
{
    struct bd_bytes forward = {0}, inverse = {0};
    enum bd_err err = BD_ERR_OK;
    if (bd_bytes_put(&forward, 0, edit->forward.data, edit->forward.size) ||
        bd_bytes_put(&inverse, 0, edit->inverse.data, edit->inverse.size))
        err = bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (!err)
        err = bd_delta_read(forward.data, forward.size_bytes, find_content, finding, &out->forward,
                            detail);
    if (!err)
        err = bd_delta_read(inverse.data, inverse.size_bytes, find_content, finding, &out->inverse,
                            detail);
    bd_bytes_finish(&forward);
    bd_bytes_finish(&inverse);
    return explain(finding, err, detail);
}

enum bd_err bd_store_read_step(struct bd_journal *journal, const char *id, uint64_t revision,
                               const struct bd_scene *known, struct bd_store_step *out,
                               struct bd_err_detail *detail)
{
    struct finding finding = {.journal = journal};
    struct bd_journal_edit edit;
    *out = (struct bd_store_step){0};
    enum bd_err err = bd_journal_get_edit(journal, id, revision, &edit, detail);
    if (err) return err;
    snprintf(out->author, sizeof out->author, "%s", edit.author);
    bd_content_of_scene(known, keep_content, &finding.held);
    err = read_deltas(&finding, &edit, out, detail);
    bd_content_table_finish(&finding.held);
    finish_walked(&finding);
    if (err) bd_store_step_finish(out);
    return err;
}

void bd_store_step_finish(struct bd_store_step *step)
{
    bd_delta_finish(&step->forward);
    bd_delta_finish(&step->inverse);
}

// --- start-up -------------------------------------------------------------------------------

struct listing {
    uint32_t count;
    struct bd_store_entry *entries;
};

static void list_scene(void *user, const struct bd_journal_scene *scene)
{
    struct listing *listing = user;
    listing->entries = realloc(listing->entries, (listing->count + 1) * sizeof *listing->entries);
    BD_ASSERT(listing->entries);
    struct bd_store_entry *entry = &listing->entries[listing->count++];
    *entry = (struct bd_store_entry){.revision = scene->revision};
    snprintf(entry->id, sizeof entry->id, "%s", scene->scene);
    snprintf(entry->name, sizeof entry->name, "%s", scene->name);
    snprintf(entry->owner, sizeof entry->owner, "%s", scene->owner);
}

struct past {
    uint32_t count;
    struct bd_store_past *items;
};

static void list_edit(void *user, const struct bd_journal_edit *edit)
{
    struct past *past = user;
    past->items = realloc(past->items, (past->count + 1) * sizeof *past->items);
    BD_ASSERT(past->items);
    struct bd_store_past *item = &past->items[past->count++];
    *item = (struct bd_store_past){.revision = edit->revision, .of = edit->of};
    snprintf(item->client_edit_id, sizeof item->client_edit_id, "%s", edit->client_edit_id);
    snprintf(item->author, sizeof item->author, "%s", edit->author);
    for (int kind = BD_BATCH_ADD; kind <= BD_BATCH_REVERT; kind++)
        if (strcmp(edit->kind, bd_batch_kind_name((enum bd_batch_kind)kind)) == 0)
            item->kind = (enum bd_batch_kind)kind;
}

static enum bd_err load_scene(struct bd_store *store, struct finding *finding,
                              struct bd_store_entry *entry, struct bd_err_detail *detail)
{
    uint64_t reached = 0;
    enum bd_err err = walk_to(finding, entry->id, 0, &entry->scene, &reached, detail);
    if (!err && reached < entry->revision)
        err = bd_journal_cut(finding->journal, entry->id, reached, detail);
    struct past past = {0};
    if (!err)
        err = bd_journal_each_edit(finding->journal, entry->id, 0, UINT32_MAX, list_edit, &past,
                                   detail);
    entry->revision = reached;
    if (!err) err = bd_store_restore(store, entry, past.items, past.count, detail);
    if (!err) bd_content_of_scene(entry->scene, keep_content, &finding->held);
    finish_walked(finding);
    bd_scene_release(&entry->scene);
    free(past.items);
    return err;
}

enum bd_err bd_store_load(struct bd_store *store, struct bd_journal *journal,
                          struct bd_err_detail *detail)
{
    struct listing listing = {0};
    struct finding finding = {.journal = journal};
    enum bd_err err = bd_journal_each_scene(journal, list_scene, &listing, detail);
    for (uint32_t i = 0; !err && i < listing.count; i++) {
        struct bd_err_detail why = {0};
        enum bd_err failed = load_scene(store, &finding, &listing.entries[i], &why);
        if (failed == BD_ERR_LIMIT)
            err = bd_err_set(detail, BD_ERR_LIMIT, "scenes",
                             "the data directory holds %u scenes, more than the limit scenes",
                             listing.count);
        else if (failed)
            bd_log(BD_LOG_WARN, "scene", "%s (\"%s\") cannot be served: %s", listing.entries[i].id,
                   listing.entries[i].name, why.message);
    }
    bd_content_table_finish(&finding.held);
    free(listing.entries);
    return err;
}
