#include "technique/params.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum param_type { PARAM_COUNT, PARAM_REAL, PARAM_CHOICE };

struct param_row {
    const char *key;
    enum param_type type;
    size_t offset; // in struct bd_params
    double minimum, maximum, standard;
    const char *choices[4];
};

#define FIELD(name) offsetof(struct bd_params, name)

static const struct param_row table[BD_PARAM_COUNT] = {
    [BD_PARAM_BRDF] = {"brdf", PARAM_CHOICE, FIELD(lambert), 0, 0, 0, {"full", "lambert"}},
    [BD_PARAM_SHADOW_SIZE] = {"shadow_size", PARAM_COUNT, FIELD(shadow_size), 16, 8192, 1024, {0}},
    [BD_PARAM_VPLS] = {"vpls", PARAM_COUNT, FIELD(vpls), 1, 1u << 24, 1024, {0}},
    [BD_PARAM_VPL_BUDGET] = {"vpl_budget", PARAM_COUNT, FIELD(vpl_budget), 0, 1u << 24, 0, {0}},
    [BD_PARAM_RSM_SIZE] = {"rsm_size", PARAM_COUNT, FIELD(rsm_size), 8, 4096, 256, {0}},
    [BD_PARAM_VPL_KERNEL] = {"vpl_kernel", PARAM_CHOICE, FIELD(vpl_kernel), 0, 0, 0,
                             {"patch", "disk", "point"}},
    [BD_PARAM_NEAR_FIELD] = {"near_field", PARAM_REAL, FIELD(near_field), 0, 1000, 5, {0}},
    [BD_PARAM_PAPER_MODE] = {"paper_mode", PARAM_COUNT, FIELD(paper_mode), 0, 1, 0, {0}},
};

static uint32_t *count_at(struct bd_params *params, size_t offset)
{
    return (uint32_t *)((char *)params + offset);
}

static double *real_at(struct bd_params *params, size_t offset)
{
    return (double *)((char *)params + offset);
}

static void set_defaults(struct bd_params *params)
{
    memset(params, 0, sizeof *params);
    for (int i = 0; i < BD_PARAM_COUNT; i++) {
        const struct param_row *row = &table[i];
        if (row->type == PARAM_REAL)
            *real_at(params, row->offset) = row->standard;
        else
            *count_at(params, row->offset) = (uint32_t)row->standard;
    }
}

static enum bd_err read_choice(const struct param_row *row, const char *value,
                               struct bd_params *out, struct bd_fault *fault)
{
    for (uint32_t i = 0; i < 4 && row->choices[i]; i++) {
        if (strcmp(row->choices[i], value) != 0) continue;
        *count_at(out, row->offset) = i;
        return BD_ERR_OK;
    }
    char known[96] = "";
    for (uint32_t i = 0; i < 4 && row->choices[i]; i++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, "%s%s", i ? ", " : "", row->choices[i]);
    }
    return bd_fault_set(fault, BD_ERR_USAGE, row->key, "%s=%s: must be one of %s", row->key, value,
                        known);
}

static enum bd_err read_number(const struct param_row *row, const char *value,
                               struct bd_params *out, struct bd_fault *fault)
{
    char *end;
    double number = strtod(value, &end);
    bool whole = row->type == PARAM_REAL || floor(number) == number;
    if (end == value || *end || !(number >= row->minimum && number <= row->maximum) || !whole)
        return bd_fault_set(fault, BD_ERR_USAGE, row->key, "%s=%s: must be a %snumber from %g to %.9g",
                            row->key, value, row->type == PARAM_REAL ? "" : "whole ", row->minimum,
                            row->maximum);
    if (row->type == PARAM_REAL)
        *real_at(out, row->offset) = number;
    else
        *count_at(out, row->offset) = (uint32_t)number;
    return BD_ERR_OK;
}

