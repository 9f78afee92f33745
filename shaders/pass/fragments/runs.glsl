// The prefix sum over tiles, in levels of its own: level 0 has a number for each tile, level s + 1 one
// for each run of level s, up to the level with one number, which is the sum of all. Each number is
// the sum of those before it in its run. The levels lie one after the other in one buffer.
#include "pass/fragments/tiles.glsl"

uint runs_of(uint count) { return (count + BD_FRAGMENT_SCAN_RUN - 1u) / BD_FRAGMENT_SCAN_RUN; }
