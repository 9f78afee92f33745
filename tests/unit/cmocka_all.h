// cmocka wants these four before it, in this order, everywhere.
#ifndef BD_TESTS_UNIT_CMOCKA_ALL_H
#define BD_TESTS_UNIT_CMOCKA_ALL_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#endif
