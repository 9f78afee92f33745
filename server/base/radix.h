// Numbered keys in order, digit by digit (least significant first): equal keys stay as they were.
//
// A pass over all of them takes some 10 ms a million. Any thread.

#ifndef BD_BASE_RADIX_H
#define BD_BASE_RADIX_H

#include <stddef.h>
#include <stdint.h>

struct bd_radix_entry {
    uint64_t key;
    uint32_t number;
};

#define BD_RADIX_BITS 11u

// One pass: by the digit that begins at bit `shift`, from one array of `count` into another. For
// keys of so many bits as many passes as have them, shift 0 first, each in its own slice of time.
void bd_radix_pass(const struct bd_radix_entry *from, struct bd_radix_entry *to, size_t count,
                   uint32_t shift);

#endif
