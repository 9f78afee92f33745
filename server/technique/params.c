#include "technique/params.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/hash.h"
#include "base/nearest.h"
#include "pass/area_direct.h"
#include "pass/far.h"
#include "pass/light_paths.h"
#include "technique/technique.h"

enum param_type {
    PARAM_COUNT,
    PARAM_EVEN, // an even count
    PARAM_REAL,
    PARAM_CHOICE,    // one of the row's words, stored as its index
    PARAM_LIGHTS,    // several of them joined by +, stored as bits; the last word is all of them
    PARAM_TECHNIQUE, // one of the registry's names, or none
};

struct param_row {
    const char *key;
    enum param_type type;
    size_t offset; // in struct bd_params
    double minimum, maximum;
    double standard;
    const char *choices[4];
};

#define UNLIMITED "inf"
#define OFF_ON                                                                                     \
    {                                                                                              \
        "off", "on"                                                                                \
    }
#define NO_TECHNIQUE "none"
#define ALL_LIGHTS   7
#define SPP_MAX      (1u << 24)
// One dispatch tests a list: 65,535 groups of BD_SUBSPLAT_GROUP blocks.
#define SUBSPLATS_MAX (65535u * 64)

#define FIELD(name) offsetof(struct bd_params, name)

static const struct param_row table[BD_PARAM_COUNT] = {
    [BD_PARAM_BRDF] = {"brdf", PARAM_CHOICE, FIELD(lambert), 0, 0, 0, {"full", "lambert"}},
    [BD_PARAM_SHADOW_SIZE] = {"shadow_size", PARAM_COUNT, FIELD(shadow_size), 16, 8192, 1024, {0}},
    [BD_PARAM_VPLS] = {"vpls", PARAM_COUNT, FIELD(vpls), 1, 1u << 24, 1024, {0}},
    [BD_PARAM_VPL_BUDGET] = {"vpl_budget", PARAM_COUNT, FIELD(vpl_budget), 0, 1u << 24, 0, {0}},
    [BD_PARAM_RSM_SIZE] = {"rsm_size", PARAM_COUNT, FIELD(rsm_size), 8, 4096, 256, {0}},
    [BD_PARAM_VPL_KERNEL] =
        {"vpl_kernel", PARAM_CHOICE, FIELD(vpl_kernel), 0, 0, 0, {"patch", "disk", "point"}},
    [BD_PARAM_NEAR_FIELD] = {"near_field", PARAM_REAL, FIELD(near_field), 0, 1000, 5, {0}},
    [BD_PARAM_PAPER_MODE] = {"paper_mode", PARAM_COUNT, FIELD(paper_mode), 0, 1, 0, {0}},
    [BD_PARAM_SPLAT_SHARE] = {"splat_share", PARAM_REAL, FIELD(splat_share), 1e-6, 1, 0.05, {0}},
    [BD_PARAM_DEPTH_TEST] = {"depth_test",
                             PARAM_CHOICE,
                             FIELD(depth_test),
                             0,
                             0,
                             0,
                             {"minmax", "derivative", "off", "step"}},
    [BD_PARAM_DEPTH_THRESHOLD] =
        {"depth_threshold", PARAM_REAL, FIELD(depth_threshold), 0, 1e6, 0.05, {0}},
    [BD_PARAM_NORMAL_TEST] =
        {"normal_test", PARAM_CHOICE, FIELD(normal_test), 0, 0, 0, {"minmax", "chord", "off"}},
    [BD_PARAM_NORMAL_THRESHOLD] =
        {"normal_threshold", PARAM_REAL, FIELD(normal_threshold), 0, 2, 0.25, {0}},
    [BD_PARAM_NEIGHBOURHOOD] = {"neighbourhood",
                                PARAM_CHOICE,
                                FIELD(neighbourhood),
                                0,
                                0,
                                0,
                                {"plain", "diagonal", "adjacent"}},
    [BD_PARAM_COARSEST] = {"coarsest", PARAM_COUNT, FIELD(coarsest), 1, 16384, 64, {0}},
    [BD_PARAM_FINEST] =
        {"finest", PARAM_CHOICE, FIELD(finest_level), 0, 0, 0, {"1", "2", "4", "8"}},
    [BD_PARAM_LIGHT_THRESHOLD] =
        {"light_threshold", PARAM_REAL, FIELD(light_threshold), 0, 1e6, INFINITY, {0}},
    [BD_PARAM_SURFACE_DETAIL] = {"surface_detail",
                                 PARAM_CHOICE,
                                 FIELD(surface_detail),
                                 0,
                                 0,
                                 1,
                                 {"off", "direction", "paper"}},
    [BD_PARAM_VISIT] = {"visit", PARAM_CHOICE, FIELD(visit), 0, 0, 0, {"list", "mask"}},
    [BD_PARAM_SUB_FRAMES] =
        {"sub_frames", PARAM_CHOICE, FIELD(sub_frames), 0, 0, 0, {"shared", "own"}},
    [BD_PARAM_RADIANCE_TEST] =
        {"radiance_test", PARAM_CHOICE, FIELD(radiance_test), 0, 0, 0, {"relative", "absolute"}},
    [BD_PARAM_RADIANCE_THRESHOLD] =
        {"radiance_threshold", PARAM_REAL, FIELD(radiance_threshold), 0, 1e12, 0.25, {0}},
    [BD_PARAM_MATERIAL_THRESHOLD] =
        {"material_threshold", PARAM_REAL, FIELD(material_threshold), 0, 1, 0.1, {0}},
    [BD_PARAM_SUBSPLAT_LIMIT] =
        {"subsplat_limit", PARAM_COUNT, FIELD(subsplat_limit), 64, SUBSPLATS_MAX, 1u << 18, {0}},
    [BD_PARAM_CLUSTER_LEVELS] =
        {"cluster_levels", PARAM_COUNT, FIELD(cluster_levels), 0, 12, 3, {0}},
    [BD_PARAM_CLUSTER_DEPTH_THRESHOLD] =
        {"cluster_depth_threshold", PARAM_REAL, FIELD(cluster_depth_threshold), 0, 1e6, 0.3, {0}},
    [BD_PARAM_CLUSTER_NORMAL_THRESHOLD] =
        {"cluster_normal_threshold", PARAM_REAL, FIELD(cluster_normal_threshold), 0, 2, 0.3, {0}},
    [BD_PARAM_TREE_CUT] =
        {"tree_cut", PARAM_CHOICE, FIELD(tree_cut), 0, 0, 0, {"lightcuts", "bound", "level"}},
    [BD_PARAM_TAU] = {"tau", PARAM_REAL, FIELD(tau), 0, 1, 0.03, {0}},
    [BD_PARAM_TREE_ROOTS] = {"tree_roots", PARAM_COUNT, FIELD(tree_roots), 1, 1u << 24, 256, {0}},
    [BD_PARAM_MODEL_OF] = {"model_of", PARAM_TECHNIQUE, FIELD(model_of), 0, 0, 0, {0}},
    [BD_PARAM_SPP] = {"spp", PARAM_EVEN, FIELD(spp), 2, SPP_MAX, 64, {0}},
    [BD_PARAM_FIRST_SAMPLE] = {"first_sample", PARAM_EVEN, FIELD(first_sample), 0, SPP_MAX, 0, {0}},
    [BD_PARAM_BOUNCES] = {"bounces", PARAM_COUNT, FIELD(bounces), 0, 64, INFINITY, {0}},
    [BD_PARAM_INDIRECT_VISIBILITY] = {"indirect_visibility",
                                      PARAM_CHOICE,
                                      FIELD(indirect_visibility),
                                      0,
                                      0,
                                      1,
                                      {"none", "rays"}},
    [BD_PARAM_RAYS] = {"rays", PARAM_COUNT, FIELD(rays), 1, 1u << 24, 16, {0}},
    [BD_PARAM_LIGHTS] = {"lights",
                         PARAM_LIGHTS,
                         FIELD(lights),
                         0,
                         0,
                         ALL_LIGHTS,
                         {"punctual", "emissive", "environment", "all"}},
    [BD_PARAM_FILTER] = {"filter", PARAM_CHOICE, FIELD(filter), 0, 0, 0, {"point", "box"}},
    [BD_PARAM_ALPHA] =
        {"alpha", PARAM_CHOICE, FIELD(alpha_coverage), 0, 0, 1, {"mask", "coverage"}},
    [BD_PARAM_CLAMP] = {"clamp", PARAM_REAL, FIELD(clamp_per_m2), 0, 1e12, INFINITY, {0}},
    [BD_PARAM_SENDERS] =
        {"senders", PARAM_CHOICE, FIELD(senders_lambert), 0, 0, 0, {"full", "lambert"}},
    [BD_PARAM_TRANSMISSION] = {"transmission", PARAM_CHOICE, FIELD(transmission), 0, 0, 1, OFF_ON},
    [BD_PARAM_LIGHT_VERTICES] = {"light_vertices", PARAM_CHOICE, FIELD(light_vertices), 0, 0, 1,
                                 OFF_ON},
    [BD_PARAM_NOISE_FILTER] = {"noise_filter", PARAM_CHOICE, FIELD(noise_filter), 0, 0, 1, OFF_ON},
    [BD_PARAM_LIGHT_RAYS] =
        {"light_rays", PARAM_EVEN, FIELD(light_rays), 0, BD_LIGHT_RAYS_MAX, 16, {0}},
    [BD_PARAM_LAMPS] = {"lamps", PARAM_CHOICE, FIELD(lamps), 0, 0, 0, {"auto", "maps", "rays"}},
    [BD_PARAM_INDIRECT_LIGHTS] = {"indirect_lights",
                                  PARAM_LIGHTS,
                                  FIELD(indirect_lights),
                                  0,
                                  0,
                                  ALL_LIGHTS,
                                  {"punctual", "emissive", "environment", "all"}},
    [BD_PARAM_INDIRECT_BOUNCES] =
        {"indirect_bounces", PARAM_COUNT, FIELD(indirect_bounces), 1, 64, 1, {0}},
    [BD_PARAM_EXECUTOR] =
        {"executor", PARAM_CHOICE, FIELD(executor), 0, 0, 0, {"auto", "device", "native"}},
    [BD_PARAM_DRAWING] =
        {"drawing", PARAM_CHOICE, FIELD(drawing), 0, 0, 0, {"auto", "raster", "rays"}},
    [BD_PARAM_WALK_VPLS] =
        {"walk_vpls", PARAM_COUNT, FIELD(walk_vpls), 64, BD_LIGHT_PATHS_MAX, 2048, {0}},
    [BD_PARAM_CACHE_CELLS] =
        {"cache_cells", PARAM_COUNT, FIELD(cache_cells), 64, 1u << 20, 2048, {0}},
    [BD_PARAM_FAR_RAYS] = {"far_rays", PARAM_EVEN, FIELD(far_rays), 2, BD_FAR_RAYS_MAX, 4, {0}},
    [BD_PARAM_LIGHT_BLOCKS] =
        {"light_blocks", PARAM_CHOICE, FIELD(light_blocks), 0, 0, 0, {"auto", "1", "2", "4"}},
};

