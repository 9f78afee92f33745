#include <jansson.h>
#include <stdio.h>

#include "clients/cli/commands.h"

int bd_cmd_fail(enum bd_err err, const struct bd_fault *fault, bool json)
{
    fprintf(stderr, "bounce: %s\n", fault->message[0] ? fault->message : bd_err_name(err));
    if (json) {
        // The shape that the daemon's HTTP face gives errors.
        json_t *object = json_pack("{s:s, s:s, s:{s:s}}", "code", bd_err_name(err), "message",
                                   fault->message, "details", "field", fault->field);
        if (object) json_dumpf(object, stdout, JSON_INDENT(2));
        putchar('\n');
        json_decref(object);
    }
    return bd_err_exit_code(err);
}
