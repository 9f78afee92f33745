#include "clients/cli/print.h"

#include <stdarg.h>
#include <stdlib.h>

#include "base/assert.h"
#include "base/text.h"

BD_PRINTF(2, 0)
static void print(FILE *out, const char *format, va_list args)
{
    char *text = NULL;
    int length = vasprintf(&text, format, args);
    BD_ASSERT(length >= 0);
    bd_text_make_plain(text);
    fputs(text, out);
    free(text);
}

void bd_cli_print(FILE *out, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print(out, format, args);
    va_end(args);
}

void bd_cli_print_line(FILE *out, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    print(out, format, args);
    va_end(args);
    putc('\n', out);
}

bool bd_cli_print_json_line(FILE *out, const json_t *json, size_t flags)
{
    char *text = bd_text_escape_json(json_dumps(json, flags));
    if (!text) return false;
    fputs(text, out);
    putc('\n', out);
    free(text);
    return true;
}
