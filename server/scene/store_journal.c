#include "scene/store_journal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/content_table.h"

// --- bytes ----------------------------------------------------------------------------------

struct text {
    uint8_t *bytes;
    size_t size, room;
};

static bool append(void *user, const void *bytes, size_t size)
{
    struct text *text = user;
    if (text->size + size > text->room) {
        size_t room = text->room ? 2 * text->room : 4096;
        while (room < text->size + size) room *= 2;
        uint8_t *grown = realloc(text->bytes, room);
        if (!grown) return false;
        text->bytes = grown;
        text->room = room;
    }
    memcpy(text->bytes + text->size, bytes, size);
    text->size += size;
    return true;
}

static struct bd_journal_bytes bytes_of(const struct text *text)
{
    return (struct bd_journal_bytes){text->bytes, text->size};
}

// --- records --------------------------------------------------------------------------------

// What one batch becomes, and the bytes that the record points into.
struct form {
    struct bd_journal_edit edit;
    struct bd_journal_snapshot snapshot;
    struct text forward, inverse, index, summary;
    struct text forward_names, inverse_names, index_names;
};

struct writing {
    struct bd_journal *journal;
    uint32_t count;
    struct bd_journal_record *records;
    struct form *forms;
    struct bd_content_table content; // of all that is written
};

static void free_form(struct form *form)
{
    struct text *texts[] = {&form->forward,    &form->inverse,       &form->index,
                            &form->summary,    &form->forward_names, &form->inverse_names,
                            &form->index_names};
    for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) free(texts[i]->bytes);
}

static void finish_writing(struct writing *writing)
{
    for (uint32_t i = 0; i < writing->count; i++) free_form(&writing->forms[i]);
    bd_content_table_finish(&writing->content);
    free(writing->forms);
    free(writing->records);
}

struct naming {
    struct writing *writing;
    struct text *names;
    struct bd_content_table seen;
};

static void name_content(void *user, const struct bd_content *content)
{
    struct naming *naming = user;
    const uint8_t *sha256 = bd_content_sha256(content);
    if (!sha256 || bd_content_table_get(&naming->seen, sha256)) return;
    bd_content_table_put(&naming->seen, content);
    bd_content_table_put(&naming->writing->content, content);
    bool kept = append(naming->names, sha256, BD_SHA256_BYTES);
    BD_ASSERT(kept);
}

static struct bd_journal_digests digests_of(const struct text *names)
{
    return (struct bd_journal_digests){names->bytes, (uint32_t)(names->size / BD_SHA256_BYTES)};
}

static struct bd_journal_digests name_delta(struct writing *writing, const struct bd_delta *delta,
                                            struct text *names)
{
    struct naming naming = {.writing = writing, .names = names};
    bd_content_of_delta(delta, name_content, &naming);
    bd_content_table_finish(&naming.seen);
    return digests_of(names);
}

static struct bd_journal_digests name_scene(struct writing *writing, const struct bd_scene *scene,
                                            struct text *names)
{
    struct naming naming = {.writing = writing, .names = names};
    bd_content_of_scene(scene, name_content, &naming);
    bd_content_table_finish(&naming.seen);
    return digests_of(names);
}

// What the log shows of it: entries, one a line.
static void summarize(const struct bd_delta *delta, struct text *out)
{
    char entries[16][BD_DELTA_ENTRY_BYTES];
    uint32_t count = bd_delta_describe(delta, entries, 16);
    for (uint32_t i = 0; i < count; i++) {
        bool kept = append(out, entries[i], strlen(entries[i])) && append(out, "\n", 1);
        BD_ASSERT(kept);
    }
}

static bool form_snapshot(struct writing *writing, const struct bd_scene *scene, uint64_t revision,
                          struct form *form)
{
    if (!bd_flat_write_index(scene, append, &form->index)) return false;
    form->snapshot =
        (struct bd_journal_snapshot){.revision = revision, .index = bytes_of(&form->index)};
    memcpy(form->snapshot.sha256, scene->content_sha256, sizeof form->snapshot.sha256);
    form->snapshot.content = name_scene(writing, scene, &form->index_names);
    return true;
}

