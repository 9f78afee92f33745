// Choosing among cuts of trees: each receiver walks all lights' trees as it would to gather
// (pass/gather_tree.h), chooses nodes of its cut in proportion to what they would give it, and for
// each a leaf below it in the same way, whose segment it asks. So a choice among a hundred thousand
// VPLs takes as long as two walks.
//
// Unbiased for what the cut gives where a node counts by the part of its light whose leaves are
// seen.
// Yuksel 2019 (stochastic lightcuts).

#ifndef BD_PASS_CHOOSE_TREE_H
#define BD_PASS_CHOOSE_TREE_H

#include "pass/choose.h"
#include "pass/gather_tree.h"

struct bd_tree_choice;

// Of fragments; `inputs` is borrowed.
BD_MUST_CHECK
enum bd_err bd_tree_choice_create(const struct bd_pass_context *context,
                                  const struct bd_gather_tree_inputs *inputs, uint32_t rays,
                                  struct bd_tree_choice **out, struct bd_err_detail *detail);
void bd_tree_choice_destroy(struct bd_tree_choice **choice);
// For a chooser's inputs. Lives as long as the choice.
const struct bd_choice *bd_tree_choice_get(const struct bd_tree_choice *choice);

#endif
