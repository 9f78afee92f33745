// The verbs of `bounce scene` that are about a scene's history. Each carries one out and prints the
// answer. Thread: main.

#ifndef BD_CLI_HISTORY_H
#define BD_CLI_HISTORY_H

#include "base/err.h"
#include "clients/cli/options.h"

BD_MUST_CHECK
enum bd_err bd_cli_history_log(const struct bd_cli_scene *options, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_history_undo(const struct bd_cli_scene *options, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_history_redo(const struct bd_cli_scene *options, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_history_commit(const struct bd_cli_scene *options, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_history_revert(const struct bd_cli_scene *options, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_history_name(const struct bd_cli_scene *options, struct bd_err_detail *detail);
BD_MUST_CHECK
enum bd_err bd_cli_history_export(const struct bd_cli_scene *options, struct bd_err_detail *detail);

#endif
