#include "net/wire/offers.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "protocol/frame_options.h"
#include "protocol/json.h"
#include "technique/technique.h"

static char *text_or_none(const char *text)
{
    return text ? bd_answer_text(text) : NULL;
}

static Bounced__FrameOption *message_of(const struct bd_frame_option *option)
{
    char takes[BD_FRAME_OPTION_TAKES_BYTES];
    Bounced__FrameOption *out = bd_answer_zeroed(1, sizeof *out);
    bounced__frame_option__init(out);
    out->name = bd_answer_text(option->name);
    out->alias = text_or_none(option->alias);
    out->form = text_or_none(option->form);
    out->takes = bd_answer_text(bd_frame_option_takes(option, takes));
    out->standard = text_or_none(option->standard);
    out->help = bd_answer_text(option->help);
    size_t words = 0;
    while (option->words && option->words[words]) words++;
    out->words = bd_answer_zeroed(words + 1, sizeof *out->words);
    for (; out->n_words < words; out->n_words++)
        out->words[out->n_words] = bd_answer_text(option->words[out->n_words]);
    if (!(option->least < option->most)) return out;
    BD_SET(out, minimum, option->least);
    BD_SET(out, maximum, option->most);
    return out;
}

struct bd_answer bd_answer_options(void)
{
    Bounced__OptionsReply *reply = bd_answer_zeroed(1, sizeof *reply);
    bounced__options_reply__init(reply);
    reply->options = bd_answer_zeroed(bd_frame_option_count, sizeof *reply->options);
    for (; reply->n_options < bd_frame_option_count; reply->n_options++)
        reply->options[reply->n_options] = message_of(&bd_frame_options[reply->n_options]);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_OPTIONS_REPLY, reply);
}

// --- devices ---------------------------------------------------------------------------------

static void add(Bounced__DevicesReply *reply, Bounced__Device *device)
{
    Bounced__Device **devices =
        realloc(reply->devices, (reply->n_devices + 1) * sizeof(Bounced__Device *));
    BD_ASSERT(devices);
    reply->devices = devices;
    devices[reply->n_devices++] = device;
}

static void add_listed(Bounced__DevicesReply *reply, json_t *listed)
{
    struct bd_err_detail detail;
    ProtobufCMessage *message;
    // What --device takes has the name of the option there, and `spec` in the schema.
    json_object_set(listed, "spec", json_object_get(listed, "device"));
    if (bd_json_to_message(listed, &bounced__device__descriptor, &message, &detail)) {
        bd_log(BD_LOG_WARN, "net", "a device is not listed: %s", detail.message);
        return;
    }
    add(reply, (Bounced__Device *)message);
}

struct bd_answer bd_answer_devices(struct bd_sched *sched, const char *list_json)
{
    Bounced__DevicesReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__devices_reply__init(reply);
    struct bd_sched_stats stats;
    bd_sched_stats(sched, &stats);
    add(reply, bd_device_message(&stats));
    json_t *list = list_json ? json_loads(list_json, 0, NULL) : NULL;
    for (size_t i = 0; i < json_array_size(list); i++) add_listed(reply, json_array_get(list, i));
    json_decref(list);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_DEVICES_REPLY, reply);
}

// --- techniques ------------------------------------------------------------------------------

static size_t write_lights(uint32_t lights, char ***out)
{
    static const struct {
        enum bd_lights bit;
        const char *name;
    } kinds[] = {{BD_LIGHTS_PUNCTUAL, "punctual"},
                 {BD_LIGHTS_EMISSIVE, "emissive"},
                 {BD_LIGHTS_ENVIRONMENT, "environment"}};
    const size_t kind_count = sizeof kinds / sizeof kinds[0];
    size_t count = 0;
    *out = bd_answer_zeroed(kind_count, sizeof **out);
    for (size_t i = 0; i < kind_count; i++)
        if (lights & kinds[i].bit) (*out)[count++] = bd_answer_text(kinds[i].name);
    return count;
}

