// The journal: what the daemon knows after it died. One SQLite file in the data directory, in which
// every acknowledged edit is, whole, or nothing was acknowledged.
//
// It stores bytes and knows nothing of scenes: an edit is a forward and an inverse delta, a
// snapshot is the index of a scene, and what is heavy (meshes, pictures) is content, named by its
// SHA-256 and stored once. README.md tells the format and what each kind of crash leaves.
//
// Thread: any, one at a time (the caller's turn-taking); every call may wait for the disk, so keep
// them off the event loop. No call takes longer than one bounded transaction and one bounded
// checkpoint, but those that hand out bytes, which take as long as the bytes.
//
// Errors, everywhere: BD_ERR_NO_MEMORY, field `data`: the disk is full; BD_ERR_IO, field `data`: it
// is read-only or fails. Nothing of the call is kept then, and a later one works once the cause is
// gone. A commit that failed for BD_ERR_IO can be found whole if the machine dies before the next
// commit succeeds: nobody can know what a disk did that did not answer.

#ifndef BD_SCENE_JOURNAL_JOURNAL_H
#define BD_SCENE_JOURNAL_JOURNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/err.h"
#include "base/hash.h"

#define BD_JOURNAL_FORMAT     3 // an older file is brought up to it, a newer one refused
#define BD_JOURNAL_FILE       "journal.sqlite"
#define BD_JOURNAL_FILE_BYTES 4160 // a path to it

// Texts: ids, names, kinds, messages.
#define BD_JOURNAL_TEXT_BYTES_MAX 256
// Each of a record's byte strings: a delta, an index, an answer.
#define BD_JOURNAL_RECORD_BYTES_MAX   (256u << 20)
#define BD_JOURNAL_COMMIT_RECORDS_MAX 4096
#define BD_JOURNAL_CONTENT_BYTES_MAX  (64ull << 30)
// Content lies in parts of this size, and goes in and out by transactions of at most this many
// bytes.
#define BD_JOURNAL_PART_BYTES  (1u << 20)
#define BD_JOURNAL_SLICE_BYTES (4u << 20)
// Records that one call of bd_journal_compact or bd_journal_collect looks at or takes away.
#define BD_JOURNAL_SLICE_RECORDS 256
// The write-ahead log is copied into the file by the first commit that finds it this long.
#define BD_JOURNAL_LOG_PAGES   512
#define BD_JOURNAL_PAGE_BYTES  4096
#define BD_JOURNAL_CACHE_BYTES (2u << 20)

struct bd_journal;

// Opens, or makes, `directory`/journal.sqlite. The directory must be held (data_dir.h). A write
// that a crash left unfinished is cut off; a damaged file is built anew from what is whole in it
// and kept beside as journal.sqlite.damaged; both with a warning in the log that names what is
// lost. BD_ERR_UNSUPPORTED, field `data`: it was written by a newer version. BD_ERR_IO: it is no
// journal, or so damaged that nothing can be read; it is left as it is.
//
// BD_ERR_IO, too, where the directory's identity (journal_identity.h) says that there was more: the
// file or its log is missing, is an older copy or belongs to another directory. All is left as it
// is, and the line says what to do.
BD_MUST_CHECK
enum bd_err bd_journal_open(const char *directory, struct bd_journal **out,
                            struct bd_err_detail *detail);
// The way out of that: whatever is there is taken for all that there was, with a warning. A log
// without its file is kept as journal.sqlite-wal.lone.
BD_MUST_CHECK
enum bd_err bd_journal_open_as_it_is(const char *directory, struct bd_journal **out,
                                     struct bd_err_detail *detail);
// Whether file and log are where they were when they were opened: nothing is committed otherwise.
// Thread: any, at any time between opening and closing.
bool bd_journal_is_in_place(const struct bd_journal *journal);
// A copy of a journal that no daemon holds, for reading: `path` is the file, or the data directory
// around it. The file is only read, and its write-ahead log with it; the copy lies in a temporary
// directory and goes with bd_journal_close. BD_ERR_CONFLICT: a daemon holds the directory.
// BD_ERR_NOT_FOUND: there is no such file. BD_ERR_UNSUPPORTED: it was written by a newer version.
// BD_ERR_IO: it is no journal, or damaged, which is said and not mended.
BD_MUST_CHECK
enum bd_err bd_journal_open_copy(const char *path, struct bd_journal **out,
                                 struct bd_err_detail *detail);
// Takes NULL.
void bd_journal_close(struct bd_journal **journal);

struct bd_journal_bytes {
    const void *data;
    size_t size;
};

// Names of content, 32 bytes each, one after another.
struct bd_journal_digests {
    const uint8_t *sha256;
    uint32_t count;
};

