// Morton order: the bits of x and y interleaved, x lowest.

uint every_second_bit(uint bits)
{
    bits &= 0x55555555u;
    bits = (bits | bits >> 1) & 0x33333333u;
    bits = (bits | bits >> 2) & 0x0f0f0f0fu;
    bits = (bits | bits >> 4) & 0x00ff00ffu;
    return (bits | bits >> 8) & 0x0000ffffu;
}

uvec2 place_of_morton(uint morton)
{
    return uvec2(every_second_bit(morton), every_second_bit(morton >> 1));
}
