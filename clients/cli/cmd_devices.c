// `bounce devices`.

#include <stdio.h>
#include <stdlib.h>

#include "clients/cli/commands.h"
#include "clients/cli/conn.h"
#include "clients/cli/help.h"
#include "clients/cli/options.h"
#include "clients/cli/report.h"

static void print_device(const Bounced__Device *device)
{
    printf("%c %-12s %s%s", device->in_use ? '*' : ' ', device->spec ? device->spec : "",
           device->name ? device->name : "", device->software ? " (software)" : "");
    if (device->has_memory_mib) printf(", %.0f MiB", device->memory_mib);
    if (device->error && device->error[0]) printf(": %s", device->error);
    putchar('\n');
}

static enum bd_err print_devices(const Bounced__DevicesReply *reply, bool json,
                                 struct bd_fault *fault)
{
    for (size_t i = 0; !json && i < reply->n_devices; i++) print_device(reply->devices[i]);
    if (!json) return BD_ERR_OK;
    char *text = bd_cli_report_json(&reply->base);
    if (!text) return bd_fault_set(fault, BD_ERR_NO_MEMORY, "", "no memory for the answer");
    fputs(text, stdout);
    free(text);
    return BD_ERR_OK;
}

static enum bd_err list_devices(const struct bd_cli_common *common, struct bd_fault *fault)
{
    struct bd_cli_conn *conn = NULL;
    enum bd_err err = bd_cli_conn_open(common, BD_CLI_CONN_RUNNING_OR_START, &conn, fault);
    if (err) return err;
    Bounced__Devices devices = BOUNCED__DEVICES__INIT;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_DEVICES;
    envelope.devices = &devices;
    struct bd_cli_answer answer;
    err = bd_cli_conn_call(conn, &envelope, NULL, 0, BOUNCED__ENVELOPE__BODY_DEVICES_REPLY, NULL,
                           &answer, fault);
    if (!err) err = print_devices(answer.envelope->devices_reply, common->json, fault);
    bd_cli_answer_finish(&answer);
    bd_cli_conn_close(&conn);
    return err;
}

int bd_cmd_devices(const char *const *words, int count)
{
    struct bd_cli_common common;
    struct bd_fault fault = {0};
    const char *operands[1];
    int operand_count;
    bool help;
    enum bd_err err =
        bd_cli_parse_plain(words, count, &common, operands, 0, &operand_count, &help, &fault);
    if (!err && help) return bd_help_devices();
    if (!err) err = list_devices(&common, &fault);
    return err ? bd_cmd_fail(err, &fault, common.json) : 0;
}
