#include "net/pool_turn.h"

#include "base/assert.h"
#include "net/command_internal.h"

#define TURNS_AT_ONCE 2

static void begin_next(struct bd_net *net);

static void run_on_pool(uv_work_t *work)
{
    struct bd_command *command = work->data;
    command->on_pool(command);
}

static void back(uv_work_t *work, int status)
{
    struct bd_command *command = work->data;
    struct bd_net *net = command->net;
    BD_ASSERT_CMP(status, ==, 0);
    net->pool_turn_count--;
    if (!bd_command_stop_here(command)) command->then(command);
    begin_next(net);
}

static void begin_next(struct bd_net *net)
{
    if (!net->pool_turns_waiting || net->pool_turn_count >= TURNS_AT_ONCE) return;
    struct bd_command *command = net->pool_turns_waiting;
    net->pool_turns_waiting = command->next_waiting;
    command->waits_for_turn = false;
    net->pool_turn_count++;
    bd_command_progress(command, command->turn_stage);
    bd_command_pool(command, run_on_pool, back);
}

void bd_pool_turn_take(struct bd_command *command, const char *stage,
                       void (*on_pool)(struct bd_command *command),
                       void (*then)(struct bd_command *command))
{
    struct bd_net *net = command->net;
    command->turn_stage = stage;
    command->on_pool = on_pool;
    command->then = then;
    command->waits_for_turn = true;
    struct bd_command **last = &net->pool_turns_waiting;
    while (*last) last = &(*last)->next_waiting;
    *last = command;
    command->next_waiting = NULL;
    begin_next(net);
}

bool bd_pool_turn_leave(struct bd_command *command)
{
    if (!command->waits_for_turn) return false;
    struct bd_command **at = &command->net->pool_turns_waiting;
    while (*at != command) at = &(*at)->next_waiting;
    *at = command->next_waiting;
    command->waits_for_turn = false;
    return true;
}
