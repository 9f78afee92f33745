// `bounce edit --help-ops`: what an edit can do, by the daemon's own tables.

#include <math.h>
#include <stdio.h>

#include "clients/cli/help.h"
#include "clients/cli/print.h"
#include "scene/edit/edit_kinds.h"

// --- for people ---------------------------------------------------------------------------------

static void print_standard(const struct bd_object_field *row)
{
    if (row->type == BD_FIELD_SWITCH) fputs(row->standard != 0 ? ", default true" : ", default false", stdout);
    if (row->type == BD_FIELD_WORD) printf(", default %s", row->words[(int)row->standard]);
    if (row->type == BD_FIELD_OBJECT || row->type == BD_FIELD_MAP) fputs(", default -1", stdout);
    if (row->type == BD_FIELD_NUMBERS &&
        bd_field_takes(row, bd_field_said(row, (float)row->standard)))
        printf(", default %g", isinf(row->standard) ? 0 : row->standard);
}

static void print_fields(enum bd_object_kind kind)
{
    const struct bd_object_field_list list = bd_object_fields(kind);
    char takes[BD_FIELD_TAKES_BYTES];
    for (uint32_t i = 0; i < list.count; i++) {
        const struct bd_object_field *row = &list.rows[i];
        printf("    %-26s  %s", row->name, bd_field_takes_text(row, takes));
        print_standard(row);
        printf("%s%s\n", row->type == BD_FIELD_HEAVY ? "" : ": ", row->help);
    }
}

static void print_kind(enum bd_object_kind kind)
{
    putchar('\n');
    for (int k = 0; k < BD_EDIT_KIND_COUNT; k++)
        if (bd_edit_kinds[k].object == kind)
            printf("  %s%s%s\n", bd_edit_kinds[k].name, bd_edit_kinds[k].help[0] ? ": " : "",
                   bd_edit_kinds[k].help);
    print_fields(kind);
}

static void print_text(void)
{
    fputs("Operations of an edit, each one of {\"ops\": [{\"add_light\": {\"intensity\": 5}}]}.\n"
          "\n"
          "A set_ names its object by the field that is called as its kind ({\"light\": 3}), a\n"
          "remove_ by \"id\"; -2 - k is what operation k of the batch adds. What a set_ does not\n"
          "give stays; what an add_ does not give has the default.\n",
          stdout);
    for (int kind = BD_OBJECT_KIND_COUNT; kind-- > 0;)
        if (bd_object_fields((enum bd_object_kind)kind).count)
            print_kind((enum bd_object_kind)kind);
}

// --- for programs -------------------------------------------------------------------------------

static json_t *field_json(const struct bd_object_field *row)
{
    static const char *const types[] = {
        [BD_FIELD_NAME] = "text",   [BD_FIELD_SWITCH] = "switch", [BD_FIELD_NUMBERS] = "numbers",
        [BD_FIELD_WORD] = "word",   [BD_FIELD_OBJECT] = "object", [BD_FIELD_MAP] = "object",
        [BD_FIELD_HEAVY] = "heavy",
    };
    char takes[BD_FIELD_TAKES_BYTES];
    json_t *out = json_pack("{s:s, s:s, s:s, s:s}", "name", row->name, "type", types[row->type],
                            "takes", bd_field_takes_text(row, takes), "help", row->help);
    if (out && row->type == BD_FIELD_NUMBERS)
        json_object_set_new(out, "count", json_integer(row->count));
    return out;
}

static json_t *kind_json(enum bd_object_kind kind)
{
    json_t *operations = json_array(), *fields = json_array();
    const struct bd_object_field_list list = bd_object_fields(kind);
    for (int k = 0; k < BD_EDIT_KIND_COUNT; k++)
        if (bd_edit_kinds[k].object == kind)
            json_array_append_new(operations, json_pack("{s:s, s:s}", "name", bd_edit_kinds[k].name,
                                                        "help", bd_edit_kinds[k].help));
    for (uint32_t i = 0; i < list.count; i++)
        json_array_append_new(fields, field_json(&list.rows[i]));
    return json_pack("{s:s, s:o, s:o}", "kind", bd_object_kind_name(kind), "operations", operations,
                     "fields", fields);
}

static bool print_json(void)
{
    json_t *kinds = json_array();
    for (int kind = 0; kind < BD_OBJECT_KIND_COUNT; kind++)
        if (bd_object_fields((enum bd_object_kind)kind).count)
            json_array_append_new(kinds, kind_json((enum bd_object_kind)kind));
    const bool ok = bd_cli_print_json_line(stdout, kinds, JSON_INDENT(1));
    json_decref(kinds);
    return ok;
}

int bd_help_ops(bool as_json)
{
    if (as_json) return print_json() ? 0 : bd_err_exit_code(BD_ERR_NO_MEMORY);
    print_text();
    return 0;
}
