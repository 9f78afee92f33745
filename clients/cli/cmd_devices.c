// `bounce devices`.

#include <stdio.h>

#include "clients/cli/commands.h"
#include "clients/cli/help.h"
#include "clients/cli/list.h"
#include "clients/cli/print.h"

static void print_device(const Bounced__Device *device)
{
    bd_cli_print(stdout, "%c %-12s %s%s", device->in_use ? '*' : ' ',
                 device->spec ? device->spec : "", device->name ? device->name : "",
                 device->software ? " (software)" : "");
    if (device->has_memory_mib) printf(", %.0f MiB", device->memory_mib);
    if (device->error && device->error[0]) bd_cli_print(stdout, ": %s", device->error);
    putchar('\n');
}

static void print_devices(const Bounced__Envelope *answer)
{
    const Bounced__DevicesReply *reply = answer->devices_reply;
    for (size_t i = 0; i < reply->n_devices; i++) print_device(reply->devices[i]);
}

static const ProtobufCMessage *body_of(const Bounced__Envelope *answer)
{
    return &answer->devices_reply->base;
}

int bd_cmd_devices(const char *const *words, int count)
{
    Bounced__Devices request = BOUNCED__DEVICES__INIT;
    Bounced__Envelope envelope = BOUNCED__ENVELOPE__INIT;
    envelope.body_case = BOUNCED__ENVELOPE__BODY_DEVICES;
    envelope.devices = &request;
    const struct bd_cli_list list = {
        .kind = BD_CLI_CONN_RUNNING_OR_START,
        .request = &envelope,
        .want = BOUNCED__ENVELOPE__BODY_DEVICES_REPLY,
        .body = body_of,
        .print = print_devices,
        .help = bd_help_devices,
    };
    return bd_cli_list(&list, words, count);
}
