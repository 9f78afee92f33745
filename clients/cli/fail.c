// How a command says that it failed: one line or an object of JSON, and its exit code.

#include <stdio.h>
#include <string.h>

#include "clients/cli/commands.h"
#include "clients/cli/print.h"

void bd_cmd_name_scene(const char *scene, struct bd_err_detail *detail)
{
    const char *slash = scene ? strrchr(scene, '/') : NULL;
    const char *name = slash ? slash + 1 : scene;
    if (detail->err != BD_ERR_BAD_INPUT && detail->err != BD_ERR_UNSUPPORTED) return;
    if (!name || strstr(detail->message, name)) return;
    const struct bd_err_detail inner = *detail;
    bool place = inner.field[0] && !strstr(inner.message, inner.field);
    bd_err_set(detail, inner.err, inner.field, "%.100s: %s%s%s", name, place ? inner.field : "",
               place ? ": " : "", inner.message);
}

json_t *bd_cmd_error_json(enum bd_err err, const struct bd_err_detail *detail)
{
    return json_pack("{s:s, s:s, s:{s:s}}", "code", bd_err_name(err), "message", detail->message,
                     "details", "field", detail->field);
}

int bd_cmd_fail(enum bd_err err, const struct bd_err_detail *detail, bool json)
{
    fprintf(stderr, "bounce: %s\n", detail->message[0] ? detail->message : bd_err_name(err));
    if (json) {
        json_t *object = bd_cmd_error_json(err, detail);
        if (!object || !bd_cli_print_json_line(stdout, object, JSON_INDENT(2))) putchar('\n');
        json_decref(object);
    }
    return bd_err_exit_code(err);
}