// What made a revision of a scene. Texts are never NULL when read; NULL is "" when written.
struct bd_journal_edit {
    uint64_t revision;          // the one before it + 1
    const char *kind;           // import | edit | undo | redo | revert
    uint64_t of;                // the revision that it is about; 0: none
    const char *client_edit_id; // unique in its scene while the edit is kept; "": none
    const char *message;
    const char *author;                                         // who did it; "": nobody knows
    uint64_t time_ms;                                           // since 1970
    uint8_t snapshot_sha256[BD_SHA256_BYTES];                   // of the state after it
    struct bd_journal_bytes summary;                            // what the log shows of it
    struct bd_journal_bytes answer;                             // what its client was told
    struct bd_journal_bytes forward, inverse;                   // deltas
    struct bd_journal_digests forward_content, inverse_content; // that they need
};

struct bd_journal_snapshot {
    uint64_t revision;
    uint8_t sha256[BD_SHA256_BYTES];
    struct bd_journal_bytes index;
    struct bd_journal_digests content; // that the index needs
};

// --- content ---------------------------------------------------------------------------------

struct bd_journal_content {
    uint8_t sha256[BD_SHA256_BYTES]; // of the bytes; trusted here, proven when it is read
    struct bd_journal_bytes bytes;
};

// A run of content on its way in, before the commit that needs it.
struct bd_journal_put {
    const struct bd_journal_content *content;
    uint32_t count;
    // How far it is: begin with zeros.
    uint32_t next, pinned;
    uint64_t next_bytes;
};

// Stores at most BD_JOURNAL_SLICE_BYTES more: call it until `put->next == put->count`; other calls
// may come between. What is there already is not written again, unless it was found damaged. Until
// bd_journal_put_end, which is due after success and failure alike, nothing of it is collected.
BD_MUST_CHECK
enum bd_err bd_journal_put_some(struct bd_journal *journal, struct bd_journal_put *put,
                                struct bd_err_detail *detail);
void bd_journal_put_end(struct bd_journal *journal, struct bd_journal_put *put);

// `out`: it is there, and whole as far as is known.
BD_MUST_CHECK
enum bd_err bd_journal_has_content(struct bd_journal *journal,
                                   const uint8_t sha256[BD_SHA256_BYTES], bool *out,
                                   struct bd_err_detail *detail);

// `*bytes` is the caller's, for free(). BD_ERR_NOT_FOUND: it is not there, or no longer what its
// name says; then it counts as missing from here on, and bd_journal_load steers clear of it.
BD_MUST_CHECK
enum bd_err bd_journal_read_content(struct bd_journal *journal,
                                    const uint8_t sha256[BD_SHA256_BYTES], void **bytes,
                                    size_t *size, struct bd_err_detail *detail);
// How many times that found damage since the journal was opened.
uint64_t bd_journal_damage_count(const struct bd_journal *journal);

// --- commit ----------------------------------------------------------------------------------

enum bd_journal_record_kind {
    BD_JOURNAL_ADD_SCENE,    // scene, name, owner, edit (its first revision), snapshot (of that
                             // revision)
    BD_JOURNAL_REMOVE_SCENE, // scene
    BD_JOURNAL_EDIT,         // scene, edit
    BD_JOURNAL_NAME,         // scene, name, revision; a name that is taken moves
    BD_JOURNAL_UNNAME,       // scene, name
};

struct bd_journal_record {
    enum bd_journal_record_kind kind;
    const char *scene; // the id
    const char *name;
    uint64_t revision;
    const struct bd_journal_edit *edit;
    const struct bd_journal_snapshot *snapshot;
    const char *owner;
};

// All of the records, in order, or none; on the disk when it returns BD_ERR_OK. A record that
// cannot be kept is BD_ERR_NOT_FOUND (scene, name, revision or content), BD_ERR_CONFLICT (scene,
// revision or client_edit_id) or BD_ERR_LIMIT; `faulty`, which may be NULL, is its index, and
// `count` if the error is none of theirs.
BD_MUST_CHECK
enum bd_err bd_journal_commit(struct bd_journal *journal, const struct bd_journal_record *records,
                              uint32_t count, uint32_t *faulty, struct bd_err_detail *detail);

// --- reading ---------------------------------------------------------------------------------

// Whatever is passed to a callback is borrowed until it returns. Callbacks may read content, and
// nothing else here.

struct bd_journal_scene {
    const char *scene, *name, *owner;
    uint64_t revision; // the newest
    uint64_t added_ms;
};

// In order of addition.
typedef void bd_journal_scene_fn(void *user, const struct bd_journal_scene *scene);
BD_MUST_CHECK
enum bd_err bd_journal_each_scene(struct bd_journal *journal, bd_journal_scene_fn *visit,
                                  void *user, struct bd_err_detail *detail);

