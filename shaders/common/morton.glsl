// Places in Morton order.
#include "kernel/morton.h"

uvec2 place_of_morton(uint morton)
{
    return uvec2(every_second_bit(morton), every_second_bit(morton >> 1));
}
