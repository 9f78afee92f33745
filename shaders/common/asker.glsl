// Receivers that ask which VPLs they see: pixels of a tile; with BD_FRAGMENTS blocks of a list, in rows as wide
// as the tile.
#include "shared/choose.h"
#include "shared/bindings.h"
#ifdef BD_FRAGMENTS
#include "shared/multires.h"
#endif

layout(std140, binding = BD_UNIFORM_ARGS) uniform args_block { bd_choose_args args; };
#ifdef BD_FRAGMENTS
layout(std430, binding = BD_STORAGE_FRAGMENTS) readonly buffer fragments_block { uint fragments[]; };
#endif

// Where an answer is kept: among those of the slice, and in the picture.
struct asker_place {
    bool exists;
    uint index;  // in the slice
    uint level;  // 0: a pixel
    ivec2 block; // of that level
};

asker_place asker_place_at(uvec2 at)
{
    bool exists = all(lessThan(at, uvec2(args.tile_width, args.tile_height)));
    uint index = at.y * args.tile_width + at.x;
#ifdef BD_FRAGMENTS
    exists = exists && index < args.fragment_count;
    uint fragment = exists ? fragments[args.first_fragment + index] : 0u;
    return asker_place(exists, index, BD_FRAGMENT_LEVEL(fragment),
                       ivec2(BD_FRAGMENT_X(fragment), BD_FRAGMENT_Y(fragment)));
#else
    return asker_place(exists, index, 0u, ivec2(at + uvec2(args.tile_x, args.tile_y)));
#endif
}

uint asker_count() { return args.tile_width * args.tile_height; } // with those that do not exist
