/* The search as a sequence of batches of independent tasks.
 *
 *   lm_search *search = lm_open_search(&problem);
 *   while ((count = lm_next_tasks(search, &tasks)) > 0)
 *     for each task, anywhere and in any order:
 *       lm_run_task(&problem, &task, &answer, ...); lm_accept_answer(search, &answer);
 *
 * The next tasks depend on the answers, never on their order or time: a batch is reduced in the
 * order of its tasks when the last answer has arrived. Thus one thread, many threads, a cluster,
 * and a search continued from a journal give the same bytes.
 *
 * Stages: bounds prune combinations without any evaluation; initial designs are examined and join
 * the first population; a screen examines a few points of each combination; populations over all
 * combinations find the promising regions, and with more than one objective use the ends of the
 * front, which a local solver finds, as parents. With two objectives the solver works beside the
 * populations until the budget is spent: in turn on the first objective, from points far from the
 * best design of a combination, and from designs of the front into its steps. Otherwise a race
 * halves the number of combinations while it doubles their budget; the last ones are polished; then
 * the budget goes into directions between the objectives or, for one objective, into restarts (with
 * a few thousand evaluations and more than one objective the populations have all of it instead).
 * If no design satisfies all limits, the nearest combinations are repaired. In the end the designs
 * of the front are verified (whole grades, no violation between the angles of the scan and between
 * the tooth phases): all of them with their grades rounded, then a solver continues from the ends
 * and from those that did not hold, or with two objectives in rounds as beside the populations, on
 * the verified front, until the verification has cost as much as the search; if none holds, from
 * their neighbours. Neither repair nor verification is charged against the budget; both are part of
 * the work in lm_progress.
 *
 * The continuous part is not convex: "dominated" means that a combination lost the race, not that a
 * bound excludes it. Only "pruned" is a proof.
 */
#ifndef LOSTMOTION_OPTIMIZER_SEARCH_H
#define LOSTMOTION_OPTIMIZER_SEARCH_H

#include "lostmotion/status.h"
#include "stage.h"
#include "task.h"

#ifdef __cplusplus
extern "C" {
#endif

const char *lm_fate_name(int fate); /* "not reached", ... */

typedef struct lm_progress {
  int stage;
  int has_best; /* 1: best_* hold a feasible design */
  int best_combination;
  double best_value; /* of the first objective */
  int evaluations;   /* charged so far */
  int budget;
  double work_done;      /* in plain evaluations, including the verification */
  double work_total;     /* estimated; equal at the end */
  double feasible_share; /* of all evaluations */
  int refused;           /* evaluations that the model refused or without a finite result */
  int tasks_done;
  int fate[LM_FATE_COUNT]; /* combinations by fate; those still in the race count as not reached */
  int front_size;
} lm_progress;

/* A search of a prepared problem; null: out of memory. */
lm_search *lm_open_search(const lm_problem *problem);
void lm_close_search(lm_search *search);

/* The tasks whose answers are awaited; 0: the search has ended. *tasks stays valid until the last
 * of them is answered. */
int lm_next_tasks(lm_search *search, const lm_task **tasks);

/* Accept an answer; one that is not awaited (a repetition) is ignored. LM_NULL, LM_OUT_OF_RANGE (an
 * id of no awaited or answered task, or invalid values: lm_is_sound_answer). */
lm_status lm_accept_answer(lm_search *search, const lm_answer *answer);

/* 1 if this task has its answer. */
int lm_is_answered(const lm_search *search, int id);

void lm_read_progress(const lm_search *search, lm_progress *progress);

/* Designs none of which is better than another in every objective, rising in the first one; at the
 * end only verified ones, if there are any. Returns their number and writes at most `capacity`. */
int lm_read_front(const lm_search *search, lm_solution front[], int capacity);

/* The design with the smallest first objective; 0 if there is none yet. */
int lm_read_best(const lm_search *search, lm_solution *best);

/* Fate of a combination, and for a pruned one the limit (lm_limit, or -1: no drive can be
 * built). */
int lm_read_fate(const lm_search *search, int combination, int *limit);

/* Of the evaluated points the one with the least relaxation, of the repaired ones if there are any;
 * 0 if the model refused every point. For lm_explain_infeasible. */
int lm_read_nearest(const lm_search *search, int *combination, double unit[LM_FREE_MAX],
                    double *violation);

#ifdef __cplusplus
}
#endif

#endif
