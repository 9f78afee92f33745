#include "net/access/author.h"

#include <stdio.h>
#include <string.h>

#include "base/text.h"

static enum bd_err check_by(const char *by, struct bd_err_detail *detail)
{
    const size_t size = strlen(by);
    if (size == 0 || size > BD_AUTHOR_BY_BYTES)
        return bd_err_set(detail, size ? BD_ERR_LIMIT : BD_ERR_USAGE, "by",
                          "by has 1 to %d bytes, not %zu", BD_AUTHOR_BY_BYTES, size);
    if (by[0] == ' ' || by[size - 1] == ' ' || !bd_text_is_plain(by))
        return bd_err_set(detail, BD_ERR_USAGE, "by",
                          "by is one line of UTF-8 that neither begins nor ends with a space");
    return BD_ERR_OK;
}

// Users of one line of the token file are as many authors.
static void principal(const struct bd_grant *grant, const struct bd_client *client, char *out,
                      size_t out_bytes)
{
    const bool is_user = grant->is_shared && strncmp(client->key, "uid:", 4) == 0;
    if (is_user && strcmp(grant->name, "uid:*") == 0)
        snprintf(out, out_bytes, "%.40s", client->key);
    else
        snprintf(out, out_bytes, "%s%s%.40s", grant->name, is_user ? ":" : "",
                 is_user ? client->key : "");
}

enum bd_err bd_author_make(const struct bd_grant *grant, const struct bd_client *client,
                           const char *by, char out[BD_EDIT_AUTHOR_BYTES],
                           struct bd_err_detail *detail)
{
    char name[BD_GRANT_NAME_BYTES + 48];
    enum bd_err err = by ? check_by(by, detail) : BD_ERR_OK;
    principal(grant, client, name, sizeof name);
    snprintf(out, BD_EDIT_AUTHOR_BYTES, "%.90s%s%.64s", name, by ? " " : "", by ? by : "");
    return err;
}

enum bd_err bd_author_take(const char *author, char out[BD_EDIT_AUTHOR_BYTES],
                           struct bd_err_detail *detail)
{
    if (!author) author = "";
    if (strlen(author) >= BD_EDIT_AUTHOR_BYTES || !bd_text_is_plain(author))
        return bd_err_set(detail, BD_ERR_USAGE, "author",
                          "author is one line of UTF-8 of at most %d bytes",
                          BD_EDIT_AUTHOR_BYTES - 1);
    snprintf(out, BD_EDIT_AUTHOR_BYTES, "%s", author);
    return BD_ERR_OK;
}
