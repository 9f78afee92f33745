#include "pass/vpl_clusters.h"

#include "base/assert.h"
#include "pass/vpl_block.h"
#include "shared/bindings.h"
#include "shared/vpl_clusters.h"

struct clusters {
    const struct bd_pass_context *context;
    const struct bd_vpl_clusters_inputs *inputs;
    struct bd_fragments *faces[BD_LIGHT_FACES_MAX];
    struct bd_vpl_list *list;
};

// --- which blocks -----------------------------------------------------------------------------

static uint32_t level_of_side(uint32_t texels)
{
    uint32_t level = 0;
    while (1u << level < texels) level++;
    BD_ASSERT_CMP(1u << level, ==, texels);
    return level;
}

static enum bd_err cluster_face(struct clusters *c, uint32_t face, struct bd_err_detail *detail)
{
    const struct bd_rsm *rsm = c->inputs->rsm;
    const struct bd_viewpoint viewpoint =
        bd_light_setup_viewpoint(c->inputs->light, face, rsm->side_px);
    struct bd_discontinuity_inputs inputs = {
        .viewpoint = &viewpoint,
        .rsm = rsm,
        .face = face,
        .space = c->inputs->space,
        .settings = c->inputs->settings,
    };
    inputs.settings.finest_level = level_of_side(c->inputs->finest_block_texels);
    struct bd_discontinuity *discontinuity;
    enum bd_err err = bd_discontinuity_run(c->context, &inputs, &discontinuity, detail);
    if (err) return err;
    err = bd_fragments_run(c->context, &inputs, discontinuity, BD_REFINEMENT_ONE_PASS,
                           &c->faces[face], detail);
    bd_discontinuity_destroy(c->context->gpu, &discontinuity);
    return err;
}

static enum bd_err cluster_faces(struct clusters *c, uint32_t *count, struct bd_err_detail *detail)
{
    *count = 0;
    for (uint32_t face = 0; face < c->inputs->rsm->face_count; face++) {
        enum bd_err err = cluster_face(c, face, detail);
        if (err) return err;
        *count += c->faces[face]->count;
    }
    return BD_ERR_OK;
}

// --- their VPLs -------------------------------------------------------------------------------

struct slice {
    uint32_t face, first, count; // fragments
    uint32_t before;             // VPLs of the faces before
    bool group_per_vpl;
};

static void dispatch(const struct clusters *c, const struct bd_program *program,
                     const struct slice *slice)
{
    const struct bd_vpl_clusters_inputs *inputs = c->inputs;
    const struct bd_vpl_clusters_args args = {
        .block = bd_vpl_block_args(inputs->rsm, slice->face, inputs->kernel, inputs->near_field),
        .first_fragment = slice->first,
        .fragment_count = slice->count,
        .vpls_before = slice->before,
    };
    const struct bd_light_uniform light =
        bd_light_setup_uniform(inputs->light, inputs->space, inputs->rsm->side_px);
    struct bd_bindings bindings = {0};
    bd_vpl_block_bind(inputs->rsm, c->list, &bindings);
    bindings.storage[BD_STORAGE_FRAGMENT_LIST].buf = c->faces[slice->face]->list;
    bindings.storage[BD_STORAGE_FRAGMENT_LIST].read = true;
    bindings.uniforms[BD_UNIFORM_ARGS].bytes = &args;
    bindings.uniforms[BD_UNIFORM_ARGS].size_bytes = sizeof args;
    bindings.uniforms[BD_UNIFORM_LIGHT].bytes = &light;
    bindings.uniforms[BD_UNIFORM_LIGHT].size_bytes = sizeof light;
    uint32_t group[3] = {1, 1, 1};
    if (!slice->group_per_vpl) bd_program_group_size(program, group);
    bd_gpu_dispatch(c->context->gpu, program, &bindings, (slice->count + group[0] - 1) / group[0],
                    1, 1);
}

static enum bd_err get_program(const struct clusters *c, bool group_per_vpl,
                               struct bd_program **out, struct bd_err_detail *detail)
{
    struct bd_program_source source = {.compute = "pass/vpl_clusters/vpl_clusters.comp"};
    if (group_per_vpl) bd_define(&source.defines, "BD_GROUP_PER_VPL", 1);
    return bd_program_get(c->context->gpu, &source, out, detail);
}

#define GROUPS_MAX 65535u // of a dispatch along one axis

static enum bd_err fill_level(const struct clusters *c, uint32_t face, uint32_t level,
                              uint32_t before, struct bd_err_detail *detail)
{
    const struct bd_fragments *fragments = c->faces[face];
    struct slice slice = {.face = face, .before = before};
    slice.group_per_vpl = 1u << level > BD_VPL_BLOCK_SOLITARY_SIDE_MAX;
    const uint32_t end = fragments->level_first[level] + fragments->level_count[level];
    const double units = BD_VPL_BLOCK_UNITS_PER_TEXEL * (1u << level) * (1u << level);
    struct bd_program *program;
    enum bd_err err = get_program(c, slice.group_per_vpl, &program, detail);
    bd_slicer_work(c->context->slicer,
                   slice.group_per_vpl ? "vpl_clusters shared" : "vpl_clusters");
    for (slice.first = fragments->level_first[level]; !err && slice.first < end;
         slice.first += slice.count) {
        slice.count = bd_slicer_rows(c->context->slicer, units, end - slice.first);
        if (slice.count > GROUPS_MAX) slice.count = GROUPS_MAX;
        dispatch(c, program, &slice);
        err = bd_slicer_checkpoint(c->context->slicer, units * slice.count);
    }
    return err;
}

static enum bd_err fill_list(const struct clusters *c, struct bd_err_detail *detail)
{
    uint32_t before = 0;
    enum bd_err err = BD_ERR_OK;
    for (uint32_t face = 0; !err && face < c->inputs->rsm->face_count; face++) {
        const struct bd_fragments *fragments = c->faces[face];
        for (uint32_t level = 0; !err && level < fragments->layout.level_count; level++)
            if (fragments->level_count[level] > 0) err = fill_level(c, face, level, before, detail);
        before += fragments->count;
    }
    return err;
}

enum bd_err bd_vpl_clusters_run(const struct bd_pass_context *context,
                                const struct bd_vpl_clusters_inputs *inputs,
                                struct bd_vpl_list **out, struct bd_err_detail *detail)
{
    struct clusters c = {.context = context, .inputs = inputs};
    uint32_t count;
    enum bd_err err = cluster_faces(&c, &count, detail);
    if (!err) err = bd_vpl_list_create(context->gpu, count, &c.list, detail);
    if (!err) err = fill_list(&c, detail);
    for (uint32_t face = 0; face < BD_LIGHT_FACES_MAX; face++)
        bd_fragments_destroy(context->gpu, &c.faces[face]);
    if (err) {
        bd_vpl_list_destroy(context->gpu, &c.list);
        return err;
    }
    *out = c.list;
    return BD_ERR_OK;
}
