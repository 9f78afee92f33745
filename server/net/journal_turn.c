#include "net/journal_turn.h"

#include "base/assert.h"
#include "net/net_internal.h"

static void begin_next(struct bd_net *net);

static void on_pool(uv_work_t *work)
{
    struct bd_journal_turn *turn = work->data;
    turn->on_pool(turn);
}

static void back(uv_work_t *work, int status)
{
    struct bd_journal_turn *turn = work->data;
    struct bd_net *net = turn->net;
    BD_ASSERT_CMP(status, ==, 0);
    net->journal_turns = turn->next;
    turn->back(turn); // it may be gone after this
    begin_next(net);
}

static void begin_next(struct bd_net *net)
{
    struct bd_journal_turn *turn = net->journal_turns;
    if (!turn || turn->work.data) return;
    turn->work.data = turn;
    int result = uv_queue_work(&net->loop, &turn->work, on_pool, back);
    BD_ASSERT_CMP(result, ==, 0);
}

void bd_journal_turn_take(struct bd_net *net, struct bd_journal_turn *turn)
{
    turn->net = net;
    turn->next = NULL;
    turn->work.data = NULL; // not begun
    struct bd_journal_turn **last = &net->journal_turns;
    while (*last) last = &(*last)->next;
    *last = turn;
    begin_next(net);
}

bool bd_journal_turn_is_taken(const struct bd_net *net)
{
    return net->journal_turns != NULL;
}