static enum bd_err read_pair(const char *key, const char *value, uint64_t readable,
                             const char *owner, struct bd_params *out, struct bd_fault *fault)
{
    for (int i = 0; i < BD_PARAM_COUNT; i++) {
        if (strcmp(table[i].key, key) != 0) continue;
        if (!(readable >> i & 1))
            return bd_fault_set(fault, BD_ERR_USAGE, key, "%s: technique %s does not read it", key,
                                owner);
        return table[i].type == PARAM_CHOICE ? read_choice(&table[i], value, out, fault)
                                             : read_number(&table[i], value, out, fault);
    }
    return bd_fault_set(fault, BD_ERR_USAGE, key, "%s: no such parameter", key);
}

enum bd_err bd_params_read(const struct bd_param_list *list, uint64_t readable, const char *owner,
                           struct bd_params *out, struct bd_fault *fault)
{
    set_defaults(out);
    for (uint32_t i = 0; i < list->count; i++) {
        enum bd_err err =
            read_pair(list->pairs[i].key, list->pairs[i].value, readable, owner, out, fault);
        if (err) return err;
    }
    return BD_ERR_OK;
}

static void write_value(const struct param_row *row, struct bd_params *params, char *text,
                        size_t size)
{
    switch (row->type) {
    case PARAM_COUNT: snprintf(text, size, "%u", *count_at(params, row->offset)); break;
    case PARAM_REAL: snprintf(text, size, "%g", *real_at(params, row->offset)); break;
    case PARAM_CHOICE:
        snprintf(text, size, "%s", row->choices[*count_at(params, row->offset)]);
        break;
    }
}

void bd_param_describe(enum bd_param param, struct bd_param_info *out)
{
    const struct param_row *row = &table[param];
    struct bd_params defaults;
    set_defaults(&defaults);
    *out = (struct bd_param_info){.key = row->key,
                                  .minimum = row->minimum,
                                  .maximum = row->maximum,
                                  .whole = row->type == PARAM_COUNT,
                                  .choices = row->choices};
    while (out->choice_count < 4 && row->choices[out->choice_count]) out->choice_count++;
    write_value(row, &defaults, out->standard, sizeof out->standard);
}

void bd_params_write(const struct bd_params *params, uint64_t readable, struct bd_param_list *out)
{
    struct bd_params copy = *params;
    out->count = 0;
    for (int i = 0; i < BD_PARAM_COUNT; i++) {
        if (!(readable >> i & 1)) continue;
        snprintf(out->pairs[out->count].key, BD_PARAM_KEY_MAX, "%s", table[i].key);
        write_value(&table[i], &copy, out->pairs[out->count].value, BD_PARAM_VALUE_MAX);
        out->count++;
    }
}

enum bd_err bd_param_list_add(struct bd_param_list *list, const char *key_equals_value,
                              struct bd_fault *fault)
{
    const char *equals = strchr(key_equals_value, '=');
    if (!equals || equals == key_equals_value)
        return bd_fault_set(fault, BD_ERR_USAGE, "set", "%s: must be KEY=VALUE", key_equals_value);
    size_t key_length = (size_t)(equals - key_equals_value), value_length = strlen(equals + 1);
    if (key_length >= BD_PARAM_KEY_MAX || value_length >= BD_PARAM_VALUE_MAX)
        return bd_fault_set(fault, BD_ERR_USAGE, "set", "%.60s: key or value is longer than %d",
                            key_equals_value, BD_PARAM_KEY_MAX - 1);
    if (list->count == BD_PARAM_MAX)
        return bd_fault_set(fault, BD_ERR_LIMIT, "set", "more than %d parameters", BD_PARAM_MAX);
    memcpy(list->pairs[list->count].key, key_equals_value, key_length);
    list->pairs[list->count].key[key_length] = 0;
    memcpy(list->pairs[list->count].value, equals + 1, value_length + 1);
    list->count++;
    return BD_ERR_OK;
}
