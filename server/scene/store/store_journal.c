// Staged batches to records.

#include "scene/store/store_journal.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "image/bytes.h"
#include "scene/model/content_table.h"

static bool append(void *user, const void *data, size_t size)
{
    struct bd_bytes *bytes = user;
    return bd_bytes_put(bytes, bytes->size_bytes, data, size) == BD_ERR_OK;
}

static struct bd_journal_bytes bytes_of(const struct bd_bytes *bytes)
{
    return (struct bd_journal_bytes){bytes->data, bytes->size_bytes};
}

// --- records --------------------------------------------------------------------------------

// What one batch becomes, and the bytes that the record points into.
struct form {
    struct bd_journal_edit edit;
    struct bd_journal_snapshot snapshot;
    struct bd_bytes forward, inverse, index, summary;
    struct bd_bytes forward_names, inverse_names, index_names;
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
    struct bd_bytes *all[] = {&form->forward,    &form->inverse,       &form->index,
                              &form->summary,    &form->forward_names, &form->inverse_names,
                              &form->index_names};
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++) bd_bytes_finish(all[i]);
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
    struct bd_bytes *names;
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

static struct bd_journal_digests digests_of(const struct bd_bytes *names)
{
    return (struct bd_journal_digests){names->data,
                                       (uint32_t)(names->size_bytes / BD_SHA256_BYTES)};
}

static struct bd_journal_digests name_delta(struct writing *writing, const struct bd_delta *delta,
                                            struct bd_bytes *names)
{
    struct naming naming = {.writing = writing, .names = names};
    bd_content_of_delta(delta, name_content, &naming);
    bd_content_table_finish(&naming.seen);
    return digests_of(names);
}

static struct bd_journal_digests name_scene(struct writing *writing, const struct bd_scene *scene,
                                            struct bd_bytes *names)
{
    struct naming naming = {.writing = writing, .names = names};
    bd_content_of_scene(scene, name_content, &naming);
    bd_content_table_finish(&naming.seen);
    return digests_of(names);
}

// What the log shows of it: entries, one a line.
static void summarize(const struct bd_delta *delta, struct bd_bytes *out)
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
        .author = batch->author,
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
                               struct bd_err_detail *detail)
{
    struct bd_journal_content item = {0};
    struct bd_bytes bytes = {0};
    memcpy(item.sha256, bd_content_sha256(content), sizeof item.sha256);
    if (!bd_content_write(content, append, &bytes)) {
        bd_bytes_finish(&bytes);
        return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for a mesh or a picture");
    }
    item.bytes = bytes_of(&bytes);
    struct bd_journal_put put = {.content = &item, .count = 1};
    enum bd_err err = BD_ERR_OK;
    while (!err && put.next < put.count) err = bd_journal_put_some(journal, &put, detail);
    // Nothing collects it before the commit: whoever has the journal's turn keeps it until then.
    bd_journal_put_end(journal, &put);
    bd_bytes_finish(&bytes);
    return err;
}

static enum bd_err put_missing_content(struct writing *writing, struct bd_err_detail *detail)
{
    const struct bd_content_table *table = &writing->content;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t i = 0; !err && i < table->size; i++) {
        const uint8_t *sha256 = bd_content_sha256(&table->items[i]);
        bool is_there = true;
        if (sha256) err = bd_journal_has_content(writing->journal, sha256, &is_there, detail);
        if (!err && !is_there) err = put_content(writing->journal, &table->items[i], detail);
    }
    return err;
}

static const struct bd_batch *batch_at(const struct bd_batch *first, uint32_t index)
{
    while (first && index-- > 0) first = first->next;
    return first;
}

enum bd_err bd_store_write(struct bd_journal *journal, const struct bd_batch *first,
                           const struct bd_batch **faulty, struct bd_err_detail *detail)
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
        formed ? BD_ERR_OK : bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the edit");
    if (!err) err = put_missing_content(&writing, detail);
    uint32_t at = writing.count;
    if (!err) err = bd_journal_commit(journal, writing.records, writing.count, &at, detail);
    *faulty = batch_at(first, at);
    finish_writing(&writing);
    return err;
}

// --- upkeep ---------------------------------------------------------------------------------

enum bd_err bd_store_snapshot(struct bd_journal *journal, const char *id, uint64_t revision,
                              const struct bd_scene *scene, struct bd_err_detail *detail)
{
    struct writing writing = {.journal = journal};
    struct form form = {0};
    enum bd_err err = form_snapshot(&writing, scene, revision, &form)
                          ? BD_ERR_OK
                          : bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for an index");
    // What was found damaged in the journal is whole in memory.
    if (!err) err = put_missing_content(&writing, detail);
    if (!err) err = bd_journal_write_snapshot(journal, id, &form.snapshot, detail);
    free_form(&form);
    finish_writing(&writing);
    return err;
}
