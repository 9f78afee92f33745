// What the roots of a light's tree by themselves send to each receiver, added to its estimate.
#define BD_ESTIMATE
#include "common/tree_choice.glsl"

layout(local_size_x = 8, local_size_y = 8) in;

void main()
{
    asker_place asker = asker_place_at(gl_GlobalInvocationID.xy);
    if (!asker.exists) return;
    ivec2 pixel;
    receiver r = asker_receiver(asker, pixel);
    uint steps = r.lit ? estimated_steps(r) : 0u;
    estimates[asker.index] = tree_args.is_first != 0u ? steps : estimates[asker.index] + steps;
}
