// Which block a texel of a multiresolution image stands for.
#include "common/blocks.glsl"

struct block_at {
    bool exists; // the stack is as wide as its widest level
    uint level;
    ivec2 block;
};

// BD_FINE: of level 0's texture, else of the stack.
block_at block_at_texel(ivec2 texel)
{
#ifdef BD_FINE
    return block_at(true, 0u, texel);
#else
    block_at at = block_at(false, 0u, ivec2(0));
    for (uint level = 1u; level <= coarsest_level(); level++) {
        ivec2 block = texel - in_stack(level, ivec2(0));
        bool inside = all(greaterThanEqual(block, ivec2(0))) &&
                      all(lessThan(block, blocks_of_level(level)));
        if (inside) at = block_at(true, level, block);
    }
    return at;
#endif
}
