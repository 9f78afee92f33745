#include "frame/ladder.h"

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

static void set(struct bd_param_list *list, const char *key, const char *value)
{
    uint32_t i = 0;
    while (i < list->count && strcmp(list->pairs[i].key, key) != 0) i++;
    if (i == BD_PARAM_MAX) return; // the request is full of other keys; that one is refused by then
    if (i == list->count) list->count++;
    strcpy(list->pairs[i].key, key);
    strcpy(list->pairs[i].value, value);
}

static void lay_over(const char *rung, const struct bd_param_list *given, struct bd_param_list *out)
{
    struct bd_param_list pair;
    *out = *given;
    while (next_pair(&rung, &pair)) {
        // A repeated key is read by its last value: none may stay behind.
        for (uint32_t i = 0; i < out->count; i++)
            if (strcmp(out->pairs[i].key, pair.pairs[0].key) == 0)
                strcpy(out->pairs[i].value, pair.pairs[0].value);
        set(out, pair.pairs[0].key, pair.pairs[0].value);
    }
}

static bool names_any(const char *rung, const struct bd_param_list *given)
{
    struct bd_param_list pair;
    while (next_pair(&rung, &pair))
        if (value_of(given, pair.pairs[0].key)) return true;
    return false;
}

static double number_in(const char *rung, const char *key)
{
    struct bd_param_list pair;
    while (next_pair(&rung, &pair))
        if (strcmp(pair.pairs[0].key, key) == 0) return strtod(pair.pairs[0].value, NULL);
    return 0;
}

// 1 where a key's values grow from the cheapest rung to the best, -1 where they fall (thresholds).
static double direction_of(const char *const *ladder, const char *key)
{
    uint32_t best = 0;
    while (ladder[best + 1]) best++;
    return number_in(ladder[best], key) < number_in(ladder[0], key) ? -1 : 1;
}

// No value cheaper than what was given, and one better.
static bool is_above(const char *const *ladder, const char *rung, const struct bd_param_list *given)
{
    struct bd_param_list pair;
    bool above = false;
    while (next_pair(&rung, &pair)) {
        const char *value = value_of(given, pair.pairs[0].key);
        if (!value) continue;
        double better = direction_of(ladder, pair.pairs[0].key);
        double has = better * strtod(value, NULL);
        double would = better * strtod(pair.pairs[0].value, NULL);
        if (would < has) return false;
        above = above || would > has;
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
        lay_over(ladder[0], given, out);
        return 1;
    }
    uint32_t rung = 0;
    while (ladder[rung] && !is_above(ladder, ladder[rung], given)) rung++;
    return rung;
}

bool bd_ladder_climb(const struct bd_technique *technique, const struct bd_param_list *given,
                     uint32_t *rung, struct bd_param_list *out)
{
    const char *const *ladder = technique->ladder;
    if (!ladder || !ladder[*rung]) return false;
    lay_over(ladder[(*rung)++], given, out);
    return true;
}