// Other words for choices. They are read, and never written.
static const struct {
    enum bd_param param;
    const char *word;
    uint32_t choice;
} aliases[] = {
    {BD_PARAM_INDIRECT_VISIBILITY, "off", BD_VISIBILITY_NONE},
    {BD_PARAM_INDIRECT_VISIBILITY, "on", BD_VISIBILITY_RAYS},
};

static bool is_alias(const struct param_row *row, uint32_t choice, const char *word)
{
    for (size_t i = 0; i < sizeof aliases / sizeof *aliases; i++)
        if (&table[aliases[i].param] == row && aliases[i].choice == choice &&
            strcmp(aliases[i].word, word) == 0)
            return true;
    return false;
}

// Numbers that may be "inf" too.
static bool is_unlimited(const struct param_row *row)
{
    const uint64_t unlimited =
        BD_READS(BD_PARAM_BOUNCES) | BD_READS(BD_PARAM_CLAMP) | BD_READS(BD_PARAM_DEPTH_THRESHOLD) |
        BD_READS(BD_PARAM_NORMAL_THRESHOLD) | BD_READS(BD_PARAM_MATERIAL_THRESHOLD) |
        BD_READS(BD_PARAM_LIGHT_THRESHOLD) | BD_READS(BD_PARAM_CLUSTER_DEPTH_THRESHOLD) |
        BD_READS(BD_PARAM_CLUSTER_NORMAL_THRESHOLD);
    return unlimited >> (row - table) & 1;
}

