// Which of the compiled widths of native loops this machine can run.

#include "pass/native/native.h"

#include <stdlib.h>
#include <string.h>

#include "pass/native/loops.h"

#define LOOP(field, name) .field = bd_native_##field##_##name,
#define LOOPS_OF(name)                                                                             \
    {                                                                                              \
        .width = #name, BD_NATIVE_EACH(LOOP, name)                                                 \
    }

// Narrowest first.
static const struct bd_native_loops widths[] = {
    LOOPS_OF(baseline),
#ifdef __x86_64__
    LOOPS_OF(avx2),
    LOOPS_OF(avx512),
#endif
};
#define WIDTH_COUNT (sizeof widths / sizeof *widths)

static bool machine_has(const char *width)
{
#ifdef __x86_64__
    __builtin_cpu_init();
    if (strcmp(width, "avx2") == 0) return __builtin_cpu_supports("avx2");
    if (strcmp(width, "avx512") == 0)
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw");
#endif
    return strcmp(width, "baseline") == 0;
}

const struct bd_native_loops *bd_native_loops_at(uint32_t index, const char **width)
{
    *width = index < WIDTH_COUNT ? widths[index].width : NULL;
    return *width && machine_has(*width) ? &widths[index] : NULL;
}

const struct bd_native_loops *bd_native_loops(void)
{
    const char *most = getenv("BD_NATIVE_WIDTH");
    const struct bd_native_loops *best = &widths[0];
    for (uint32_t i = 0; i < WIDTH_COUNT; i++) {
        if (machine_has(widths[i].width)) best = &widths[i];
        if (most && strcmp(most, widths[i].width) == 0) break;
    }
    return best;
}
