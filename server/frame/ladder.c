#include "frame/ladder.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/assert.h"

// The next "KEY=VALUE" of a rung, from `*at` on; false at its end.
static bool next_pair(const char **at, struct bd_param_list *pair)
{
    char text[BD_PARAM_KEY_MAX + BD_PARAM_VALUE_MAX];
    *at += strspn(*at, " ");
    size_t length = strcspn(*at, " ");
    if (length == 0) return false;
    BD_ASSERT_CMP(length, <, sizeof text);
    memcpy(text, *at, length);
    text[length] = 0;
    *at += length;
    pair->count = 0;
    enum bd_err err = bd_param_list_add(pair, text, NULL);
    BD_ASSERT(!err);
    return true;
}

static const char *value_of(const struct bd_param_list *list, const char *key)
{
    const char *value = NULL;
    for (uint32_t i = 0; i < list->count; i++)
        if (strcmp(list->pairs[i].key, key) == 0) value = list->pairs[i].value;
    return value;
}

// False where the request is full of other keys; that one is refused by then.
static bool set(struct bd_param_list *list, const char *key, const char *value)
{
    bool is_set = false;
    // A repeated key is read by its last value: none may stay behind.
    for (uint32_t i = 0; i < list->count; i++) {
        if (strcmp(list->pairs[i].key, key) != 0) continue;
        strcpy(list->pairs[i].value, value);
        is_set = true;
    }
    if (is_set || list->count == BD_PARAM_MAX) return is_set;
    strcpy(list->pairs[list->count].key, key);
    strcpy(list->pairs[list->count++].value, value);
    return true;
}

static bool is_zero(const char *value)
{
    char *end;
    return value && strtod(value, &end) == 0 && end != value && *end == 0;
}

void bd_ladder_lay_over(const char *rung, const struct bd_param_list *given,
                        struct bd_param_list *out)
{
    struct bd_param_list pair;
    *out = *given;
    while (next_pair(&rung, &pair))
        if (!is_zero(value_of(given, pair.pairs[0].key)))
            set(out, pair.pairs[0].key, pair.pairs[0].value);
}

static bool names_any(const char *rung, const struct bd_param_list *given)
{
    struct bd_param_list pair;
    while (next_pair(&rung, &pair))
        if (value_of(given, pair.pairs[0].key)) return true;
    return false;
}

// Where a value stands among a key's values from rung to rung: on the rungs `lowest` to `highest`,
// which have it, or half a rung between two of them, or beyond an end. Whether values grow or fall
// on the way up, or do either, says nothing: what is better is what a later rung has.
struct standing {
    double lowest, highest;
};

static bool value_on(const char *rung, const char *key, double *value)
{
    struct bd_param_list pair;
    while (next_pair(&rung, &pair)) {
        if (strcmp(pair.pairs[0].key, key) != 0) continue;
        *value = strtod(pair.pairs[0].value, NULL);
        return true;
    }
    return false;
}

static bool is_between(double value, double a, double b)
{
    return (a < value && value < b) || (b < value && value < a);
}

static struct standing standing_of(const char *const *ladder, const char *key, double value)
{
    struct standing on = {-1, -1}, between = {-1, -1};
    double before, here, first = 0, last = 0;
    uint32_t count = 0;
    for (; ladder[count] && value_on(ladder[count], key, &here); before = here, count++) {
        if (here == value && on.lowest < 0) on.lowest = count;
        if (here == value) on.highest = count;
        if (count > 0 && between.lowest < 0 && is_between(value, before, here))
            between = (struct standing){count - 0.5, count - 0.5};
        if (count == 0) first = here;
        last = here;
    }
    if (on.lowest >= 0) return on;
    if (between.lowest >= 0) return between;
    double end = fabs(value - first) <= fabs(value - last) ? -0.5 : count - 0.5;
    return (struct standing){end, end};
}

// Nothing that was given is better than the rung's, and something is worse.
static bool is_above(const char *const *ladder, uint32_t rung, const struct bd_param_list *given)
{
    struct bd_param_list pair;
    bool above = false;
    for (const char *at = ladder[rung]; next_pair(&at, &pair);) {
        const char *key = pair.pairs[0].key, *value = value_of(given, key);
        if (!value || is_zero(value)) continue;
        const struct standing standing = standing_of(ladder, key, strtod(value, NULL));
        if (standing.lowest > rung) return false;
        above = above || standing.highest < rung;
    }
    return above;
}

uint32_t bd_ladder_begin(const struct bd_technique *technique, const struct bd_param_list *given,
                         struct bd_param_list *out)
{
    const char *const *ladder = technique->ladder;
    *out = *given;
    if (!ladder || !ladder[0]) return 0;
    if (!names_any(ladder[0], given)) {
        bd_ladder_lay_over(ladder[0], given, out);
        return 1;
    }
    uint32_t rung = 0;
    while (ladder[rung] && !is_above(ladder, rung, given)) rung++;
    return rung;
}

bool bd_ladder_cheapest(const struct bd_technique *technique, const struct bd_param_list *given,
                        struct bd_param_list *out)
{
    const char *const *ladder = technique->ladder;
    struct bd_params read;
    struct bd_param_list whole, pair;
    if (!ladder || !ladder[0] || bd_params_read(given, technique, &read, NULL)) return false;
    bd_params_write(&read, technique, &whole);
    *out = *given;
    bool is_cheaper = false;
    for (const char *at = ladder[0]; next_pair(&at, &pair);) {
        const char *key = pair.pairs[0].key, *value = value_of(&whole, key);
        if (!value || standing_of(ladder, key, strtod(value, NULL)).lowest <= 0) continue;
        is_cheaper |= set(out, key, pair.pairs[0].value);
    }
    // A budget over all lights takes the place of what each would have.
    const char *vpls = value_of(out, "vpls");
    if (vpls && read.vpl_budget > strtod(vpls, NULL)) is_cheaper |= set(out, "vpl_budget", "0");
    return is_cheaper;
}

bool bd_ladder_climb(const struct bd_technique *technique, const struct bd_param_list *given,
                     uint32_t *rung, struct bd_param_list *out)
{
    const char *const *ladder = technique->ladder;
    if (!ladder || !ladder[*rung]) return false;
    bd_ladder_lay_over(ladder[(*rung)++], given, out);
    return true;
}

uint32_t bd_ladder_above(const struct bd_technique *technique, const struct bd_param_list *given,
                         uint32_t rungs, struct bd_param_list *out)
{
    struct bd_params params;
    struct bd_param_list all, ignored;
    *out = *given;
    if (rungs == 0 || bd_params_read(given, technique, &params, NULL)) return 0;
    bd_params_write(&params, technique, &all);
    uint32_t rung = bd_ladder_begin(technique, &all, &ignored), taken = 0;
    while (taken < rungs && bd_ladder_climb(technique, given, &rung, out)) taken++;
    return taken;
}