_Static_assert(BD_MODEL_BOUNCES_UNLIMITED == UINT32_MAX, "what an unlimited count is");

static uint32_t *count_at(struct bd_params *params, size_t offset)
{
    return (uint32_t *)((char *)params + offset);
}

static double *real_at(struct bd_params *params, size_t offset)
{
    return (double *)((char *)params + offset);
}

static void store(const struct param_row *row, double number, struct bd_params *out)
{
    if (row->type == PARAM_REAL)
        *real_at(out, row->offset) = number;
    else
        *count_at(out, row->offset) = isinf(number) ? UINT32_MAX : (uint32_t)number;
}

// With `paper_mode` the table's blocks, which are the papers', and not the technique's own.
static void set_defaults(const struct bd_technique *technique, bool paper_mode,
                         struct bd_params *params)
{
    const uint64_t blocks = BD_READS_FRAGMENTS | BD_READS(BD_PARAM_LIGHT_THRESHOLD);
    memset(params, 0, sizeof *params);
    for (int i = 0; i < BD_PARAM_COUNT; i++) store(&table[i], table[i].standard, params);
    for (uint32_t i = 0; i < technique->default_count; i++) {
        const struct bd_param_default *own = &technique->defaults[i];
        if (paper_mode && BD_READS(own->param) & blocks) continue;
        store(&table[own->param], own->value, params);
    }
    // The papers' direct light is that of punctual lights.
    if (paper_mode) params->light_rays = 0;
}

