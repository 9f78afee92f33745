// The scenes that the daemon holds, by id, and what becomes of changes to them.
//
// A change is staged: checked and applied to the scene's head, which nobody sees. The caller writes
// what is staged to the journal (store_journal.h) and then publishes it, in order, or fails it:
// only what is on the disk is ever shown, acknowledged or announced. Transient changes lie over
// what is durable, are shown at once and are gone after a crash, until they are staged as one
// batch.
//
// Thread: one, the event loop's, for every call. Snapshots are for any thread, and so is a staged
// batch while it is being written: nobody changes it then.

#ifndef BD_SCENE_STORE_STORE_H
#define BD_SCENE_STORE_STORE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"
#include "scene/model/delta.h"
#include "scene/model/scene.h"

#define BD_SCENE_ID_BYTES      17 // sixteen hexadecimal digits and the final zero
#define BD_SCENE_NAME_BYTES    128
#define BD_SCENE_OWNER_BYTES   64
#define BD_EDIT_ID_BYTES       65 // client_edit_id
#define BD_EDIT_MESSAGE_BYTES  257
#define BD_EDIT_AUTHOR_BYTES   160 // who did it, in words of the caller's
#define BD_REVISION_NAME_BYTES 65

struct bd_store;

struct bd_store *bd_store_create(uint32_t scene_count_max);
void bd_store_destroy(struct bd_store **store);

// One scene as everybody sees it. Borrowed: until the next call that changes the store.
struct bd_store_entry {
    char id[BD_SCENE_ID_BYTES];
    char name[BD_SCENE_NAME_BYTES];
    char owner[BD_SCENE_OWNER_BYTES]; // whose quota it counts for
    uint64_t revision;                // durable
    uint64_t transient;               // batches that lie on it, 0 = none
    uint64_t transient_ns;            // for how long one author has laid nothing more on what is
                                      // to be committed still: since when (bd_clock_ns), 0 = none
    struct bd_scene *scene;           // with them
};

// BD_ERR_NOT_FOUND.
BD_MUST_CHECK
enum bd_err bd_store_get(const struct bd_store *store, const char *id,
                         const struct bd_store_entry **out, struct bd_err_detail *detail);

// In order of addition. The entry of `index`, NULL past the end.
uint32_t bd_store_count(const struct bd_store *store);
const struct bd_store_entry *bd_store_at(const struct bd_store *store, uint32_t index);

// What `owner` has, with what is still on its way to the disk. The bytes are those of
// bd_scene_bytes, without the scene `but_bytes_of` ("": of all).
struct bd_store_holdings {
    uint64_t scenes, bytes;
};
struct bd_store_holdings bd_store_holdings(const struct bd_store *store, const char *owner,
                                           const char *but_bytes_of);

// --- staging --------------------------------------------------------------------------------

enum bd_batch_kind {
    BD_BATCH_ADD,    // a scene
    BD_BATCH_REMOVE, // one
    BD_BATCH_EDIT,
    BD_BATCH_UNDO,   // of the revision `of`
    BD_BATCH_REDO,   // of the undo `of`
    BD_BATCH_REVERT, // to the revision `of`
    BD_BATCH_NAME,   // `of` is called `name`
    BD_BATCH_UNNAME,
};

// What the journal calls it: "import", "edit", ...; "" of those that make no revision.
const char *bd_batch_kind_name(enum bd_batch_kind kind);

// One change on its way to the disk.
struct bd_batch {
    enum bd_batch_kind kind;
    char scene_id[BD_SCENE_ID_BYTES];
    uint64_t revision; // that it makes; 0 of those that make none
    uint64_t of;
    uint64_t time_ms; // since 1970
    char client_edit_id[BD_EDIT_ID_BYTES];
    char message[BD_EDIT_MESSAGE_BYTES];
    char author[BD_EDIT_AUTHOR_BYTES];
    char name[BD_SCENE_NAME_BYTES];   // of the scene added, or of the revision
    char owner[BD_SCENE_OWNER_BYTES]; // of the scene added
    struct bd_delta forward, inverse;
    struct bd_scene *after; // the snapshot that it makes; NULL of those that make none
    bool was_transient;
    struct bd_err_detail detail; // why it could not be kept, once that is so
    // The caller's: what its client is told, kept with it; malloc'ed.
    void *answer;
    size_t answer_bytes;
    void *user;
    struct bd_batch *next;
};

// BD_ERR_LIMIT, naming `scenes`, when the store is full. The id is random: knowing one says nothing
// about others. The scene is listed once it is published. `out` is borrowed until then.
BD_MUST_CHECK
enum bd_err bd_store_stage_add(struct bd_store *store, struct bd_scene *scene, const char *name,
                               const char *owner, struct bd_batch **out,
                               struct bd_err_detail *detail);
