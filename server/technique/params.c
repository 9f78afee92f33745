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
#include "pass/imperfect_shadows.h"
#include "pass/light_paths.h"
#include "pass/project_points.h"
#include "shared/screen.h"
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
    const char *what; // in a few words, for who chooses
};

#define UNLIMITED    "inf"
#define NO_TECHNIQUE "none"
#define ALL_LIGHTS   7
#define SPP_MAX      (1u << 24)
// One dispatch tests a list: 65,535 groups of BD_SUBSPLAT_GROUP blocks.
#define SUBSPLATS_MAX (65535u * 64)

// A row by its type: the parameter, its key and its field of struct bd_params; range and standard
// of a number, standard and words of a choice; what it does.
#define ROW(param, name, kind, field, ...)                                                         \
    [BD_PARAM_##param] = {                                                                         \
        .key = name, .type = kind, .offset = offsetof(struct bd_params, field), __VA_ARGS__}
#define NUMBER(param, name, kind, field, least, most, usual, tells)                                \
    ROW(param, name, kind, field, .minimum = least, .maximum = most, .standard = usual,            \
        .what = tells)
#define COUNT(param, name, ...) NUMBER(param, name, PARAM_COUNT, __VA_ARGS__)
#define EVEN(param, name, ...)  NUMBER(param, name, PARAM_EVEN, __VA_ARGS__)
#define REAL(param, name, ...)  NUMBER(param, name, PARAM_REAL, __VA_ARGS__)
#define CHOICE(param, name, field, usual, tells, ...)                                              \
    ROW(param, name, PARAM_CHOICE, field, .standard = usual, .what = tells,                        \
        .choices = {__VA_ARGS__})
#define LIGHTS(param, name, field, usual, tells, ...)                                              \
    ROW(param, name, PARAM_LIGHTS, field, .standard = usual, .what = tells,                        \
        .choices = {__VA_ARGS__})
#define TECHNIQUE(param, name, field, tells) ROW(param, name, PARAM_TECHNIQUE, field, .what = tells)
#define OFF_ON                               "off", "on"