static enum bd_err read_choice(const struct param_row *row, const char *value,
                               struct bd_params *out, struct bd_fault *fault)
{
    for (uint32_t i = 0; i < 4 && row->choices[i]; i++) {
        if (strcmp(row->choices[i], value) != 0 && !is_alias(row, i, value)) continue;
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
    bool whole = row->type == PARAM_REAL || fmod(number, row->type == PARAM_EVEN ? 2 : 1) == 0;
    bool unlimited = is_unlimited(row) && strcmp(value, UNLIMITED) == 0;
    bool in_range = number >= row->minimum && number <= row->maximum && whole;
    const char *kind = row->type == PARAM_REAL   ? "a"
                       : row->type == PARAM_EVEN ? "an even"
                                                 : "a whole";
    if (end == value || *end || (!in_range && !unlimited))
        return bd_fault_set(fault, BD_ERR_USAGE, row->key,
                            "%s=%s: must be %s number from %g to %.9g%s", row->key, value, kind,
                            row->minimum, row->maximum, is_unlimited(row) ? ", or " UNLIMITED : "");
    store(row, number, out);
    return BD_ERR_OK;
}

// One word of "punctual+emissive"; 0 if there is no such kind.
static uint32_t light_bits(const struct param_row *row, const char *word, size_t length)
{
    for (uint32_t i = 0; i < 4; i++)
        if (strlen(row->choices[i]) == length && strncmp(row->choices[i], word, length) == 0)
            return i == 3 ? ALL_LIGHTS : 1u << i;
    return 0;
}

static enum bd_err read_lights(const struct param_row *row, const char *value,
                               struct bd_params *out, struct bd_fault *fault)
{
    uint32_t bits = 0;
    for (const char *word = value; word;) {
        size_t length = strcspn(word, "+");
        uint32_t found = light_bits(row, word, length);
        if (!found)
            return bd_fault_set(fault, BD_ERR_USAGE, row->key,
                                "%s=%s: must be punctual, emissive or environment, several joined "
                                "by +, or all",
                                row->key, value);
        bits |= found;
        word = word[length] ? word + length + 1 : NULL;
    }
    *count_at(out, row->offset) = bits;
    return BD_ERR_OK;
}

static enum bd_err read_technique(const struct param_row *row, const char *value,
                                  struct bd_params *out, struct bd_fault *fault)
{
    uint32_t *index = count_at(out, row->offset);
    *index = 0;
    if (strcmp(value, NO_TECHNIQUE) == 0) return BD_ERR_OK;
    struct bd_fault unknown;
    if (!bd_technique_find(value, &unknown))
        return bd_fault_set(fault, BD_ERR_USAGE, row->key, "%s=%s", row->key, unknown.message);
    while (strcmp(bd_technique_at(*index)->name, value) != 0) ++*index;
    ++*index;
    return BD_ERR_OK;
}

static enum bd_err read_value(const struct param_row *row, const char *value, struct bd_params *out,
                              struct bd_fault *fault)
{
    switch (row->type) {
    case PARAM_COUNT:
    case PARAM_EVEN:
    case PARAM_REAL:
        return read_number(row, value, out, fault);
    case PARAM_CHOICE:
        return read_choice(row, value, out, fault);
    case PARAM_LIGHTS:
        return read_lights(row, value, out, fault);
    case PARAM_TECHNIQUE:
        return read_technique(row, value, out, fault);
    }
    BD_ASSERT(!"no such type of parameter");
    return BD_ERR_INTERNAL;
}

static bool is_read(const struct bd_technique *technique, int param)
{
    return technique->params_read >> param & 1;
}

static enum bd_err refuse_key(const char *key, const struct bd_technique *technique,
                              struct bd_fault *fault)
{
    char hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, key);
    for (int i = 0; i < BD_PARAM_COUNT; i++)
        if (is_read(technique, i)) bd_nearest_consider(&nearest, table[i].key);
    return bd_fault_set(fault, BD_ERR_USAGE, key, "%s: no such parameter%s", key,
                        bd_nearest_hint(&nearest, hint));
}

