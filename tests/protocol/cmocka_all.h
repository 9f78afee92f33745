// cmocka wants these four before it, in this order.
#ifndef BD_TESTS_CMOCKA_ALL_H
#define BD_TESTS_CMOCKA_ALL_H

// clang-format off
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>
// clang-format on

#endif
