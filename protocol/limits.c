#include "protocol/limits.h"

#include <errno.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

const struct bd_limits bd_limits_default = {
#define X(name, value, least, most) .name = value,
    BD_LIMIT_MAP(X)
#undef X
};

static const struct {
    const char *name;
    size_t offset;
    uint64_t least, most;
} table[] = {
#define X(name, value, least, most) {#name, offsetof(struct bd_limits, name), least, most},
    BD_LIMIT_MAP(X)
#undef X
};

#define TABLE_COUNT (sizeof table / sizeof table[0])

static int find(const char *name, size_t length)
{
    for (size_t i = 0; i < TABLE_COUNT; i++)
        if (strlen(table[i].name) == length && memcmp(table[i].name, name, length) == 0)
            return (int)i;
    return -1;
}

static int suffix_shift(const char *suffix)
{
    if (*suffix == 0) return 0;
    if (suffix[1] != 0) return -1;
    switch (*suffix) {
    case 'K':
        return 10;
    case 'M':
        return 20;
    case 'G':
        return 30;
    default:
        return -1;
    }
}

bool bd_limits_parse(const char *text, uint64_t *out)
{
    if (*text < '0' || *text > '9') return false;
    char *end;
    errno = 0;
    uint64_t value = strtoull(text, &end, 10);
    int shift = suffix_shift(end);
    if (errno || shift < 0 || value > UINT64_MAX >> shift) return false;
    *out = value << shift;
    return true;
}

enum bd_err bd_limits_set(struct bd_limits *limits, const char *name_equals_value,
                          struct bd_err_detail *detail)
{
    const char *equals = strchr(name_equals_value, '=');
    if (!equals)
        return bd_err_set(detail, BD_ERR_USAGE, "limit", "a limit is NAME=VALUE, not \"%s\"",
                          name_equals_value);
    int index = find(name_equals_value, (size_t)(equals - name_equals_value));
    if (index < 0)
        return bd_err_set(detail, BD_ERR_USAGE, "limit", "there is no limit \"%.*s\"",
                          (int)(equals - name_equals_value), name_equals_value);
    uint64_t value;
    if (!bd_limits_parse(equals + 1, &value) || value < table[index].least || value > table[index].most)
        return bd_err_set(detail, BD_ERR_USAGE, table[index].name,
                          "limit %s goes from %llu to %llu, \"%s\" is not in it", table[index].name,
                          (unsigned long long)table[index].least,
                          (unsigned long long)table[index].most, equals + 1);
    memcpy((char *)limits + table[index].offset, &value, sizeof value);
    return BD_ERR_OK;
}

const char *bd_limits_get(const struct bd_limits *limits, uint32_t index, uint64_t *value)
{
    if (index >= TABLE_COUNT) return NULL;
    memcpy(value, (const char *)limits + table[index].offset, sizeof *value);
    return table[index].name;
}