static enum bd_err read_pair(const char *key, const char *value,
                             const struct bd_technique *technique, struct bd_params *out,
                             struct bd_fault *fault)
{
    for (int i = 0; i < BD_PARAM_COUNT; i++) {
        if (strcmp(table[i].key, key) != 0) continue;
        if (!is_read(technique, i))
            return bd_fault_set(fault, BD_ERR_USAGE, key, "%s: technique %s does not read it", key,
                                technique->name);
        return read_value(&table[i], value, out, fault);
    }
    return refuse_key(key, technique, fault);
}

static void preset(const struct bd_model *model, struct bd_params *out)
{
    out->bounces = model->indirect_bounces;
    out->indirect_visibility = model->indirect_visibility;
    out->lights = model->lights;
    out->indirect_lights = model->indirect_lights;
    out->senders_lambert = !model->glossy_senders;
    out->transmission = model->transmission;
    out->alpha_coverage = model->coverage;
}

// `model_of` first, wherever it stands: what is given beside it is meant to differ from it.
static enum bd_err read_model_of(const struct bd_param_list *list,
                                 const struct bd_technique *technique, struct bd_params *out,
                                 struct bd_fault *fault)
{
    const struct param_row *row = &table[BD_PARAM_MODEL_OF];
    if (!is_read(technique, BD_PARAM_MODEL_OF)) return BD_ERR_OK;
    for (uint32_t i = 0; i < list->count; i++) {
        if (strcmp(list->pairs[i].key, row->key) != 0) continue;
        enum bd_err err = read_technique(row, list->pairs[i].value, out, fault);
        if (err) return err;
    }
    if (out->model_of) preset(&bd_technique_at(out->model_of - 1)->model, out);
    return BD_ERR_OK;
}

