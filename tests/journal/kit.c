#include "tests/journal/kit.h"

#include <ftw.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "base/assert.h"

void kit_make_directory(char path[64])
{
    // What is not about the disk need not wait for one.
    const char *parent = access("/dev/shm", W_OK) == 0 ? "/dev/shm" : getenv("TMPDIR");
    snprintf(path, 64, "%.40s/journal.XXXXXX", parent ? parent : "/tmp");
    BD_ASSERT(mkdtemp(path));
}

static int remove_one(const char *path, const struct stat *info, int kind, struct FTW *ftw)
{
    (void)info;
    (void)kind;
    (void)ftw;
    return remove(path);
}

void kit_remove_directory(const char *path)
{
    nftw(path, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

uint32_t kit_random(uint64_t *random)
{
    *random ^= *random << 13;
    *random ^= *random >> 7;
    *random ^= *random << 17;
    return (uint32_t)(*random >> 32);
}

static void fill(uint8_t *out, size_t size, uint64_t seed)
{
    for (size_t i = 0; i < size; i += 8) {
        uint64_t word = bd_hash64(&i, sizeof i, seed);
        memcpy(out + i, &word, size - i < 8 ? size - i : 8);
    }
}

static void hash_of_state(uint64_t state, uint8_t sha256[BD_SHA256_BYTES])
{
    bd_sha256_of(&state, sizeof state, sha256);
}

void kit_make_edit(struct kit_edit *out, uint64_t revision, uint64_t state, uint32_t salt)
{
    uint64_t seed = bd_hash64(&revision, sizeof revision, salt);
    size_t forward_size = 8 + seed % (KIT_BYTES - 8), inverse_size = 8 + (seed >> 16) % 64;
    memset(out, 0, sizeof *out);
    fill(out->forward, forward_size, seed);
    fill(out->inverse, inverse_size, seed + 1);
    out->state = bd_hash64(out->forward, forward_size, state);
    snprintf(out->client_edit_id, sizeof out->client_edit_id, "e%llu.%u",
             (unsigned long long)revision, salt);
    snprintf(out->message, sizeof out->message, "makes %llu", (unsigned long long)revision);
    snprintf(out->author, sizeof out->author, "user %llu", (unsigned long long)(revision % 2));
    snprintf(out->summary, sizeof out->summary, "light %llu", (unsigned long long)(seed % 9));
    snprintf(out->answer, sizeof out->answer, "revision %llu", (unsigned long long)revision);
    out->edit = (struct bd_journal_edit){
        .revision = revision,
        .kind = revision % 3 ? "edit" : "undo",
        .of = revision % 3 ? 0 : revision - 1,
        .client_edit_id = out->client_edit_id,
        .message = out->message,
        .author = out->author,
        .time_ms = 1700000000000 + revision,
        .summary = {out->summary, strlen(out->summary)},
        .answer = {out->answer, strlen(out->answer)},
        .forward = {out->forward, forward_size},
        .inverse = {out->inverse, inverse_size},
    };
    hash_of_state(out->state, out->edit.snapshot_sha256);
}

static bool are_equal(struct bd_journal_bytes a, struct bd_journal_bytes b)
{
    return a.size == b.size && memcmp(a.data, b.data, a.size) == 0;
}

static bool are_same_list(struct bd_journal_digests a, struct bd_journal_digests b)
{
    return a.count == b.count &&
           (a.count == 0 || memcmp(a.sha256, b.sha256, a.count * BD_SHA256_BYTES) == 0);
}

bool kit_is_edit(const struct bd_journal_edit *edit, const struct kit_edit *made, bool is_of_log)
{
    const struct bd_journal_edit *want = &made->edit;
    bool is_head = edit->revision == want->revision && strcmp(edit->kind, want->kind) == 0 &&
                   edit->of == want->of && edit->time_ms == want->time_ms &&
                   strcmp(edit->client_edit_id, want->client_edit_id) == 0 &&
                   strcmp(edit->message, want->message) == 0 &&
                   strcmp(edit->author, want->author) == 0 &&
                   memcmp(edit->snapshot_sha256, want->snapshot_sha256, BD_SHA256_BYTES) == 0 &&
                   are_equal(edit->summary, want->summary);
    if (is_of_log || !is_head) return is_head;
    return are_equal(edit->answer, want->answer) && are_equal(edit->forward, want->forward) &&
           are_equal(edit->inverse, want->inverse) &&
           are_same_list(edit->forward_content, want->forward_content) &&
           are_same_list(edit->inverse_content, want->inverse_content);
}

void kit_make_snapshot(struct kit_snapshot *out, uint64_t revision, uint64_t state)
{
    memset(out, 0, sizeof *out);
    fill(out->index, sizeof out->index, state);
    memcpy(out->index, &state, sizeof state);
    out->snapshot.revision = revision;
    out->snapshot.index = (struct bd_journal_bytes){out->index, sizeof out->index};
    hash_of_state(state, out->snapshot.sha256);
}

void kit_make_content(struct kit_content *out, size_t size, uint64_t seed)
{
    out->bytes = malloc(size ? size : 1);
    BD_ASSERT(out->bytes);
    fill(out->bytes, size, seed);
    out->content.bytes = (struct bd_journal_bytes){out->bytes, size};
    bd_sha256_of(out->bytes, size, out->content.sha256);
}

enum bd_err kit_put(struct bd_journal *journal, const struct bd_journal_content *content,
                    uint32_t count, struct bd_err_detail *detail)
{
    struct bd_journal_put put = {.content = content, .count = count};
    enum bd_err err = BD_ERR_OK;
    while (!err && put.next < put.count) err = bd_journal_put_some(journal, &put, detail);
    bd_journal_put_end(journal, &put);
    return err;
}

bool kit_has(struct bd_journal *journal, const struct kit_content *content)
{
    bool is_there = false;
    enum bd_err err = bd_journal_has_content(journal, content->content.sha256, &is_there, NULL);
    BD_ASSERT_CMP(err, ==, BD_ERR_OK);
    return is_there;
}

enum bd_err kit_read(struct bd_journal *journal, const struct kit_content *content,
                     struct bd_err_detail *detail)
{
    void *bytes;
    size_t size;
    enum bd_err err =
        bd_journal_read_content(journal, content->content.sha256, &bytes, &size, detail);
    if (err) return err;
    bool is_same = size == content->content.bytes.size && memcmp(bytes, content->bytes, size) == 0;
    free(bytes);
    return is_same ? BD_ERR_OK : BD_ERR_DIFFERS;
}

enum bd_err kit_add(struct bd_journal *journal, const char *scene, const struct kit_edit *first,
                    const struct kit_snapshot *snapshot, struct bd_err_detail *detail)
{
    struct bd_journal_record record = {.kind = BD_JOURNAL_ADD_SCENE,
                                       .scene = scene,
                                       .name = "box",
                                       .edit = &first->edit,
                                       .snapshot = &snapshot->snapshot};
    return bd_journal_commit(journal, &record, 1, NULL, detail);
}

enum bd_err kit_commit(struct bd_journal *journal, const char *scene, const struct kit_edit *edit,
                       struct bd_err_detail *detail)
{
    struct bd_journal_record record = {
        .kind = BD_JOURNAL_EDIT, .scene = scene, .edit = &edit->edit};
    return bd_journal_commit(journal, &record, 1, NULL, detail);
}

static enum bd_err take_snapshot(void *user, const struct bd_journal_snapshot *snapshot,
                                 struct bd_err_detail *detail)
{
    struct kit_loaded *loaded = user;
    if (snapshot->index.size < sizeof loaded->state)
        return bd_err_set(detail, BD_ERR_INTERNAL, "", "an index of %zu bytes",
                          snapshot->index.size);
    memcpy(&loaded->state, snapshot->index.data, sizeof loaded->state);
    loaded->snapshot_revision = snapshot->revision;
    loaded->edit_count = 0;
    return BD_ERR_OK;
}

static enum bd_err take_edit(void *user, const struct bd_journal_edit *edit,
                             struct bd_err_detail *detail)
{
    struct kit_loaded *loaded = user;
    uint8_t sha256[BD_SHA256_BYTES];
    loaded->state = bd_hash64(edit->forward.data, edit->forward.size, loaded->state);
    loaded->edit_count++;
    hash_of_state(loaded->state, sha256);
    if (memcmp(sha256, edit->snapshot_sha256, sizeof sha256) == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_INTERNAL, "", "revision %llu replays to another state",
                      (unsigned long long)edit->revision);
}

enum bd_err kit_load(struct bd_journal *journal, const char *scene, uint64_t revision,
                     struct kit_loaded *out, struct bd_err_detail *detail)
{
    *out = (struct kit_loaded){0};
    struct bd_journal_visitor visitor = {take_snapshot, take_edit, out};
    return bd_journal_load(journal, scene, revision, &visitor, &out->revision, detail);
}
