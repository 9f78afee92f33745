// What the server says of itself at the start of a session.

#include <stdio.h>
#include <stdlib.h>

#include "base/assert.h"
#include "net/session_internal.h"
#include "protocol/wire.h"

static void add_limits(Bounced__HelloReply *reply, const struct bd_limits *limits)
{
    reply->limits = calloc(sizeof *limits / sizeof(uint64_t), sizeof(Bounced__KeyValue *));
    BD_ASSERT(reply->limits);
    uint64_t value;
    for (const char *name; (name = bd_limits_get(limits, (uint32_t)reply->n_limits, &value));) {
        char text[24];
        snprintf(text, sizeof text, "%llu", (unsigned long long)value);
        Bounced__KeyValue *pair = malloc(sizeof *pair);
        BD_ASSERT(pair);
        bounced__key_value__init(pair);
        pair->key = bd_answer_text(name);
        pair->value = bd_answer_text(text);
        reply->limits[reply->n_limits++] = pair;
    }
}

static void add_capabilities(Bounced__HelloReply *reply)
{
    static const char *const names[] = {"blobs",   "scenes", "render",     "progress", "cancel",
                                        "devices", "stats",  "techniques", "views",    "watches",
                                        "pose",    "half",   "resume",     "under_way"};
    reply->capabilities = calloc(sizeof names / sizeof names[0], sizeof(char *));
    BD_ASSERT(reply->capabilities);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        reply->capabilities[reply->n_capabilities++] = bd_answer_text(names[i]);
}

struct bd_answer bd_session_hello_reply(const struct bd_net *net)
{
    Bounced__HelloReply *reply = malloc(sizeof *reply);
    BD_ASSERT(reply);
    bounced__hello_reply__init(reply);
    BD_SET(reply, version, BD_PROTOCOL_VERSION_MAX);
    BD_SET(reply, min, BD_PROTOCOL_VERSION_MIN);
    BD_SET(reply, max, BD_PROTOCOL_VERSION_MAX);
    add_capabilities(reply);
    add_limits(reply, &net->options.limits);
    reply->build = bd_answer_text(BD_VERSION);
    struct bd_sched_stats stats;
    bd_sched_stats(net->options.sched, &stats);
    reply->device = bd_device_message(&stats);
    return bd_answer_of(BOUNCED__ENVELOPE__BODY_HELLO_REPLY, reply);
}
