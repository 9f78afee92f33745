// Climbing a technique's ladder: from a request's own parameters to better and better ones.
//
// A rung is laid over what was given: keys that the ladder does not vary stay, and so does a 0,
// which leaves something out or is the best there is. Any thread.

#ifndef BD_FRAME_LADDER_H
#define BD_FRAME_LADDER_H

#include <stdbool.h>
#include <stdint.h>

#include "technique/technique.h"

// "KEY=VALUE KEY=VALUE" over what was given.
void bd_ladder_lay_over(const char *rung, const struct bd_param_list *given,
                        struct bd_param_list *out);

// Where to begin: with what was given if it names a parameter that the ladder varies, otherwise on
// the cheapest rung. Fills `out` and returns the rung that bd_ladder_climb goes on with.
uint32_t bd_ladder_begin(const struct bd_technique *technique, const struct bd_param_list *given,
                         struct bd_param_list *out);

// What costs least: the cheapest rung's values where those given, or else the technique's own, stand
// above them. False where none does, or the parameters are not to be read.
bool bd_ladder_cheapest(const struct bd_technique *technique, const struct bd_param_list *given,
                        struct bd_param_list *out);

// The next setting, from `*rung` on; false past the last.
bool bd_ladder_climb(const struct bd_technique *technique, const struct bd_param_list *given,
                     uint32_t *rung, struct bd_param_list *out);

// So many rungs above where the request stands, its defaults included; what was given where there
// are none. Returns how many there were.
uint32_t bd_ladder_above(const struct bd_technique *technique, const struct bd_param_list *given,
                         uint32_t rungs, struct bd_param_list *out);

#endif
