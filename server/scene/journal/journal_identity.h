// The data directory's identity: what the directory says should be there, outside the database. A
// small file beside it, `identity`, with the name that the database bears, too, and the sequence
// number of the last write that was on the disk. A database that is missing, is another one's or
// does not reach that number is not what was acknowledged, and is not taken for it.
//
// The number is a lower bound, wherever the power goes: it is written after the write that it
// names, into one of two slots, a sector each, and it is synced when the write-ahead log begins
// anew, so that a log that is lost is missed. Everything goes through SQLite's file layer, as the
// database does.
//
// Thread: the journal's.

#ifndef BD_SCENE_JOURNAL_JOURNAL_IDENTITY_H
#define BD_SCENE_JOURNAL_JOURNAL_IDENTITY_H

#include <sqlite3.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/err.h"

#define BD_IDENTITY_FILE  "identity"
#define BD_IDENTITY_BYTES 16

// What a database is, and how far. In its own table `state`, and in the file.
struct bd_journal_state {
    uint8_t identity[BD_IDENTITY_BYTES]; // zeros: it has none yet
    uint64_t sequence;                   // writes since it was made; 0: none
};

struct bd_identity {
    sqlite3_file *file; // NULL: there is none
    char path[4160];    // SQLite borrows it
    bool is_blank;      // nothing in it can be read: it was never there, or it is damaged
    bool is_damaged;    // it was written whole once, and nothing in it can be read
    bool is_failing;    // which was said
    struct bd_journal_state state;
    uint64_t base;  // what the database had without its log, when that began last
    bool needs_log; // something may be in the log and nowhere else
    uint64_t turn;  // which of its own writes is next, and so which slot
    // Of the log that was written last, so that the next one's beginning is seen, and another
    // one's. `knows_log`: it is that of the log as it is.
    uint64_t log_salt;
    bool knows_log;
};

bool bd_state_is_named(const struct bd_journal_state *state);
void bd_state_name_anew(struct bd_journal_state *state);

// Reads what is there. SQLITE_OK with `is_blank` where that is nothing.
int bd_identity_open(struct bd_identity *identity, const char *path);
// Writes `state`, with nothing known of a log, and syncs; makes the file if need be.
int bd_identity_set(struct bd_identity *identity, const struct bd_journal_state *state);
// Whether the log at `path` is the one that was in use. One that is not may be just as good.
bool bd_identity_is_log(const struct bd_identity *identity, const char *path);
// The log that the database has when it is opened is not one that begins.
void bd_identity_meet_log(struct bd_identity *identity, sqlite3 *db);
// A write of the database is on the disk. What cannot be noted is said once, and changes nothing.
void bd_identity_note(struct bd_identity *identity, sqlite3 *db, uint64_t sequence);
// The database has `base` writes by itself, all of them on the disk: the log may go. On the disk,
// too, when this returns SQLITE_OK; otherwise the log must stay.
int bd_identity_settle(struct bd_identity *identity, uint64_t base);
// Syncs what was noted.
void bd_identity_close(struct bd_identity *identity);

#endif
