// `bounce techniques`.

#include <stdio.h>

#include "clients/cli/commands.h"
#include "clients/cli/help.h"
#include "clients/cli/list.h"
#include "clients/cli/print.h"

static const char *or_empty(const char *text)
{
    return text ? text : "";
}

static void print_bounces(const Bounced__Model *model)
{
    if (model->indirect_bounces == UINT32_MAX)
        fputs("unlimited bounces", stdout);
    else
        printf("%u bounce%s", model->indirect_bounces, model->indirect_bounces == 1 ? "" : "s");
}

// The model in one line, what it has alone: "1 bounce, punctual lights, glossy receivers".
static void print_model(const Bounced__Model *model)
{
    fputs("  model       ", stdout);
    print_bounces(model);
    for (size_t i = 0; i < model->n_lights; i++)
        bd_cli_print(stdout, "%s%s", i ? " and " : ", ", model->lights[i]);
    fputs(model->n_lights ? " lights" : ", no lights", stdout);
    if (model->indirect_visibility) fputs(", indirect visibility", stdout);
    if (model->glossy_receivers) fputs(", glossy receivers", stdout);
    if (model->glossy_senders) fputs(", glossy senders", stdout);
    if (model->transmission) fputs(", transmission", stdout);
    if (model->coverage) fputs(", coverage", stdout);
    putchar('\n');
}

static void print_parameter(const Bounced__Parameter *parameter)
{
    bd_cli_print(stdout, "  %-11s ", or_empty(parameter->key));
    for (size_t i = 0; i < parameter->n_choices; i++)
        bd_cli_print(stdout, "%s%s", i ? "|" : "", parameter->choices[i]);
    if (!parameter->n_choices) printf("%.9g to %.9g", parameter->minimum, parameter->maximum);
    bd_cli_print_line(stdout, ", default %s: %s", or_empty(parameter->standard),
                      or_empty(parameter->what));
}

static void print_technique(const Bounced__Technique *technique)
{
    bd_cli_print_line(stdout, "%-10s %s%s", or_empty(technique->name), or_empty(technique->summary),
                      technique->is_default ? " (default)" : "");
    if (technique->model) print_model(technique->model);
    printf("  tolerance   direct %g %%", 100 * technique->tolerance_direct);
    if (technique->tolerance_indirect > 0)
        printf(", indirect %g %%", 100 * technique->tolerance_indirect);
    fputs(" against closed forms of its model", stdout);
    if (technique->tolerance_settings)
        bd_cli_print(stdout, ", at %s", technique->tolerance_settings);
    putchar('\n');
    for (size_t i = 0; i < technique->n_parameters; i++) print_parameter(technique->parameters[i]);
}

static void print_techniques(const Bounced__Envelope *answer)
{
    const Bounced__TechniquesReply *reply = answer->techniques_reply;
    for (size_t i = 0; i < reply->n_techniques; i++) {
        if (i) putchar('\n');
        print_technique(reply->techniques[i]);
    }
}

static const ProtobufCMessage *body_of(const Bounced__Envelope *answer)
{
    return &answer->techniques_reply->base;
}

int bd_cmd_techniques(const char *const *words, int count)
{
    Bounced__Techniques request = BOUNCED__TECHNIQUES__INIT;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_TECHNIQUES;
    envelope.techniques = &request;
    const struct bd_cli_list list = {
        .kind = BD_CLI_CONN_RUNNING_OR_START,
        .request = &envelope,
        .want = BOUNCED__ENVELOPE__BODY_TECHNIQUES_REPLY,
        .body = body_of,
        .print = print_techniques,
        .help = bd_help_techniques,
    };
    return bd_cli_list(&list, words, count);
}
