#include "sched/reference_filter.h"

#include "image/light_filter.h"

static const struct {
    enum bd_layer light, half[2];
} filtered[] = {
    {BD_LAYER_DIRECT, {BD_LAYER_HALF_A + 1, BD_LAYER_HALF_B + 1}},
    {BD_LAYER_INDIRECT, {BD_LAYER_HALF_A + 2, BD_LAYER_HALF_B + 2}},
};
#define FILTERED_COUNT (sizeof filtered / sizeof *filtered)

uint32_t bd_reference_filter_layers(void)
{
    uint32_t layers = 1u << BD_LAYER_BEAUTY | 1u << BD_LAYER_EMISSION | 1u << BD_LAYER_ALBEDO |
                      1u << BD_LAYER_NORMAL | 1u << BD_LAYER_DEPTH;
    for (size_t i = 0; i < FILTERED_COUNT; i++)
        layers |= 1u << filtered[i].light | 1u << filtered[i].half[0] | 1u << filtered[i].half[1];
    return layers;
}

// A pass, whose rows are the loop's items.
struct filtering {
    const struct bd_runner_caller *caller;
    struct bd_light_filter *filter;
    uint32_t pass;
    bd_reference_should_stop should_stop;
    void *user;
};

static void filter_row(void *user, uint32_t y_px)
{
    struct filtering *filtering = user;
    bd_light_filter_row(filtering->filter, filtering->pass, y_px);
}

static enum bd_err should_stop_filtering(void *user)
{
    struct filtering *filtering = user;
    return filtering->should_stop(filtering->user);
}

static enum bd_err filter_light(struct bd_reference_runner *runner, struct filtering *filtering,
                                const struct bd_light_filter_inputs *inputs, struct bd_image *light,
                                struct bd_err_detail *detail)
{
    enum bd_err err = bd_light_filter_create(inputs, &filtering->filter, detail);
    if (err) return err;
    const uint32_t passes = bd_light_filter_pass_count(filtering->filter);
    for (filtering->pass = 0; !err && filtering->pass < passes; filtering->pass++)
        err = bd_reference_runner_loop(runner, filtering->caller, light->height_px, filter_row,
                                       should_stop_filtering, filtering);
    if (!err) bd_light_filter_store(filtering->filter, light);
    bd_light_filter_destroy(&filtering->filter);
    return err;
}

enum bd_err bd_reference_filter(struct bd_reference_runner *runner,
                                const struct bd_runner_caller *caller,
                                struct bd_image *const layers[BD_LAYER_COUNT],
                                bd_reference_should_stop should_stop, void *user,
                                struct bd_err_detail *detail)
{
    struct filtering filtering = {.caller = caller, .should_stop = should_stop, .user = user};
    enum bd_err err = BD_ERR_OK;
    for (size_t i = 0; !err && i < FILTERED_COUNT; i++) {
        const struct bd_light_filter_inputs inputs = {
            .half = {layers[filtered[i].half[0]], layers[filtered[i].half[1]]},
            .albedo = layers[BD_LAYER_ALBEDO],
            .normal = layers[BD_LAYER_NORMAL],
            .depth = layers[BD_LAYER_DEPTH],
        };
        err = filter_light(runner, &filtering, &inputs, layers[filtered[i].light], detail);
    }
    const struct bd_image *const parts[] = {layers[BD_LAYER_DIRECT], layers[BD_LAYER_INDIRECT],
                                            layers[BD_LAYER_EMISSION]};
    if (!err) bd_light_add_up(parts, layers[BD_LAYER_BEAUTY]);
    return err;
}