static const struct param_row table[BD_PARAM_COUNT] = {
    CHOICE(BRDF, "brdf", lambert, 0, "lambert: without specular lobe and metals", "full",
           "lambert"),
    COUNT(SHADOW_SIZE, "shadow_size", shadow_size, 16, 8192, 1024,
          "texels along a side of a shadow map, of a cube's face"),
    COUNT(VPLS, "vpls", vpls, 1, 1u << 24, 1024, "virtual lights of each light source, or of all"),
    COUNT(
        VPL_BUDGET, "vpl_budget", vpl_budget, 0, 1u << 24, 0,
        "virtual lights of all sources, beyond which they are shared by flux; 0: four times vpls"),
    COUNT(RSM_SIZE, "rsm_size", rsm_size, 8, 4096, 256,
          "texels along a side of a light's map, of a cube's face"),
    CHOICE(VPL_KERNEL, "vpl_kernel", vpl_kernel, 0,
           "what a virtual light is: the patch that it stands for, a disk, or a point", "patch",
           "disk", "point"),
    REAL(NEAR_FIELD, "near_field", near_field, 0, 1000, 5,
         "radii of a patch below which its light is integrated exactly"),
    COUNT(PAPER_MODE, "paper_mode", paper_mode, 0, 1, 0,
          "1: the paper's printed formulas and defaults"),
    REAL(SPLAT_SHARE, "splat_share", splat_share, 1e-6, 1, 0.05,
         "fragments of all splats, as a part of pixels times virtual lights"),
    CHOICE(DEPTH_TEST, "depth_test", depth_test, 0,
           "what tells that a block of pixels spans a step in depth", "minmax", "derivative", "off",
           "step"),
    REAL(DEPTH_THRESHOLD, "depth_threshold", depth_threshold, 0, 1e6, 0.05,
         "above which it is split"),
    CHOICE(NORMAL_TEST, "normal_test", normal_test, 0,
           "what tells that a block spans surfaces that face apart", "minmax", "chord", "off"),
    REAL(NORMAL_THRESHOLD, "normal_threshold", normal_threshold, 0, 2, 0.25,
         "above which it is split"),
    CHOICE(NEIGHBOURHOOD, "neighbourhood", neighbourhood, 0,
           "which blocks around are looked at, too", "plain", "diagonal", "adjacent"),
    COUNT(COARSEST, "coarsest", coarsest, 1, 16384, 64,
          "blocks along the longer side of the coarsest level, at most"),
    CHOICE(FINEST, "finest", finest_level, 0,
           "pixels along a side of blocks that are not split any more", "1", "2", "4", "8"),
    REAL(LIGHT_THRESHOLD, "light_threshold", light_threshold, 0, 1e6, INFINITY,
         "spread of light over a block, as a part of it, above which it "
         "is split (surface_detail=direction)"),
    CHOICE(SURFACE_DETAIL, "surface_detail", surface_detail, 1,
           "how normal maps show where light is interpolated", "off", "direction", "paper"),
    CHOICE(VISIT, "visit", visit, 0,
           "how blocks are found: by lists, or by a mask over the picture", "list", "mask"),
    CHOICE(SUB_FRAMES, "sub_frames", sub_frames, 0,
           "whether each of an antialiased picture's sub-frames gathers its own light", "shared",
           "own"),
    CHOICE(RADIANCE_TEST, "radiance_test", radiance_test, 0,
           "whether radiance_threshold is a part of the radiance, or in cd/m^2", "relative",
           "absolute"),
    REAL(RADIANCE_THRESHOLD, "radiance_threshold", radiance_threshold, 0, 1e12, 0.25,
         "of what a glossy receiver sees of a virtual light, above which its block is split"),
    REAL(MATERIAL_THRESHOLD, "material_threshold", material_threshold, 0, 1, 0.1,
         "of roughness and the like over a block, above which it is split"),
    COUNT(SUBSPLAT_LIMIT, "subsplat_limit", subsplat_limit, 64, SUBSPLATS_MAX, 1u << 18,
          "blocks of one list, at most"),
    COUNT(CLUSTER_LEVELS, "cluster_levels", cluster_levels, 0, 12, 3,
          "how often a block of a light's map may be split in four"),
    REAL(CLUSTER_DEPTH_THRESHOLD, "cluster_depth_threshold", cluster_depth_threshold, 0, 1e6, 0.3,
         "step in depth in a light's map above which a block is split"),
    REAL(CLUSTER_NORMAL_THRESHOLD, "cluster_normal_threshold", cluster_normal_threshold, 0, 2, 0.3,
         "turn of the normal in a light's map above which a block is split"),
    CHOICE(TREE_CUT, "tree_cut", tree_cut, 0,
           "by what a node of the tree of lights stands for its leaves", "lightcuts", "bound",
           "level"),
    REAL(TAU, "tau", tau, 0, 1, 0.03, "how far off such a node may be, as tree_cut measures it"),
    COUNT(TREE_ROOTS, "tree_roots", tree_roots, 1, 1u << 24, 256, "roots of each light's tree"),
    TECHNIQUE(MODEL_OF, "model_of", model_of,
              "a technique whose model of light is traced: presets bounces, "
              "indirect_visibility, lights, senders, transmission and alpha"),
    EVEN(SPP, "spp", spp, 2, SPP_MAX, 64, "samples a pixel, both halves together; even"),
    EVEN(FIRST_SAMPLE, "first_sample", first_sample, 0, SPP_MAX, 0,
         "of those, the index of the first; even"),
    COUNT(BOUNCES, "bounces", bounces, 0, 64, INFINITY, "of indirect light"),
    CHOICE(INDIRECT_VISIBILITY, "indirect_visibility", indirect_visibility, 1,
           "what hides indirect light: nothing, what rays meet, or what imperfect shadow maps show",
           "none", "rays", "ism"),
    COUNT(RAYS, "rays", rays, 1, 1u << 24, 16, "virtual lights that a receiver asks a ray for"),
    LIGHTS(LIGHTS, "lights", lights, ALL_LIGHTS, "kinds of light, joined by +", "punctual",
           "emissive", "environment", "all"),
    CHOICE(FILTER, "filter", filter, 0, "through the pixel's centre, or over the pixel", "point",
           "box"),
    CHOICE(ALPHA, "alpha", alpha_coverage, 1,
           "what blends: opaque from half on, or hiding by its part", "mask", "coverage"),
    REAL(CLAMP, "clamp", clamp_per_m2, 0, 1e12, INFINITY,
         "bound on cos cos / r^2 between surfaces, 1/m^2; of virtual lights 0: by how far they are "
         "apart"),
    CHOICE(SENDERS, "senders", senders_lambert, 0,
           "what surfaces send on: all of their BRDF, or their base colour", "full", "lambert"),
    CHOICE(TRANSMISSION, "transmission", transmission, 1,
           "whether light goes through what transmits it", OFF_ON),
    CHOICE(LIGHT_VERTICES, "light_vertices", light_vertices, 1,
           "whether paths from lights are joined to those from the eye", OFF_ON),
    CHOICE(NOISE_FILTER, "noise_filter", noise_filter, 1, "smooth light as far as its noise goes",
           OFF_ON),
    EVEN(LIGHT_RAYS, "light_rays", light_rays, 0, BD_LIGHT_RAYS_MAX, 16,
         "of a pixel to emissive surfaces and the sky, even; 0: those light nothing"),
    CHOICE(LAMPS, "lamps", lamps, 0,
           "what hides direct light of punctual lights; auto: rays where they are many, or shine "
           "through panes or what blends",
           "auto", "maps", "rays"),
    LIGHTS(INDIRECT_LIGHTS, "indirect_lights", indirect_lights, ALL_LIGHTS,
           "kinds of light that surfaces send on, joined by +", "punctual", "emissive",
           "environment", "all"),
    COUNT(INDIRECT_BOUNCES, "indirect_bounces", indirect_bounces, 1, 64, 1,
          "how often surfaces send light on, at most"),
    CHOICE(EXECUTOR, "executor", executor, 0,
           "who does the arithmetic; auto: the processor on a software device", "auto", "device",
           "native"),
    CHOICE(DRAWING, "drawing", drawing, 0,
           "how what cameras and lights see is found; auto: rays on a software "
           "device where they cost less",
           "auto", "raster", "rays"),
    COUNT(WALK_VPLS, "walk_vpls", walk_vpls, 64, BD_LIGHT_PATHS_MAX, 2048,
          "virtual lights of further reflections"),
    COUNT(CACHE_CELLS, "cache_cells", cache_cells, 64, 1u << 20, 2048,
          "cells of the cache in which rays end, at most"),
    EVEN(FAR_RAYS, "far_rays", far_rays, 2, BD_FAR_RAYS_MAX, 4,
         "rays of a pixel that end in the cache, even"),
    CHOICE(LIGHT_BLOCKS, "light_blocks", light_blocks, 0,
           "pixels along a side of blocks that gather light as one; auto by size and rays", "auto",
           "1", "2", "4"),
    CHOICE(RESIDUAL, "residual", residual, 2,
           "what gives back what the clamp takes off: the picture, short rays, or those where it "
           "does not show all that is near",
           "screen", "rays", "both"),
    COUNT(ITERATIONS, "iterations", iterations, 0, 4, 2,
          "how often the picture gives back what the clamp takes off; 0: never"),
    COUNT(RESIDUAL_LEVELS, "residual_levels", residual_levels, 1, BD_SCREEN_LEVELS_MAX, 6,
          "levels of the picture, each a quarter of the one before, that it is given back from"),
    REAL(RESIDUAL_THRESHOLD, "residual_threshold", residual_threshold, 0, 4, 0.02,
         "projected solid angle of a part of the picture, sr, above which it is looked at closer"),
    REAL(RESIDUAL_EDGE_THRESHOLD, "residual_edge_threshold", residual_edge_threshold, 0, 4, 0.02,
         "the same of a part that spans an edge"),
    COUNT(ISM_SIZE, "ism_size", ism_size, BD_SHADOW_MAP_SIDE_MIN, BD_SHADOW_MAP_SIDE_MAX, 64,
          "texels along a side of a virtual light's imperfect shadow map, at most"),
    COUNT(ISM_POINTS, "ism_points", ism_points, BD_SHADOW_POINTS_MIN, BD_SHADOW_POINTS_MAX, 8192,
          "points of all surfaces that such a map is made of"),
    REAL(ISM_BIAS, "ism_bias", ism_bias, 0, 10, 0.1,
         "how steep a surface may fall off beside a point and not hide itself"),
    CHOICE(ISM_HOLES, "ism_holes", ism_holes, 1,
           "where no point lies nothing hides, or what texels beside it say", "open", "filled"),
    REAL(LAMP_RADIUS, "lamp_radius", lamp_radius_m, 0, 1e6, 0,
         "of punctual lights, metres, and of directional ones at one metre; 0: points"),
    CHOICE(CAUSTICS, "caustics", caustics, 1,
           "photons of lamps where they land behind glass and mirrors; auto: where there are any",
           "off", "auto"),
    COUNT(PHOTONS, "photons", photons, 1024, BD_PHOTONS_MAX, 131072,
          "that lamps send to glass and mirrors, and of technique photon as many that all lights "
          "send"),
    REAL(PHOTON_RADIUS, "photon_radius", photon_radius_m, 0, 1e6, 0,
         "over which photons are told, metres; 0: by how dense they are"),
    CHOICE(INTERSECTIONS, "intersections", intersections, 0,
           "what photons meet: triangles, or what environment maps show", "rays", "images"),
    COUNT(ENV_MAPS, "env_maps", env_maps, 1, BD_ENV_MAPS_MAX, 8,
          "environment maps, at most: fewer where more show no more"),
    COUNT(ENV_MAP_SIZE, "env_map_size", env_map_size, BD_ENV_MAP_SIDE_MIN, BD_ENV_MAP_SIDE_MAX, 256,
          "texels along a side of an environment map's face"),
    COUNT(POINTS, "points", points, 1024, BD_SURFACE_POINTS_MAX, 262144,
          "points of all surfaces, that are lit and projected"),
    COUNT(CLUSTERS, "clusters", clusters, 1, BD_CLUSTERS_MAX, 512,
          "of points, that receivers explore"),
    COUNT(EXPLORE, "explore", explore, 1, BD_EXPLORE_MAX, 2,
          "points of each cluster that say what it may give"),
    COUNT(EXPLOIT, "exploit", exploit, 1, 1u << 16, 2048,
          "points that are drawn by that, of all clusters"),
    EVEN(MICROBUFFER, "microbuffer", microbuffer, BD_MICROBUFFER_SIDE_MIN, BD_MICROBUFFER_SIDE_MAX,
         32, "texels along a side of the map that points are projected into, even"),
    CHOICE(PROJECTION, "projection", projection, 0,
           "which points are projected: by importance, as many of all clusters alike, or all",
           "importance", "uniform", "all"),
    EVEN(MAP_RAYS, "map_rays", map_rays, 0, BD_MAP_RAYS_MAX, 64,
         "of a receiver through its map, in the mean, that bring what that misses, even; 0: none"),
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
    const bd_param_set unlimited =
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

// The papers' direct light is that of punctual lights, nothing blends; bias is compensated from the
// screen alone.
static void set_as_printed(struct bd_params *params)
{
    params->light_rays = 0;
    params->alpha_coverage = 0;
    params->residual = BD_RESIDUAL_SCREEN;
    params->intersections = BD_INTERSECTIONS_IMAGES;
    params->residual_threshold = 0.08;
    params->residual_edge_threshold = 0.04;
}

// With `paper_mode` the table's blocks, which are the papers', and not the technique's own.
static void set_defaults(const struct bd_technique *technique, bool paper_mode,
                         struct bd_params *params)
{
    const bd_param_set blocks = BD_READS_FRAGMENTS | BD_READS(BD_PARAM_LIGHT_THRESHOLD);
    memset(params, 0, sizeof *params);
    for (int i = 0; i < BD_PARAM_COUNT; i++) store(&table[i], table[i].standard, params);
    for (uint32_t i = 0; i < technique->default_count; i++) {
        const struct bd_param_default *own = &technique->defaults[i];
        if (paper_mode && BD_READS(own->param) & blocks) continue;
        store(&table[own->param], own->value, params);
    }
    if (paper_mode) set_as_printed(params);
}

// Those that the technique has: paths are hidden by what rays meet, or by nothing.
static uint32_t choice_count(const struct param_row *row, const struct bd_technique *technique)
{
    uint32_t count = 0;
    while (count < 4 && row->choices[count]) count++;
    const bool is_of_paths = technique->is_reference && row == &table[BD_PARAM_INDIRECT_VISIBILITY];
    return is_of_paths ? BD_VISIBILITY_ISM : count;
}

static enum bd_err read_choice(const struct param_row *row, const char *value, uint32_t count,
                               struct bd_params *out, struct bd_err_detail *detail)
{
    for (uint32_t i = 0; i < count; i++) {
        if (strcmp(row->choices[i], value) != 0 && !is_alias(row, i, value)) continue;
        *count_at(out, row->offset) = i;
        return BD_ERR_OK;
    }
    char known[96] = "";
    for (uint32_t i = 0; i < count; i++) {
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, "%s%s", i ? ", " : "", row->choices[i]);
    }
    return bd_err_set(detail, BD_ERR_USAGE, row->key, "%s=%s: must be one of %s", row->key, value,
                      known);
}

