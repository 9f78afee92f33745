// `bounce techniques`.

#include <stdio.h>
#include <stdlib.h>

#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/help.h"
#include "clients/cli/options.h"
#include "clients/cli/report.h"

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
        printf("%s%s", i ? " and " : ", ", model->lights[i]);
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
    printf("  %-11s ", or_empty(parameter->key));
    for (size_t i = 0; i < parameter->n_choices; i++)
        printf("%s%s", i ? "|" : "", parameter->choices[i]);
    if (!parameter->n_choices) printf("%.9g to %.9g", parameter->minimum, parameter->maximum);
    printf(", default %s\n", or_empty(parameter->standard));
}

static void print_technique(const Bounced__Technique *technique)
{
    printf("%-10s %s\n", or_empty(technique->name), or_empty(technique->summary));
    if (technique->model) print_model(technique->model);
    printf("  tolerance   direct %g %%", 100 * technique->tolerance_direct);
    if (technique->tolerance_indirect > 0)
        printf(", indirect %g %%", 100 * technique->tolerance_indirect);
    fputs(" against closed forms of its model\n", stdout);
    for (size_t i = 0; i < technique->n_parameters; i++) print_parameter(technique->parameters[i]);
}

static enum bd_err print_techniques(const Bounced__TechniquesReply *reply, bool json,
                                    struct bd_fault *fault)
{
    for (size_t i = 0; !json && i < reply->n_techniques; i++) {
        if (i) putchar('\n');
        print_technique(reply->techniques[i]);
    }
    if (!json) return BD_ERR_OK;
    char *text = bd_cli_report_json(&reply->base);
    if (!text) return bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the answer");
    fputs(text, stdout);
    free(text);
    return BD_ERR_OK;
}

static enum bd_err list_techniques(const struct bd_cli_common *common, struct bd_fault *fault)
{
    struct bd_cli_conn *conn = NULL;
    enum bd_err err = bd_cli_conn_open(common, BD_CLI_CONN_RUNNING_OR_START, &conn, fault);
    if (err) return err;
    Bounced__Techniques techniques = BOUNCED__TECHNIQUES__INIT;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_TECHNIQUES;
    envelope.techniques = &techniques;
    struct bd_cli_answer answer;
    err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_TECHNIQUES_REPLY, NULL,
                           &answer, fault);
    if (!err) err = print_techniques(answer.envelope->techniques_reply, common->json, fault);
    bd_cli_answer_finish(&answer);
    bd_cli_conn_close(&conn);
    return err;
}

int bd_cmd_techniques(const char *const *words, int count)
{
    struct bd_cli_common common;
    struct bd_fault fault = {0};
    const char *operands[1];
    int operand_count;
    bool help;
    enum bd_err err =
        bd_cli_parse_plain(words, count, &common, operands, 0, &operand_count, &help, &fault);
    if (!err && help) return bd_help_techniques();
    if (!err) err = list_techniques(&common, &fault);
    return err ? bd_cmd_fail(err, &fault, common.json) : 0;
}
