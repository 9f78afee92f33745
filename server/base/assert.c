#include "base/assert.h"

#include <stdio.h>
#include <stdlib.h>

void bd_assert_fail(const char *file, int line, const char *expression)
{
    fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, expression);
    abort();
}

void bd_assert_fail_cmp(const char *file, int line, const char *expression, long long left,
                        long long right)
{
    fprintf(stderr, "%s:%d: assertion failed: %s (%lld against %lld)\n", file, line, expression,
            left, right);
    abort();
}
