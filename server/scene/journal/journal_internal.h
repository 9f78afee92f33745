// What the files of the journal share. Nobody else includes it, but its tests.

#ifndef BD_SCENE_JOURNAL_JOURNAL_INTERNAL_H
#define BD_SCENE_JOURNAL_JOURNAL_INTERNAL_H

#include <sqlite3.h>

#include "scene/journal/data_dir.h"
#include "scene/journal/journal.h"
#include "scene/journal/journal_digests.h"
#include "scene/journal/journal_identity.h"
#include "scene/journal/journal_sql.h"

enum bd_journal_round {
    BD_ROUND_IDLE,
    BD_ROUND_ORPHANS,        // what removed scenes left
    BD_ROUND_MARK_SNAPSHOTS, // what is needed
    BD_ROUND_MARK_EDITS,
    BD_ROUND_SWEEP,  // what is not
    BD_ROUND_VACUUM, // free pages back to the file system
};

struct bd_journal {
    sqlite3 *db;
    sqlite3_stmt *statements[BD_SQL_COUNT];
    char path[BD_JOURNAL_FILE_BYTES];
    char name[BD_JOURNAL_FILE_BYTES]; // in messages: the path, or that of the file it is a copy of
    struct bd_journal_state state;
    bool changes_more;           // in the transaction under way: what no count of rows tells
    int64_t changes_begun;       // the rows that were changed before it
    struct bd_identity identity; // without a file in one that is read or built
    struct bd_journal_place {    // of the file and of its log, while they are open
        bool is_known;
        uint64_t device, file, log;
    } place;
    bool is_copy;
    struct bd_data_dir copy_dir; // of a copy
    bool is_damaged;             // something was read that SQLite cannot have written
    struct bd_digests pinned;    // content that is on its way to a commit
    struct bd_digests damaged;   // content that was read and is not what its name says
    uint64_t damage_count;       // how often some was found
    struct bd_journal_copy {     // what bd_journal_get_edit lends
        char *bytes;
        size_t size;
    } lent;
    // A round of bd_journal_collect: where it is, and what it found to be needed.
    enum bd_journal_round round;
    int64_t round_at;
    struct bd_digests needed;
};

// --- journal.c

// BD_ERR_IO if the file is shorter than a page. SQLite takes such a file for an empty one, and
// would begin anew.
BD_MUST_CHECK
enum bd_err bd_journal_check_size(const struct bd_journal *journal, struct bd_err_detail *detail);
// Connects and looks for damage: `where` says where it lies, and nothing stays open then.
BD_MUST_CHECK
enum bd_err bd_journal_try_open(struct bd_journal *journal, char *where, size_t where_bytes,
                                struct bd_err_detail *detail);

// --- journal_sql.c: statements, transactions, errors

// Ready to be bound. Whatever its text says must be bound, run and read before the next use.
sqlite3_stmt *bd_journal_sql(struct bd_journal *journal, enum bd_journal_sql name);
void bd_bind_u64(sqlite3_stmt *statement, int index, uint64_t value);
// NULL is "". Borrowed until the statement is done.
void bd_bind_text(sqlite3_stmt *statement, int index, const char *text);
void bd_bind_bytes(sqlite3_stmt *statement, int index, const void *data, size_t size);
void bd_bind_digests(sqlite3_stmt *statement, int index, const struct bd_journal_digests *list);
// Never NULL, "" for NULL; borrowed until the statement is stepped or reset.
const char *bd_column_text(sqlite3_stmt *statement, int index);
struct bd_journal_bytes bd_column_bytes(sqlite3_stmt *statement, int index);
struct bd_journal_digests bd_column_digests(sqlite3_stmt *statement, int index);
bool bd_column_sha256(sqlite3_stmt *statement, int index, uint8_t sha256[BD_SHA256_BYTES]);

// Runs a statement that answers nothing, and makes it ready anew. SQLITE_OK or what went wrong.
int bd_journal_run(sqlite3_stmt *statement);
// Ends the use of a statement that answered: SQLITE_OK if `step` was SQLITE_ROW or SQLITE_DONE.
int bd_journal_done(sqlite3_stmt *statement, int step);
// One number; 0 if the answer is empty or NULL.
int bd_journal_number(sqlite3_stmt *statement, uint64_t *out);

// Fills the error from what SQLite last said; `what` begins the line: "the edits were not kept".
enum bd_err bd_journal_err(struct bd_journal *journal, int result, const char *what,
                           struct bd_err_detail *detail);
bool bd_journal_is_damage(int result);
// The mark beside a file in which damage was met while it was served: the next start mends it.
void bd_journal_suspect_path(const struct bd_journal *journal, char *out, size_t out_bytes);

int bd_journal_begin(struct bd_journal *journal);
// Commits if `result` is SQLITE_OK, otherwise, or if that fails, takes everything back.
int bd_journal_end(struct bd_journal *journal, int result);

// --- journal_schema.c

struct bd_journal_step {
    const char *sql; // from the version of its index to the next
};
// Brings the file from its version to `count`, all of it or nothing.
int bd_journal_migrate(sqlite3 *db, uint32_t version, const struct bd_journal_step *steps,
                       uint32_t count);