static enum bd_err read_number(const struct param_row *row, const char *value,
                               struct bd_params *out, struct bd_err_detail *detail)
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
        return bd_err_set(detail, BD_ERR_USAGE, row->key,
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
                               struct bd_params *out, struct bd_err_detail *detail)
{
    uint32_t bits = 0;
    for (const char *word = value; word;) {
        size_t length = strcspn(word, "+");
        uint32_t found = light_bits(row, word, length);
        if (!found)
            return bd_err_set(detail, BD_ERR_USAGE, row->key,
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
                                  struct bd_params *out, struct bd_err_detail *detail)
{
    uint32_t *index = count_at(out, row->offset);
    *index = 0;
    if (strcmp(value, NO_TECHNIQUE) == 0) return BD_ERR_OK;
    struct bd_err_detail unknown;
    if (!bd_technique_find(value, &unknown))
        return bd_err_set(detail, BD_ERR_USAGE, row->key, "%s=%s", row->key, unknown.message);
    while (strcmp(bd_technique_at(*index)->name, value) != 0) ++*index;
    ++*index;
    return BD_ERR_OK;
}

static enum bd_err read_value(const struct param_row *row, const char *value,
                              const struct bd_technique *technique, struct bd_params *out,
                              struct bd_err_detail *detail)
{
    switch (row->type) {
    case PARAM_COUNT:
    case PARAM_EVEN:
    case PARAM_REAL:
        return read_number(row, value, out, detail);
    case PARAM_CHOICE:
        return read_choice(row, value, choice_count(row, technique), out, detail);
    case PARAM_LIGHTS:
        return read_lights(row, value, out, detail);
    case PARAM_TECHNIQUE:
        return read_technique(row, value, out, detail);
    }
    BD_ASSERT(!"no such type of parameter");
    return BD_ERR_INTERNAL;
}

static bool is_read(const struct bd_technique *technique, int param)
{
    return technique->params_read >> param & 1;
}

static enum bd_err refuse_key(const char *key, const struct bd_technique *technique,
                              struct bd_err_detail *detail)
{
    char hint[BD_NEAREST_HINT_BYTES];
    struct bd_nearest nearest;
    bd_nearest_begin(&nearest, key);
    for (int i = 0; i < BD_PARAM_COUNT; i++)
        if (is_read(technique, i)) bd_nearest_consider(&nearest, table[i].key);
    return bd_err_set(detail, BD_ERR_USAGE, key, "%s: no such parameter%s", key,
                      bd_nearest_hint(&nearest, hint));
}

static enum bd_err read_pair(const char *key, const char *value,
                             const struct bd_technique *technique, struct bd_params *out,
                             struct bd_err_detail *detail)
{
    for (int i = 0; i < BD_PARAM_COUNT; i++) {
        if (strcmp(table[i].key, key) != 0) continue;
        if (!is_read(technique, i))
            return bd_err_set(detail, BD_ERR_USAGE, key, "%s: technique %s does not read it", key,
                              technique->name);
        return read_value(&table[i], value, technique, out, detail);
    }
    return refuse_key(key, technique, detail);
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
                                 struct bd_err_detail *detail)
{
    const struct param_row *row = &table[BD_PARAM_MODEL_OF];
    if (!is_read(technique, BD_PARAM_MODEL_OF)) return BD_ERR_OK;
    for (uint32_t i = 0; i < list->count; i++) {
        if (strcmp(list->pairs[i].key, row->key) != 0) continue;
        enum bd_err err = read_technique(row, list->pairs[i].value, out, detail);
        if (err) return err;
    }
    if (out->model_of) preset(&bd_technique_at(out->model_of - 1)->model, out);
    return BD_ERR_OK;
}

static enum bd_err read_over_defaults(const struct bd_param_list *list,
                                      const struct bd_technique *technique, bool paper_mode,
                                      struct bd_params *out, struct bd_err_detail *detail)
{
    set_defaults(technique, paper_mode, out);
    enum bd_err unknown = read_model_of(list, technique, out, detail);
    if (unknown) return unknown;
    for (uint32_t i = 0; i < list->count; i++) {
        enum bd_err err =
            read_pair(list->pairs[i].key, list->pairs[i].value, technique, out, detail);
        if (err) return err;
    }
    return BD_ERR_OK;
}

enum bd_err bd_params_read(const struct bd_param_list *list, const struct bd_technique *technique,
                           struct bd_params *out, struct bd_err_detail *detail)
{
    enum bd_err err = read_over_defaults(list, technique, false, out, detail);
    if (err || !out->paper_mode) return err;
    return read_over_defaults(list, technique, true, out, detail);
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
                                  .what = row->what,
                                  .minimum = row->minimum,
                                  .maximum = row->maximum,
                                  .whole = row->type == PARAM_COUNT || row->type == PARAM_EVEN,
                                  .choices = row->choices};
    out->choice_count = choice_count(row, technique);
    if (row->type == PARAM_TECHNIQUE) out->choices = bd_technique_names(&out->choice_count);
    write_value(row, &defaults, out->standard, sizeof out->standard);
}

uint64_t bd_params_hash(const struct bd_params *params, bd_param_set which, uint64_t seed)
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
        BD_ASSERT_CMP(out->count, <, BD_PARAM_MAX);
        snprintf(out->pairs[out->count].key, BD_PARAM_KEY_MAX, "%s", table[i].key);
        write_value(&table[i], &copy, out->pairs[out->count].value, BD_PARAM_VALUE_MAX);
        out->count++;
    }
}

enum bd_err bd_param_list_add(struct bd_param_list *list, const char *key_equals_value,
                              struct bd_err_detail *detail)
{
    const char *equals = strchr(key_equals_value, '=');
    if (!equals || equals == key_equals_value)
        return bd_err_set(detail, BD_ERR_USAGE, "set", "%s: must be KEY=VALUE", key_equals_value);
    size_t key_length = (size_t)(equals - key_equals_value), value_length = strlen(equals + 1);
    if (key_length >= BD_PARAM_KEY_MAX || value_length >= BD_PARAM_VALUE_MAX)
        return bd_err_set(detail, BD_ERR_USAGE, "set", "%.60s: key or value is longer than %d",
                          key_equals_value, BD_PARAM_KEY_MAX - 1);
    if (list->count == BD_PARAM_MAX)
        return bd_err_set(detail, BD_ERR_LIMIT, "set", "more than %d parameters", BD_PARAM_MAX);
    memcpy(list->pairs[list->count].key, key_equals_value, key_length);
    list->pairs[list->count].key[key_length] = 0;
    memcpy(list->pairs[list->count].value, equals + 1, value_length + 1);
    list->count++;
    return BD_ERR_OK;
}
