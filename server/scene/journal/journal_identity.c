#include "scene/journal/journal_identity.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "base/log.h"

// A slot is a sector, which a disk writes whole or not at all, and a page of text for people.
#define SLOT_BYTES 512
#define SLOT_COUNT 2
#define HEADING    "bounced data directory 1"
#define SUM_AT     "\nsum "

#define LOG_SALT_AT 16 // of a write-ahead log: another one each time that it begins anew

bool bd_state_is_named(const struct bd_journal_state *state)
{
    static const uint8_t none[BD_IDENTITY_BYTES];
    return memcmp(state->identity, none, sizeof none) != 0;
}

void bd_state_name_anew(struct bd_journal_state *state)
{
    sqlite3_randomness(BD_IDENTITY_BYTES, state->identity);
    state->identity[0] |= 1; // zeros are no name
}

static void identity_hex(const uint8_t identity[BD_IDENTITY_BYTES],
                         char out[2 * BD_IDENTITY_BYTES + 1])
{
    for (int i = 0; i < BD_IDENTITY_BYTES; i++) snprintf(out + 2 * i, 3, "%02x", identity[i]);
}

static bool read_hex(const char *hex, uint8_t identity[BD_IDENTITY_BYTES])
{
    for (int i = 0; i < BD_IDENTITY_BYTES; i++)
        if (sscanf(hex + 2 * i, "%2hhx", &identity[i]) != 1) return false;
    return true;
}

static void write_slot(const struct bd_identity *identity, char slot[SLOT_BYTES])
{
    char hex[2 * BD_IDENTITY_BYTES + 1];
    identity_hex(identity->state.identity, hex);
    memset(slot, '\n', SLOT_BYTES);
    int length = snprintf(slot, SLOT_BYTES,
                          HEADING "\nturn %" PRIu64 "\nidentity %s\nsequence %" PRIu64
                                  "\nbase %" PRIu64 "\nlog %d %016" PRIx64,
                          identity->turn, hex, identity->state.sequence, identity->base,
                          identity->needs_log, identity->log_salt);
    uint64_t sum = bd_hash64(slot, (size_t)length, 0);
    length += snprintf(slot + length, SLOT_BYTES - (size_t)length, SUM_AT "%016" PRIx64, sum);
    slot[length] = '\n';
}

// False if it is not what was written.
static bool read_slot(const char bytes[SLOT_BYTES], struct bd_identity *out)
{
    char slot[SLOT_BYTES + 1], hex[2 * BD_IDENTITY_BYTES + 1];
    memcpy(slot, bytes, SLOT_BYTES);
    slot[SLOT_BYTES] = 0;
    const char *end = strstr(slot, SUM_AT);
    uint64_t sum;
    int needs_log;
    if (!end || sscanf(end + strlen(SUM_AT), "%16" SCNx64, &sum) != 1 ||
        sum != bd_hash64(slot, (size_t)(end - slot), 0))
        return false;
    int count =
        sscanf(slot,
               HEADING "\nturn %" SCNu64 "\nidentity %32[0-9a-f]\nsequence %" SCNu64
                       "\nbase %" SCNu64 "\nlog %d %16" SCNx64,
               &out->turn, hex, &out->state.sequence, &out->base, &needs_log, &out->log_salt);
    out->needs_log = needs_log != 0;
    return count == 6 && strlen(hex) == sizeof hex - 1 && read_hex(hex, out->state.identity);
}

static sqlite3_vfs *vfs(void)
{
    sqlite3_vfs *found = sqlite3_vfs_find(NULL);
    BD_ASSERT(found);
    return found;
}

// Its first sync syncs the directory, too, as that of every file whose name matters.
static int open_file(const char *path, int flags, sqlite3_file **out)
{
    *out = calloc(1, (size_t)vfs()->szOsFile);
    BD_ASSERT(*out);
    int result = vfs()->xOpen(vfs(), path, *out, SQLITE_OPEN_SUPER_JOURNAL | flags, NULL);
    if (result) {
        free(*out);
        *out = NULL;
    }
    return result;
}

static void close_file(sqlite3_file **file)
{
    (*file)->pMethods->xClose(*file);
    free(*file);
    *file = NULL;
}

// The second slot is written when the first one is on the disk: where both are there, one of them was
// good, wherever the power went.
static int look_for_damage(struct bd_identity *identity)
{
    sqlite3_int64 size = 0;
    int result = identity->file->pMethods->xFileSize(identity->file, &size);
    identity->is_damaged = identity->is_blank && size >= (sqlite3_int64)SLOT_COUNT * SLOT_BYTES;
    return result;
}