// A connection with our settings; the file's version checked, and brought up to date.
BD_MUST_CHECK
enum bd_err bd_journal_connect(struct bd_journal *journal, struct bd_err_detail *detail);
void bd_journal_disconnect(struct bd_journal *journal);

// --- journal_check.c: a sum over a record's fields, so that a bit that flipped is found

uint64_t bd_check_scene(const struct bd_journal_scene *scene);
uint64_t bd_check_name(int64_t scene, const char *name, uint64_t revision);
uint64_t bd_check_snapshot(int64_t scene, const struct bd_journal_snapshot *snapshot);
uint64_t bd_check_edit_payload(const struct bd_journal_edit *edit);
uint64_t bd_check_edit(int64_t scene, const struct bd_journal_edit *edit, uint64_t payload_check);

uint64_t bd_check_state(const struct bd_journal_state *state);

// --- journal_row.c: rows to structs; false: not what was written

bool bd_row_scene(sqlite3_stmt *row, struct bd_journal_scene *out);
bool bd_row_snapshot(sqlite3_stmt *row, int64_t scene, struct bd_journal_snapshot *out);
// Without answer, deltas and content.
bool bd_row_edit_head(sqlite3_stmt *row, int64_t scene, struct bd_journal_edit *out);
bool bd_row_edit(sqlite3_stmt *row, int64_t scene, struct bd_journal_edit *out);
// The row and its newest revision. BD_ERR_NOT_FOUND, field `scene`.
BD_MUST_CHECK
enum bd_err bd_journal_find_scene(struct bd_journal *journal, const char *scene, int64_t *row,
                                  uint64_t *revision, struct bd_err_detail *detail);

// --- journal_read.c

// The revision of the newest snapshot at or before another; 0 if there is none.
int bd_journal_snapshot_before(struct bd_journal *journal, int64_t row, uint64_t revision,
                               uint64_t *out);
BD_MUST_CHECK
enum bd_err bd_journal_can_reach(struct bd_journal *journal, int64_t row, uint64_t revision,
                                 bool *out, struct bd_err_detail *detail);

// --- journal_commit.c

// Takes away what lies beyond `revision`, inside a transaction.
int bd_journal_cut_rows(struct bd_journal *journal, int64_t row, const char *scene,
                        uint64_t revision);

// --- journal_compact.c

// Forgets by one of the statements FORGET_EDITS and FORGET_SNAPSHOTS what lies in ]after, to], and
// takes what it forgot off `room`.
int bd_journal_forget(struct bd_journal *journal, enum bd_journal_sql which, int64_t row,
                      uint64_t after, uint64_t to, uint32_t *room);

// --- journal_put.c

// The row of content that is whole; 0 if there is none.
int bd_journal_find_content(struct bd_journal *journal, const uint8_t sha256[BD_SHA256_BYTES],
                            uint64_t *row);
// `out`: all of it is whole, as far as is known.
int bd_journal_has_contents(struct bd_journal *journal, const struct bd_journal_digests *list,
                            bool *out);

// --- journal_write.c: rows from structs, inside a transaction

int bd_write_snapshot(struct bd_journal *journal, int64_t scene,
                      const struct bd_journal_snapshot *snapshot);
int bd_write_edit(struct bd_journal *journal, int64_t scene, const struct bd_journal_edit *edit);
// Adds what a new record needs to a round's marks.
void bd_journal_mark(struct bd_journal *journal, const struct bd_journal_digests *list);

// --- journal_state.c: what a database is and how far, and whether that is what it should be

// Reads `journal->state`. SQLITE_CORRUPT if it is not what was written.
int bd_journal_read_state(struct bd_journal *journal);
// Writes it, one further, inside a transaction.
int bd_journal_write_state(struct bd_journal *journal);
// Whether the directory holds what its identity says, before anything in it is opened to be
// written; `takes_all`: whatever it is, with a warning. Names what has no name yet.
BD_MUST_CHECK
enum bd_err bd_journal_check_state(struct bd_journal *journal, bool takes_all,
                                   struct bd_err_detail *detail);
// The database that was opened bears the identity's name from now on.
BD_MUST_CHECK
enum bd_err bd_journal_take_state(struct bd_journal *journal, struct bd_err_detail *detail);
// Before it is closed: the log goes into the database, if that can be, and may go.
void bd_journal_settle(struct bd_journal *journal);

// --- journal_damage.c, journal_salvage.c

// SQLITE_CORRUPT if anything that a start needs is not whole; `where` says what.
int bd_journal_find_damage(struct bd_journal *journal, char *where, size_t where_bytes);
// Builds the file anew from what is whole in it, for `identity`, and keeps the old one beside.
BD_MUST_CHECK
enum bd_err bd_journal_salvage(const char *path, const char *where, struct bd_identity *identity,
                               struct bd_err_detail *detail);
// Says in the log if the write-ahead log has an end that was cut off.
void bd_journal_warn_of_tail(struct bd_journal *journal);

#endif
