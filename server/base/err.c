#include "base/err.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "base/text.h"

static const struct {
    const char *name;
    int exit_code;
    int http_status;
} errs[BD_ERR_COUNT] = {
#define X(name, wire, exit_code, http) {wire, exit_code, http},
    BD_ERR_MAP(X)
#undef X
};

const char *bd_err_name(enum bd_err err)
{
    return (unsigned)err < BD_ERR_COUNT ? errs[err].name : errs[BD_ERR_INTERNAL].name;
}

enum bd_err bd_err_from_name(const char *name)
{
    for (int i = 0; i < BD_ERR_COUNT; i++)
        if (strcmp(errs[i].name, name) == 0) return (enum bd_err)i;
    return BD_ERR_INTERNAL;
}

int bd_err_exit_code(enum bd_err err)
{
    return (unsigned)err < BD_ERR_COUNT ? errs[err].exit_code : errs[BD_ERR_INTERNAL].exit_code;
}

int bd_err_http_status(enum bd_err err)
{
    return (unsigned)err < BD_ERR_COUNT ? errs[err].http_status : errs[BD_ERR_INTERNAL].http_status;
}

enum bd_err bd_err_set(struct bd_err_detail *detail, enum bd_err err, const char *field,
                       const char *format, ...)
{
    if (!detail) return err;
    detail->err = err;
    snprintf(detail->field, sizeof detail->field, "%s", field ? field : "");
    va_list args;
    va_start(args, format);
    vsnprintf(detail->message, sizeof detail->message, format, args);
    va_end(args);
    bd_text_make_plain(detail->field);
    bd_text_make_plain(detail->message);
    return err;
}
