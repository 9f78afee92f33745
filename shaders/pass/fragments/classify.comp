// Which blocks are fragments: a word of the mask for each half tile.
//
// One pass: every block decides for itself, by its parent's flag (algorithms.md A2.1). Iterative
// (BD_ITERATIVE): one dispatch a level, from the coarsest; a block is reached only if its parent was and
// is split. Flags that are monotone, as they are, make both the same.
//
// Below the finest level there are lone pixels, and blocks (BD_LONE_PIXELS).
//
// What a pixel is, the flags of level 1 tell. BD_ONE_LEVEL: there are none, and pixels are looked at;
// BD_GLOSSY: for glossy receivers alone, as the flags are (pass/glossy_blocks). BD_UNLIT: for those that have no
// light yet (pass/shared_light).
#include "common/seen_surface.glsl"
#include "pass/fragments/tiles.glsl"
#ifdef BD_LONE_PIXELS
#include "common/one_surface.glsl"
layout(binding = BD_UNIT_BLOCK_REPRESENTATIVE) uniform usampler2D representative;
#endif

layout(binding = BD_UNIT_BLOCK_FLAGS) uniform usampler2D flags;
layout(std430, binding = BD_STORAGE_FRAGMENT_MASKS) writeonly buffer mask_block { uint masks[]; };
#ifdef BD_ITERATIVE
layout(std430, binding = BD_STORAGE_REACHED_MASKS) buffer reached_block { uint reached_masks[]; };
#endif

#ifdef BD_UNLIT
layout(binding = BD_UNIT_LIT) uniform sampler2D lit;
#endif

#ifdef BD_ONE_LEVEL
bool is_member(ivec2 pixel)
{
#ifdef BD_GLOSSY
    float metallic = texelFetch(gbuffer_albedo, pixel, 0).a;
    if (!has_glossy_lobe(metallic, texelFetch(gbuffer_material, pixel, 0).x)) return false;
#endif
#ifdef BD_UNLIT
    if (texelFetch(lit, pixel, 0).a > 0.0) return false;
#endif
    return seen_lit(pixel, args.face);
}
#endif

// Of a block of the level, from 1 on, or of a place where it has none.
uint word_of(uint level, uvec2 block)
{
    bd_multires_level size = args.multires.levels[level];
    return multires_has(size, block) ? texelFetch(flags, multires_texel(size, block), 0).x : BD_BLOCK_EMPTY;
}

// Of a block of the level, whose parent has that word.
uint kind_of(uint level, uvec2 block, uint parent)
{
#ifdef BD_ONE_LEVEL
    bool inside = multires_has(args.multires.levels[0], block);
    return inside && is_member(ivec2(block)) ? BD_BLOCK_SMOOTH : BD_BLOCK_EMPTY;
#else
    uint i = (block.x & 1u) + 2u * (block.y & 1u);
    if (level == 0u) return BD_BLOCK_CHILDREN(parent) >> i & BD_BLOCK_SMOOTH;
    return BD_BLOCK_KIND(word_of(level, block));
#endif
}

bool is_reached(uint level, uvec2 block)
{
#ifdef BD_ITERATIVE
    return (reached_masks[half_tile_of(level, block)] >> bit_of(block) & 1u) != 0u;
#else
    return true;
#endif
}

bool is_split(uint level, uvec2 block, uint word)
{
    if (level <= args.finest_level) return false; // its blocks are whole, whatever they hold
    if (level == args.multires.level_count) return true; // the coarsest level's blocks have no parent
    return BD_BLOCK_KIND(word) == BD_BLOCK_DISCONTINUOUS && is_reached(level, block);
}

#ifdef BD_LONE_PIXELS
receiver receiver_of(uint level, uvec2 block)
{
    uint pixel = BD_PIXEL_PACK(block.x, block.y);
    if (level > 0u)
        pixel = texelFetch(representative, multires_texel(args.multires.levels[level], block), 0).x;
    return gbuffer_receiver(ivec2(BD_PIXEL_X(pixel), BD_PIXEL_Y(pixel)));
}

