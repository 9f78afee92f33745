#include "scene/journal/journal.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/assert.h"
#include "scene/journal/journal_internal.h"

enum bd_err bd_journal_try_open(struct bd_journal *journal, char *where, size_t where_bytes,
                                struct bd_err_detail *detail)
{
    snprintf(where, where_bytes, "its structure");
    journal->is_damaged = false;
    enum bd_err err = bd_journal_connect(journal, detail);
    if (!err) {
        bd_journal_warn_of_tail(journal);
        int result = bd_journal_find_damage(journal, where, where_bytes);
        if (result) err = bd_journal_err(journal, result, where, detail);
    }
    if (err) bd_journal_disconnect(journal);
    return err;
}

enum bd_err bd_journal_check_size(const struct bd_journal *journal, struct bd_err_detail *detail)
{
    struct stat info;
    char rollback[BD_JOURNAL_FILE_BYTES + 32];
    snprintf(rollback, sizeof rollback, "%s-journal", journal->path);
    if (stat(journal->path, &info)) return BD_ERR_OK;
    if (!S_ISREG(info.st_mode))
        return bd_err_set(detail, BD_ERR_IO, "data", "%s is no file: move it away", journal->name);
    // With a rollback journal beside it, it was being made when the power went.
    if (info.st_size >= BD_JOURNAL_PAGE_BYTES || access(rollback, F_OK) == 0) return BD_ERR_OK;
    char log[BD_JOURNAL_FILE_BYTES + 32];
    snprintf(log, sizeof log, "%s-wal", journal->path);
    if (info.st_size == 0 && access(log, F_OK) != 0) return BD_ERR_OK;
    return bd_err_set(detail, BD_ERR_IO, "data",
                      "%s is cut short to %lld bytes, and nothing in it can be read: mend it, or "
                      "move it away to begin without scenes",
                      journal->name, (long long)info.st_size);
}

static enum bd_err open_or_mend(struct bd_journal *journal, struct bd_err_detail *detail)
{
    char where[128] = "as it was met before", suspect[BD_JOURNAL_FILE_BYTES + 32];
    bd_journal_suspect_path(journal, suspect, sizeof suspect);
    enum bd_err err = BD_ERR_OK;
    // What is not there any more needs no mending: somebody moved it away.
    struct stat info;
    if (stat(journal->path, &info) || info.st_size == 0) unlink(suspect);
    bool is_suspect = access(suspect, F_OK) == 0;
    if (!is_suspect) err = bd_journal_try_open(journal, where, sizeof where, detail);
    if (!is_suspect && !journal->is_damaged) return err;
    // It is the same one, and what is lost was said: no write of the old one is missed.
    err = bd_journal_salvage(journal->path, where, &journal->identity, detail);
    if (err) return err;
    unlink(suspect);
    return bd_journal_try_open(journal, where, sizeof where, detail);
}

static enum bd_err open_identity(struct bd_journal *journal, const char *directory,
                                 struct bd_err_detail *detail)
{
    char path[BD_JOURNAL_FILE_BYTES];
    snprintf(path, sizeof path, "%.4000s/" BD_IDENTITY_FILE, directory);
    int result = bd_identity_open(&journal->identity, path);
    return result
               ? bd_journal_err(journal, result, "the directory's identity cannot be read", detail)
               : BD_ERR_OK;
}

static enum bd_err open_directory(const char *directory, bool takes_all, struct bd_journal **out,
                                  struct bd_err_detail *detail)
{
    struct bd_journal *journal = calloc(1, sizeof *journal);
    BD_ASSERT(journal);
    int length = snprintf(journal->path, sizeof journal->path, "%s/" BD_JOURNAL_FILE, directory);
    enum bd_err err = BD_ERR_OK;
    if (length < 0 || (size_t)length >= sizeof journal->path)
        err = bd_err_set(detail, BD_ERR_USAGE, "data", "the data directory's path is too long");
    memcpy(journal->name, journal->path, sizeof journal->name);
    if (!err) err = open_identity(journal, directory, detail);
    if (!err) err = bd_journal_check_size(journal, detail);
    if (!err) err = bd_journal_check_state(journal, takes_all, detail);
    if (!err) err = open_or_mend(journal, detail);
    if (!err) err = bd_journal_take_state(journal, detail);
    if (err) bd_journal_close(&journal);
    *out = journal;
    return err;
}

enum bd_err bd_journal_open(const char *directory, struct bd_journal **out,
                            struct bd_err_detail *detail)
{
    return open_directory(directory, false, out, detail);
}

enum bd_err bd_journal_open_as_it_is(const char *directory, struct bd_journal **out,
                                     struct bd_err_detail *detail)
{
    return open_directory(directory, true, out, detail);
}

void bd_journal_close(struct bd_journal **journal)
{
    if (!*journal) return;
    bd_journal_settle(*journal);
    bd_journal_disconnect(*journal);
    bd_identity_close(&(*journal)->identity);
    bd_digests_clear(&(*journal)->pinned);
    bd_digests_clear(&(*journal)->damaged);
    bd_digests_clear(&(*journal)->needed);
    free((*journal)->lent.bytes);
    if ((*journal)->is_copy) bd_data_dir_close(&(*journal)->copy_dir);
    free(*journal);
    *journal = NULL;
}
