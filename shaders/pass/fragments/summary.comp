// Counts, for the host and for indirect dispatches.
#include "pass/fragments/places.glsl"

layout(std430, binding = BD_STORAGE_FRAGMENT_SUMMARY) writeonly buffer summary_block
{
    bd_fragments_summary summary;
};
layout(std430, binding = BD_STORAGE_FRAGMENT_DISPATCH) writeonly buffer dispatch_block
{
    uvec4 dispatch_groups;
};

void main()
{
    uint level = gl_LocalInvocationIndex;
    if (level < args.multires.level_count)
        summary.first[level] = fragments_before(args.tiles[level].first_word);
    if (level > 0u) return;
    uint count = fragment_count(), groups = (count + BD_FRAGMENT_GROUP - 1u) / BD_FRAGMENT_GROUP;
    summary.fragment_count = count;
    dispatch_groups = uvec4(min(groups, BD_FRAGMENT_GROUPS_MAX),
                            (groups + BD_FRAGMENT_GROUPS_MAX - 1u) / BD_FRAGMENT_GROUPS_MAX, 1u, 0u);
}
