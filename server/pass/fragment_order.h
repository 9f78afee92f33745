// Fragments in an order in which neighbours in the list are neighbours in the picture: what is
// alike is in one group of receivers. Blocks of any level first, then pixels. Private to pass/.

#ifndef BD_PASS_FRAGMENT_ORDER_H
#define BD_PASS_FRAGMENT_ORDER_H

#include <stdint.h>

// Sorts packed fragments (shared/multires.h), blocks and then pixels, each by the Morton order of
// their first pixels, in pictures of up to 32,768 pixels a side; `spare` is room for as many.
void bd_fragment_order(uint32_t *fragments, uint64_t *spare, uint32_t count);

#endif
