// Receivers and VPLs that the tests of the processor's loops have in common: made up, the same each
// time, with lanes and VPLs of every kind that a loop treats by itself.

#ifndef BD_TESTS_NATIVE_STAGE_H
#define BD_TESTS_NATIVE_STAGE_H

#include <stdbool.h>
#include <stdint.h>

#include "pass/native/native.h"
#include "shared/vpl.h"

#define VPLS     2100u // two ranges of sums and a part, that ends within a block
#define IN_PLANE 7u    // every so many VPLs lie in a wall that receivers lie in, too
#define WORDS    ((VPLS + 31) / 32)

struct stage {
    struct bd_receivers receivers;
    struct bd_vec4 vpls[VPLS * BD_VPL_VEC4S], quads[VPLS * BD_VPL_QUAD_VEC4S];
};

// The caller's. With its first receiver where nothing was seen.
struct stage *set_stage(void);
// A square of .05, with a limit of about three times that.
void set_vpl(struct stage *s, uint32_t v, struct bd_vec4 at, struct bd_vec4 n);

// Numbers that seem random, from where `begin_chance` says.
void begin_chance(uint64_t seed);
float chance(void); // [-1, 1]
struct bd_vec4 unit(void);
void put(struct bd_lanes3 *lanes, uint32_t i, struct bd_vec4 v);

// A bit for each VPL and receiver, from odd lanes. The caller's.
uint32_t *some_hidden(void);

extern const struct bd_native_wishes wishes[6];
#define WISHES (sizeof wishes / sizeof *wishes)
// Light of all VPLs.
struct bd_receiver_light gather(const struct bd_native_loops *loops, const struct stage *s,
                                struct bd_native_wishes wish);

// In double precision: as the formulas are printed.
double dot(const double a[3], const double b[3]);
bool is_above_plane(double height, double r2);

#endif
