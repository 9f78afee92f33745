#include "clients/cli/list.h"

#include <stdio.h>
#include <stdlib.h>

#include "clients/cli/commands.h"
#include "clients/cli/options.h"
#include "clients/cli/report.h"

enum bd_err bd_cli_print_json(const ProtobufCMessage *message, struct bd_err_detail *detail)
{
    char *text = bd_cli_report_json(message);
    if (!text) return bd_err_set(detail, BD_ERR_NO_MEMORY, "", "no memory for the answer");
    fputs(text, stdout);
    free(text);
    return BD_ERR_OK;
}

static enum bd_err ask(const struct bd_cli_list *list, const struct bd_cli_common *common,
                       struct bd_err_detail *detail)
{
    struct bd_cli_conn *conn = NULL;
    enum bd_err err = bd_cli_conn_open(common, list->kind, &conn, detail);
    if (err) return err;
    struct bd_cli_answer answer;
    err = bd_cli_conn_call(conn, list->request, NULL, 0, list->want, NULL, &answer, detail);
    if (!err && common->json)
        err = bd_cli_print_json(list->body(answer.envelope), detail);
    else if (!err)
        list->print(answer.envelope);
    bd_cli_answer_finish(&answer);
    bd_cli_conn_close(&conn);
    return err;
}

int bd_cli_list(const struct bd_cli_list *list, const char *const *words, int count)
{
    struct bd_cli_common common;
    struct bd_err_detail detail = {0};
    const char *operands[1];
    int operand_count;
    bool help;
    enum bd_err err =
        bd_cli_parse_plain(words, count, &common, operands, 0, &operand_count, &help, &detail);
    if (!err && help) return list->help();
    if (!err) err = ask(list, &common, &detail);
    return err ? bd_cmd_fail(err, &detail, common.json) : 0;
}
