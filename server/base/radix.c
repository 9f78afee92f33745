#include "base/radix.h"

#define DIGITS (1u << BD_RADIX_BITS)

static uint32_t digit_of(uint64_t key, uint32_t shift)
{
    return (uint32_t)(key >> shift) & (DIGITS - 1);
}

void bd_radix_pass(const struct bd_radix_entry *from, struct bd_radix_entry *to, size_t count,
                   uint32_t shift)
{
    size_t next[DIGITS] = {0}, first = 0;
    for (size_t i = 0; i < count; i++) next[digit_of(from[i].key, shift)]++;
    for (uint32_t d = 0; d < DIGITS; d++) {
        const size_t of_digit = next[d];
        next[d] = first;
        first += of_digit;
    }
    for (size_t i = 0; i < count; i++) to[next[digit_of(from[i].key, shift)]++] = from[i];
}
