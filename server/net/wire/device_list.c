#include "net/wire/device_list.h"

#include <stdlib.h>
#include <string.h>

#include "base/assert.h"
#include "base/log.h"
#include "protocol/json.h"

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
    struct bd_fault fault;
    ProtobufCMessage *message;
    // What --device takes has the name of the option there, and `spec` in the schema.
    json_object_set(listed, "spec", json_object_get(listed, "device"));
    if (bd_json_to_message(listed, &bounced__device__descriptor, &message, &fault)) {
        bd_log(BD_LOG_WARN, "net", "a device is not listed: %s", fault.message);
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