static Bounced__Model *model_message(const struct bd_model *model)
{
    Bounced__Model *out = bd_answer_zeroed(1, sizeof *out);
    bounced__model__init(out);
    BD_SET(out, indirect_bounces, model->indirect_bounces);
    BD_SET(out, indirect_visibility, model->indirect_visibility);
    out->n_lights = write_lights(model->lights, &out->lights);
    out->n_indirect_lights =
        write_lights(model->lights & model->indirect_lights, &out->indirect_lights);
    BD_SET(out, glossy_receivers, model->glossy_receivers);
    BD_SET(out, glossy_senders, model->glossy_senders);
    BD_SET(out, transmission, model->transmission);
    BD_SET(out, coverage, model->coverage);
    return out;
}

static Bounced__Parameter *parameter_message(const struct bd_technique *technique,
                                             enum bd_param param)
{
    struct bd_param_info info;
    bd_param_describe(technique, param, &info);
    Bounced__Parameter *out = bd_answer_zeroed(1, sizeof *out);
    bounced__parameter__init(out);
    out->key = bd_answer_text(info.key);
    out->what = bd_answer_text(info.what);
    out->standard = bd_answer_text(info.standard);
    out->choices = bd_answer_zeroed(info.choice_count, sizeof *out->choices);
    for (uint32_t i = 0; i < info.choice_count; i++)
        out->choices[out->n_choices++] = bd_answer_text(info.choices[i]);
    if (info.choice_count) return out;
    BD_SET(out, minimum, info.minimum);
    BD_SET(out, maximum, info.maximum);
    BD_SET(out, whole, info.whole);
    return out;
}

static void write_parameters(const struct bd_technique *technique, Bounced__Technique *out)
{
    out->parameters = bd_answer_zeroed(BD_PARAM_COUNT, sizeof *out->parameters);
    for (int i = 0; i < BD_PARAM_COUNT; i++)
        if (technique->params_read >> i & 1)
            out->parameters[out->n_parameters++] = parameter_message(technique, (enum bd_param)i);
}

static void write_ladder(const char *const *ladder, Bounced__Technique *out)
{
    size_t count = 0;
    while (ladder && ladder[count]) count++;
    out->ladder = bd_answer_zeroed(count, sizeof *out->ladder);
    for (size_t i = 0; i < count; i++) out->ladder[out->n_ladder++] = bd_answer_text(ladder[i]);
}

static Bounced__Technique *technique_message(const struct bd_technique *technique)
{
    Bounced__Technique *out = bd_answer_zeroed(1, sizeof *out);
    bounced__technique__init(out);
    out->name = bd_answer_text(technique->name);
    out->summary = bd_answer_text(technique->summary);
    out->model = model_message(&technique->model);
    write_parameters(technique, out);
    write_ladder(technique->ladder, out);
    BD_SET(out, tolerance_direct, technique->tolerance.direct);
    BD_SET(out, tolerance_indirect, technique->tolerance.indirect);
    if (technique->tolerance.settings)
        out->tolerance_settings = bd_answer_text(technique->tolerance.settings);
    out->hazard_codes = bd_answer_text(technique->hazard_codes);
    BD_SET(out, is_reference, technique->is_reference);
    BD_SET(out, for_comparison, technique->for_comparison);
    BD_SET(out, is_sampled, technique->is_sampled);
    BD_SET(out, is_default, technique == bd_technique_default);
    return out;
}

struct bd_answer bd_answer_techniques(void)
{
    size_t count = 0;
    while (bd_technique_at((uint32_t)count)) count++;
    Bounced__TechniquesReply *reply = bd_answer_zeroed(1, sizeof *reply);
    bounced__techniques_reply__init(reply);
    reply->techniques = bd_answer_zeroed(count, sizeof *reply->techniques);
    for (; reply->n_techniques < count; reply->n_techniques++)
        reply->techniques[reply->n_techniques] =
            technique_message(bd_technique_at((uint32_t)reply->n_techniques));
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_TECHNIQUES_REPLY, reply);
}
