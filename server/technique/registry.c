// The table of techniques, and which of them `auto` is.

#include <stdio.h>
#include <string.h>
#include <threads.h>

#include "technique/technique.h"

// A technique registers here, once; clients, tests and the plan find it from then on.
static const struct bd_technique *const techniques[] = {
    &bd_technique_direct,
    &bd_technique_rsm,
    &bd_technique_rsm_splat,
    &bd_technique_multires_gather,
    &bd_technique_multires_splat,
    &bd_technique_isr,
    &bd_technique_hisr,
    &bd_technique_many_light,
    &bd_technique_ssbc,
    &bd_technique_photon,
    &bd_technique_point_projection,
    &bd_technique_reference,
};
#define TECHNIQUE_COUNT (sizeof techniques / sizeof techniques[0])

const struct bd_technique *const bd_technique_default = &bd_technique_many_light;

// What `auto` chooses from, what it likes best first.
static const struct bd_technique *const choices[] = {
    &bd_technique_many_light,
    &bd_technique_multires_gather,
    &bd_technique_hisr,
    &bd_technique_reference,
};

bool bd_technique_is_auto(const char *name)
{
    return !name[0] || strcmp(name, BD_TECHNIQUE_AUTO) == 0;
}

// Where none reads them the default says so.
static const struct bd_technique *choose(const struct bd_param_list *given)
{
    for (size_t i = 0; i < sizeof choices / sizeof *choices; i++)
        if (bd_params_are_read(given, choices[i])) return choices[i];
    return bd_technique_default;
}

const struct bd_technique *bd_technique_for(const char *name, const struct bd_param_list *given,
                                            struct bd_err_detail *detail)
{
    return bd_technique_is_auto(name) ? choose(given) : bd_technique_find(name, detail);
}

const struct bd_technique *bd_technique_at(uint32_t index)
{
    return index < TECHNIQUE_COUNT ? techniques[index] : NULL;
}

static const char *names[TECHNIQUE_COUNT];

static void collect_names(void)
{
    for (size_t i = 0; i < TECHNIQUE_COUNT; i++) names[i] = techniques[i]->name;
}

const char *const *bd_technique_names(uint32_t *count)
{
    static once_flag collected = ONCE_FLAG_INIT;
    call_once(&collected, collect_names);
    *count = TECHNIQUE_COUNT;
    return names;
}

const struct bd_technique *bd_technique_find(const char *name, struct bd_err_detail *detail)
{
    char known[256] = BD_TECHNIQUE_AUTO;
    for (size_t i = 0; i < TECHNIQUE_COUNT; i++) {
        if (strcmp(techniques[i]->name, name) == 0) return techniques[i];
        size_t used = strlen(known);
        snprintf(known + used, sizeof known - used, ", %s", techniques[i]->name);
    }
    (void)bd_err_set(detail, BD_ERR_USAGE, "technique", "%.40s: no such technique; known: %s", name,
                     known);
    return NULL;
}