// What a state is made from: one snapshot, then the edits after it, in order. An error that one of
// them returns ends the walk and is passed on.
struct bd_journal_visitor {
    enum bd_err (*snapshot)(void *user, const struct bd_journal_snapshot *snapshot,
                            struct bd_err_detail *detail);
    enum bd_err (*edit)(void *user, const struct bd_journal_edit *edit,
                        struct bd_err_detail *detail);
    void *user;
};

// Walks to `revision`; 0: to the newest that is whole, with a warning in the log if that is not the
// newest. `reached` is where it ended. BD_ERR_NOT_FOUND: there is no way to that revision any more.
//
// At start-up: load; if the visitor finds content damaged, load again, which then ends before it,
// until it finds no more; then bd_journal_cut at `reached` if that is below the scene's revision.
BD_MUST_CHECK
enum bd_err bd_journal_load(struct bd_journal *journal, const char *scene, uint64_t revision,
                            const struct bd_journal_visitor *visitor, uint64_t *reached,
                            struct bd_err_detail *detail);

// Walks from the oldest state that is kept, along every edit, to `revision`; 0: to the newest. The
// visitor has seen all that is whole when this fails: BD_ERR_IO names the revision that is damaged
// or whose content is missing. BD_ERR_NOT_FOUND: the scene is not there, or has no such revision
// any more.
BD_MUST_CHECK
enum bd_err bd_journal_walk(struct bd_journal *journal, const char *scene, uint64_t revision,
                            const struct bd_journal_visitor *visitor, struct bd_err_detail *detail);

// Takes away what lies beyond `revision`, which becomes the scene's newest. For damage alone; says
// in the log what went.
BD_MUST_CHECK
enum bd_err bd_journal_cut(struct bd_journal *journal, const char *scene, uint64_t revision,
                           struct bd_err_detail *detail);

// One edit, by its revision or by its client's id. Borrowed until the next call. BD_ERR_NOT_FOUND.
BD_MUST_CHECK
enum bd_err bd_journal_get_edit(struct bd_journal *journal, const char *scene, uint64_t revision,
                                struct bd_journal_edit *out, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_journal_find_edit(struct bd_journal *journal, const char *scene,
                                 const char *client_edit_id, struct bd_journal_edit *out,
                                 struct bd_err_detail *detail);

// The newest `limit` edits beyond revision `after`, oldest first, without answer, deltas and
// content. One that is damaged is left out, with a warning.
typedef void bd_journal_edit_fn(void *user, const struct bd_journal_edit *edit);
BD_MUST_CHECK
enum bd_err bd_journal_each_edit(struct bd_journal *journal, const char *scene, uint64_t after,
                                 uint32_t limit, bd_journal_edit_fn *visit, void *user,
                                 struct bd_err_detail *detail);

// By revision, then by name.
typedef void bd_journal_name_fn(void *user, const char *name, uint64_t revision);
BD_MUST_CHECK
enum bd_err bd_journal_each_name(struct bd_journal *journal, const char *scene,
                                 bd_journal_name_fn *visit, void *user,
                                 struct bd_err_detail *detail);

// Every revision from `*out` to the newest can be loaded. Named ones before it can, too.
BD_MUST_CHECK
enum bd_err bd_journal_oldest(struct bd_journal *journal, const char *scene, uint64_t *out,
                              struct bd_err_detail *detail);

struct bd_journal_stats {
    uint64_t scene_count, edit_count, snapshot_count, content_count;
    uint64_t content_bytes;
    uint64_t file_bytes; // and its write-ahead log
    uint64_t free_bytes; // of the file, to be used again
};
BD_MUST_CHECK
enum bd_err bd_journal_get_stats(struct bd_journal *journal, struct bd_journal_stats *out,
                                 struct bd_err_detail *detail);

// --- upkeep, while serving -------------------------------------------------------------------

// The index of a revision that can still be loaded: start-ups begin at the newest snapshot, and
// bd_journal_compact can forget what lies before one. Replaces one that is there.
BD_MUST_CHECK
enum bd_err bd_journal_write_snapshot(struct bd_journal *journal, const char *scene,
                                      const struct bd_journal_snapshot *snapshot,
                                      struct bd_err_detail *detail);

// Forgets edits and snapshots, BD_JOURNAL_SLICE_RECORDS a call: those at or before the newest
// snapshot that lies `keep_edits` or more behind the newest revision, but what is needed to go back
// to a named revision (a snapshot there makes that little). `is_done`: nothing is left to do.
BD_MUST_CHECK
enum bd_err bd_journal_compact(struct bd_journal *journal, const char *scene, uint64_t keep_edits,
                               bool *is_done, struct bd_err_detail *detail);

// One slice of a round that takes away what removed scenes left, and content that nothing needs,
// and gives free pages back to the file system. `is_done`: the round is over.
BD_MUST_CHECK
enum bd_err bd_journal_collect(struct bd_journal *journal, bool *is_done,
                               struct bd_err_detail *detail);

#endif