static enum bd_err read_over_defaults(const struct bd_param_list *list,
                                      const struct bd_technique *technique, bool paper_mode,
                                      struct bd_params *out, struct bd_fault *fault)
{
    set_defaults(technique, paper_mode, out);
    enum bd_err unknown = read_model_of(list, technique, out, fault);
    if (unknown) return unknown;
    for (uint32_t i = 0; i < list->count; i++) {
        enum bd_err err =
            read_pair(list->pairs[i].key, list->pairs[i].value, technique, out, fault);
        if (err) return err;
    }
    return BD_ERR_OK;
}

enum bd_err bd_params_read(const struct bd_param_list *list, const struct bd_technique *technique,
                           struct bd_params *out, struct bd_fault *fault)
{
    enum bd_err err = read_over_defaults(list, technique, false, out, fault);
    if (err || !out->paper_mode) return err;
    return read_over_defaults(list, technique, true, out, fault);
}

bool bd_params_are_read(const struct bd_param_list *list, const struct bd_technique *technique)
{
    bool all = true;
    for (uint32_t p = 0; p < list->count; p++) {
        bool one = false;
        for (int i = 0; i < BD_PARAM_COUNT; i++)
            one |= is_read(technique, i) && strcmp(table[i].key, list->pairs[p].key) == 0;
        all &= one;
    }
    return all;
}

static void write_lights(const struct param_row *row, uint32_t bits, char *text, size_t size)
{
    text[0] = 0;
    if (bits == ALL_LIGHTS) snprintf(text, size, "%s", row->choices[3]);
    for (uint32_t i = 0; i < 3 && bits != ALL_LIGHTS; i++) {
        size_t used = strlen(text);
        if (bits >> i & 1)
            snprintf(text + used, size - used, "%s%s", used ? "+" : "", row->choices[i]);
    }
}

static void write_count(const struct param_row *row, uint32_t count, char *text, size_t size)
{
    if (is_unlimited(row) && count == UINT32_MAX)
        snprintf(text, size, UNLIMITED);
    else
        snprintf(text, size, "%u", count);
}

static void write_value(const struct param_row *row, struct bd_params *params, char *text,
                        size_t size)
{
    uint32_t count = row->type == PARAM_REAL ? 0 : *count_at(params, row->offset);
    switch (row->type) {
    case PARAM_COUNT:
    case PARAM_EVEN:
        write_count(row, count, text, size);
        break;
    case PARAM_REAL:
        snprintf(text, size, "%.9g", *real_at(params, row->offset));
        break;
    case PARAM_CHOICE:
        snprintf(text, size, "%s", row->choices[count]);
        break;
    case PARAM_LIGHTS:
        write_lights(row, count, text, size);
        break;
    case PARAM_TECHNIQUE:
        snprintf(text, size, "%s", count ? bd_technique_at(count - 1)->name : NO_TECHNIQUE);
        break;
    }
}

void bd_param_describe(const struct bd_technique *technique, enum bd_param param,
                       struct bd_param_info *out)
{
    const struct param_row *row = &table[param];
    struct bd_params defaults;
    set_defaults(technique, false, &defaults);
    *out = (struct bd_param_info){.key = row->key,
                                  .minimum = row->minimum,
                                  .maximum = row->maximum,
                                  .whole = row->type == PARAM_COUNT || row->type == PARAM_EVEN,
                                  .choices = row->choices};
    while (out->choice_count < 4 && row->choices[out->choice_count]) out->choice_count++;
    if (row->type == PARAM_TECHNIQUE) out->choices = bd_technique_names(&out->choice_count);
    write_value(row, &defaults, out->standard, sizeof out->standard);
}

uint64_t bd_params_hash(const struct bd_params *params, uint64_t which, uint64_t seed)
{
    for (int i = 0; i < BD_PARAM_COUNT; i++)
        if (which >> i & 1)
            seed = bd_hash64((const char *)params + table[i].offset,
                             table[i].type == PARAM_REAL ? sizeof(double) : sizeof(uint32_t), seed);
    return seed;
}

void bd_params_write(const struct bd_params *params, const struct bd_technique *technique,
                     struct bd_param_list *out)
{
    struct bd_params copy = *params;
    out->count = 0;
    for (int i = 0; i < BD_PARAM_COUNT; i++) {
        if (!is_read(technique, i)) continue;
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