// What a block is lit for is its geometric normal; the irradiance vector tells of normals near that one.
const float NEAR_NORMALS_CHORD = 0.4;
const int ENOUGH_BESIDE = 3;

bool is_lit_by(receiver here, receiver there)
{
    return is_one_surface(here, there) && distance(here.normal, there.normal_geometric) <= NEAR_NORMALS_CHORD;
}

// Whether light of the level above cannot be interpolated here: neither from the parent, nor from most
// of those around it that pass/upsample asks, the three beside it on this side and the two opposite. One of
// those alone may be another surface that happens to lie in the plane of this one, leaves above all.
// All of them hold light that have pixels to be lit.
bool is_lone(uint level, uvec2 block)
{
    const ivec2 steps[6] = ivec2[6](ivec2(0, 0), ivec2(1, 0), ivec2(0, 1), ivec2(-1, 0), ivec2(0, -1),
                                    ivec2(1, 1));
    ivec2 parent = ivec2(block >> 1u), side = ivec2(block & 1u) * 2 - 1;
    receiver here = receiver_of(level, block);
    int found = 0;
    for (int i = 0; i < 6 && found < ENOUGH_BESIDE; i++) {
        uvec2 at = uvec2(parent + side * steps[i]); // below 0 it wraps, and no level has such a block
        if (BD_BLOCK_KIND(word_of(level + 1u, at)) == BD_BLOCK_EMPTY) continue;
        if (is_lit_by(here, receiver_of(level + 1u, at))) found += i == 0 ? ENOUGH_BESIDE : 1;
    }
    return found < ENOUGH_BESIDE;
}

// Of a level below the finest.
uint lone_mask(uint level, uvec2 first)
{
    uint asked = 0u, lone = 0u;
    for (uint i = 0u; i < 8u; i++) {
        uvec2 in_half = 2u * uvec2(i % 4u, i / 4u), parent = (first + in_half) / 2u;
        uint whole = word_of(args.finest_level, parent >> (args.finest_level - level - 1u));
        if (BD_BLOCK_KIND(whole) != BD_BLOCK_DISCONTINUOUS) continue;
        uint children = BD_BLOCK_CHILDREN(word_of(level + 1u, parent));
        asked |= ((children & 3u) | (children & 12u) << 6) << (8u * in_half.y + in_half.x);
    }
    while (asked != 0u) {
        uint i = uint(findLSB(asked));
        asked &= asked - 1u;
        if (is_lone(level, first + uvec2(i % 8u, i / 8u))) lone |= 1u << i;
    }
    return lone;
}
#endif

void main()
{
    uint half_tile = item_index();
    if (half_tile >= args.end_item) return;
    uint level = level_of_tile(half_tile >> 1u);
    uvec2 first = first_block(level, half_tile);
    uint mask = 0u, reached = 0u;
#ifdef BD_LONE_PIXELS
    if (level < args.finest_level) {
        masks[half_tile] = lone_mask(level, first);
        return;
    }
#endif
    bool finest = level == args.finest_level;
    for (uint parent = 0u; parent < 8u; parent++) {
        uvec2 in_half = 2u * uvec2(parent % 4u, parent / 4u);
        uvec2 block = (first + in_half) / 2u;
        uint word = level + 1u < args.multires.level_count ? word_of(level + 1u, block) : BD_BLOCK_EMPTY;
        if (!is_split(level + 1u, block, word)) continue;
        for (uint i = 0u; i < 4u; i++) {
            uvec2 at = in_half + uvec2(i & 1u, i >> 1u);
            uint flag = kind_of(level, first + at, word), bit = 1u << (8u * at.y + at.x);
            if (flag != BD_BLOCK_EMPTY) reached |= bit;
            if (flag == BD_BLOCK_SMOOTH || (finest && flag != BD_BLOCK_EMPTY)) mask |= bit;
        }
    }
    masks[half_tile] = mask;
#ifdef BD_ITERATIVE
    reached_masks[half_tile] = reached;
#endif
}