// The same of a scene that was elsewhere before: it begins with `revision`, 1 or more.
BD_MUST_CHECK
enum bd_err bd_store_stage_add_at(struct bd_store *store, struct bd_scene *scene, const char *name,
                                  const char *owner, uint64_t revision, struct bd_batch **out,
                                  struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_store_stage_remove(struct bd_store *store, const char *id, struct bd_batch **out,
                                  struct bd_err_detail *detail);

// The snapshot that the next batch applies to: durable, with all that is staged. Borrowed.
BD_MUST_CHECK
enum bd_err bd_store_head(const struct bd_store *store, const char *id, const struct bd_scene **out,
                          uint64_t *revision, struct bd_err_detail *detail);

struct bd_store_change {
    const char *scene_id;
    enum bd_batch_kind kind; // EDIT, UNDO, REDO or REVERT
    uint64_t of;
    uint64_t base_revision;     // 0: whatever is current
    const char *client_edit_id; // NULL or "": none
    const char *message;        // NULL: none
    const char *author;         // NULL: nobody is known
    struct bd_delta *delta;     // against the head; taken over if it is staged
};

// BD_ERR_CONFLICT with a stale base, naming the revision that is current; BD_ERR_NOT_FOUND; what
// bd_delta_apply says.
BD_MUST_CHECK
enum bd_err bd_store_stage(struct bd_store *store, const struct bd_store_change *change,
                           struct bd_batch **out, struct bd_err_detail *detail);

// `name`: of a revision that the scene has had; 0: the current one, staged ones included.
BD_MUST_CHECK
enum bd_err bd_store_stage_name(struct bd_store *store, const char *id, const char *name,
                                uint64_t revision, bool remove, struct bd_batch **out,
                                struct bd_err_detail *detail);

// Whether anything of the scene is on its way to the disk.
bool bd_store_is_busy(const struct bd_store *store, const char *id);

// --- to the disk and back -------------------------------------------------------------------

// What was staged since the last call, oldest first, linked by `next`; NULL: nothing.
struct bd_batch *bd_store_take_staged(struct bd_store *store);
bool bd_store_has_staged(const struct bd_store *store);

// It is on the disk: it is what everybody sees. In the order in which they were staged. The batch
// is the caller's to free from then on.
void bd_store_publish(struct bd_store *store, struct bd_batch *batch);
// It is not, and will not be. All that was staged on the same scene after it, taken or not, has to
// be failed too before anything is staged there again. The batch is the caller's to free.
void bd_store_fail(struct bd_store *store, struct bd_batch *batch);
void bd_batch_free(struct bd_batch **batch);

// --- transient ------------------------------------------------------------------------------

// Lays it over what is shown, as what `author` (NULL: "") did. What it names was checked against
// `scene` of the entry. BD_ERR_LIMIT, naming transient_objects; BD_ERR_BUSY, naming `ops`, if it
// adds an object under an id that a batch on its way to the disk has; what bd_delta_apply says. The
// ids of what it adds are given to nothing else: batches that are checked against the head go
// around them. A durable batch that touches an object takes its transient state away; one that
// leaves the rest without meaning, or comes with ids of its own that it has, takes all.
BD_MUST_CHECK
enum bd_err bd_store_lay(struct bd_store *store, const char *id, const char *author,
                         const struct bd_delta *delta, const struct bd_store_entry **out,
                         struct bd_err_detail *detail);

// What `author` laid becomes one batch, of what that author changed alone, shown as transient until
// it is published; NULL: what has lain for longest, whoever laid it. `*out` NULL: there is nothing
// to commit. What lies there stays if it cannot be staged; BD_ERR_BUSY, naming `commit`, while
// something of the scene but other commits is on its way to the disk.
BD_MUST_CHECK
enum bd_err bd_store_stage_commit(struct bd_store *store, const char *id, const char *author,
                                  const char *client_edit_id, struct bd_batch **out,
                                  struct bd_err_detail *detail);

// --- history --------------------------------------------------------------------------------

// The revision whose inverse takes back the last change that is not taken back (`redo`: the last
// undo) of `author`; NULL: whoever made it. BD_ERR_BUSY while something of the scene is on its way
// to the disk, BD_ERR_CONFLICT, naming `undo` or `redo`, if there is nothing.
BD_MUST_CHECK
enum bd_err bd_store_undo_target(const struct bd_store *store, const char *id, const char *author,
                                 bool redo, uint64_t *out, struct bd_err_detail *detail);

// The revision that this client_edit_id made, 0 if none is known. BD_ERR_BUSY while it is on its
// way to the disk.
BD_MUST_CHECK
enum bd_err bd_store_find_edit(const struct bd_store *store, const char *id,
                               const char *client_edit_id, uint64_t *revision,
                               struct bd_err_detail *detail);

// One revision of the past, as the journal has it, for bd_store_restore.
struct bd_store_past {
    uint64_t revision, of;
    enum bd_batch_kind kind;
    char client_edit_id[BD_EDIT_ID_BYTES];
    char author[BD_EDIT_AUTHOR_BYTES];
};

// A scene out of the journal, published. Takes a reference. `past`: oldest first.
BD_MUST_CHECK
enum bd_err bd_store_restore(struct bd_store *store, const struct bd_store_entry *entry,
                             const struct bd_store_past *past, uint32_t past_count,
                             struct bd_err_detail *detail);

#endif