static bool form_edit(struct writing *writing, const struct bd_batch *batch, struct form *form)
{
    if (!bd_delta_write(&batch->forward, append, &form->forward) ||
        !bd_delta_write(&batch->inverse, append, &form->inverse))
        return false;
    summarize(&batch->forward, &form->summary);
    form->edit = (struct bd_journal_edit){
        .revision = batch->revision,
        .kind = bd_batch_kind_name(batch->kind),
        .of = batch->of,
        .client_edit_id = batch->client_edit_id,
        .message = batch->message,
        .time_ms = batch->time_ms,
        .summary = bytes_of(&form->summary),
        .answer = {batch->answer, batch->answer_bytes},
        .forward = bytes_of(&form->forward),
        .inverse = bytes_of(&form->inverse),
        .forward_content = name_delta(writing, &batch->forward, &form->forward_names),
        .inverse_content = name_delta(writing, &batch->inverse, &form->inverse_names),
    };
    memcpy(form->edit.snapshot_sha256, batch->after->content_sha256, BD_SHA256_BYTES);
    return true;
}

static bool form_record(struct writing *writing, const struct bd_batch *batch, uint32_t index)
{
    static const enum bd_journal_record_kind kinds[] = {
        BD_JOURNAL_ADD_SCENE, BD_JOURNAL_REMOVE_SCENE, BD_JOURNAL_EDIT, BD_JOURNAL_EDIT,
        BD_JOURNAL_EDIT,      BD_JOURNAL_EDIT,         BD_JOURNAL_NAME, BD_JOURNAL_UNNAME};
    struct form *form = &writing->forms[index];
    writing->records[index] = (struct bd_journal_record){.kind = kinds[batch->kind],
                                                         .scene = batch->scene_id,
                                                         .name = batch->name,
                                                         .owner = batch->owner,
                                                         .revision = batch->of,
                                                         .edit = &form->edit,
                                                         .snapshot = &form->snapshot};
    if (!batch->after) return true;
    if (!form_edit(writing, batch, form)) return false;
    return batch->kind != BD_BATCH_ADD ||
           form_snapshot(writing, batch->after, batch->revision, form);
}

// --- content --------------------------------------------------------------------------------

static enum bd_err put_content(struct bd_journal *journal, const struct bd_content *content,
                               struct bd_fault *fault)
{
    struct bd_journal_content item = {0};
    struct text text = {0};
    memcpy(item.sha256, bd_content_sha256(content), sizeof item.sha256);
    if (!bd_content_write(content, append, &text)) {
        free(text.bytes);
        return bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for a mesh or a picture");
    }
    item.bytes = bytes_of(&text);
    struct bd_journal_put put = {.content = &item, .count = 1};
    enum bd_err err = BD_ERR_OK;
    while (!err && put.next < put.count) err = bd_journal_put_some(journal, &put, fault);
    // Nothing collects it before the commit: whoever has the journal's turn keeps it until then.
    bd_journal_put_end(journal, &put);
    free(text.bytes);
    return err;
}

static enum bd_err put_missing_content(struct writing *writing, struct bd_fault *fault)
{
    const struct bd_content_table *table = &writing->content;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < table->size; i++) {
        const uint8_t *sha256 = bd_content_sha256(&table->items[i]);
        bool is_there = true;
        if (sha256) err = bd_journal_has_content(writing->journal, sha256, &is_there, fault);
        if (!err && !is_there) err = put_content(writing->journal, &table->items[i], fault);
    }
    return err;
}

static const struct bd_batch *batch_at(const struct bd_batch *first, uint32_t index)
{
    while (first && index-- > 0) first = first->next;
    return first;
}

