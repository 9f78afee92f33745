// What loops over lanes are written with. Private to pass/native/.
//
// Such a loop counts to BD_LANES, calls kernels, and has no branch: the compiler packs it whole
// (tests/native reads the objects). BD_WIDTH is the name of the width that a file is compiled for.

#ifndef BD_PASS_NATIVE_LANES_H
#define BD_PASS_NATIVE_LANES_H

#include "pass/f3_arrays.h"

#define LANES(i) for (size_t i = 0; i < BD_LANES; i++)

#define JOIN_(a, b) a##_##b
#define JOIN(a, b)  JOIN_(a, b)
#define WIDE(name)  JOIN(name, BD_WIDTH)

#endif
