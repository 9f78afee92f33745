// A journal to be read and never written to: its file and its write-ahead log, copied to where
// SQLite may mend, migrate and check as it does at a start.

#include <errno.h>
#include <fcntl.h>
#include <linux/fs.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/assert.h"
#include "base/log.h"
#include "scene/journal/journal_internal.h"

#define PIECE_BYTES (1u << 20)

struct source {
    char file[BD_JOURNAL_FILE_BYTES];
    char directory[BD_JOURNAL_FILE_BYTES];
    int lock; // of the directory; -1: it has none
};

static enum bd_err io_err(const char *path, struct bd_err_detail *detail)
{
    return bd_err_set(detail, errno == ENOENT ? BD_ERR_NOT_FOUND : BD_ERR_IO, "journal",
                      "%.400s: %s", path, strerror(errno));
}

static enum bd_err find(const char *path, struct source *out, struct bd_err_detail *detail)
{
    struct stat info;
    *out = (struct source){.lock = -1};
    if (stat(path, &info)) return io_err(path, detail);
    const char *slash = strrchr(path, '/');
    bool is_directory = S_ISDIR(info.st_mode);
    int file = snprintf(out->file, sizeof out->file, "%s%s", path,
                        is_directory ? "/" BD_JOURNAL_FILE : "");
    int directory = is_directory
                        ? snprintf(out->directory, sizeof out->directory, "%s", path)
                        : snprintf(out->directory, sizeof out->directory, "%.*s",
                                   slash ? (int)(slash - path + 1) : 1, slash ? path : ".");
    if ((size_t)file < sizeof out->file && (size_t)directory < sizeof out->directory)
        return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_USAGE, "journal", "the journal's path is too long");
}

// Shared: a daemon that wants the directory is kept out until it is copied.
static enum bd_err hold(struct source *source, struct bd_err_detail *detail)
{
    char path[BD_JOURNAL_FILE_BYTES + 32];
    snprintf(path, sizeof path, "%s/lock", source->directory);
    source->lock = open(path, O_RDONLY | O_CLOEXEC);
    if (source->lock < 0 || flock(source->lock, LOCK_SH | LOCK_NB) == 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_CONFLICT, "journal",
                      "a daemon holds %.400s: end it first, or its journal changes while it is "
                      "read",
                      source->directory);
}

static bool copy_bytes(int from, int to)
{
    if (ioctl(to, FICLONE, from) == 0) return true; // the file system shares the blocks
    char *piece = malloc(PIECE_BYTES);
    BD_ASSERT(piece);
    ssize_t got = 0;
    bool ok = true;
    while (ok && (got = read(from, piece, PIECE_BYTES)) > 0)
        for (ssize_t at = 0, wrote = 0; ok && at < got; at += wrote) {
            wrote = write(to, piece + at, (size_t)(got - at));
            ok = wrote > 0;
        }
    int reason = errno;
    free(piece);
    errno = reason;
    return ok && got == 0;
}

static enum bd_err copy_file(const char *from_path, const char *to_path,
                             struct bd_err_detail *detail)
{
    int from = open(from_path, O_RDONLY | O_CLOEXEC);
    if (from < 0) return io_err(from_path, detail);
    int to = open(to_path, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
    enum bd_err err = to < 0 ? io_err(to_path, detail) : BD_ERR_OK;
    if (!err && !copy_bytes(from, to))
        err = bd_err_set(detail, errno == ENOSPC ? BD_ERR_NO_MEMORY : BD_ERR_IO, "journal",
                         "%.200s cannot be copied to %.200s: %s", from_path, to_path,
                         strerror(errno));
    if (to >= 0) close(to);
    close(from);
    return err;
}

static enum bd_err copy_both(const struct source *source, const struct bd_journal *journal,
                             struct bd_err_detail *detail)
{
    char from[BD_JOURNAL_FILE_BYTES + 32], to[BD_JOURNAL_FILE_BYTES + 32];
    struct stat info;
    snprintf(from, sizeof from, "%s-wal", source->file);
    snprintf(to, sizeof to, "%s-wal", journal->path);
    bool has_log = access(from, F_OK) == 0;
    if (stat(source->file, &info)) return io_err(source->file, detail);
    if (!S_ISREG(info.st_mode) || (info.st_size == 0 && !has_log))
        return bd_err_set(detail, BD_ERR_IO, "journal", "%.400s is no journal of bounced",
                          source->file);
    enum bd_err err = copy_file(source->file, journal->path, detail);
    return err || !has_log ? err : copy_file(from, to, detail);
}

// What is there can be read all the same; whoever reads it should know.
static void warn_if_short(const struct source *source, const struct bd_journal *journal)
{
    struct bd_identity *identity = calloc(1, sizeof *identity);
    char path[BD_JOURNAL_FILE_BYTES + 32];
    BD_ASSERT(identity);
    snprintf(path, sizeof path, "%s/" BD_IDENTITY_FILE, source->directory);
    if (!bd_identity_open(identity, path) && !identity->is_blank &&
        memcmp(identity->state.identity, journal->state.identity, BD_IDENTITY_BYTES) == 0 &&
        journal->state.sequence < identity->state.sequence)
        bd_log(BD_LOG_WARN, "journal",
               "%s ends at write %llu of %llu that were kept: it or its log is missing or an older "
               "copy",
               journal->name, (unsigned long long)journal->state.sequence,
               (unsigned long long)identity->state.sequence);
    bd_identity_close(identity);
    free(identity);
}

static enum bd_err open_copy(struct bd_journal *journal, struct source *source,
                             struct bd_err_detail *detail)
{
    char where[128];
    enum bd_err err = hold(source, detail);
    if (!err) err = bd_data_dir_open_temporary(&journal->copy_dir, detail);
    journal->is_copy = !err;
    if (err) return err;
    memcpy(journal->name, source->file, sizeof journal->name);
    snprintf(journal->path, sizeof journal->path, "%s/" BD_JOURNAL_FILE, journal->copy_dir.path);
    err = copy_both(source, journal, detail);
    if (!err) err = bd_journal_check_size(journal, detail);
    if (!err) err = bd_journal_try_open(journal, where, sizeof where, detail);
    if (!err) warn_if_short(source, journal);
    return err;
}

enum bd_err bd_journal_open_copy(const char *path, struct bd_journal **out,
                                 struct bd_err_detail *detail)
{
    struct source source;
    *out = NULL;
    enum bd_err err = find(path, &source, detail);
    if (err) return err;
    struct bd_journal *journal = calloc(1, sizeof *journal);
    BD_ASSERT(journal);
    err = open_copy(journal, &source, detail);
    if (source.lock >= 0) close(source.lock);
    if (err) bd_journal_close(&journal);
    *out = journal;
    return err;
}
