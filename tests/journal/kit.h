// What the journal's tests share: a directory, and scenes whose state is one number, so that any
// history can be made, replayed and compared.

#ifndef BD_TESTS_JOURNAL_KIT_H
#define BD_TESTS_JOURNAL_KIT_H

#include <stdint.h>

#include "scene/journal/journal.h"

#define KIT_BYTES 600

void kit_make_directory(char path[64]);
void kit_remove_directory(const char *path);

// xorshift: the same seed, the same test.
uint32_t kit_random(uint64_t *random);

// An edit that takes `state` to another, made up from revision and `salt`. Its texts and bytes lie
// in it: it must not move.
struct kit_edit {
    struct bd_journal_edit edit;
    uint64_t state; // after it
    char client_edit_id[32], message[64], author[32], summary[32], answer[32];
    uint8_t forward[KIT_BYTES], inverse[KIT_BYTES];
};
void kit_make_edit(struct kit_edit *out, uint64_t revision, uint64_t state, uint32_t salt);
// Whether `edit` is that one, field by field; without deltas and answer if it is of the log.
bool kit_is_edit(const struct bd_journal_edit *edit, const struct kit_edit *made, bool is_of_log);

struct kit_snapshot {
    struct bd_journal_snapshot snapshot;
    uint8_t index[KIT_BYTES];
};
void kit_make_snapshot(struct kit_snapshot *out, uint64_t revision, uint64_t state);

struct kit_content {
    struct bd_journal_content content;
    uint8_t *bytes; // for free()
};
void kit_make_content(struct kit_content *out, size_t size, uint64_t seed);
enum bd_err kit_put(struct bd_journal *journal, const struct bd_journal_content *content,
                    uint32_t count, struct bd_err_detail *detail);
bool kit_has(struct bd_journal *journal, const struct kit_content *content);
// BD_ERR_DIFFERS if what is read is not what was made.
enum bd_err kit_read(struct bd_journal *journal, const struct kit_content *content,
                     struct bd_err_detail *detail);

// One record alone.
enum bd_err kit_add(struct bd_journal *journal, const char *scene, const struct kit_edit *first,
                    const struct kit_snapshot *snapshot, struct bd_err_detail *detail);
enum bd_err kit_commit(struct bd_journal *journal, const char *scene, const struct kit_edit *edit,
                       struct bd_err_detail *detail);

struct kit_loaded {
    uint64_t revision, state, snapshot_revision;
    uint32_t edit_count;
};
enum bd_err kit_load(struct bd_journal *journal, const char *scene, uint64_t revision,
                     struct kit_loaded *out, struct bd_err_detail *detail);

#endif