enum bd_err bd_store_write(struct bd_journal *journal, const struct bd_batch *first,
                           const struct bd_batch **faulty, struct bd_fault *fault)
{
    struct writing writing = {.journal = journal};
    for (const struct bd_batch *batch = first; batch; batch = batch->next) writing.count++;
    writing.records = calloc(writing.count + 1, sizeof *writing.records);
    writing.forms = calloc(writing.count + 1, sizeof *writing.forms);
    BD_ASSERT(writing.records && writing.forms);
    bool formed = true;
    uint32_t index = 0;
    for (const struct bd_batch *batch = first; formed && batch; batch = batch->next)
        formed = form_record(&writing, batch, index++);
    enum bd_err err =
        formed ? BD_ERR_OK : bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (!err) err = put_missing_content(&writing, fault);
    uint32_t at = writing.count;
    if (!err) err = bd_journal_commit(journal, writing.records, writing.count, &at, fault);
    *faulty = batch_at(first, at);
    finish_writing(&writing);
    return err;
}

// --- back -----------------------------------------------------------------------------------

// Of the past of a scene so many bytes are kept in memory, since what went may come back.
#define PAST_BYTES_MAX (32u << 20)

// Content that is in memory, or in the journal.
struct finding {
    struct bd_journal *journal;
    struct bd_content_table held;   // by scenes that are loaded
    struct bd_content_table walked; // by the one that is being walked to, and by its past
    uint64_t walked_bytes;          // read since the past was forgotten
    struct bd_fault fault;          // of a disk that did not answer
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
    struct bd_fault fault = {0};
    void *bytes = NULL;
    size_t size;
    enum bd_err err = bd_journal_read_content(finding->journal, sha256, &bytes, &size, &fault);
    if (err && err != BD_ERR_NOT_FOUND) finding->fault = fault;
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
static enum bd_err explain(const struct finding *finding, enum bd_err err, struct bd_fault *fault)
{
    if (err != BD_ERR_NOT_FOUND || !finding->fault.err) return err;
    if (fault) *fault = finding->fault;
    return finding->fault.err;
}

// A walk from a snapshot along the edits after it.
struct walk {
    struct finding *finding;
    struct bd_scene *scene;
};

static enum bd_err visit_snapshot(void *user, const struct bd_journal_snapshot *snapshot,
                                  struct bd_fault *fault)
{
    struct walk *walk = user;
    bd_scene_release(&walk->scene); // a second walk begins anew
    enum bd_err err = bd_flat_read_index(snapshot->index.data, snapshot->index.size, find_content,
                                         walk->finding, &walk->scene, fault);
    return err ? err : bd_scene_finish(walk->scene, fault);
}

static enum bd_err visit_edit(void *user, const struct bd_journal_edit *edit,
                              struct bd_fault *fault)
{
    struct walk *walk = user;
    struct bd_delta delta = {0};
    struct bd_scene *next = NULL;
    enum bd_err err = bd_delta_read(edit->forward.data, edit->forward.size, find_content,
                                    walk->finding, &delta, fault);
    if (!err) err = bd_delta_apply(walk->scene, &delta, &next, fault);
    bd_delta_finish(&delta);
    if (err) return err;
    bd_scene_release(&walk->scene);
    walk->scene = next;
    forget_past(walk->finding, next);
    if (memcmp(next->content_sha256, edit->snapshot_sha256, BD_SHA256_BYTES) == 0) return BD_ERR_OK;
    return bd_fault_set(fault, BD_ERR_BAD_INPUT, "data",
                        "revision %llu is not what it was when it was written",
                        (unsigned long long)edit->revision);
}

static enum bd_err walk_to(struct finding *finding, const char *id, uint64_t revision,
                           struct bd_scene **out, uint64_t *reached, struct bd_fault *fault)
{
    struct walk walk = {.finding = finding};
    const struct bd_journal_visitor visitor = {visit_snapshot, visit_edit, &walk};
    enum bd_err err;
    uint64_t known_damage;
    // Content that was found damaged on the way counts as missing from here on, and the next walk
    // ends before it.
    do {
        finding->fault = (struct bd_fault){0};
        known_damage = bd_journal_damage_count(finding->journal);
        err = bd_journal_load(finding->journal, id, revision, &visitor, reached, fault);
    } while (err == BD_ERR_NOT_FOUND && revision == 0 &&
             bd_journal_damage_count(finding->journal) > known_damage);
    err = explain(finding, err, fault);
    if (err)
        bd_scene_release(&walk.scene);
    else
        *out = walk.scene;
    return err;
}

enum bd_err bd_store_read_revision(struct bd_journal *journal, const char *id, uint64_t revision,
                                   struct bd_scene **out, struct bd_fault *fault)
{
    struct finding finding = {.journal = journal};
    uint64_t reached;
    enum bd_err err = walk_to(&finding, id, revision, out, &reached, fault);
    finish_walked(&finding);
    return err;
}

enum bd_err bd_store_read_inverse(struct bd_journal *journal, const char *id, uint64_t revision,
                                  struct bd_delta *out, struct bd_fault *fault)
{
    struct finding finding = {.journal = journal};
    struct bd_journal_edit edit;
    enum bd_err err = bd_journal_get_edit(journal, id, revision, &edit, fault);
    struct text inverse = {0};
    // What the journal lends is gone with the next call to it, and finding content is one.
    if (!err && !append(&inverse, edit.inverse.data, edit.inverse.size))
        err = bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (!err) err = bd_delta_read(inverse.bytes, inverse.size, find_content, &finding, out, fault);
    err = explain(&finding, err, fault);
    free(inverse.bytes);
    finish_walked(&finding);
    return err;
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
    for (int kind = BD_BATCH_ADD; kind <= BD_BATCH_REVERT; kind++)
        if (strcmp(edit->kind, bd_batch_kind_name((enum bd_batch_kind)kind)) == 0)
            item->kind = (enum bd_batch_kind)kind;
}

static enum bd_err load_scene(struct bd_store *store, struct finding *finding,
                              struct bd_store_entry *entry, struct bd_fault *fault)
{
    uint64_t reached = 0;
    enum bd_err err = walk_to(finding, entry->id, 0, &entry->scene, &reached, fault);
    if (!err && reached < entry->revision)
        err = bd_journal_cut(finding->journal, entry->id, reached, fault);
    struct past past = {0};
    if (!err)
        err = bd_journal_each_edit(finding->journal, entry->id, 0, UINT32_MAX, list_edit, &past,
                                   fault);
    entry->revision = reached;
    if (!err) err = bd_store_restore(store, entry, past.items, past.count, fault);
    if (!err) bd_content_of_scene(entry->scene, keep_content, &finding->held);
    finish_walked(finding);
    bd_scene_release(&entry->scene);
    free(past.items);
    return err;
}

enum bd_err bd_store_load(struct bd_store *store, struct bd_journal *journal,
                          struct bd_fault *fault)
{
    struct listing listing = {0};
    struct finding finding = {.journal = journal};
    enum bd_err err = bd_journal_each_scene(journal, list_scene, &listing, fault);
    for (uint32_t i = 0; !err && i < listing.count; i++) {
        struct bd_fault why = {0};
        enum bd_err failed = load_scene(store, &finding, &listing.entries[i], &why);
        if (failed == BD_ERR_LIMIT)
            err = bd_fault_set(fault, BD_ERR_LIMIT, "scenes",
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

// --- upkeep ---------------------------------------------------------------------------------

enum bd_err bd_store_snapshot(struct bd_journal *journal, const char *id, uint64_t revision,
                              const struct bd_scene *scene, struct bd_fault *fault)
{
    struct writing writing = {.journal = journal};
    struct form form = {0};
    enum bd_err err = form_snapshot(&writing, scene, revision, &form)
                          ? BD_ERR_OK
                          : bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for an index");
    // What was found damaged in the journal is whole in memory.
    if (!err) err = put_missing_content(&writing, fault);
    if (!err) err = bd_journal_write_snapshot(journal, id, &form.snapshot, fault);
    free_form(&form);
    finish_writing(&writing);
    return err;
}
