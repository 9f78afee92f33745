#include "base/flags.h"

#include <string.h>

static const struct {
    const char *name, *what;
    bool fails;
} flags[BD_FLAG_COUNT] = {
#define X(name, fails, what) [BD_FLAG_##name] = {#name, what, fails},
    BD_FLAG_MAP(X)
#undef X
};

const char *bd_flag_name(enum bd_flag flag)
{
    return flag < BD_FLAG_COUNT ? flags[flag].name : NULL;
}

const char *bd_flag_what(enum bd_flag flag)
{
    return flag < BD_FLAG_COUNT ? flags[flag].what : NULL;
}

uint64_t bd_flags_that_fail(void)
{
    uint64_t set = 0;
    for (int f = 0; f < BD_FLAG_COUNT; f++)
        if (flags[f].fails) set |= UINT64_C(1) << f;
    return set;
}

enum bd_flag bd_flag_of(const char *text, uint32_t length)
{
    const char *colon = memchr(text, ':', length);
    size_t name_length = colon ? (size_t)(colon - text) : length;
    for (int f = 0; f < BD_FLAG_COUNT; f++)
        if (strlen(flags[f].name) == name_length && memcmp(flags[f].name, text, name_length) == 0)
            return (enum bd_flag)f;
    return BD_FLAG_COUNT;
}