// The one of the two that was written last.
static int read_file(struct bd_identity *identity)
{
    for (int i = 0; i < SLOT_COUNT; i++) {
        char slot[SLOT_BYTES];
        struct bd_identity read = *identity;
        int result = identity->file->pMethods->xRead(identity->file, slot, SLOT_BYTES,
                                                     (sqlite3_int64)i * SLOT_BYTES);
        if (result && result != SQLITE_IOERR_SHORT_READ) return result;
        if (!read_slot(slot, &read)) continue;
        if (!identity->is_blank && read.turn < identity->turn) continue;
        *identity = read;
        identity->is_blank = false;
    }
    identity->turn++;
    return look_for_damage(identity);
}

int bd_identity_open(struct bd_identity *identity, const char *path)
{
    *identity = (struct bd_identity){.is_blank = true};
    int length = snprintf(identity->path, sizeof identity->path, "%s", path);
    if (length < 0 || (size_t)length >= sizeof identity->path) return SQLITE_CANTOPEN;
    int is_there = 0;
    int result = vfs()->xAccess(vfs(), identity->path, SQLITE_ACCESS_EXISTS, &is_there);
    if (result || !is_there) return result;
    result = open_file(identity->path, SQLITE_OPEN_READWRITE, &identity->file);
    return result ? result : read_file(identity);
}

static int write_next(struct bd_identity *identity, bool syncs)
{
    char slot[SLOT_BYTES];
    write_slot(identity, slot);
    const sqlite3_io_methods *methods = identity->file->pMethods;
    int result = methods->xWrite(identity->file, slot, SLOT_BYTES,
                                 (sqlite3_int64)(identity->turn % SLOT_COUNT) * SLOT_BYTES);
    if (!result) identity->turn++;
    return !result && syncs ? methods->xSync(identity->file, SQLITE_SYNC_NORMAL) : result;
}

// Both slots, one after the other: what the other one says is no longer so.
int bd_identity_set(struct bd_identity *identity, const struct bd_journal_state *state)
{
    int result = identity->file
                     ? SQLITE_OK
                     : open_file(identity->path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE,
                                 &identity->file);
    identity->state = *state;
    identity->base = 0;
    identity->needs_log = false;
    for (int i = 0; i < SLOT_COUNT && !result; i++) result = write_next(identity, true);
    identity->is_blank = result != SQLITE_OK;
    identity->is_damaged = false;
    return result;
}

// 0 of an empty one. False if the disk does not say.
static bool read_salt(sqlite3_file *log, uint64_t *out)
{
    int result = log && log->pMethods ? log->pMethods->xRead(log, out, sizeof *out, LOG_SALT_AT)
                                      : SQLITE_IOERR_READ;
    if (result == SQLITE_IOERR_SHORT_READ) *out = 0;
    return !result || result == SQLITE_IOERR_SHORT_READ;
}

// Whether the log is another one than it was when this was asked last. False, too, if nobody knows:
// `knows_log` is false until that is so no more.
static bool log_began(struct bd_identity *identity, sqlite3 *db)
{
    sqlite3_file *log = NULL;
    uint64_t salt = 0;
    bool knew = identity->knows_log;
    sqlite3_file_control(db, "main", SQLITE_FCNTL_JOURNAL_POINTER, &log);
    identity->knows_log = read_salt(log, &salt);
    if (!identity->knows_log) return false;
    bool is_other = salt != identity->log_salt;
    identity->log_salt = salt;
    return knew && is_other;
}

bool bd_identity_is_log(const struct bd_identity *identity, const char *path)
{
    sqlite3_file *log;
    uint64_t salt;
    if (open_file(path, SQLITE_OPEN_READONLY, &log)) return true; // nobody knows
    bool is_it = !read_salt(log, &salt) || salt == identity->log_salt;
    close_file(&log);
    return is_it;
}

void bd_identity_meet_log(struct bd_identity *identity, sqlite3 *db)
{
    identity->knows_log = false;
    log_began(identity, db);
}

void bd_identity_note(struct bd_identity *identity, sqlite3 *db, uint64_t sequence)
{
    if (!identity->file) return;
    // All that was in the log before is in the database then, and on the disk.
    bool syncs = log_began(identity, db);
    if (syncs && sequence > 0) identity->base = sequence - 1;
    syncs |= !identity->needs_log || identity->is_failing;
    identity->state.sequence = sequence;
    identity->needs_log = true;
    int result = write_next(identity, syncs);
    if (result && !identity->is_failing)
        bd_log(BD_LOG_WARN, "journal", "%s cannot be kept up to date: %s", identity->path,
               sqlite3_errstr(result));
    identity->is_failing = result != SQLITE_OK;
}

int bd_identity_settle(struct bd_identity *identity, uint64_t base)
{
    if (!identity->file) return SQLITE_OK;
    identity->base = base;
    identity->needs_log = false;
    return write_next(identity, true);
}

void bd_identity_close(struct bd_identity *identity)
{
    if (!identity->file) return;
    // Nothing hangs on it: what is not synced says less, never more, than there is.
    identity->file->pMethods->xSync(identity->file, SQLITE_SYNC_NORMAL);
    close_file(&identity->file);
}
