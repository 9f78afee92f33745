// What every fuzz target is: one function that takes any bytes and must neither crash, nor leak,
// nor break a promise of what it calls (those it checks with BD_ASSERT).

#ifndef BD_TESTS_FUZZ_TARGET_H
#define BD_TESTS_FUZZ_TARGET_H

#include <stddef.h>
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);

#endif
